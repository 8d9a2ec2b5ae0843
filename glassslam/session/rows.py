"""Outcomes of a run as rows of the tables, and back, bit by bit."""

from collections.abc import Sequence
from dataclasses import astuple
from typing import Any

import numpy as np

from glassslam.records import Float32Array, FloatArray
from glassslam.slam.closure import Candidate, Closure
from glassslam.slam.journal import ScanOutcome
from glassslam.slam.node import Node
from glassslam.slam.tracking import Event, How, Match, Tracking

Row = Sequence[Any]


def scan_row(number: int, stamp: float, outcome: ScanOutcome) -> tuple[Any, ...]:
    """Row of `scans`."""
    match, now = outcome.match, outcome.tracking
    return (
        number, float(stamp), *match.pose.tolist(), float(match.residual), int(match.points),
        float(match.hold), float(match.free_heading), float(match.overlap), int(match.how), int(match.event),
        int(match.doubtful), int(outcome.returns), int(outcome.is_node), *map(_plain, astuple(now)),
    )  # fmt: skip


def scan_outcome(row: Row) -> ScanOutcome:
    """Outcome of a row of `scans`."""
    x, y, theta, residual, points, hold, heading, overlap, how, event, doubtful, returns, is_node = row[2:15]
    usual, since_gap, since_start, in_doubt, *counts = row[15:]
    match = Match(
        np.array([x, y, theta], dtype=np.float64), _number(residual), points, _number(hold), _number(heading),
        _number(overlap), How(how), Event(event), bool(doubtful),
    )  # fmt: skip
    tracking = Tracking(_number(usual), since_gap, since_start, bool(in_doubt), *counts)
    return ScanOutcome(match, tracking, returns, bool(is_node))


def node_row(node: Node) -> tuple[Any, ...]:
    """Row of `nodes`."""
    return (
        node.index, node.scan, float(node.stamp), *node.pose_in_local.tolist(), *node.sensor.tolist(),
        float(node.residual), int(node.doubtful), int(node.begins),
        node.returns.tobytes(), node.free_ends.tobytes(), node.ghosts.tobytes(),
    )  # fmt: skip


def node_of(row: Row) -> Node:
    """Node of a row of `nodes`."""
    number, scan, stamp, x, y, theta, sx, sy, residual, doubtful, begins, *points = row
    returns, free_ends, ghosts = map(_points, points)
    return Node(
        index=number,
        scan=scan,
        stamp=stamp,
        pose_in_local=np.array([x, y, theta]),
        sensor=np.array([sx, sy]),
        returns=returns,
        free_ends=free_ends,
        residual=_number(residual),
        doubtful=bool(doubtful),
        ghosts=ghosts,
        begins=bool(begins),
    )


def search_row(number: int, round_number: int, closure: Closure) -> tuple[Any, ...]:
    """Row of `searches`."""
    candidate = closure.candidate
    numbers = np.concatenate(
        [
            candidate.anchor_in_local, candidate.anchor_from_node,
            [candidate.linear_window, candidate.angular_window], candidate.covariance.ravel(),
            closure.anchor_from_node, closure.covariance.ravel(),
        ]
    )  # fmt: skip
    return (
        number, round_number, int(candidate.node), int(candidate.anchor), int(candidate.submap),
        closure.rejected, int(closure.ambiguous), int(closure.searched), numbers.tobytes(),
    )  # fmt: skip


def closure_of(row: Row) -> Closure:
    """Closure of a row of `searches`."""
    _, _, node, anchor, submap, rejected, ambiguous, searched, blob = row
    numbers: FloatArray = np.frombuffer(blob, dtype=np.float64).copy()
    local, expected, windows, before, measured, covariance = np.split(numbers, [3, 6, 8, 17, 20])
    candidate = Candidate(
        node, anchor, submap, local, expected, float(windows[0]), float(windows[1]), before.reshape(3, 3)
    )
    return Closure(candidate, rejected, measured, covariance.reshape(3, 3), bool(ambiguous), bool(searched))


def _plain(value: float) -> float:
    """A number as the database takes it: truth values as 0 and 1."""
    return int(value) if isinstance(value, bool) else value


def _number(value: float | None) -> float:
    """A number as it was: the database has no NaN."""
    return float("nan") if value is None else value


def _points(blob: bytes) -> Float32Array:
    # a copy: kernels are compiled for arrays that may be written to
    return np.frombuffer(blob, dtype=np.float32).reshape(-1, 2).copy()
