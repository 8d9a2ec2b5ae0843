"""Locked cells: occupied for good, in grids and in the submaps that begin with them."""

import numpy as np
import pytest
from grid_worlds import drawing, drawn
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import GridError
from glassslam.grid import ActiveSubmaps, OddsModel, ProbabilityGrid
from glassslam.grid.kernels import updated

NOTHING = np.empty((0, 2))
MODEL = OddsModel()


def shown(grid):
    """The inner cells as text, locked ones as L."""
    text = drawing(grid.cells[3:-3, 3:-3], grid.odds.prior).split("\n")
    rows = grid.cells[3:-3, 3:-3][::-1]
    return "\n".join(
        "".join("L" if v == grid.odds.locked else c for c, v in zip(line, row, strict=True))
        for line, row in zip(text, rows, strict=True)
    )


def locked(grid):
    """Centres of the locked cells, row after row."""
    rows, columns = np.nonzero(grid.cells == grid.odds.locked)
    return (grid.origin + grid.resolution * (np.stack((columns, rows), axis=1) + 0.5)).tolist()


@given(st.lists(st.sampled_from([MODEL.hit_step, MODEL.miss_step]), max_size=30))
def test_no_observation_changes_a_locked_value(steps):
    value = np.uint16(MODEL.locked)
    for step in steps:
        value = updated(value, step, MODEL.prior, MODEL.top)
    assert value == MODEL.locked


def test_rays_pass_a_locked_cell_and_clear_those_around_it():
    grid = ProbabilityGrid(0.5)
    grid.lock(np.array([[1.25, 0.25]]))
    for _ in range(50):
        grid.insert(np.array([0.25, 0.25]), np.array([[2.25, 0.25]]), NOTHING)
    grid.finish()
    assert shown(grid) == drawn("..L.#")


def test_a_cell_already_cleared_can_be_locked():
    grid = ProbabilityGrid(0.5)
    grid.insert(np.array([0.25, 0.25]), np.array([[1.25, 0.25]]), NOTHING)
    grid.lock(np.array([[0.75, 0.25]]))
    grid.finish()
    assert shown(grid) == drawn(".L#")
    assert grid.probability_at(np.array([[0.75, 0.25]]))[0] == pytest.approx(0.98, abs=1e-4)


def test_the_grid_grows_for_locked_cells():
    grid = ProbabilityGrid(0.5)
    grid.insert(np.zeros(2), np.array([[1.0, 0.0]]), NOTHING)
    grid.lock(np.array([[-40.1, 30.2], [-40.2, 30.1]]))
    grid.finish()
    assert locked(grid) == [[-40.25, 30.25]]


def test_nothing_to_lock_changes_nothing():
    grid = ProbabilityGrid(0.5)
    grid.lock(NOTHING)
    assert grid.cells.size == 0


def test_a_place_that_is_not_finite_cannot_be_locked():
    with pytest.raises(GridError, match="not finite"):
        ProbabilityGrid(0.5).lock(np.array([[np.nan, 0.0]]))


def test_glass_is_locked_in_every_active_submap_and_known_glass_in_a_new_one_only():
    submaps = ActiveSubmaps(0.5, MODEL, 2)
    known, seen = np.array([[5.25, 0.25]]), np.array([[3.25, 0.25]])
    done = []
    for node in range(4):
        glass = seen if node == 2 else NOTHING
        _, finished = submaps.insert(
            node, np.zeros(3), np.zeros(2), np.ones((1, 2)), NOTHING, glass=glass,
            known_glass=known if node == 2 else NOTHING,
        )  # fmt: skip
        done += [finished] if finished else []
    done += submaps.finish()
    assert [sorted(locked(submap.grid)) for submap in done] == [
        seen.tolist(),
        [*seen.tolist(), *known.tolist()],
    ]


def test_a_submap_starts_when_the_newest_is_half_full():
    submaps = ActiveSubmaps(0.5, MODEL, 2)
    starts = []
    for node in range(5):
        starts.append(submaps.starts_next)
        submaps.insert(node, np.zeros(3), np.zeros(2), np.ones((1, 2)), NOTHING)
    assert starts == [True, False, True, False, True]
