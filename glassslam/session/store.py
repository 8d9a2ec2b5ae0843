"""A finished run in a session file: facts as JSON, everything long as arrays."""

import json
import sqlite3
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from glassslam.config import Config, SubmapConfig
from glassslam.finished import FinishedRun, SourceFacts
from glassslam.grid.probability_grid import OddsModel, ProbabilityGrid
from glassslam.grid.submap import Submap
from glassslam.posegraph.graph import Constraint
from glassslam.posegraph.storage import KINDS
from glassslam.records import Damage, FloatArray, PointSet, RangeRing, RecordingInfo, SonarRing, Trajectory
from glassslam.session.rows import node_of, scan_outcome, scan_stamps
from glassslam.session.schema import insert, unsealed
from glassslam.slam.glass_locks import locks_submaps, miss_probability
from glassslam.slam.node import Node
from glassslam.slam.result import RunStatistics
from glassslam.slam.settled import GlassFindings, SettledRun
from glassslam.slam.trajectory import PoseTracks

Arrays = dict[str, NDArray[Any]]

FINISHED = ("arrays", "calibration", "is_whole", "source", "statistics")
"""Facts that only a finished run has."""
_LOCAL, _PARTIAL, _NODES, _FINAL = "tracks.local", "tracks.partial", "tracks.nodes", "tracks.final"


def save_finished(database: sqlite3.Connection, run: FinishedRun) -> None:
    """Put a finished run beside the rows written on its way, within a transaction of the caller."""
    settled = run.settled
    arrays: Arrays = {
        **_tracks(settled.tracks),
        **_constraints(settled.constraints),
        **_submaps(settled),
        **_glass(settled.glass),
        **_sweeps(run.sweeps),
        **_points(run.points),
    }
    database.execute("DELETE FROM arrays")
    insert(database, "arrays", [_packed(name, array) for name, array in arrays.items()])
    learnt = settled.glass and settled.glass.calibration
    write_facts(
        database,
        {
            "statistics": asdict(replace(settled.statistics, stages={})),
            "source": {**asdict(run.facts), "info": _plain_info(run.facts.info)},
            "calibration": learnt.to_dict() if learnt else None,
            "is_whole": run.is_whole,
            "arrays": sorted(arrays),
        },
    )


def forget_finished(database: sqlite3.Connection) -> None:
    """Take a finished run out again, and leave the rows written on its way."""
    database.execute("DELETE FROM arrays")
    names = ", ".join(f"'{name}'" for name in FINISHED)
    database.execute(f"DELETE FROM facts WHERE name IN ({names})")  # noqa: S608  (own names only)


def load_finished(database: sqlite3.Connection, config: Config) -> FinishedRun:
    """The finished run of a session, with nodes from the rows written on its way.

    Parameters
    ----------
    database : sqlite3.Connection
        A session that holds a finished run.
    config : Config
        Its configuration.
    """
    arrays = {row[0]: _unpacked(unsealed(row)) for row in database.execute("SELECT * FROM arrays")}
    facts = read_facts(database)
    source = facts["source"]
    nodes, tracks = read_nodes(database), _read_tracks(arrays)
    if len(nodes) != len(tracks.nodes.poses):
        raise ValueError(f"{len(nodes)} of {len(tracks.nodes.poses)} nodes")
    settled = SettledRun(
        config=config,
        nodes=nodes,
        submaps=_read_submaps(arrays, config),
        constraints=_read_constraints(arrays),
        tracks=tracks,
        statistics=TypeAdapter(RunStatistics).validate_python(facts["statistics"]),
        glass=_read_glass(arrays, facts["calibration"]),
    )
    return FinishedRun(
        settled,
        SourceFacts(
            _read_info(source["info"]),
            source["dropped"],
            tuple(Damage(**damage) for damage in source["damage"]),
            tuple(source["warnings"]),
        ),
        _read_sweeps(arrays),
        _read_points(arrays),
        facts["is_whole"],
    )


def write_facts(database: sqlite3.Connection, facts: dict[str, Any]) -> None:
    """Add facts to those there are, all in one order whatever was there before."""
    together = {**read_facts(database), **facts}
    database.execute("DELETE FROM facts")
    insert(database, "facts", [(name, json.dumps(together[name])) for name in sorted(together)])


def read_facts(database: sqlite3.Connection) -> dict[str, Any]:
    """All facts by name."""
    return {name: json.loads(text) for name, text in map(unsealed, database.execute("SELECT * FROM facts"))}


def read_nodes(database: sqlite3.Connection) -> tuple[Node, ...]:
    """All nodes, in their order.

    Raises
    ------
    ValueError
        One is missing, or is not what was written.
    """
    rows = database.execute("SELECT * FROM nodes ORDER BY number")
    nodes = tuple(node_of(unsealed(row)) for row in rows)
    if [node.index for node in nodes] != [*range(len(nodes))]:
        raise ValueError("a node is missing")
    return nodes


def read_scans(database: sqlite3.Connection) -> tuple[FloatArray, FloatArray]:
    """Stamps, shape (n,), and local poses, shape (n, 3), of all scans, in their order.

    Raises
    ------
    ValueError
        One is missing, or is not what was written.
    """
    rows = [unsealed(row) for row in database.execute("SELECT * FROM scans ORDER BY number")]
    if [row[0] for row in rows] != [*range(len(rows))]:
        raise ValueError("a scan is missing")
    return scan_stamps(rows), np.array([scan_outcome(row).match.pose for row in rows]).reshape(-1, 3)


