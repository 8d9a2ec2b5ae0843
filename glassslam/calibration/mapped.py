"""Panes stated in a map, carried into the scans of a recording by the poses of SLAM."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from detectors.calibration import Calibration
from glassslam.api import ProgressCallback, map_recording
from glassslam.calibration.reading import Reading, bearings, places_of
from glassslam.calibration.views import Plane, View, settled
from glassslam.config import Config
from glassslam.errors import CalibrationError
from glassslam.evaluation.glass_alignment import best_alignment
from glassslam.evaluation.glass_lines import Segments, read_true_glass
from glassslam.geometry import compose, inverse, transform_points
from glassslam.records import FloatArray, LaserScan
from glassslam.slam.result import MapResult
from glassslam.sources import SourceOptions

# frames and mullions are left out at the ends of a pane, m
FRAME = 0.08
LEAST_LENGTH = 0.1
FARTHEST = 10.0
NEAREST = 0.1
# a return so far before a pane may still be its own, m
ON_PANE = 0.15
STEEPEST = math.radians(60.0)


def mapped_views(
    reading: Reading,
    calibration: Calibration,
    *,
    options: SourceOptions | None = None,
    align: bool = False,
    progress: ProgressCallback | None = None,
) -> list[View]:
    """Lay the stated panes of a session into its scans.

    Parameters
    ----------
    reading : Reading
        Of a session with a file of panes.
    calibration : Calibration
        With the diffuse curve, which finds the walls for the alignment, and the errors of the beams.
    options : SourceOptions, optional
        As the scans were read with.
    align : bool
        Move the map rigidly to where the glass found in it agrees best with the panes.
    progress : callable, optional
        See `glassslam.map_recording`.

    Raises
    ------
    EvaluationError
        The file of panes cannot be read.
    CalibrationError
        It holds no pane, or no glass is found to align with it.
    """
    path = reading.session.panes
    panes = read_true_glass(path) if path is not None else []
    if not panes:
        raise CalibrationError(f"{path} holds no pane", "a recording without glass is of --material no-glass")
    truth = np.concatenate(panes)
    config = mapping_config(calibration, align=align)
    result = map_recording(reading.session.recording, config, source_options=options, progress=progress)
    poses = _poses(reading, result)
    if align:
        poses = compose(_alignment(reading, result, truth), poses)
    lasers = compose(poses, np.array(reading.info.base_from_laser))
    numbers = places_of(reading)
    return [
        View(
            scan,
            tuple(settled(scan, plane, calibration.diffuse) for plane in planes_in(laser, truth)),
            None,
            int(place),
            met_panes(scan, laser, truth),
        )
        for scan, laser, place in zip(reading.scans, lasers, numbers, strict=True)
    ]


def planes_in(laser: FloatArray, panes: Segments) -> list[Plane]:
    """Panes near a laser, in its frame.

    Parameters
    ----------
    laser : ndarray of float64, shape (3,)
        Pose of the laser in the frame of the panes, m and rad.
    panes : ndarray of float64, shape (n, 2, 2)
        Ends of the panes, m.
    """
    ends = transform_points(inverse(laser), panes.reshape(-1, 2)).reshape(-1, 2, 2)
    planes = (_plane(start, end) for start, end in ends)
    return [plane for plane in planes if plane is not None]


def met_panes(scan: LaserScan, laser: FloatArray, panes: Segments) -> NDArray[np.bool_]:
    """Which beams have met a pane before they returned.

    Parameters
    ----------
    scan : LaserScan
        n beams.
    laser : ndarray of float64, shape (3,)
        Pose of the laser in the frame of the panes, m and rad.
    panes : ndarray of float64, shape (m, 2, 2)
        Ends of the panes, m.
    """
    ends = transform_points(inverse(laser), panes.reshape(-1, 2)).reshape(-1, 2, 2)
    angles = bearings(scan)[:, None]
    cosines, sines = np.cos(angles), np.sin(angles)
    start, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    # the beam meets the line of the pane at `reach`, the share `place` along it
    across = cosines * along[:, 1] - sines * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / across
        place = (start[:, 0] * sines - start[:, 1] * cosines) / across
    ranges = scan.ranges.astype(np.float64)[:, None]
    met = (reach > 0.0) & (reach < ranges + ON_PANE) & (place >= 0.0) & (place <= 1.0)
    return np.asarray(met.any(axis=1))


def _plane(start: FloatArray, end: FloatArray) -> Plane | None:
    direction = end - start
    length = float(np.hypot(*direction))
    if length < LEAST_LENGTH + 2.0 * FRAME:
        return None
    tangent = direction / length
    foot = start - (start @ tangent) * tangent
    distance = float(np.hypot(*foot))
    if not NEAREST < distance < FARTHEST:
        return None
    normal = math.atan2(foot[1], foot[0])
    across = np.array([-math.sin(normal), math.cos(normal)])
    low, high = sorted((float(start @ across), float(end @ across)))
    reach = distance * math.tan(STEEPEST)
    low, high = max(low + FRAME, -reach), min(high - FRAME, reach)
    return Plane(normal, distance, (low, high)) if high - low > LEAST_LENGTH else None


def mapping_config(calibration: Calibration, *, align: bool) -> Config:
    """How a recording with stated panes is mapped: its beams corrected, glass looked for only to align."""
    glass: dict[str, Any] = {"detector": "off"}
    if align:
        glass = {"detector": "calibrated_peak", "calibration": calibration.to_dict()}
    errors = calibration.beam_errors
    return Config.from_mapping({"glass": glass, "sensor": errors.settings if errors else {}})


def _poses(reading: Reading, result: MapResult) -> FloatArray:
    """Pose of the base at every scan of the reading, map frame."""
    poses = result.trajectory.poses
    if reading.numbers[-1] >= len(poses):
        raise CalibrationError(
            f"{reading.session.name}: SLAM has placed {len(poses)} scans only",
            "leave out the damaged part with --start and --duration",
        )
    return poses[reading.numbers]


def _alignment(reading: Reading, result: MapResult, truth: Segments) -> FloatArray:
    walls = () if result.glass is None else result.glass.walls
    if not walls:
        raise CalibrationError(
            f"{reading.session.name}: no glass wall was found to align with {reading.session.panes}",
            "state the panes in the frame of the map and leave out --align",
        )
    return best_alignment(np.array([(wall.start, wall.end) for wall in walls]), truth)
