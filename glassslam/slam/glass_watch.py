"""Glass seen along the way: scans are looked at, every observation is bound to a node."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from glassslam.config import GlassConfig, SensorConfig
from glassslam.geometry import between, compose, transform_points, wrap_angle
from glassslam.records import FloatArray, LaserScan
from glassslam.slam.beam_errors import errors_of, true_detection
from glassslam.slam.glass_choice import DetectorChoice
from glassslam.slam.local import LocalResult
from glassslam.slam.range_data import base_motion
from glassslam.slam.settled import GlassFindings

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from detectors.detection import Detection
    from glassslam.glass.beam_labels import BeamLabelLog
    from glassslam.glass.observations import GlassObservations

_COLUMNS = 10
_NO_POINTS = np.empty((0, 2))


@dataclass(frozen=True, slots=True)
class Sighting:
    """Glass in one scan.

    Attributes
    ----------
    rows : ndarray of float64, shape (k, 10)
        Position, normal, sensor position, strength, probability, their deviations and extent, in the frame of
        the base at the stamp of the scan; the motion within the sweep is undone.
    labels : ndarray of uint8, shape (n,)
        Label of every beam.
    """

    rows: FloatArray
    labels: NDArray[np.uint8]

    @property
    def positions(self) -> FloatArray:
        """Points on the glass, frame of the base, m, shape (k, 2)."""
        return self.rows[:, :2]


class Look:
    """A scan that may be looked at, at most once, by whoever needs it first."""

    def __init__(self, watch: "GlassWatch", scan: LaserScan, twist: FloatArray) -> None:
        self._watch = watch
        self.scan, self._twist = scan, twist
        self._seen: Sighting | None = None
        self._done = False

    def sighting(self) -> Sighting | None:
        """Glass in the scan; None where nothing is looked for, or not yet."""
        if not self._done:
            self._seen = self._watch.sighted(self.scan, self._twist)
            self._done = self._watch.is_decided
        return self._seen

    def points(self) -> FloatArray:
        """Points on the glass, frame of the base, m, shape (k, 2)."""
        seen = self.sighting()
        return _NO_POINTS if seen is None else seen.positions

    def behind_glass(self) -> NDArray[np.bool_] | None:
        """Beams whose returns came from behind glass, shape (n,); None where nothing was looked for."""
        from detectors.labels import GHOST  # noqa: PLC0415

        seen = self.sighting()
        return None if seen is None else np.asarray(seen.labels == GHOST)


@dataclass(frozen=True, slots=True)
class _Placed:
    """A scan that local SLAM has placed, in the frame of the node last entered."""

    look: Look
    is_node: bool
    node: int
    node_from_base: FloatArray


class GlassWatch:
    """Collects what the detector finds in the scans of a run.

    Parameters
    ----------
    config : GlassConfig
        Detector and walls.
    base_from_laser : ndarray of float64, shape (3,)
        Pose of the laser in the frame of the base, m and rad.
    sensor : SensorConfig, optional
        Errors of the beams.
    """

    def __init__(
        self, config: GlassConfig, base_from_laser: FloatArray, sensor: SensorConfig | None = None
    ) -> None:
        self._config = config
        self._errors = errors_of(sensor or SensorConfig())
        self._base_from_laser = base_from_laser
        self._choice = DetectorChoice(config)
        self._waiting: list[_Placed] = []
        self._node = -1
        self._node_pose = np.zeros(3)
        self._nodes: list[NDArray[np.int64]] = []
        self._rows: list[FloatArray] = []
        self._beams: BeamLabelLog | None = None

    @property
    def choice(self) -> DetectorChoice:
        """Which detector is in use, and why."""
        return self._choice

    @property
    def is_decided(self) -> bool:
        """Whether it is known how to look, and whether at all."""
        return not self._choice.is_pending

    def look(self, scan: LaserScan, twist: FloatArray) -> Look:
        """Prepare to look at a scan.

        Parameters
        ----------
        scan : LaserScan
            The scan.
        twist : ndarray of float64, shape (3,)
            Velocity of the base during the sweep, in its own frame, m/s and rad/s.
        """
        return Look(self, scan, twist)

    def sighted(self, scan: LaserScan, twist: FloatArray) -> Sighting | None:
        """Glass in a scan; None where nothing is looked for, or not yet."""
        found = self._choice.detect(scan) if self._choice.detect is not None else None
        if found is None:
            return None
        return _sighted(true_detection(found, self._errors), scan, twist, self._base_from_laser)

    def add(self, look: Look, placed: LocalResult) -> None:
        """Take a scan that local SLAM has placed; what it shows belongs to the node last entered."""
        if self.is_decided and self._choice.detect is None:
            return
        is_node = placed.node is not None
        if placed.node is not None:
            self._node, self._node_pose = placed.node.index, placed.node.pose_in_local
        place = _Placed(look, is_node, self._node, between(self._node_pose, placed.pose_in_local))
        if self.is_decided:
            self._see(place)
        elif is_node or not self._choice.wants_nodes_only:
            self._waiting.append(place)
        self._choice.add(look.scan, is_node=is_node)
        self._catch_up()

    def settle(self) -> None:
        """Decide on the detector, at the latest now, and look at the scans that waited for it."""
        self._choice.settle()
        self._catch_up()

    def observations(self) -> "GlassObservations":
        """Everything found so far."""
        from glassslam.glass.observations import GlassObservations  # noqa: PLC0415

        if not self._rows:
            return GlassObservations.empty()
        table = np.concatenate(self._rows)
        x, y, normal, sx, sy, strength, probability, sigma, turn, extent = np.ascontiguousarray(table.T)
        return GlassObservations(
            np.concatenate(self._nodes), np.stack((x, y), axis=1), normal, np.stack((sx, sy), axis=1),
            strength, probability, sigma, turn, extent, np.zeros(len(table), dtype=np.uint8),
        )  # fmt: skip

    def findings(self) -> GlassFindings | None:
        """Everything found so far; None where the lidar is not asked for glass."""
        if self._choice.detect is None:
            return None
        labels = None if self._beams is None else self._beams.beams()
        return GlassFindings(self.observations(), labels, self._choice.calibration)

    def _catch_up(self) -> None:
        if self.is_decided:
            for place in self._waiting:
                self._see(place)
            self._waiting = []

    def _see(self, place: _Placed) -> None:
        """Look at nodes; a pane that gives narrow returns gives them seldom, so every scan is needed."""
        if not (place.is_node or self._choice.name == "narrow_return"):
            return
        if (seen := place.look.sighting()) is not None:
            self._keep(place.look.scan.stamp, seen, place.node, place.node_from_base)

    def _keep(self, stamp: float, seen: Sighting, node: int, node_from_base: FloatArray) -> None:
        if self._beams is None:
            from glassslam.glass.beam_labels import BeamLabelLog  # noqa: PLC0415

            self._beams = BeamLabelLog()
        self._beams.add(stamp, seen.labels)
        if len(seen.rows):
            self._rows.append(_moved(seen.rows, node_from_base))
            self._nodes.append(np.full(len(seen.rows), node, dtype=np.int64))


def _sighted(found: "Detection", scan: LaserScan, twist: FloatArray, base_from_laser: FloatArray) -> Sighting:
    """What a detector has found, in the frame of the base at the stamp of the scan."""
    rows = np.empty((len(found), _COLUMNS))
    times = scan.time_increment * found.beam.astype(np.float64)
    laser = compose(base_motion(twist, times), base_from_laser)
    bearing = found.bearing + laser[:, 2]
    rows[:, 0] = laser[:, 0] + found.range * np.cos(bearing)
    rows[:, 1] = laser[:, 1] + found.range * np.sin(bearing)
    rows[:, 2] = wrap_angle(found.normal + laser[:, 2])
    rows[:, 3:5] = laser[:, :2]
    rows[:, 5], rows[:, 6] = found.strength, found.probability
    rows[:, 7], rows[:, 8], rows[:, 9] = found.position_sigma, found.normal_sigma, found.extent
    return Sighting(rows, found.labels)


def _moved(rows: FloatArray, node_from_base: FloatArray) -> FloatArray:
    """Rows of a sighting in the frame of a node."""
    moved = rows.copy()
    moved[:, :2] = transform_points(node_from_base, rows[:, :2])
    moved[:, 2] = wrap_angle(rows[:, 2] + node_from_base[2])
    moved[:, 3:5] = transform_points(node_from_base, rows[:, 3:5])
    return moved
