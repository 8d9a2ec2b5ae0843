"""The octree against a dictionary of voxels: values, merging, growth, queries."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from volume_worlds import NaiveVolume, drawn_tree, listed, naive_code, voxel

from glassslam.errors import GridError
from glassslam.volume.octree import CENTRE, Leaves, Octree, decode, encode
from glassslam.volume.octree_kernels import DEPTH, LEAF, gather, shared_depth, spread
from glassslam.volume.odds import Clamp

key = st.integers(0, 65535)
# voxels of a small cube that straddles the middle of the tree, and changes that reach the bounds soon
near = st.tuples(*[st.integers(CENTRE - 2, CENTRE + 3)] * 3)
change = st.sampled_from([-0.4, 0.85, -3.0, 6.0, 0.0])
batch = st.lists(st.tuples(near, change), min_size=1, max_size=40)


def split(pairs):
    return encode(np.array([k for k, _ in pairs])), np.array([c for _, c in pairs], dtype=np.float32)


@given(st.lists(st.tuples(key, key, key), min_size=1, max_size=20))
def test_codes_interleave_the_bits_of_the_keys(keys):
    codes = encode(np.array(keys))
    assert codes.tolist() == [naive_code(k) for k in keys]
    assert decode(codes).tolist() == [list(k) for k in keys]


@given(key)
def test_spreading_bits_is_undone_by_gathering(value):
    assert gather(spread(value)) == value


@given(st.integers(0, 2**48 - 1), st.integers(0, 2**48 - 1))
def test_two_voxels_share_the_levels_of_their_common_prefix(a, b):
    naive = next((d for d in range(DEPTH, 0, -1) if a >> 3 * (DEPTH - d) == b >> 3 * (DEPTH - d)), 0)
    assert shared_depth(a, b) == naive


@settings(max_examples=150)
@given(st.lists(batch, min_size=1, max_size=6))
def test_a_tree_holds_what_a_dictionary_holds(batches):
    tree, naive = Octree(0.1), NaiveVolume(Clamp())
    for pairs in batches:
        codes, changes = split(pairs)
        tree.add(codes, changes)
        naive.add(codes, changes)
        assert listed(tree.leaves()) == naive.leaves()
    known = np.array(sorted(naive.voxels))
    assert tree.log_odds_of(known).tolist() == [naive.voxels[c] for c in known.tolist()]
    assert tree.leaves().voxels().codes.tolist() == known.tolist()


@given(st.lists(batch, min_size=1, max_size=4))
def test_counts_and_bounds_are_those_of_the_leaves(batches):
    tree = Octree(0.1)
    for pairs in batches:
        tree.add(*split(pairs))
    leaves = tree.leaves()
    ancestors = {(d, c >> 3 * (DEPTH - d)) for c, depth, _ in listed(leaves) for d in range(depth + 1)}
    assert tree.count() == (len(ancestors), len(leaves))
    keys = decode(leaves.voxels().codes)
    low, high = tree.bounds()
    assert low == pytest.approx((keys.min(axis=0) - CENTRE) * 0.1)
    assert high == pytest.approx((keys.max(axis=0) + 1 - CENTRE) * 0.1)


@given(batch, st.integers(0, DEPTH))
def test_a_tree_cut_at_a_depth_has_the_largest_value_of_what_is_below(pairs, depth):
    tree = Octree(0.1)
    tree.add(*split(pairs))
    size = 8 ** (DEPTH - depth)
    naive = {}
    for code, _, value in listed(tree.leaves().voxels()):
        naive[code // size] = max(value, naive.get(code // size, value))
    cut = tree.leaves(depth)
    assert cut.depths.max() <= depth
    covered = {c // size + k for c, d, _ in listed(cut) for k in range(8 ** (depth - d))}
    assert covered == set(naive)
    got = tree.log_odds_of(np.array([c * size for c in naive]), depth)
    assert got.tolist() == list(naive.values())


def test_eight_stable_equal_voxels_are_one_cube_and_come_apart_again():
    tree = Octree(1.0)
    cube = encode(np.argwhere(np.ones((2, 2, 2))) + CENTRE)
    tree.add(cube, np.full(8, 9.0, dtype=np.float32))
    ((code, depth, value),) = listed(tree.leaves())
    assert (code, depth, value) == (voxel(0, 0, 0), DEPTH - 1, np.float32(tree.clamp.high))
    assert tree.leaves().edges.tolist() == [2]
    assert tree.centres(tree.leaves()).tolist() == [[1.0, 1.0, 1.0]]
    tree.add(cube[:1], np.array([-1.0], dtype=np.float32))
    assert len(tree.leaves()) == 8
    assert tree.log_odds_of(cube).tolist() == [tree.clamp.high - 1.0] + [tree.clamp.high] * 7


def test_equal_voxels_that_are_not_stable_stay_apart():
    tree = Octree(1.0)
    tree.add(encode(np.argwhere(np.ones((2, 2, 2))) + CENTRE), np.full(8, 0.5, dtype=np.float32))
    assert len(tree.leaves()) == 8


def test_more_of_the_same_does_not_take_a_stable_cube_apart():
    tree = Octree(1.0)
    cube = encode(np.argwhere(np.ones((4, 4, 4))) + CENTRE)
    tree.add(cube, np.full(64, -9.0, dtype=np.float32))
    used = tree.memory().used_bytes
    tree.add(cube[:5], np.full(5, -0.4, dtype=np.float32))
    assert (len(tree.leaves()), tree.memory().used_bytes) == (1, used)


def test_blocks_of_merged_cubes_are_used_again():
    tree = Octree(1.0)
    cube = encode(np.argwhere(np.ones((8, 8, 8))) + CENTRE)
    for _ in range(5):
        tree.add(cube, np.full(512, 0.1, dtype=np.float32))
        reserved = tree.memory().reserved_bytes
        tree.add(cube, np.full(512, 9.0, dtype=np.float32))
        assert len(tree.leaves()) == 1
        tree.add(cube, np.full(512, -0.1, dtype=np.float32))
        tree.add(cube, np.full(512, 0.05, dtype=np.float32))
    assert tree.memory().reserved_bytes == reserved


def test_a_tree_grows_with_what_is_entered():
    tree, naive = Octree(0.05), NaiveVolume(Clamp())
    random = np.random.default_rng(3)
    codes = np.unique(encode(random.integers(0, 65536, (3000, 3))))
    changes = random.normal(size=codes.size).astype(np.float32)
    before = tree.memory().reserved_bytes
    tree.add_sorted(codes, changes)
    naive.add(codes, changes)
    assert tree.memory().reserved_bytes > 10 * before
    assert tree.memory().used_bytes <= tree.memory().reserved_bytes
    assert tree.log_odds_of(codes).tolist() == [naive.voxels[c] for c in codes.tolist()]


def test_memory_tells_what_a_dense_grid_would_take():
    tree = Octree(0.5)
    tree.add(np.array([voxel(0, 0, 0), voxel(9, 1, 0)]), np.ones(2, dtype=np.float32))
    assert tree.memory().full_grid_bytes == 4 * 10 * 2 * 1


def test_nothing_is_known_of_an_empty_tree():
    tree = Octree()
    assert len(tree.leaves()) == 0
    assert np.isnan(tree.log_odds_at(np.zeros((1, 3)))).all()
    assert tree.bounds()[0].tolist() == tree.bounds()[1].tolist() == [0.0, 0.0, 0.0]
    assert tree.count() == (0, 0)
    assert tree._first_child[0] == LEAF


def test_occupied_are_those_from_the_threshold_on():
    tree = Octree(1.0, Clamp(threshold=0.7))
    codes = np.array([voxel(0, 0, 0), voxel(1, 0, 0), voxel(2, 0, 0)])
    tree.add(codes, np.array([0.8, 0.9, -0.4], dtype=np.float32))
    assert tree.occupied().codes.tolist() == [voxel(1, 0, 0)]


@given(st.lists(batch, min_size=1, max_size=4))
def test_a_tree_comes_back_from_its_leaves(batches):
    tree = Octree(0.2)
    for pairs in batches:
        tree.add(*split(pairs))
    again = Octree.from_leaves(tree.leaves(), 0.2)
    assert listed(again.leaves()) == listed(tree.leaves())
    assert again.count() == tree.count()


@pytest.mark.parametrize(
    ("codes", "depths", "values"),
    [
        ([8, 0], [16, 16], [0.5, 0.5]),
        ([0, 0], [16, 16], [0.5, 0.5]),
        ([0, 3], [15, 16], [0.5, 0.5]),
        ([4], [15], [0.5]),
    ],
)
def test_leaves_that_overlap_or_are_out_of_order_are_refused(codes, depths, values):
    leaves = Leaves(np.array(codes), np.array(depths, dtype=np.uint8), np.array(values, dtype=np.float32))
    with pytest.raises(GridError, match="overlap, are out of order or not aligned with their level"):
        Octree.from_leaves(leaves, 0.1)


@pytest.mark.parametrize(("code", "depth", "value"), [(-1, 16, 0.5), (0, 17, 0.5), (0, 16, np.nan)])
def test_leaves_outside_of_the_tree_are_refused(code, depth, value):
    leaves = Leaves(np.array([code]), np.array([depth], dtype=np.uint8), np.array([value], dtype=np.float32))
    with pytest.raises(GridError, match="a leaf of a volume lies outside of the tree or has no value"):
        Octree.from_leaves(leaves, 0.1)


@pytest.mark.parametrize("point", [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, 3276.9], [-3277.0, 0, 0]])
def test_points_outside_of_the_tree_are_refused(point):
    with pytest.raises(GridError, match="a point is not finite or outside of the volume") as error:
        Octree(0.1).log_odds_at(np.array([point]))
    assert error.value.hint == "voxels of 0.1 m reach 3276.8 m from the origin"


@pytest.mark.parametrize("resolution", [0.0, -0.1, np.nan, np.inf])
def test_a_resolution_must_be_positive(resolution):
    with pytest.raises(GridError, match=f"resolution of a volume is {resolution} m"):
        Octree(resolution)


@pytest.mark.parametrize("depth", [-1, 17])
def test_a_depth_must_be_one_of_the_tree(depth):
    with pytest.raises(GridError, match=f"there is no depth {depth}"):
        Octree().leaves(depth)


@pytest.mark.parametrize("bounds", [(0.5, 0.97), (0.1, 0.5), (0.0, 0.9), (0.1, 1.0)])
def test_bounds_must_lie_on_both_sides_of_even_odds(bounds):
    with pytest.raises(GridError, match="a voxel cannot be clamped to"):
        Clamp(*bounds)


def test_a_threshold_must_lie_between_the_bounds():
    with pytest.raises(GridError, match=r"a threshold of 0\.99 is never crossed") as error:
        Clamp(threshold=0.99)
    assert error.value.hint == "it must lie between 0.1192 and 0.971"


@pytest.mark.parametrize("layers", [["#.?\n.?#"], ["#."], ["##\n##", "##\n##"], ["..\n..", "..\n.."]])
def test_voxels_are_counted_whether_they_are_merged_or_not(layers):
    drawing = "".join(layers)
    assert drawn_tree(layers).volumes() == (drawing.count("#"), drawing.count("."))
