"""The pools as voxels use them: in log odds, two at a time, and for whole volumes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from volume_worlds import drawn_tree, voxel

from glassslam.errors import GridError
from glassslam.fusion.pools import bayes_pool, independent_pool
from glassslam.volume.octree import Octree
from glassslam.volume.odds import probabilities
from glassslam.volume.pooling import fuse_volumes, pooled

POOLS = ["bayes", "iop", "lop", "liop"]
odds = st.floats(-3, 3, width=32)


def one(first, second, pool, weights=(1.0, 1.0)):
    return float(pooled(np.array([first], np.float32), np.array([second], np.float32), pool, weights)[0])


@given(odds, odds, st.sampled_from(["bayes", "iop"]))
def test_adding_log_odds_is_the_pool_of_the_probabilities(first, second, pool):
    p = probabilities(np.array([[first], [second]]))
    expected = {"bayes": bayes_pool, "iop": independent_pool}[pool](p)
    assert probabilities(np.array([one(first, second, pool)])) == pytest.approx(expected, abs=1e-6)


@given(odds)
def test_bayes_and_iop_follow_the_only_sensor_that_says_something(first):
    assert one(first, 0.0, "bayes") == one(0.0, first, "iop") == np.float32(first)


@pytest.mark.parametrize(("pool", "expected"), [("lop", 0.6), ("liop", 0.604)])
def test_lop_and_liop_are_weakened_by_a_sensor_that_says_nothing(pool, expected):
    # 0.7 and 0.5: (0.7 + 0.5) / 2, and sqrt(0.7 / 0.3) in odds
    strength = np.log(0.7 / 0.3)
    assert probabilities(np.array([one(strength, 0.0, pool)]))[0] == pytest.approx(expected, abs=5e-4)


def test_two_readings_of_0_7_make_0_845():
    strength = np.log(0.7 / 0.3)
    assert probabilities(np.array([one(strength, strength, "bayes")]))[0] == pytest.approx(0.8448, abs=1e-4)


@given(odds, st.sampled_from(POOLS))
def test_conflict_ends_at_even_odds(first, pool):
    assert one(first, -first, pool) == pytest.approx(0.0, abs=1e-5)


@given(odds, odds, st.sampled_from(["lop", "liop"]))
def test_the_whole_weight_on_one_sensor_is_its_opinion(first, second, pool):
    assert one(first, second, pool, (3.0, 0.0)) == pytest.approx(first, abs=1e-4)


def test_a_pool_must_exist():
    with pytest.raises(GridError, match="there is no pool 'mean'") as error:
        one(0.0, 0.0, "mean")
    assert error.value.hint == "known: bayes, iop, lop, liop"


@pytest.mark.parametrize("weights", [(0.0, 0.0), (-1.0, 2.0), (np.nan, 1.0)])
def test_weights_must_weigh(weights):
    with pytest.raises(GridError, match=r"weights .* for 2 maps"):
        one(0.0, 0.0, "lop", weights)


def test_volumes_are_fused_voxel_by_voxel_even_where_one_has_merged_them():
    merged = drawn_tree(["##\n##", "##\n##"])
    assert len(merged.leaves()) == 1
    other = Octree(0.5)
    other.add(np.array([voxel(0, 0, 0), voxel(5, 0, 0)]), np.array([-1.0, 1.0], dtype=np.float32))
    fused = fuse_volumes(merged, other)
    high = np.float32(merged.clamp.high)
    assert fused.log_odds_of(np.array([voxel(0, 0, 0), voxel(1, 1, 1), voxel(5, 0, 0)])).tolist() == [
        high - np.float32(1.0), high, 1.0,
    ]  # fmt: skip
    assert len(fused.leaves().voxels()) == 9


def test_volumes_of_different_voxels_are_not_fused():
    with pytest.raises(GridError, match=r"voxels of 0.1 m cannot be fused with those of 0.2 m"):
        fuse_volumes(Octree(0.1), Octree(0.2))
