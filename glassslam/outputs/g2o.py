"""Pose graphs as g2o text: VERTEX_SE2, FIX and EDGE_SE2 lines."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import OutputError
from glassslam.outputs.table import parse_numbers, read_text
from glassslam.posegraph.graph import Constraint
from glassslam.records import FloatArray

_UPPER = np.triu_indices(3)
_FIELDS = {"VERTEX_SE2": 4, "EDGE_SE2": 11}


@dataclass(frozen=True, slots=True)
class G2oGraph:
    """A planar pose graph as a g2o file states it.

    Attributes
    ----------
    ids : ndarray of int64, shape (n,)
        Names of the vertices, in the order of the file.
    poses : ndarray of float64, shape (n, 3)
        (x, y, theta) of the vertices, m and rad.
    edges : ndarray of int64, shape (m, 2)
        Names of the two vertices of every edge.
    a_from_b : ndarray of float64, shape (m, 3)
        Measured pose of the second vertex in the frame of the first, m and rad.
    information : ndarray of float64, shape (m, 3, 3)
        Information matrices.
    fixed : tuple of int
        Names of the vertices held in place.
    """

    ids: NDArray[np.int64]
    poses: FloatArray
    edges: NDArray[np.int64]
    a_from_b: FloatArray
    information: FloatArray
    fixed: tuple[int, ...]


def write_g2o(poses: FloatArray, constraints: Sequence[Constraint], path: str | Path) -> Path:
    """Write a pose graph whose vertices are numbered by their row; vertex 0 is fixed.

    Parameters
    ----------
    poses : ndarray of float64, shape (n, 3)
        (x, y, theta) of the vertices, m and rad.
    constraints : sequence of Constraint
        The edges.
    path : str or Path
        The file to write.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    OSError
        The file cannot be written.
    """
    lines = [f"VERTEX_SE2 {vertex} {_pose(pose)}\n" for vertex, pose in enumerate(poses.tolist())]
    if lines:
        lines.append("FIX 0\n")
    lines.extend(_edge(constraint) for constraint in constraints)
    target = Path(path)
    target.write_text("".join(lines), encoding="ascii")
    return target


def _pose(values: list[float]) -> str:
    # Adding zero after rounding turns a negative zero into a plain one.
    return " ".join(format(round(value, 9) + 0.0, ".9f") for value in values)


def _edge(constraint: Constraint) -> str:
    information = constraint.sqrt_information.T @ constraint.sqrt_information
    upper = " ".join(format(value, ".9g") for value in information[_UPPER].tolist())
    return f"EDGE_SE2 {constraint.a} {constraint.b} {_pose(constraint.a_from_b.tolist())} {upper}\n"


def read_g2o(path: str | Path) -> G2oGraph:
    """Read the planar vertices, edges and fixed vertices of a g2o file; other lines are skipped.

    Parameters
    ----------
    path : str or Path
        A g2o text file.

    Returns
    -------
    G2oGraph
        The graph.

    Raises
    ------
    OutputError
        The file cannot be read, has a malformed line, or an edge names an unknown vertex.
    """
    tables: dict[str, list[list[float]]] = {"VERTEX_SE2": [], "EDGE_SE2": []}
    fixed: list[int] = []
    for number, line in enumerate(read_text(path, OutputError).splitlines(), start=1):
        tag, *fields = line.split() or [""]
        where = f"{path}, line {number}"
        if tag == "FIX":
            fixed.extend(int(value) for value in parse_numbers(fields, where, OutputError))
        elif tag in tables:
            if len(fields) < _FIELDS[tag]:
                raise OutputError(f"{where}: {tag} has {len(fields)} fields", f"expected {_FIELDS[tag]}")
            tables[tag].append(parse_numbers(fields[: _FIELDS[tag]], where, OutputError))
    return _assemble(path, tables, tuple(fixed))


def _assemble(path: str | Path, tables: dict[str, list[list[float]]], fixed: tuple[int, ...]) -> G2oGraph:
    vertices = np.array(tables["VERTEX_SE2"], dtype=np.float64).reshape(-1, 4)
    edges = np.array(tables["EDGE_SE2"], dtype=np.float64).reshape(-1, 11)
    ids, ends = vertices[:, 0].astype(np.int64), edges[:, :2].astype(np.int64)
    if (unknown := np.setdiff1d(ends, ids)).size:
        raise OutputError(f"{path}: an edge names vertex {unknown[0]}, which is not in the file")
    information = np.zeros((len(edges), 3, 3))
    information[:, _UPPER[0], _UPPER[1]] = edges[:, 5:]
    information[:, _UPPER[1], _UPPER[0]] = edges[:, 5:]
    return G2oGraph(ids, vertices[:, 1:], ends, edges[:, 2:5], information, fixed)
