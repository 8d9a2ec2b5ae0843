"""Correlative searches against brute force with the same scoring."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from matching_worlds import NOTHING, apart, mapped, naive_residuals, random_grid, scan_from

from glassslam.geometry import transform_points
from glassslam.grid import ProbabilityGrid
from glassslam.matching import BranchAndBoundMatcher, match_scan
from glassslam.matching.branch_and_bound import occupancy_scores
from glassslam.matching.correlative import search_around
from glassslam.matching.exhaustive_kernels import exhaustive_search
from glassslam.matching.profile_kernels import flat_reach
from glassslam.matching.pyramid_kernels import max_over_windows, quantise
from glassslam.matching.search_kernels import branch_and_bound, discretise

TRUE = np.array([0.3, -0.4, 0.7])
seeds = st.integers(0, 10_000)


def naive_windows(grid, edge):
    """Maximum over windows of `edge` cells that start at a cell, cut at the border."""
    out = np.zeros_like(grid)
    for y, x in np.ndindex(grid.shape):
        out[y, x] = grid[y : y + edge, x : x + edge].max()
    return out


@given(seeds, st.integers(1, 12), st.integers(1, 12), st.integers(0, 3))
def test_doubling_gives_the_maxima_over_windows(seed, rows, columns, doublings):
    level = np.random.default_rng(seed).integers(0, 256, (rows, columns)).astype(np.uint8)
    base = level.copy()
    for k in range(doublings):
        wider = np.zeros_like(level)
        max_over_windows(level, 1 << k, wider)
        level = wider
    np.testing.assert_array_equal(level, naive_windows(base, 1 << doublings))


@given(seeds, st.integers(1, 9), st.integers(1, 9), st.integers(1, 3), st.integers(0, 3))
def test_quantise_keeps_the_best_cell_of_every_block(seed, rows, columns, factor, pad):
    rng = np.random.default_rng(seed)
    cells, scores = rng.integers(0, 5, (rows, columns)).astype(np.uint16), rng.random(5).astype(np.float32)
    scores[0] = 1.0
    shape = (-(-rows // factor) + 2 * pad, -(-columns // factor) + 2 * pad)
    out = np.zeros(shape, np.uint8)
    quantise(cells, scores, factor, pad, out)
    expected = np.zeros(shape, np.uint8)
    for y, x in np.ndindex(cells.shape):
        at = (y // factor + pad, x // factor + pad)
        byte = int(scores[cells[y, x]] * np.float64(255.0) + 0.5) if cells[y, x] else 0
        expected[at] = max(int(expected[at]), byte)
    np.testing.assert_array_equal(out, expected)


def test_unknown_and_free_cells_score_nothing_and_walls_everything():
    table = np.array([0.9, 0.2, 0.35, 0.5, 0.65, 0.98], dtype=np.float32)
    np.testing.assert_allclose(occupancy_scores(table), [0, 0, 0, 0.5, 1, 1], atol=1e-6)


@given(seeds, st.floats(-3, 3), st.integers(1, 5), st.integers(0, 4))
def test_discretise_turns_the_scan_and_drops_what_cannot_reach_the_grid(seed, first, count, reach):
    rng = np.random.default_rng(seed)
    points, rows, columns, pad = rng.uniform(-4, 4, (9, 2)), 8, 11, reach + 2
    index, lengths = np.zeros((count, 9), np.int32), np.zeros(count, np.int64)
    discretise(points, 2.2, 1.7, first, 0.3, count, 2.0, rows, columns, pad, reach, index, lengths)
    for a in range(count):
        cells = np.floor(transform_points((2.2, 1.7, first + 0.3 * a), points) * 2.0).astype(int)
        near = (cells >= -reach).all(axis=1) & (cells < np.array([columns, rows]) + reach).all(axis=1)
        expected = [(r + pad) * (columns + 2 * pad) + c + pad for c, r in cells[near]]
        assert index[a, : lengths[a]].tolist() == expected


class Pyramid:
    """Levels as the matcher makes them, from a small grid of bytes."""

    def __init__(self, rng, window, angles=4, points=6):
        rows, columns = 7, 9
        self.window, self.start = window, max(window, 1).bit_length() - 1
        pad = 2 * window + (2 << self.start)
        base = np.zeros((rows + 2 * pad, columns + 2 * pad), np.uint8)
        values = rng.integers(0, 256, (rows, columns)) * (rng.random((rows, columns)) < 0.4)
        base[pad : pad + rows, pad : pad + columns] = values
        levels = [naive_windows(base, 1 << h) for h in range(self.start + 1)]
        self.levels, self.stride = np.stack([level.ravel() for level in levels]), base.shape[1]
        self.lengths = rng.integers(0, points + 1, angles)
        cells = rng.integers(pad - window, pad + 7 + window, (angles, points, 2))
        self.index = (cells[..., 1] * self.stride + cells[..., 0]).astype(np.int32)

    def score(self, a, dx, dy):
        hit = self.index[a, : self.lengths[a]] + dy * self.stride + dx
        return int(self.levels[0][hit].astype(int).sum())

    def brute_force(self):
        offsets = range(-self.window, self.window + 1)
        return max(self.score(*c) for c in itertools.product(range(len(self.index)), offsets, offsets))

    def search(self, threshold):
        found = np.full(3, 99, np.int64)
        best = branch_and_bound(
            self.levels, self.stride, self.index, self.lengths, self.window, self.start, threshold, found
        )
        return best, found


@given(seeds, st.integers(0, 9))
def test_branch_and_bound_finds_the_best_of_the_whole_window(seed, window):
    pyramid = Pyramid(np.random.default_rng(seed), window)
    best, (a, dx, dy) = pyramid.search(-1)
    assert best == pyramid.brute_force()
    assert max(abs(dx), abs(dy)) <= window
    assert pyramid.score(a, dx, dy) == best


@given(seeds, st.integers(0, 6), st.integers(-2, 2))
def test_nothing_is_found_at_or_below_the_threshold(seed, window, beyond):
    pyramid = Pyramid(np.random.default_rng(seed), window)
    threshold = max(pyramid.brute_force() + beyond, 0)
    best, found = pyramid.search(threshold)
    assert best == max(threshold, pyramid.brute_force())
    assert (found == 99).all() == (pyramid.brute_force() <= threshold)


def blocks(grid, factor):
    """Scores of blocks of cells as bytes, in a dictionary."""
    scores = occupancy_scores(grid.table)
    out = {}
    for r, c in np.argwhere(grid.cells):
        at = (int(c) // factor, int(r) // factor)
        out[at] = max(out.get(at, 0), int(scores[grid.cells[r, c]] * np.float64(255.0) + 0.5))
    return out


def brute_force_match(grid, points, guess, linear, angular, factor=2):
    """Best score of all poses on the raster of the search."""
    cell, bytes_ = grid.resolution * factor, blocks(grid, factor)
    step = cell / max(np.hypot(*points.T).max(), 4 * cell)
    turns, reach = math.ceil(angular / step), math.ceil(linear / cell)
    best = 0
    for a in range(-turns, turns + 1):
        moved = transform_points((guess[0], guess[1], guess[2] + a * step), points) - grid.origin
        hit = np.floor(moved / cell).astype(int)
        for dx, dy in itertools.product(range(-reach, reach + 1), repeat=2):
            best = max(best, sum(bytes_.get((c + dx, r + dy), 0) for c, r in hit.tolist()))
    return best / 255 / len(points)


@pytest.mark.parametrize("shift", [[0.4, -0.3, 0.1], [-0.5, 0.5, -0.12], [0.0, 0.0, 0.0]])
@pytest.mark.parametrize("window", [0.0, 0.1, 0.55])
def test_the_matcher_finds_what_brute_force_finds(shift, window):
    grid, points, guess = mapped(), scan_from(TRUE, 12), TRUE + np.array(shift)
    match = BranchAndBoundMatcher(grid, 1.0).match(points, guess, window, 0.15, 0.0)
    assert match.score == pytest.approx(brute_force_match(grid, points, guess, window, 0.15), abs=1e-12)


@pytest.mark.parametrize("shift", [[1.4, -0.9, 0.25], [-1.5, 1.3, -0.3], [0.02, 0.0, 0.0]])
def test_a_far_guess_leads_to_the_place_of_the_scan(shift):
    match = BranchAndBoundMatcher(mapped(), 2.0).match(scan_from(TRUE, 90), TRUE + shift, 2.0, 0.4, 0.6)
    distance, turn = apart(match.pose, TRUE)
    assert distance < 0.15
    assert turn < 0.05
    assert match.score > 0.8
    refined = match_scan(mapped(), scan_from(TRUE, 90), match.pose)
    assert apart(refined.pose, TRUE)[0] < 0.01


@given(seeds, st.sampled_from([1, 2, 3]), st.floats(0.0, 0.9))
def test_the_reported_pose_has_the_reported_score(seed, factor, window):
    rng = np.random.default_rng(seed)
    grid, points = random_grid(rng), rng.uniform(-1.5, 1.5, (7, 2))
    guess = np.array([*rng.uniform(-1, 3, 2), rng.uniform(-3, 3)])
    matcher = BranchAndBoundMatcher(grid, 0.75, factor)
    match = matcher.match(points, guess, window, 0.3, 0.0)
    away = np.abs(match.pose - guess)
    cell = grid.resolution * factor
    assert (away[:2] <= min(math.ceil(window / cell), math.ceil(0.75 / cell)) * cell + 1e-9).all()
    # on the borders of cells rounding decides: the shift is a whole number of cells
    shift = np.rint((match.pose - guess)[:2] / cell).astype(int)
    hit = np.floor((transform_points((*guess[:2], match.pose[2]), points) - grid.origin) / cell).astype(int)
    scores = [blocks(grid, factor).get((c + shift[0], r + shift[1]), 0) for c, r in hit.tolist()]
    assert match.score == pytest.approx(sum(scores) / 255 / len(points), abs=1e-12)


def test_a_score_that_is_just_reached_counts():
    grid, points = mapped(), scan_from(TRUE, 60)
    matcher = BranchAndBoundMatcher(grid, 1.0)
    best = matcher.match(points, TRUE, 0.3, 0.1, 0.0).score
    assert matcher.match(points, TRUE, 0.3, 0.1, best).score == best
    assert matcher.match(points, TRUE, 0.3, 0.1, best + 1e-3) is None


def test_a_perfect_score_can_be_asked_for():
    grid = ProbabilityGrid(0.25)
    grid.cells, grid.origin = np.full((8, 8), grid.odds.top, np.uint16), np.zeros(2)
    match = BranchAndBoundMatcher(grid, 1.0).match(
        np.array([[0.3, 0.4]]), np.array([1.0, 1.0, 0.0]), 0.5, 0.1, 1.0
    )
    assert match.score == 1.0


def test_nothing_is_found_where_nothing_is():
    matcher = BranchAndBoundMatcher(mapped(), 1.0)
    assert matcher.match(scan_from(TRUE, 60), np.array([80.0, 0.0, 0.0]), 1.0, 0.3, 0.1) is None
    assert matcher.match(NOTHING, TRUE, 1.0, 0.3, 0.0) is None
    assert BranchAndBoundMatcher(ProbabilityGrid()).match(scan_from(TRUE), TRUE, 1.0, 0.3, 0.1) is None


def test_a_window_wider_than_the_matcher_is_cut():
    matcher = BranchAndBoundMatcher(mapped(), 0.5)
    assert matcher.max_linear_window == pytest.approx(0.5)
    far = matcher.match(scan_from(TRUE, 60), TRUE + np.array([1.5, 0.0, 0.0]), 5.0, 0.1, 0.0)
    assert (np.abs(far.pose[:2] - TRUE[:2] - [1.5, 0.0]) <= 0.5 + 1e-9).all()


def test_later_changes_of_the_grid_are_not_seen():
    grid = ProbabilityGrid(0.05)
    grid.insert(np.zeros(2), scan_from(np.zeros(3)), NOTHING)
    matcher, points = BranchAndBoundMatcher(grid, 1.0), scan_from(np.zeros(3), 60)
    before = matcher.match(points, np.zeros(3), 0.2, 0.1, 0.0)
    size = matcher.nbytes
    for _ in range(30):
        grid.insert(np.array([9.0, 9.0]), points * 0.3, NOTHING)
    assert matcher.match(points, np.zeros(3), 0.2, 0.1, 0.0).score == before.score
    assert matcher.nbytes == size > 0


def naive_exhaustive(grid, points, guess, steps, turns, turn, costs):
    """{(dx, dy, a): penalised score} of the whole raster."""
    out = {}
    for a in range(-turns, turns + 1):
        moved = transform_points((guess[0], guess[1], guess[2] + a * turn), points) - grid.origin
        hit = np.floor(moved / grid.resolution).astype(int)
        for dx, dy in itertools.product(range(-steps, steps + 1), repeat=2):
            total = 0.0
            for c, r in np.add(hit, (dx, dy)):
                if 0 <= r < grid.cells.shape[0] and 0 <= c < grid.cells.shape[1] and grid.cells[r, c]:
                    total += float(grid.table[grid.cells[r, c]])
            cost = costs[0] * math.hypot(dx, dy) * grid.resolution + costs[1] * abs(a * turn)
            out[dx, dy, a] = total / len(points) * math.exp(-cost * cost)
    return out


@given(seeds, st.integers(0, 3), st.integers(0, 2), st.sampled_from([(0.0, 0.0), (0.1, 0.1), (2.0, 3.0)]))
def test_the_exhaustive_search_finds_the_best_of_the_raster(seed, steps, turns, costs):
    rng = np.random.default_rng(seed)
    grid, points = random_grid(rng), rng.uniform(-2, 2, (8, 2))  # some fall outside of the grid
    guess, pose = np.array([*rng.uniform(-1, 3, 2), 0.4]), np.empty(3)
    best = exhaustive_search(
        grid.cells,
        grid.table,
        grid.origin,
        1 / grid.resolution,
        points,
        guess,
        steps,
        turns,
        0.1,
        *costs,
        pose,
    )
    scores = naive_exhaustive(grid, points, guess, steps, turns, 0.1, costs)
    assert best == pytest.approx(max(scores.values()), rel=1e-5)
    dx, dy = np.rint((pose - guess)[:2] / grid.resolution).astype(int)
    assert scores[int(dx), int(dy), round((pose[2] - guess[2]) / 0.1)] == pytest.approx(best, rel=1e-5)


def test_the_real_time_search_finds_the_scan_nearby():
    guess = TRUE + np.array([0.12, -0.15, 0.2])
    found = search_around(mapped(), scan_from(TRUE), guess, 0.2, 0.3)
    distance, turn = apart(found, TRUE)
    assert distance < 0.08
    assert turn < 0.02
    assert guess.tolist() == (TRUE + np.array([0.12, -0.15, 0.2])).tolist()


@pytest.mark.parametrize("points", [NOTHING, np.array([[40.0, 0.0]])])
def test_without_points_nearby_the_guess_stays(points):
    assert search_around(mapped(), points, TRUE, 0.2, 0.3).tolist() == TRUE.tolist()


def slides(grid, points, direction, limit=0.3, reach=3.0):
    """How far the scan may slide from the middle of the grid."""
    place = (grid.cells, grid.table, grid.origin, 1 / grid.resolution)
    return flat_reach(*place, points, np.zeros(3), np.array(direction), limit, reach, 0.1)


def test_a_scan_slides_along_a_corridor_but_not_across():
    points = scan_from(np.zeros(3), walls=[((-3, -1), (3, -1)), ((-3, 1), (3, 1))])
    grid = mapped(corridor=True)
    assert slides(grid, points, (1.0, 0.0), reach=2.0) == pytest.approx(2.0)
    assert slides(grid, points, (0.0, 1.0)) == 0.0


def test_a_scan_does_not_slide_in_a_room():
    assert slides(mapped(), scan_from(np.zeros(3)), (1.0, 0.0)) <= 0.1


@pytest.mark.parametrize("limit", [0.1, 0.3, 0.4, 0.5])
def test_the_reach_is_the_farthest_shift_that_fits(limit):
    grid, points = mapped(corridor=True), scan_from(np.zeros(3), 24)
    fits = [
        0.1 * k
        for k in range(1, 16)
        for sign in (-1, 1)
        if np.sqrt((naive_residuals(grid, points, [0.0, sign * 0.1 * k, 0.0]) ** 2).mean()) < limit
    ]
    assert slides(grid, points, (0.0, 1.0), limit, 1.5) == pytest.approx(max(fits, default=0.0))
