"""What a calibration hands to its files and its table."""

from dataclasses import asdict, dataclass
from typing import Any

from detectors.calibration import Calibration
from detectors.diffuse_fit import SurfaceSamples
from detectors.panes import PaneProfile


@dataclass(frozen=True, slots=True)
class RecordingSummary:
    """What was seen in one recording.

    Attributes
    ----------
    recording, material : str
        Base name, and what it is of.
    distance : float or None
        As stated, m.
    scans : int
        Scans looked at.
    with_surface : int
        Those in which a pane, or the matte wall, was found.
    at_normal : int
        Views of a pane that answers at normal incidence; only these say whether it is detected.
    places : int
        Different places from which the scans were taken.
    measured : float or None
        Median distance of the surface found, m.
    """

    recording: str
    material: str
    distance: float | None
    scans: int
    with_surface: int
    at_normal: int
    places: int
    measured: float | None

    def to_dict(self) -> dict[str, Any]:
        """Plain values; what is not known is left out."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationResult:
    """A finished calibration and what it was made of.

    Attributes
    ----------
    calibration : Calibration
        Accepted by `map --calibration`.
    recordings : tuple of RecordingSummary
        In the order given.
    warnings : tuple of str
        What a user should know, one line each.
    panes : tuple of PaneProfile
        Every view of a known pane that answers somewhere.
    surfaces : SurfaceSamples
        The returns behind the diffuse curve.
    proven : bool
        Whether panes were seen; otherwise the thresholds are those of other sensors.
    """

    calibration: Calibration
    recordings: tuple[RecordingSummary, ...]
    warnings: tuple[str, ...]
    panes: tuple[PaneProfile, ...]
    surfaces: SurfaceSamples
    proven: bool

    @property
    def has_curve(self) -> bool:
        """Whether the diffuse curve is one; without intensities there is none."""
        return self.calibration.informative or self.surfaces.ranges.size > 0
