"""The recordings of a calibration, and what is known of each."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, TypeVar

from glassslam.calibration.roi import Roi
from glassslam.errors import UsageError

PANES: Final = ("glass", "acrylic", "polycarbonate")
"""Materials whose panes are to be found."""
MATERIALS: Final = (*PANES, "matte", "no-glass", "unknown")
NOTHING: Final = "-"
"""Stands for no value where an option is given for every recording."""

_T = TypeVar("_T")


@dataclass(frozen=True, slots=True)
class Session:
    """One recording of a calibration.

    Attributes
    ----------
    recording : Path
        Bag, mcap or CARMEN log.
    material : str
        "glass", "acrylic" or "polycarbonate": a pane is faced at `distance`, or `panes` says where panes are.
        "matte": a matte wall is faced at `distance`. "no-glass": there is none, and whatever is found is a
        false alarm. "unknown": an ordinary recording; only the diffuse curve is read from it.
    distance : float or None
        From the laser to the surface that it faces, m.
    panes : Path or None
        File of panes, as `glassslam.evaluation.read_true_glass` reads it.
    roi : Roi or None
        Where the faced surface is looked for; None: 30 deg to both sides of straight ahead.

    Raises
    ------
    UsageError
        What is known does not fit the material.
    """

    recording: Path
    material: str = "unknown"
    distance: float | None = None
    panes: Path | None = None
    roi: Roi | None = None

    def __post_init__(self) -> None:
        if self.material not in MATERIALS:
            raise UsageError(f"--material {self.material}: not known", f"known are {', '.join(MATERIALS)}")
        if self.distance is not None and not (math.isfinite(self.distance) and self.distance > 0.0):
            raise UsageError(f"--distance {self.distance:g}: not above 0 m")
        if problem := self._problem():
            raise UsageError(f"{self.name}: {problem[0]}", problem[1])

    @property
    def name(self) -> str:
        """Base name of the recording."""
        return self.recording.resolve().name

    @property
    def has_pane(self) -> bool:
        """Whether panes are known in the recording."""
        return self.material in PANES

    def _problem(self) -> tuple[str, str] | None:
        leave_out = f"give {NOTHING} for a recording without one"
        if self.distance is not None and self.panes is not None:
            return "both a distance and a file of panes", leave_out
        if self.has_pane:
            unplaced = self.distance is None and self.panes is None
            hint = "give its --distance, or --panes FILE"
            return (f"nothing says where the {self.material} is", hint) if unplaced else None
        if self.panes is not None:
            return f"--panes, but its material is {self.material}", leave_out
        if self.material == "matte":
            missing = self.distance is None
            return ("nothing says where the matte wall is", "give its --distance") if missing else None
        if self.distance is not None:
            return f"--distance, but its material is {self.material}", leave_out
        return None


def make_sessions(
    recordings: Sequence[Path],
    *,
    materials: Sequence[str] = (),
    distances: Sequence[str] = (),
    panes: Sequence[str] = (),
    rois: Sequence[str] = (),
) -> list[Session]:
    """Sessions of recordings from what the command line says of them.

    Every option is given once for all recordings or once for each, in their order; "-" stands for none.

    Parameters
    ----------
    recordings : sequence of Path
        At least one.
    materials, distances, panes, rois : sequence of str
        Where no material is said, a recording with a distance or panes is of glass, another one unknown.

    Raises
    ------
    UsageError
        A recording is named twice, a number of values does not fit theirs, or a value is refused.
    """
    count = len(recordings)
    _check_different(recordings)
    given = zip(
        recordings,
        _spread("--material", materials, count, str),
        _spread("--distance", distances, count, _metres),
        _spread("--panes", panes, count, Path),
        _spread("--roi", rois, count, Roi.parse),
        strict=True,
    )
    return [_session(*values) for values in given]


def _check_different(recordings: Sequence[Path]) -> None:
    known: set[Path] = set()
    for path in recordings:
        if path.resolve() in known:
            raise UsageError(
                f"{path} is named twice", "its scans would count twice: name every recording once"
            )
        known.add(path.resolve())


def _session(
    recording: Path, material: str | None, distance: float | None, panes: Path | None, roi: Roi | None
) -> Session:
    if material is None:
        material = "unknown" if distance is None and panes is None else "glass"
    return Session(recording, material, distance, panes, roi)


def _spread(option: str, texts: Sequence[str], count: int, read: Callable[[str], _T]) -> list[_T | None]:
    """One value for every recording, or None where there is none."""
    if len(texts) not in (0, 1, count):
        raise UsageError(
            f"{len(texts)} values of {option} for {count} recording{'s' * (count != 1)}",
            f"give one for all, or one for each in their order, {NOTHING} where there is none",
        )
    values = [None if text == NOTHING else read(text) for text in texts] or [None]
    return values if len(values) == count else values * count


def _metres(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise UsageError(f"--distance {text}: not a number of metres") from None
