"""A finished run in a session file: facts as JSON, everything long as arrays."""

import json
import sqlite3
from dataclasses import asdict, replace
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from glassslam.config import Config
from glassslam.finished import FinishedRun, SourceFacts
from glassslam.records import Damage, FloatArray, RecordingInfo, SonarRing
from glassslam.session.arrays import (
    Arrays,
    constraint_arrays,
    glass_arrays,
    packed,
    point_arrays,
    read_constraints,
    read_glass,
    read_points,
    read_submaps,
    read_sweeps,
    read_tracks,
    submap_arrays,
    sweep_arrays,
    track_arrays,
    unpacked,
)
from glassslam.session.rows import node_of, scan_outcome, scan_stamps
from glassslam.session.schema import insert, unsealed
from glassslam.slam.node import Node
from glassslam.slam.result import RunStatistics
from glassslam.slam.settled import SettledRun

FINISHED = ("arrays", "calibration", "is_whole", "source", "statistics")
"""Facts that only a finished run has."""


def save_finished(database: sqlite3.Connection, run: FinishedRun) -> None:
    """Put a finished run beside the rows written on its way, within a transaction of the caller."""
    settled = run.settled
    arrays: Arrays = {
        **track_arrays(settled.tracks),
        **constraint_arrays(settled.constraints),
        **submap_arrays(settled),
        **glass_arrays(settled.glass),
        **sweep_arrays(run.sweeps),
        **point_arrays(run.points),
    }
    database.execute("DELETE FROM arrays")
    insert(database, "arrays", [packed(name, array) for name, array in arrays.items()])
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
    arrays = {row[0]: unpacked(unsealed(row)) for row in database.execute("SELECT * FROM arrays")}
    facts = read_facts(database)
    source = facts["source"]
    nodes, tracks = read_nodes(database), read_tracks(arrays)
    if len(nodes) != len(tracks.nodes.poses):
        raise ValueError(f"{len(nodes)} of {len(tracks.nodes.poses)} nodes")
    settled = SettledRun(
        config=config,
        nodes=nodes,
        submaps=read_submaps(arrays, config),
        constraints=read_constraints(arrays),
        tracks=tracks,
        statistics=TypeAdapter(RunStatistics).validate_python(facts["statistics"]),
        glass=read_glass(arrays, facts["calibration"]),
    )
    return FinishedRun(
        settled,
        SourceFacts(
            _read_info(source["info"]),
            source["dropped"],
            tuple(Damage(**damage) for damage in source["damage"]),
            tuple(source["warnings"]),
        ),
        read_sweeps(arrays),
        read_points(arrays),
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
