"""The arrays of a finished run, by name: poses, graph, submaps, glass, sonars and points."""

import json
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from glassslam.config import Config, SubmapConfig
from glassslam.grid.probability_grid import OddsModel, ProbabilityGrid
from glassslam.grid.submap import Submap
from glassslam.posegraph.graph import Constraint
from glassslam.posegraph.storage import KINDS
from glassslam.records import PointSet, RangeRing, Trajectory
from glassslam.slam.glass_locks import locks_submaps, miss_probability
from glassslam.slam.settled import GlassFindings, SettledRun
from glassslam.slam.trajectory import PoseTracks

Arrays = dict[str, NDArray[Any]]

_LOCAL, _PARTIAL, _NODES, _FINAL = "tracks.local", "tracks.partial", "tracks.nodes", "tracks.final"


def packed(name: str, array: NDArray[Any]) -> tuple[str, str, str, bytes]:
    """A row of `arrays`."""
    return name, array.dtype.str, json.dumps(array.shape), np.ascontiguousarray(array).tobytes()


def unpacked(row: Sequence[Any]) -> NDArray[Any]:
    """The array of a row of `arrays`."""
    _, kind, shape, data = row
    return np.frombuffer(data, dtype=np.dtype(kind)).reshape(json.loads(shape)).copy()


def track_arrays(tracks: PoseTracks) -> Arrays:
    """The poses of a run."""
    tables = {_LOCAL: tracks.local, _PARTIAL: tracks.partial, _NODES: tracks.nodes, _FINAL: tracks.final}
    return {name: np.column_stack((track.stamps, track.poses)) for name, track in tables.items()}


def read_tracks(arrays: Arrays) -> PoseTracks:
    """The poses of a run, from its arrays."""
    local, partial, nodes, final = (
        Trajectory(arrays[name][:, 0].copy(), arrays[name][:, 1:].copy())
        for name in (_LOCAL, _PARTIAL, _NODES, _FINAL)
    )
    return PoseTracks(local=local, partial=partial, nodes=nodes, final=final)


def constraint_arrays(constraints: Sequence[Constraint]) -> Arrays:
    """The edges of the pose graph."""
    return {
        "constraints.ends": np.array([(c.a, c.b) for c in constraints], dtype=np.int64).reshape(-1, 2),
        "constraints.kinds": np.array([KINDS.index(c.kind) for c in constraints], dtype=np.int8),
        "constraints.measured": np.array([c.a_from_b for c in constraints]).reshape(-1, 3),
        "constraints.weights": np.array([c.sqrt_information for c in constraints]).reshape(-1, 3, 3),
    }


def read_constraints(arrays: Arrays) -> tuple[Constraint, ...]:
    """The edges of the pose graph, from their arrays."""
    columns = (arrays[f"constraints.{name}"] for name in ("ends", "measured", "weights", "kinds"))
    return tuple(
        Constraint(int(a), int(b), measured, weights, KINDS[kind])
        for (a, b), measured, weights, kind in zip(*columns, strict=True)
    )


def submap_arrays(run: SettledRun) -> Arrays:
    """Nodes of all submaps; their cells only where glass is locked in them."""
    members = [np.array(submap.nodes, dtype=np.int64) for submap in run.submaps]
    arrays: Arrays = {
        "submaps.sizes": np.array([len(nodes) for nodes in members], dtype=np.int64),
        "submaps.nodes": np.concatenate([np.empty(0, np.int64), *members]),
        "submaps.poses": np.array([submap.local_pose for submap in run.submaps]).reshape(-1, 3),
    }
    if locks_submaps(run.config.glass.scheme):
        for k, submap in enumerate(run.submaps):
            arrays[f"submaps.{k}.cells"] = submap.grid.cells
            arrays[f"submaps.{k}.origin"] = submap.grid.origin
    return arrays


