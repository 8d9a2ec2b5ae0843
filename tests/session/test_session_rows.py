"""Outcomes of a run as rows of the tables: every bit comes back, and nothing is left out."""

import math
import sqlite3
from dataclasses import fields

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from sameness import differences

from glassslam.session import schema
from glassslam.session.rows import closure_of, node_of, node_row, scan_outcome, scan_row, search_row
from glassslam.slam.closure import Candidate, Closure
from glassslam.slam.journal import ScanOutcome
from glassslam.slam.node import Node
from glassslam.slam.tracking import Event, How, Match, Tracking

CHANGED = (
    "what a session holds has changed: raise schema.VERSION, register in schema.MIGRATIONS what makes a file "
    "of the version before one of this version, and write the change down in this test"
)

numbers = st.floats(width=64) | st.sampled_from([-0.0, math.nan, -math.nan, math.inf, -math.inf, 5e-324])
counts = st.integers(-(2**40), 2**40)
points = arrays(np.float32, st.tuples(st.integers(0, 5), st.just(2)), elements=st.floats(width=32))


def vectors(*shape):
    return arrays(np.float64, shape, elements=numbers)


matches = st.builds(
    Match, vectors(3), numbers, counts, numbers, numbers, numbers,
    st.sampled_from(How), st.integers(0, 7).map(Event), st.booleans(),
)  # fmt: skip
trackings = st.builds(Tracking, numbers, counts, counts, st.booleans(), *[counts] * 6)
outcomes = st.builds(ScanOutcome, matches, trackings, counts, st.booleans())
nodes = st.builds(
    Node, counts, counts, numbers, vectors(3), vectors(2), points, points, numbers, st.booleans(),
    points, st.booleans(),
)  # fmt: skip
candidates = st.builds(
    Candidate, counts, counts, counts, vectors(3), vectors(3), numbers, numbers, vectors(3, 3)
)
closures = st.builds(
    Closure, candidates, st.text(max_size=20).filter(lambda text: text.isascii()), vectors(3), vectors(3, 3),
    st.booleans(), st.booleans(),
)  # fmt: skip


@pytest.fixture(scope="module")
def through_table():
    """Writes a row into a table of a database and reads it back."""
    database = sqlite3.connect(":memory:", isolation_level=None)
    schema.create_tables(database)

    def write_and_read(table, row):
        database.execute(f"DELETE FROM {table}")  # noqa: S608  (own names only)
        schema.insert(database, table, [row])
        return schema.unsealed(database.execute(f"SELECT * FROM {table}").fetchone())  # noqa: S608

    yield write_and_read
    database.close()


@given(outcome=outcomes, stamp=numbers)
def test_outcomes_of_scans_come_back_bit_by_bit(through_table, outcome, stamp):
    row = through_table("scans", scan_row(7, stamp, outcome))
    assert differences(outcome, scan_outcome(row)) == []


@given(node=nodes)
def test_nodes_come_back_bit_by_bit(through_table, node):
    assert differences(node, node_of(through_table("nodes", node_row(node)))) == []


@given(closure=closures)
def test_closures_come_back_bit_by_bit(through_table, closure):
    assert differences(closure, closure_of(through_table("searches", search_row(3, 2, closure)))) == []


def test_points_of_a_node_may_be_written_to(through_table):
    empty = np.empty((0, 2), np.float32)
    node = Node(0, 0, 1.0, np.zeros(3), np.zeros(2), np.ones((4, 2), np.float32), empty, 0.1)
    node_of(through_table("nodes", node_row(node))).returns[0] = 5.0


EXPANDED = {
    "pose": ("x", "y", "theta"), "pose_in_local": ("x", "y", "theta"), "sensor": ("sensor_x", "sensor_y"),
}  # fmt: skip


def names(kind):
    return [name for field in fields(kind) for name in EXPANDED.get(field.name, (field.name,))]


def test_every_field_of_match_and_tracking_has_its_column():
    tracking = ["in_doubt" if name == "doubtful" else name for name in names(Tracking)]
    expected = ["number", "stamp", *names(Match), "returns", "is_node", *tracking, "seal"]
    assert list(schema.TABLES["scans"]) == expected, CHANGED
    assert names(ScanOutcome) == ["match", "tracking", "returns", "is_node"], CHANGED


def test_every_field_of_a_node_has_its_column():
    held = {"number" if name == "index" else name for name in names(Node)}
    assert set(schema.TABLES["nodes"]) == held | {"seal"}, CHANGED


def test_every_field_of_a_closure_has_its_place():
    packed = {"anchor_in_local", "anchor_from_node", "linear_window", "angular_window", "covariance"}
    held = {*schema.TABLES["searches"]} - {"number", "round", "numbers", "seal"} | packed
    assert {*names(Candidate), *names(Closure)} - {"candidate"} == held, CHANGED
    row = search_row(0, 0, closure_like(np.arange(29.0)))
    assert len(row[-1]) == 8 * 29, CHANGED


def closure_like(values):
    """A closure whose numbers are the given ones in the order of their fields."""
    candidate = Candidate(1, 2, 3, values[:3], values[3:6], *values[6:8].tolist(), values[8:17].reshape(3, 3))
    return Closure(candidate, "", values[17:20], values[20:29].reshape(3, 3))


PINNED = {
    1: {
        "facts": "name value seal",
        "scans": "number stamp x y theta residual points hold free_heading overlap how event doubtful "
        "returns is_node usual_residual since_gap since_start in_doubt searches searches_taken "
        "relocalisations relocalised coasted unmatched seal",
        "nodes": "number scan stamp x y theta sensor_x sensor_y residual doubtful begins returns free_ends "
        "ghosts seal",
        "rounds": "number searches seal",
        "searches": "number round node anchor submap rejected ambiguous searched numbers seal",
        "arrays": "name type shape data seal",
    }
}
"""Columns of every version there has been."""


def test_a_row_that_is_not_what_was_written_is_noticed(through_table):
    *row, mark = scan_row(0, 1.0, ScanOutcome(Match(np.zeros(3), 0.5), Tracking(), 3, False)), 17
    with pytest.raises(ValueError, match="a row is not what was written"):
        schema.unsealed((*row[0], mark))


def test_the_tables_are_those_of_the_version():
    assert schema.VERSION in PINNED, CHANGED
    found = {table: " ".join(columns) for table, columns in schema.TABLES.items()}
    assert found == PINNED[schema.VERSION], CHANGED


def test_files_of_every_earlier_version_can_be_read():
    assert set(schema.MIGRATIONS) == set(range(1, schema.VERSION)), "a version without a way to the next"