def _packed(name: str, array: NDArray[Any]) -> tuple[str, str, str, bytes]:
    return name, array.dtype.str, json.dumps(array.shape), np.ascontiguousarray(array).tobytes()


def _unpacked(row: Sequence[Any]) -> NDArray[Any]:
    _, kind, shape, data = row
    return np.frombuffer(data, dtype=np.dtype(kind)).reshape(json.loads(shape)).copy()


def _tracks(tracks: PoseTracks) -> Arrays:
    tables = {_LOCAL: tracks.local, _PARTIAL: tracks.partial, _NODES: tracks.nodes, _FINAL: tracks.final}
    return {name: np.column_stack((track.stamps, track.poses)) for name, track in tables.items()}


def _read_tracks(arrays: Arrays) -> PoseTracks:
    local, partial, nodes, final = (
        Trajectory(arrays[name][:, 0].copy(), arrays[name][:, 1:].copy())
        for name in (_LOCAL, _PARTIAL, _NODES, _FINAL)
    )
    return PoseTracks(local=local, partial=partial, nodes=nodes, final=final)


def _constraints(constraints: Sequence[Constraint]) -> Arrays:
    return {
        "constraints.ends": np.array([(c.a, c.b) for c in constraints], dtype=np.int64).reshape(-1, 2),
        "constraints.kinds": np.array([KINDS.index(c.kind) for c in constraints], dtype=np.int8),
        "constraints.measured": np.array([c.a_from_b for c in constraints]).reshape(-1, 3),
        "constraints.weights": np.array([c.sqrt_information for c in constraints]).reshape(-1, 3, 3),
    }


def _read_constraints(arrays: Arrays) -> tuple[Constraint, ...]:
    columns = (arrays[f"constraints.{name}"] for name in ("ends", "measured", "weights", "kinds"))
    return tuple(
        Constraint(int(a), int(b), measured, weights, KINDS[kind])
        for (a, b), measured, weights, kind in zip(*columns, strict=True)
    )


def _submaps(run: SettledRun) -> Arrays:
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


def _read_submaps(arrays: Arrays, config: Config) -> tuple[Submap, ...]:
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


def _glass(found: GlassFindings | None) -> Arrays:
    if found is None:
        return {}
    arrays = {f"glass.{f.name}": getattr(found.observations, f.name) for f in fields(found.observations)}
    if found.beams is not None:
        arrays |= {f"beams.{f.name}": getattr(found.beams, f.name) for f in fields(found.beams)}
    return arrays


def _read_glass(arrays: Arrays, learnt: dict[str, Any] | None) -> GlassFindings | None:
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


def _sweeps(sweeps: Sequence[RangeRing]) -> Arrays:
    if not sweeps:
        return {}
    return {
        "sweeps.stamps": np.array([(sweep.stamp, sweep.record_stamp) for sweep in sweeps]),
        "sweeps.sizes": np.array([len(sweep.ranges) for sweep in sweeps], dtype=np.int64),
        "sweeps.ranges": np.concatenate([sweep.ranges for sweep in sweeps]),
    }


def _read_sweeps(arrays: Arrays) -> list[RangeRing]:
    if "sweeps.stamps" not in arrays:
        return []
    parts = np.split(arrays["sweeps.ranges"], np.cumsum(arrays["sweeps.sizes"])[:-1])
    stamps = arrays["sweeps.stamps"].tolist()
    return [RangeRing(stamp, part, recorded) for (stamp, recorded), part in zip(stamps, parts, strict=True)]


def _points(sets: Sequence[PointSet]) -> Arrays:
    if not sets:
        return {}
    return {
        "points.stamps": np.array([(points.stamp, points.record_stamp) for points in sets]),
        "points.origins": np.array([points.origin for points in sets]),
        "points.axes": np.array([points.axis for points in sets]),
        "points.sizes": np.array([len(points.points) for points in sets], dtype=np.int64),
        "points.points": np.concatenate([points.points for points in sets]),
    }


def _read_points(arrays: Arrays) -> list[PointSet]:
    if "points.stamps" not in arrays:
        return []
    parts = np.split(arrays["points.points"], np.cumsum(arrays["points.sizes"])[:-1])
    stamps, axes = arrays["points.stamps"].tolist(), arrays["points.axes"].tolist()
    columns = (stamps, parts, arrays["points.origins"], axes)
    return [
        PointSet(stamp, part, origin, recorded, tuple(axis))
        for (stamp, recorded), part, origin, axis in zip(*columns, strict=True)
    ]


def _plain_info(info: RecordingInfo) -> dict[str, Any]:
    plain = asdict(info)
    if info.sonar_ring is not None:
        plain["sonar_ring"]["poses"] = info.sonar_ring.poses.tolist()
    return plain


def _read_info(plain: dict[str, Any]) -> RecordingInfo:
    ring = plain.pop("sonar_ring")
    if ring is not None:
        ring = SonarRing(**{**ring, "poses": np.array(ring["poses"], dtype=np.float64).reshape(-1, 3)})
    values: dict[str, Any] = {name: tupled(value) for name, value in plain.items()}
    return RecordingInfo(**values, sonar_ring=ring)


def tupled(value: Any) -> Any:
    """A list as the tuple it was before it became JSON; anything else as it is."""
    return tuple(value) if isinstance(value, list) else value
