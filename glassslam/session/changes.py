"""Which parameters of a run may be changed when its results are drawn again."""

from typing import Any

from glassslam.config import Config
from glassslam.errors import UsageError
from glassslam.slam.glass_locks import locks_submaps

_SLAM = ("sensor", "filter", "local", "motion_filter", "submap", "loop_closure", "optimization")
_DETECTION = (
    "detector", "require_intensity", "sensor", "calibration", "thresh", "grad", "width",
)  # fmt: skip


def needs_recording(before: Config, after: Config) -> bool:
    """Whether a change of parameters means that the scans must be looked at for glass once more.

    Parameters
    ----------
    before, after : Config
        Parameters of the run, and those wished for.

    Raises
    ------
    UsageError
        A parameter takes part in SLAM: its results cannot be had without it.
    """
    old, new = before.model_dump(), after.model_dump()
    for section in _SLAM:
        _refuse(section, _changed(old[section], new[section]))
    glass = _changed(old["glass"], new["glass"])
    schemes = before.glass.scheme, after.glass.scheme
    if any(map(locks_submaps, schemes)):
        _refuse("glass", [name for name in glass if name in ("scheme", *_DETECTION)])
    if "ghosts_in_matching" in glass:
        _refuse("glass", ["ghosts_in_matching"])
    detection = [name for name in glass if name in _DETECTION]
    if not before.glass.ghosts_in_matching:
        _refuse("glass", detection)
    filters = _changed(old["sonar"]["scan_filter"], new["sonar"]["scan_filter"])
    _refuse("sonar.scan_filter", filters)
    return bool(detection)


def _changed(old: dict[str, Any], new: dict[str, Any]) -> list[str]:
    return [name for name, value in old.items() if new[name] != value]


def _refuse(section: str, names: list[str]) -> None:
    if names:
        raise UsageError(
            f"{section}.{names[0]} takes part in SLAM and cannot be changed afterwards",
            "map the recording again",
        )
