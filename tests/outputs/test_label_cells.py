"""Classes of the cells of a map."""

import numpy as np

from glassslam.glass.layer import GlassLayer
from glassslam.glass.observations import GlassObservations
from glassslam.glass.walls import GlassWall
from glassslam.outputs.labels import label_cells, read_labels, write_labels

NAMES = {0: "?", 1: ".", 2: "#", 3: "g", 4: "h"}


def layer(ghosts=(), walls=()):
    none = np.empty(0)
    return GlassLayer(
        tuple(walls), GlassObservations.empty(), np.empty((0, 2)), none,
        ghost_cells=np.array(ghosts, dtype=np.float64).reshape(-1, 2),
    )  # fmt: skip


def drawn(labels):
    return ["".join(NAMES[value] for value in row) for row in labels[::-1]]


def test_cells_are_solid_free_or_unknown(draw_map):
    assert drawn(label_cells(draw_map("#.?+"), layer())) == ["#.??"]


def test_cells_of_ghosts_are_ghosts_unless_they_are_free(draw_map):
    """With ghosts in the map their cells are occupied, without them unknown."""
    grid = draw_map(
        """
        ##.?
        ....
        """,
        origin=(-1.0, 2.0),
    )
    ghosts = [(-0.75, 2.75), (0.25, 2.75), (0.75, 2.75)]
    assert drawn(label_cells(grid, layer(ghosts))) == ["h#.h", "...."]


def test_glass_covers_ghosts(draw_map):
    wall = GlassWall(np.array([0.0, 0.25]), np.array([1.0, 0.25]), 9, 5, 1.0, 0.01, 0.01, 1.0)
    assert drawn(label_cells(draw_map("####"), layer([(0.25, 0.25), (1.75, 0.25)], [wall]))) == ["gggh"]


def test_every_class_has_a_colour_of_its_own(draw_map, tmp_path):
    wall = GlassWall(np.array([0.0, 0.25]), np.array([0.3, 0.25]), 9, 5, 1.0, 0.01, 0.01, 1.0)
    grid, glass = draw_map("##.?#"), layer([(0.75, 0.25)], [wall])
    path = write_labels(grid, glass, tmp_path / "labels.png")
    assert drawn(label_cells(grid, glass)) == ["gh.?#"]
    assert drawn(read_labels(path)) == ["gh.?#"]
