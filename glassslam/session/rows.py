"""Outcomes of a run as rows of the tables, and back, bit by bit."""

import math
import struct
from collections.abc import Sequence
from dataclasses import fields
from operator import attrgetter
from typing import Any

import numpy as np

from glassslam.records import Float32Array, FloatArray
from glassslam.slam.closure import Candidate, Closure
from glassslam.slam.journal import ScanOutcome
from glassslam.slam.node import Node
from glassslam.slam.tracking import Event, How, Match, Tracking

Row = Sequence[Any]

_carried_on = attrgetter(*(field.name for field in fields(Tracking)))
_SAME_POINT = 1e-4
_DOUBLE = struct.Struct("<d")


def scan_row(number: int, stamp: float, outcome: ScanOutcome) -> tuple[Any, ...]:
    """Row of `scans`."""
    match, (usual, *counts) = outcome.match, _carried_on(outcome.tracking)
    return (
        number, *map(_kept, (stamp, *match.pose, match.residual)), int(match.points),
        *map(_kept, (match.hold, match.free_heading, match.overlap)), int(match.how), int(match.event),
        int(match.doubtful), int(outcome.returns), int(outcome.is_node), _kept(usual), *map(int, counts),
    )  # fmt: skip


def scan_outcome(row: Row) -> ScanOutcome:
    """Outcome of a row of `scans`."""
    x, y, theta, residual, points, hold, heading, overlap, how, event, doubtful, returns, is_node = row[2:15]
    usual, since_gap, since_start, in_doubt, *counts = row[15:]
    match = Match(
        np.array([*map(_number, (x, y, theta))]), _number(residual), points, _number(hold), _number(heading),
        _number(overlap), How(how), Event(event), bool(doubtful),
    )  # fmt: skip
    tracking = Tracking(_number(usual), since_gap, since_start, bool(in_doubt), *counts)
    return ScanOutcome(match, tracking, returns, bool(is_node))


def scan_stamps(rows: Sequence[Row]) -> FloatArray:
    """Stamps of rows of `scans`, s, shape (n,)."""
    return np.array([_number(row[1]) for row in rows])


def same_points(before: Row, now: Row) -> bool:
    """Whether two rows of `nodes` hold the same points.

    Another processor may round otherwise; what differs by less than 0.1 mm is the same.
    """
    return all(
        len(a) == len(b) and np.allclose(_points(a), _points(b), rtol=0.0, atol=_SAME_POINT)
        for a, b in zip(before[-3:], now[-3:], strict=True)
    )


def node_row(node: Node) -> tuple[Any, ...]:
    """Row of `nodes`."""
    return (
        node.index, node.scan, *map(_kept, (node.stamp, *node.pose_in_local, *node.sensor, node.residual)),
        int(node.doubtful), int(node.begins),
        node.returns.tobytes(), node.free_ends.tobytes(), node.ghosts.tobytes(),
    )  # fmt: skip


def node_of(row: Row) -> Node:
    """Node of a row of `nodes`."""
    number, scan, stamp, x, y, theta, sx, sy, residual, doubtful, begins, *points = row
    returns, free_ends, ghosts = map(_points, points)
    return Node(
        index=number,
        scan=scan,
        stamp=_number(stamp),
        pose_in_local=np.array([*map(_number, (x, y, theta))]),
        sensor=np.array([*map(_number, (sx, sy))]),
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


def _kept(value: float) -> float | bytes:
    """A number as the database gives it back: it has neither NaN nor -0.0, which go as their bytes."""
    value = float(value)
    if math.isnan(value) or (value == 0.0 and math.copysign(1.0, value) < 0.0):
        return _DOUBLE.pack(value)
    return value


def _number(value: float | bytes) -> float:
    """A number as it was."""
    return _DOUBLE.unpack(value)[0] if isinstance(value, bytes) else value


def _points(blob: bytes) -> Float32Array:
    # a copy: kernels are compiled for arrays that may be written to
    return np.frombuffer(blob, dtype=np.float32).reshape(-1, 2).copy()
