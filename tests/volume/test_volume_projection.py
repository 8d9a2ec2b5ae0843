"""A volume seen from above, drawn layer by layer."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volume_worlds import drawing_of, drawn_tree

from glassslam.errors import GridError
from glassslam.volume import projection
from glassslam.volume.octree import CENTRE, Octree, encode
from glassslam.volume.projection import band_keys, project, project_bands, top_heights
from glassslam.volume.projection_kernels import highest, project_leaves

ROOM = [
    # the floor: a pallet on the left
    "....\n#...\n....",
    # the plane of the lidar sees a wall on the right
    "...#\n...#\n...#",
    # a lamp in the middle, nothing known at the border
    "????\n?#.?\n????",
]


def test_the_most_occupied_voxel_of_a_column_decides():
    assert drawing_of(project(drawn_tree(ROOM), (0.0, 1.5))) == ["...#", "##.#", "...#"]


def test_a_voxel_seen_free_once_does_not_hide_a_column_known_to_be_free():
    tree = drawn_tree(["."])
    tree.add(encode(np.array([[0, 0, 1]]) + CENTRE), np.array([-0.4], dtype=np.float32))
    assert drawing_of(project(tree, (0.0, 1.0))) == ["."]
    assert drawing_of(project(tree, (0.5, 1.0))) == ["+"]


def test_a_band_leaves_out_what_is_above_and_below():
    tree = drawn_tree(ROOM)
    assert drawing_of(project(tree, (0.5, 1.0))) == ["...#"] * 3
    assert drawing_of(project(tree, (1.0, 1.5))) == ["????", "?#.?", "????"]
    assert drawing_of(project(tree, (3.0, 4.0))) == ["????"] * 3


def test_a_pooled_column_weighs_all_its_voxels():
    # one occupied voxel and two free ones: 3.51 - 2 * 2.0 in log odds, over 3
    lamp = project(drawn_tree(ROOM), (0.0, 1.5), "pool").probability[1, 1]
    assert lamp == pytest.approx(1 / (1 + np.exp(-(3.511 - 2 * 2.0) / 3)), abs=1e-3)


def test_the_map_lies_where_the_volume_lies():
    tree = Octree(0.5)
    tree.add(encode(np.array([[-2, 3, 0]]) + CENTRE), np.array([9.0], dtype=np.float32))
    grid = project(tree, (0.0, 0.5))
    assert (grid.origin, grid.resolution, grid.probability.shape) == ((-1.0, 1.5), 0.5, (1, 1))


def test_a_merged_cube_counts_in_every_column_it_covers():
    tree = drawn_tree(["##\n##", "##\n##"])
    assert len(tree.leaves()) == 1
    assert drawing_of(project(tree, (0.5, 1.0))) == ["##", "##"]


def test_a_bound_on_a_layer_does_not_touch_the_next_one():
    tree = Octree(0.05)
    assert band_keys(tree, (0.15, 0.3)) == (CENTRE + 3, CENTRE + 6)
    assert band_keys(tree, (0.16, 0.31)) == (CENTRE + 3, CENTRE + 7)


@pytest.mark.parametrize("band", [(1.0, 1.0), (2.0, 1.0), (np.nan, 1.0), (0.0, np.inf)])
def test_a_band_must_hold_some_height(band):
    with pytest.raises(GridError, match="there is no height from"):
        project(Octree(), band)


def test_a_rule_must_exist():
    with pytest.raises(GridError, match="there is no rule 'min' of projection") as error:
        project(Octree(), (0.0, 1.0), "min")
    assert error.value.hint == "known: max, pool"


def test_tops_are_the_upper_sides_of_the_highest():
    tree = drawn_tree(ROOM)
    heights, origin = top_heights(tree, tree.occupied())
    assert origin == (0.0, 0.0)
    assert heights[::-1].tolist() == pytest.approx(
        np.array([[np.nan, np.nan, np.nan, 1.0], [0.5, 1.5, np.nan, 1.0], [np.nan, np.nan, np.nan, 1.0]]),
        nan_ok=True,
    )


cube = st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(0, 5), st.sampled_from([1, 2, 4]))


@given(st.lists(cube, min_size=1, max_size=8), st.integers(0, 3), st.integers(4, 8))
def test_the_kernels_agree_with_their_twins(cubes, bottom, top):
    keys = np.array([c[:3] for c in cubes])
    edges = np.array([c[3] for c in cubes])
    values = np.arange(len(cubes), dtype=np.float32) - 2.0
    shape = (8, 7)
    largest, smallest = np.full(shape, -np.inf, np.float32), np.full(shape, np.inf, np.float32)
    total = np.zeros(shape, np.float32)
    count = np.zeros(shape, np.int32)
    corner = np.array([1, 1])
    project_leaves(keys, edges, values, corner, bottom, top, largest, smallest, total, count)
    naive = {}
    for (x, y, z), edge, value in zip(keys.tolist(), edges.tolist(), values, strict=True):
        for dx, dy, dz in np.ndindex(edge, edge, edge):
            row, column = y + dy - 1, x + dx - 1
            if bottom <= z + dz < top and 0 <= row < shape[0] and 0 <= column < shape[1]:
                naive.setdefault((row, column), []).append(value)
    for place in np.ndindex(shape):
        seen = naive.get(place, [])
        assert count[place] == len(seen)
        assert largest[place] == max(seen, default=-np.inf)
        assert smallest[place] == min(seen, default=np.inf)
        assert total[place] == pytest.approx(sum(seen), abs=1e-4)
    tops = np.full((10, 10), -1)
    highest(keys, edges, np.zeros(2, dtype=np.int64), tops)
    for row, column in np.ndindex(10, 10):
        over = [z + e for (x, y, z), e in zip(keys, edges, strict=True)
                if x <= column < x + e and y <= row < y + e]  # fmt: skip
        assert tops[row, column] == max(over, default=-1)


def test_a_map_too_large_for_memory_is_refused_before_it_is_made(monkeypatch):
    monkeypatch.setattr(projection, "MOST_CELLS", 11)
    with pytest.raises(GridError, match=r"2 x 2 m in voxels of 0\.5 m are too many for a map") as error:
        project(drawn_tree(["....\n....\n...."]), (0.0, 1.0))
    assert error.value.hint == "raise volume.resolution"
    monkeypatch.setattr(projection, "MOST_CELLS", 12)
    assert project(drawn_tree(["....\n....\n...."]), (0.0, 1.0)).probability.shape == (3, 4)


@pytest.mark.parametrize("rule", ["max", "pool"])
def test_several_bands_are_projected_as_each_alone(rule):
    tree = drawn_tree(ROOM)
    bands = [(0.0, 0.5), (0.5, 1.0), (0.0, 1.5)]
    together = list(project_bands(tree, bands, rule))
    assert len(together) == 3
    for band, grid in zip(bands, together, strict=True):
        alone = project(tree, band, rule)
        np.testing.assert_array_equal(grid.probability, alone.probability)
        assert grid.origin == alone.origin


def test_a_band_may_reach_beyond_the_tree():
    tree = drawn_tree(ROOM)
    everything = project(tree, (0.0, 1.5)).probability
    for far in (1e5, 1e300, 1.7e308):
        np.testing.assert_array_equal(project(tree, (-far, far)).probability, everything)
        assert np.isnan(project(tree, (far / 2, far)).probability).all()
