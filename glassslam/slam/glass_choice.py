"""Which detector looks at the scans of a run, and why none does."""

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from glassslam.config import GlassConfig
from glassslam.errors import RecordingError
from glassslam.records import LaserScan
from glassslam.slam.glass_locks import locks_submaps

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from detectors.calibration import Calibration
    from glassslam.slam.glass_detectors import Detector

_ENOUGH_NODES = 60
_FEW_NODES = 20
_MOST_NODES = 2000
_ENOUGH_SCANS = 2000
_STRIDE = 10
_BY_INTENSITY = ("auto", "intensity_peak", "wang_wang", "calibrated_peak")


class DetectorChoice:
    """Finds the detector: the one asked for, or, for `auto`, the one that suits the first scans.

    Parameters
    ----------
    config : GlassConfig
        What is asked for.

    Attributes
    ----------
    detect : callable or None
        Scan -> Detection; None as long as nothing is decided, and where glass is not looked for.
    name : str
        The detector in use; "off" without one.
    reason : str
        Why the detector is in use, or why there is none; one line.
    calibration : Calibration or None
        What `auto` has learnt about the sensor.
    wants_nodes_only : bool
        Whether the decision waits for more nodes, and for nothing but nodes.
    """

    def __init__(self, config: GlassConfig) -> None:
        self._config = config
        self._sample: list[LaserScan] = []
        self._others: list[LaserScan] = []
        self._scans = 0
        self.detect: Detector | None = None
        self.name, self.reason = "off", "not asked for"
        self.calibration: Calibration | None = None
        self.is_pending, self.wants_nodes_only = self._waits(), False
        self._verdict_due = config.detector in _BY_INTENSITY
        self._too_coarse = ""
        if config.detector != "off" and not self.is_pending:
            self._use(config.detector, "asked for")

    @property
    def warnings(self) -> list[str]:
        """That glass was asked for and is not looked for, or cannot be found so; empty otherwise."""
        if self._config.detector in ("auto", "off"):
            return []
        if self.name == "off":
            return [f"glass is not looked for: {self.reason}"]
        return [self._too_coarse] if self._too_coarse else []

    def add(self, scan: LaserScan, *, is_node: bool) -> None:
        """Take a scan into account; nodes are the sample, for they are seen from different places."""
        if not self._verdict_due:
            return
        if is_node:
            self._sample.append(scan)
        elif self._scans % _STRIDE == 0 and len(self._others) < _ENOUGH_NODES:
            self._others.append(scan)
        self._scans += 1
        if self._is_due():
            self.settle()

    def settle(self) -> None:
        """Decide now, on the scans seen so far.

        Raises
        ------
        RecordingError
            Intensities are required, and these tell nothing.
        """
        if not self._verdict_due:
            return
        self._verdict_due = False
        if len(self._sample) < _FEW_NODES:  # a lidar that stands
            self._sample += self._others
        reason = self._uninformative()
        if reason:
            self.detect, self.name, self.reason = None, "off", reason
            if self._config.require_intensity:
                raise RecordingError(
                    f"glass cannot be looked for: {reason}", "map without --require-intensity"
                )
        elif self.is_pending:
            self._suit()
        self._too_coarse = self._coarseness()
        self.is_pending, self._sample, self._others = False, [], []

    def _is_due(self) -> bool:
        """Whether enough was seen; the more a lidar that calibrates itself has seen, the better it does."""
        if len(self._sample) < _ENOUGH_NODES and self._scans < _ENOUGH_SCANS:
            return False
        if self.wants_nodes_only:
            return len(self._sample) >= _MOST_NODES
        may_wait = self.is_pending and self._config.ghosts_in_matching
        if (
            may_wait
            and not locks_submaps(self._config.scheme)
            and self._is_fine()
            and not self._uninformative()
        ):
            self.wants_nodes_only = True
            return False
        return True

    def _is_fine(self) -> bool:
        """Whether the beams are near enough to each other to show the peak of a pane."""
        from detectors.self_calibration import COARSEST_STEP  # noqa: PLC0415

        knows = self._config.sensor or self._config.calibration
        return bool(self._sample) and not knows and abs(self._sample[-1].angle_increment) <= COARSEST_STEP

    def _waits(self) -> bool:
        config = self._config
        knows = config.sensor or config.calibration
        return config.detector == "auto" or (config.detector == "calibrated_peak" and not knows)

    def _use(self, name: str, reason: str) -> None:
        from glassslam.slam.glass_detectors import make_detector  # noqa: PLC0415

        self.detect = make_detector(self._config.model_copy(update={"detector": name}))
        self.name, self.reason = name, reason

    def _uninformative(self) -> str:
        """Why the intensities of the sample are of no use; empty when they are."""
        if not any(len(scan.intensities) for scan in self._sample):
            return "the recording has no intensities"
        from detectors.informative import is_intensity_informative  # noqa: PLC0415

        verdict = is_intensity_informative((scan.ranges, scan.intensities) for scan in self._sample)
        return "" if verdict.informative else verdict.reason

    def _suit(self) -> None:
        """Choose by the resolution, and learn the diffuse level of the sensor where the detector needs it."""
        from detectors.self_calibration import COARSEST_STEP  # noqa: PLC0415

        step = abs(self._sample[-1].angle_increment)
        if self._config.detector == "auto" and step > COARSEST_STEP:
            self._use("narrow_return", f"beams {math.degrees(step):.2g} deg apart are too few for a peak")
            return
        if self._config.sensor or self._config.calibration:
            self._use("calibrated_peak", "the calibration given")
            return
        try:
            self.calibration = self._learnt()
        except ValueError as error:
            self.detect, self.name, self.reason = None, "off", str(error)
            return
        from glassslam.slam.glass_detectors import calibrated  # noqa: PLC0415

        self.detect, self.name = calibrated(self.calibration), "calibrated_peak"
        self.reason = f"calibrated on {self.calibration.evidence['scans']} scans of this recording"

    def _coarseness(self) -> str:
        """That the detector asked for by name finds no peaks in beams so far apart; empty where it may."""
        from detectors.self_calibration import COARSEST_STEP  # noqa: PLC0415

        step = abs(self._sample[-1].angle_increment) if self._sample else 0.0
        if self._config.detector != "calibrated_peak" or step <= COARSEST_STEP:
            return ""
        return (
            f"glass can hardly be found: beams {math.degrees(step):.2g} deg apart are too few for a peak, "
            f"calibrated_peak needs {math.degrees(COARSEST_STEP):.2g} deg or less (see glass.detector)"
        )

    def _learnt(self) -> "Calibration":
        from detectors.self_calibration import self_calibration  # noqa: PLC0415

        last = self._sample[-1]
        alike = [
            (scan.ranges, scan.intensities)
            for scan in self._sample
            if len(scan.ranges) == len(last.ranges) == len(scan.intensities)
        ]
        learnt = self_calibration(
            "this recording", alike, last.angle_min, last.angle_increment,
            range_min=last.range_min, range_max=last.range_max,
        )  # fmt: skip
        return replace(learnt, detector="calibrated_peak")