def read_submaps(arrays: Arrays, config: Config) -> tuple[Submap, ...]:
    """All submaps, from their arrays."""
    sizes = arrays["submaps.sizes"]
    members = np.split(arrays["submaps.nodes"], np.cumsum(sizes)[:-1]) if len(sizes) else []
    odds = OddsModel(config.submap.hit_probability, miss_probability(config))
    return tuple(
        Submap(k, pose, _read_grid(arrays, k, config.submap, odds), nodes.tolist(), finished=True)
        for k, (pose, nodes) in enumerate(zip(arrays["submaps.poses"], members, strict=True))
    )


def _read_grid(arrays: Arrays, number: int, config: SubmapConfig, odds: OddsModel) -> ProbabilityGrid:
    grid = ProbabilityGrid(config.resolution, odds)
    if (cells := arrays.get(f"submaps.{number}.cells")) is not None:
        grid.cells, grid.origin = cells, arrays[f"submaps.{number}.origin"]
    return grid


def glass_arrays(found: GlassFindings | None) -> Arrays:
    """What was seen of glass."""
    if found is None:
        return {}
    arrays = {f"glass.{f.name}": getattr(found.observations, f.name) for f in fields(found.observations)}
    if found.beams is not None:
        arrays |= {f"beams.{f.name}": getattr(found.beams, f.name) for f in fields(found.beams)}
    return arrays


def read_glass(arrays: Arrays, learnt: dict[str, Any] | None) -> GlassFindings | None:
    """What was seen of glass, from its arrays; None where the lidar was not asked."""
    if "glass.node" not in arrays:
        return None
    from detectors.calibration import Calibration  # noqa: PLC0415  (only runs that looked for glass)
    from glassslam.glass.beam_labels import GlassBeams  # noqa: PLC0415
    from glassslam.glass.observations import GlassObservations  # noqa: PLC0415

    seen = GlassObservations(*(arrays[f"glass.{f.name}"] for f in fields(GlassObservations)))
    beams = None
    if "beams.scan" in arrays:
        beams = GlassBeams(*(arrays[f"beams.{f.name}"] for f in fields(GlassBeams)))
    return GlassFindings(seen, beams, None if learnt is None else Calibration.from_dict(learnt))


def sweep_arrays(sweeps: Sequence[RangeRing]) -> Arrays:
    """The sweeps of sonars."""
    if not sweeps:
        return {}
    return {
        "sweeps.stamps": np.array([(sweep.stamp, sweep.record_stamp) for sweep in sweeps]),
        "sweeps.sizes": np.array([len(sweep.ranges) for sweep in sweeps], dtype=np.int64),
        "sweeps.ranges": np.concatenate([sweep.ranges for sweep in sweeps]),
    }


def read_sweeps(arrays: Arrays) -> list[RangeRing]:
    """The sweeps of sonars, from their arrays."""
    if "sweeps.stamps" not in arrays:
        return []
    parts = np.split(arrays["sweeps.ranges"], np.cumsum(arrays["sweeps.sizes"])[:-1])
    stamps = arrays["sweeps.stamps"].tolist()
    return [RangeRing(stamp, part, recorded) for (stamp, recorded), part in zip(stamps, parts, strict=True)]


def point_arrays(sets: Sequence[PointSet]) -> Arrays:
    """The points of 3D ultrasonic sensors."""
    if not sets:
        return {}
    return {
        "points.stamps": np.array([(points.stamp, points.record_stamp) for points in sets]),
        "points.origins": np.array([points.origin for points in sets]),
        "points.axes": np.array([points.axis for points in sets]),
        "points.sizes": np.array([len(points.points) for points in sets], dtype=np.int64),
        "points.points": np.concatenate([points.points for points in sets]),
    }


def read_points(arrays: Arrays) -> list[PointSet]:
    """The points of 3D ultrasonic sensors, from their arrays."""
    if "points.stamps" not in arrays:
        return []
    parts = np.split(arrays["points.points"], np.cumsum(arrays["points.sizes"])[:-1])
    stamps, axes = arrays["points.stamps"].tolist(), arrays["points.axes"].tolist()
    columns = (stamps, parts, arrays["points.origins"], axes)
    return [
        PointSet(stamp, part, origin, recorded, tuple(axis))
        for (stamp, recorded), part, origin, axis in zip(*columns, strict=True)
    ]
