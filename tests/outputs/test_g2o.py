"""graph.g2o."""

import numpy as np
import pytest

from glassslam.errors import OutputError
from glassslam.outputs import read_g2o, write_g2o
from glassslam.posegraph.graph import Constraint

POSES = np.array([[0.0, 0.0, 0.0], [1.5, -2.25, 3.0]])
ROOT_OF_INFORMATION = np.array([[2.0, 1.0, 0.0], [0.0, 3.0, 0.5], [0.0, 0.0, 4.0]])
EDGE = Constraint(0, 1, np.array([1.5, -2.0, -0.0]), ROOT_OF_INFORMATION, "loop")


def test_file_states_vertices_the_fixed_one_and_edges_with_the_upper_triangle(tmp_path):
    write_g2o(POSES, [EDGE], tmp_path / "g.g2o")
    assert (tmp_path / "g.g2o").read_text().splitlines() == [
        "VERTEX_SE2 0 0.000000000 0.000000000 0.000000000",
        "VERTEX_SE2 1 1.500000000 -2.250000000 3.000000000",
        "FIX 0",
        "EDGE_SE2 0 1 1.500000000 -2.000000000 0.000000000 4 2 0 10 1.5 16.25",
    ]


def test_what_is_written_is_read_back(tmp_path):
    write_g2o(POSES, [EDGE, EDGE], tmp_path / "g.g2o")
    graph = read_g2o(tmp_path / "g.g2o")
    np.testing.assert_array_equal(graph.ids, [0, 1])
    np.testing.assert_allclose(graph.poses, POSES)
    np.testing.assert_array_equal(graph.edges, [[0, 1], [0, 1]])
    np.testing.assert_allclose(graph.a_from_b, [EDGE.a_from_b] * 2)
    np.testing.assert_allclose(graph.information, [ROOT_OF_INFORMATION.T @ ROOT_OF_INFORMATION] * 2)
    assert graph.fixed == (0,)


def test_a_graph_without_edges_is_a_graph(tmp_path):
    write_g2o(POSES, [], tmp_path / "g.g2o")
    graph = read_g2o(tmp_path / "g.g2o")
    assert graph.a_from_b.shape == (0, 3)
    assert graph.information.shape == (0, 3, 3)


def test_foreign_lines_and_extra_fields_are_skipped(tmp_path):
    path = tmp_path / "g.g2o"
    path.write_text("# comment\nPARAMS_SE2OFFSET 0 0 0 0\nVERTEX_SE2 7 1 2 3 extra\n\n")
    graph = read_g2o(path)
    np.testing.assert_array_equal(graph.ids, [7])
    np.testing.assert_allclose(graph.poses, [[1, 2, 3]])


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("VERTEX_SE2 0 1 2\n", "line 1: VERTEX_SE2 has 3 fields"),
        ("VERTEX_SE2 0 1 2 three\n", "line 1: 'three' is not a finite number"),
        ("VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 5 0 0 0 1 0 0 1 0 1\n", "an edge names vertex 5"),
    ],
)
def test_malformed_graphs_are_refused(tmp_path, text, complaint):
    path = tmp_path / "g.g2o"
    path.write_text(text)
    with pytest.raises(OutputError, match=complaint):
        read_g2o(path)
