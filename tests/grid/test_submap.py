"""Two active submaps, each finished after twice as many scans as separate their starts."""

import numpy as np
import pytest
from grid_worlds import observed

from glassslam.grid import ActiveSubmaps, OddsModel, ProbabilityGrid

NOTHING = np.empty((0, 2))


def drive(submaps, count):
    """Nodes along x, one wall point each: what every insertion returned."""
    out = []
    for node in range(count):
        pose = np.array([0.1 * node, 0.0, 0.01 * node])
        out.append(submaps.insert(node, pose, pose[:2], pose[None, :2] + [[0.0, 1.0]], NOTHING))
    return out


def test_nothing_to_match_against_before_the_first_scan():
    assert ActiveSubmaps(0.05, OddsModel(), 3).matching is None


def test_neighbours_overlap_by_half():
    submaps = ActiveSubmaps(0.05, OddsModel(), 3)
    returned = drive(submaps, 13)
    rest = submaps.finish()
    done = [finished for _, finished in returned if finished] + rest
    assert [submap.nodes for submap in done] == [
        [0, 1, 2, 3, 4, 5],
        [3, 4, 5, 6, 7, 8],
        [6, 7, 8, 9, 10, 11],
        [9, 10, 11, 12],
        [12],
    ]
    assert [submap.index for submap in done] == [0, 1, 2, 3, 4]
    assert all(submap.finished for submap in done)
    assert submaps.active == []
    assert submaps.matching is None


def test_a_scan_goes_into_both_active_submaps_the_older_first():
    returned = drive(ActiveSubmaps(0.05, OddsModel(), 3), 9)
    assert [[submap.index for submap in entered] for entered, _ in returned] == [
        [0], [0], [0], [0, 1], [0, 1], [0, 1], [1, 2], [1, 2], [1, 2],
    ]  # fmt: skip
    assert [finished.index if finished else None for _, finished in returned] == [
        None, None, None, None, None, 0, None, None, 1,
    ]  # fmt: skip


def test_the_older_submap_is_matched_against_so_that_it_is_never_empty():
    submaps = ActiveSubmaps(0.05, OddsModel(), 3)
    for node in range(12):
        pose = np.zeros(3)
        submaps.insert(node, pose, pose[:2], np.ones((1, 2)), NOTHING)
        assert submaps.matching is submaps.active[0]
        assert len(submaps.matching.nodes) >= min(node + 1, 3)
        assert not submaps.matching.finished


def test_the_frame_of_a_submap_is_the_pose_of_its_first_node():
    submaps = ActiveSubmaps(0.05, OddsModel(), 3)
    drive(submaps, 4)
    assert [submap.local_pose.tolist() for submap in submaps.active] == [
        [0.0, 0.0, 0.0],
        pytest.approx([0.3, 0.0, 0.03]),
    ]


def test_the_frame_does_not_follow_the_array_of_the_caller():
    submaps, pose = ActiveSubmaps(0.05, OddsModel(), 3), np.zeros(3)
    submaps.insert(0, pose, pose[:2], np.ones((1, 2)), NOTHING)
    pose += 1.0
    assert submaps.active[0].local_pose.tolist() == [0.0, 0.0, 0.0]


def test_a_submap_holds_its_scans_in_the_local_frame_cropped_when_finished():
    submaps = ActiveSubmaps(0.05, OddsModel(), 2)
    finished = next(done for _, done in drive(submaps, 4) if done)
    alone = ProbabilityGrid(0.05)
    for node in range(4):
        sensor = np.array([0.1 * node, 0.0])
        alone.insert(sensor, sensor[None] + [[0.0, 1.0]], NOTHING)
    assert observed(finished.grid) == observed(alone)
    assert finished.grid.cells.size < alone.cells.size
