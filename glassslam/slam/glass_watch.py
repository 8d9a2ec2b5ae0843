"""Glass seen along the way: every scan is looked at, every observation bound to a node."""

from typing import TYPE_CHECKING

import numpy as np

from glassslam.config import GlassConfig
from glassslam.geometry import between, compose, transform_points, wrap_angle
from glassslam.glass.layer import GlassLayer
from glassslam.records import FloatArray, LaserScan
from glassslam.slam.local import LocalResult
from glassslam.slam.node import Node

if TYPE_CHECKING:  # runs that do not look for glass need not load what finds it
    from detectors.detection import Detection
    from glassslam.glass.observations import GlassObservations
    from glassslam.slam.glass_detectors import Detector

_COLUMNS = 10


class GlassWatch:
    """Collects what the detector finds in the scans of a run.

    Parameters
    ----------
    config : GlassConfig
        Detector and walls.
    base_from_laser : ndarray of float64, shape (3,)
        Pose of the laser in the frame of the base, m and rad.
    """

    def __init__(self, config: GlassConfig, base_from_laser: FloatArray) -> None:
        self._config = config
        self._base_from_laser = base_from_laser
        self._detect = _detector(config)
        self._node = -1
        self._node_pose = np.zeros(3)
        self._nodes: list[np.ndarray] = []
        self._rows: list[FloatArray] = []

    @property
    def is_on(self) -> bool:
        """Whether glass is looked for."""
        return self._detect is not None

    def add(self, scan: LaserScan, placed: LocalResult) -> None:
        """Look at a scan that local SLAM has placed; what is found belongs to the node last entered."""
        if self._detect is None:
            return
        if placed.node is not None:
            self._node, self._node_pose = placed.node.index, placed.node.pose_in_local
        found = self._detect(scan)
        if found is not None and len(found):
            node_from_base = between(self._node_pose, placed.pose_in_local)
            self._rows.append(_rows(found, compose(node_from_base, self._base_from_laser)))
            self._nodes.append(np.full(len(found), self._node, dtype=np.int64))

    def observations(self) -> "GlassObservations":
        """Everything found so far."""
        from glassslam.glass.observations import GlassObservations  # noqa: PLC0415

        if not self._rows:
            return GlassObservations.empty()
        table = np.concatenate(self._rows)
        x, y, normal, sx, sy, strength, probability, sigma, turn, extent = np.ascontiguousarray(table.T)
        return GlassObservations(
            np.concatenate(self._nodes), np.stack((x, y), axis=1), normal, np.stack((sx, sy), axis=1),
            strength, probability, sigma, turn, extent,
        )  # fmt: skip

    def layer(self, nodes: list[Node], poses: FloatArray) -> GlassLayer | None:
        """Walls and observations at the optimised poses of the nodes, shape (n, 3); None when off."""
        if self._detect is None:
            return None
        from glassslam.glass.beams import BeamEvidence, Beams  # noqa: PLC0415
        from glassslam.glass.walls import fit_walls  # noqa: PLC0415

        found = self.observations()
        sensors = [node.sensor for node in nodes]
        beams = BeamEvidence(
            Beams.pack(sensors, [node.returns for node in nodes]),
            Beams.pack(sensors, [node.free_ends for node in nodes]),
        )
        positions, normals = found.at(poses)
        return GlassLayer(
            tuple(fit_walls(found, poses, beams, self._config.walls)), found, positions, normals
        )


def _detector(config: GlassConfig) -> "Detector | None":
    if config.detector == "off":
        return None
    from glassslam.slam.glass_detectors import make_detector  # noqa: PLC0415

    return make_detector(config)


def _rows(found: "Detection", node_from_laser: FloatArray) -> FloatArray:
    """Observations of one scan in the frame of a node, one row each."""
    rows = np.empty((len(found), _COLUMNS))
    ends = found.range[:, None] * np.stack((np.cos(found.bearing), np.sin(found.bearing)), axis=1)
    rows[:, :2] = transform_points(node_from_laser, ends)
    rows[:, 2] = wrap_angle(found.normal + node_from_laser[2])
    rows[:, 3:5] = node_from_laser[:2]
    rows[:, 5], rows[:, 6] = found.strength, found.probability
    rows[:, 7], rows[:, 8], rows[:, 9] = found.position_sigma, found.normal_sigma, found.extent
    return rows
