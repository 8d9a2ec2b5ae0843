"""Kernels against naive twins."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scan_worlds import STEP, bearings, pane, wall

from detectors.beams import closes, directions
from detectors.labels import SOLID, base_labels
from detectors.lobe_kernels import count_shoulders, fit_lobe, least_fall
from detectors.pane_kernels import lobe_odds, polish_odds
from detectors.pane_lines import find_feet, fit_line
from detectors.surface_kernels import local_incidence

COARSE = math.radians(1.0)
ANGLE_MIN = float(bearings()[0])


def naive_feet(ranges, labels, half=1, window=5):
    """Beams whose mean over a run of neighbours is smallest, the first of equals, within the run."""
    runs, feet = [], []
    for beam in np.flatnonzero(labels == SOLID):
        joins = runs and runs[-1][-1] == beam - 1
        if joins and abs(ranges[beam] - ranges[beam - 1]) < 0.08 + 0.01 * ranges[beam]:
            runs[-1].append(beam)
        else:
            runs.append([beam])
    for run in runs:
        values = ranges[run]
        smooth = [values[max(0, k - half) : k + half + 1].mean() for k in range(len(run))]
        for k, beam in enumerate(run):
            before, after = smooth[max(0, k - window) : k], smooth[k + 1 : k + window + 1]
            if all(s > smooth[k] for s in before) and all(s >= smooth[k] for s in after):
                feet.append(int(beam))
    return feet


# multiples of 1/64 m, whose sums are exact in any order
@given(arrays(np.float64, 40, elements=st.sampled_from([np.inf, *(1.0 + np.arange(8) / 64.0)])))
def test_feet(ranges):
    labels = base_labels(ranges)
    feet = np.empty(40, dtype=np.int64)
    count = find_feet(ranges, labels, COARSE, np.empty(40), feet)
    assert feet[:count].tolist() == naive_feet(ranges, labels)


def test_the_foot_of_a_wall_is_where_its_normal_is():
    ranges, _ = wall(1.3, normal=0.4)
    feet = np.empty(ranges.size, dtype=np.int64)
    count = find_feet(ranges, base_labels(ranges), STEP, np.empty(ranges.size), feet)
    assert np.degrees(bearings()[feet[:count]]) == pytest.approx([math.degrees(0.4)], abs=0.25)


@pytest.mark.parametrize("start_deg", [-6, 0, 5])
def test_the_line_through_a_pane_is_that_of_least_squares(start_deg):
    ranges, intensities = pane(1.2)
    labels, levels = base_labels(ranges), intensities / 4000.0
    cosines, sines = directions(ranges.size, ANGLE_MIN, STEP)
    start = math.radians(start_deg)
    normal, distance, spread, used = fit_line(
        ranges, labels, cosines, sines, levels, 0, ranges.size, start, 1.2
    )
    on = labels == SOLID
    x, y = ranges[on] * cosines[on], ranges[on] * sines[on]
    weights = 1.0 / np.sqrt(1.0 + (levels[on] / 0.5) ** 2)
    slope, intercept = np.polyfit(y, x, 1, w=weights)
    assert used == on.sum()
    assert normal == pytest.approx(-math.atan(slope), abs=1e-3)
    assert distance == pytest.approx(intercept * math.cos(math.atan(slope)), abs=1e-3)
    assert spread == pytest.approx(0.01, abs=0.002)


def test_a_line_needs_three_returns():
    ranges = np.full(21, np.inf)
    ranges[10] = 1.0
    cosines, sines = directions(21, -0.1, 0.01)
    assert fit_line(ranges, base_labels(ranges), cosines, sines, np.ones(21), 0, 21, 0.0, 1.0)[3] == 1


def lobe(world):
    ranges, intensities = world
    labels, levels = base_labels(ranges), intensities / 4000.0
    cosines, sines = directions(ranges.size, ANGLE_MIN, STEP)
    angles, logs = np.empty(ranges.size), np.empty(ranges.size)
    fitted = fit_lobe(
        ranges, labels, cosines, sines, levels, ANGLE_MIN, STEP, 0, ranges.size, 0.0, 1.2, angles, logs
    )
    return fitted, angles[: fitted[3]], logs[: fitted[3]]


def test_the_lobe_of_a_pane_is_read_off():
    (amplitude, decay, spread, used), angles, logs = lobe(pane(1.2))
    assert amplitude == pytest.approx(0.8, rel=0.1)
    assert decay == pytest.approx(7.5, rel=0.05)
    assert spread < 0.15
    assert used == angles.size == np.count_nonzero(np.abs(angles) >= math.radians(1.5))
    np.testing.assert_allclose(np.exp(logs[:3]), 0.8 * np.exp(-7.5 * np.abs(angles[:3])), rtol=0.4)


def test_a_wall_has_no_lobe():
    (amplitude, decay, spread, _), _, _ = lobe(wall(1.2))
    assert (amplitude, decay, spread) == pytest.approx((1.0, 0.0, 0.0), abs=1e-9)


def test_too_few_beams_have_none_either():
    ranges, intensities = wall(1.2)
    ranges[np.abs(bearings()) > math.radians(1.75)] = np.inf
    assert lobe((ranges, intensities))[0][:2] == (0.0, 0.0)


def fall(world, faint=0.45):
    _, angles, logs = lobe(world)
    return least_fall(angles, logs, angles.size, faint, np.empty(angles.size))


def test_haze_falls_over_the_shoulders():
    assert fall(pane(1.2)) == pytest.approx(7.5 * math.radians(24.5 - 15.0), abs=0.2)


def test_a_dark_wall_does_not():
    assert fall(wall(1.2, level=0.1)) == pytest.approx(0.0, abs=1e-9)


def test_bright_shoulders_are_not_looked_at():
    assert fall(wall(1.2)) == math.inf


def shoulders(world):
    ranges, intensities = world
    cosines, sines = directions(ranges.size, ANGLE_MIN, STEP)
    counts = np.empty((2, 4))
    peak = count_shoulders(
        ranges, base_labels(ranges), cosines, sines, intensities / 4000.0, ANGLE_MIN, STEP,
        0, ranges.size, 0.0, 1.2, 0.45, counts,
    )  # fmt: skip
    return peak, counts


def naive_shoulders(world):
    (ranges, intensities), degrees = world, np.degrees(bearings())
    behind = np.where(np.isfinite(ranges), ranges, 1e9) * np.cos(bearings()) - 1.2
    rows = []
    for side in (-1, 1):
        zone = (side * degrees >= 6 - 1e-9) & (side * degrees <= 25 + 1e-9)
        on = zone & (np.abs(behind) < 0.056)
        rows.append(
            [zone.sum(), on.sum(), (on & (intensities < 1800)).sum(), (zone & (behind > 0.112)).sum()]
        )
    return rows


@pytest.mark.parametrize("world", [pane(1.2), wall(1.2), wall(1.5), wall(1.0), pane(1.2, reach_deg=12.0)])
def test_shoulders_are_counted(world):
    np.testing.assert_allclose(shoulders(world)[1], naive_shoulders(world), atol=1)


def test_the_peak_is_that_of_the_core():
    assert shoulders(pane(1.2))[0] == pytest.approx(4.8, rel=0.2)
    assert shoulders(wall(1.2, level=0.3))[0] == pytest.approx(0.3)


def odds(left, right, distance=1.2, brightest=0.8, decay=7.5, deviation=0.2, spread=0.01):
    counts = np.array([left, right], dtype=float)
    return lobe_odds(counts, distance, brightest, decay, deviation, spread, 2.5)


FAINT_SIDE = [76, 76, 76, 0]
OPEN_SIDE = [76, 0, 0, 76]
HIDDEN_SIDE = [76, 0, 0, 0]
BRIGHT_SIDE = [76, 76, 0, 0]


def test_two_faint_shoulders_say_more_than_one():
    two, one, hidden = (odds(FAINT_SIDE, other) for other in (FAINT_SIDE, OPEN_SIDE, HIDDEN_SIDE))
    assert two > 3.0 > one > hidden > 1.0


def test_a_bright_shoulder_speaks_against_a_pane():
    assert odds(FAINT_SIDE, BRIGHT_SIDE) < -1.0


def test_without_a_shoulder_there_is_no_pane():
    assert odds(OPEN_SIDE, OPEN_SIDE) < -8.0


@pytest.mark.parametrize(
    "worse", [{"distance": 6.0}, {"brightest": 4.0}, {"decay": 1.0}, {"deviation": 0.8}, {"spread": 0.06}]
)
def test_what_makes_a_pane_less_likely(worse):
    assert odds(FAINT_SIDE, FAINT_SIDE, **worse) < odds(FAINT_SIDE, FAINT_SIDE) - 1.0


def test_a_steady_floor_or_a_dim_lobe_speaks_for_polish():
    assert polish_odds(0.8, math.inf) == polish_odds(0.8, 0.5) == 0.0
    assert polish_odds(0.8, 0.0) == pytest.approx(5.0)
    assert polish_odds(0.8, -9.0) == 6.0
    assert polish_odds(0.2, 0.5) == pytest.approx(2.0 * math.log(2.0))


@pytest.mark.parametrize("normal", [-0.5, 0.0, 0.3])
def test_incidence_on_a_wall_is_the_angle_to_its_normal(normal):
    ranges, _ = wall(1.2, normal=normal)
    cosines, sines = directions(ranges.size, ANGLE_MIN, STEP)
    incidence, spread = np.empty_like(ranges), np.empty_like(ranges)
    local_incidence(ranges, base_labels(ranges), cosines, sines, 0.2, incidence, spread)
    known = np.isfinite(incidence)
    assert known.mean() > 0.5
    np.testing.assert_allclose(incidence[known], np.abs(bearings()[known] - normal), atol=1e-5)
    assert (spread[known] < 1e-6).all()


def test_where_a_surface_ends_no_incidence_is_known():
    ranges = np.where(np.abs(bearings()) < 0.05, 1.0, np.inf)
    cosines, sines = directions(ranges.size, ANGLE_MIN, STEP)
    incidence, spread = np.empty_like(ranges), np.empty_like(ranges)
    local_incidence(ranges, base_labels(ranges), cosines, sines, 0.2, incidence, spread)
    assert np.isnan(incidence).all()
    assert np.isnan(spread).all()


def test_a_full_turn_closes():
    assert closes(360, COARSE)
    assert closes(361, -COARSE)
    assert not closes(270, COARSE)
