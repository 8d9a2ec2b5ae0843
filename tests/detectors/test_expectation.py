"""What a detector does on scans whose panes are known, and which scans tell something new."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scan_worlds import FLAT, SENSOR, STEP, bearings, pane, wall

from detectors.detection import COLUMNS, from_table
from detectors.expectation import CalibrationScan, expected
from detectors.panes import pane_profile
from detectors.places import places
from detectors.proposals import normalised_rates, propose
from detectors.rates import wilson

ANGLE_MIN = float(bearings()[0])


def seen(distance=1.2, *, along=(-math.inf, math.inf), **values):
    """A scan with its pane known."""
    ranges, echoes = pane(distance)
    known = pane_profile(
        ranges, echoes, ANGLE_MIN, STEP, curve=FLAT, normal=0.0, distance=distance, along=along
    )
    return CalibrationScan(ranges, echoes, ANGLE_MIN, STEP, (known,), **values)


def clear(**values):
    """A scan of a wall."""
    return CalibrationScan(*wall(), ANGLE_MIN, STEP, **values)


def reports(*spots):
    """A detector that reports pieces of 0.2 m at (bearing in deg, distance off the plane x = 1.2)."""

    def detect(scan):
        table = np.zeros((len(spots), len(COLUMNS)))
        beams = np.zeros(len(spots), dtype=np.int64)
        for k, (bearing_deg, off) in enumerate(spots):
            bearing = math.radians(bearing_deg)
            beams[k] = round((bearing - ANGLE_MIN) / STEP)
            table[k, 0], table[k, 1], table[k, 8] = (1.2 + off) / math.cos(bearing), bearing, 0.1
        return from_table(beams, table, np.ones(len(scan.ranges), dtype=np.uint8))

    return detect


def counts(scans, *spots):
    rates = expected(scans, reports(*spots))
    return (
        (rates.detection.successes, rates.detection.trials),
        (rates.false_alarm.successes, rates.false_alarm.trials),
    )


def test_a_report_at_the_foot_of_the_pane_is_a_detection():
    assert counts([seen()], (0.0, 0.0)) == ((1, 1), (0, 1))


def test_a_report_beside_the_foot_is_neither_detection_nor_false_alarm():
    assert counts([seen()], (20.0, 0.0)) == ((0, 1), (0, 1))


def test_a_report_off_the_plane_is_a_false_alarm():
    assert counts([seen()], (0.0, 0.3)) == ((0, 1), (1, 1))


def test_on_the_plane_but_beyond_the_end_of_the_pane_it_is_one_too():
    spot = (30.0, 0.0)  # 0.69 m from the foot
    assert counts([seen(along=(-0.6, 0.6))], spot) == ((0, 1), (0, 1))
    assert counts([seen(along=(-0.3, 0.3))], spot) == ((0, 1), (1, 1))


def test_without_a_pane_every_report_is_false():
    assert counts([clear()], (0.0, 0.0)) == ((0, 0), (1, 1))


def test_beams_that_are_not_judged_count_for_nothing():
    left = bearings() > 0.0
    assert counts([clear(judged=left)], (-20.0, 0.0)) == ((0, 0), (0, 1))
    assert counts([clear(judged=left)], (20.0, 0.0)) == ((0, 0), (1, 1))
    assert counts([clear(judged=np.zeros_like(left))], (20.0, 0.0)) == ((0, 0), (0, 0))


def test_scans_of_one_place_are_one_trial_for_the_interval():
    still = expected([seen(place="here") for _ in range(20)], reports((0.0, 0.0)))
    assert (still.detection.trials, still.detection.independent) == (20, 1)
    assert still.detection.low == wilson(1, 1).low
    moving = expected([seen(place=k) for k in range(20)], reports((0.0, 0.0)))
    assert moving.detection.low == wilson(20, 20).low
    assert expected([seen() for _ in range(20)], reports()).detection.independent == 20


def test_the_detection_is_told_by_distance():
    rates = expected([seen(1.2), seen(1.2), seen(2.4)], reports((0.0, 0.0)))
    assert [(reach, rate.successes, rate.trials) for reach, rate in rates.by_distance] == [
        (1.5, 2, 2),
        (3.0, 0, 1),
    ]
    assert rates.to_dict()["by_distance"][1]["to"] == 3.0


def test_far_panes_do_not_dim_the_model_of_near_ones():
    faint = replace(seen(5.0), intensities=0.1 * seen(5.0).intensities)
    near = propose(SENSOR, [seen() for _ in range(3)]).pane
    assert propose(SENSOR, [seen(), seen(), seen(), faint]).pane == near


def test_thresholds_of_other_sensors_are_taken_where_they_tell_panes_better():
    # half as bright as the walls of the curve: faint by the lobes alone, not by the usual level
    grey = [CalibrationScan(*wall(level=0.5), ANGLE_MIN, STEP) for _ in range(5)]
    made = propose(SENSOR, [seen() for _ in range(5)] + grey)
    assert made.evidence["calibrated_peak"]["false_alarm"]["successes"] == 0
    assert made.evidence["calibrated_peak"]["detection"]["successes"] == 5


def test_coarse_lidars_are_told_what_narrow_returns_give():
    rates = normalised_rates(replace(SENSOR, detector="narrow_return"), [clear()])
    assert set(rates) == {"calibrated_peak", "narrow_return"}
    assert set(normalised_rates(SENSOR, [clear()])) == {"calibrated_peak"}


def test_ranges_of_the_no_echo_value_mean_silence():
    assert replace(SENSOR, range_max=30.0, no_echo=65.5).silent_from == 30.0
    assert replace(SENSOR, range_max=30.0, no_echo=20.0).silent_from == 20.0
    assert replace(SENSOR, range_max=30.0).silent_from == 30.0


def room(x):
    return np.concatenate((np.full(40, 3.0 - x), np.full(40, 3.0 + x)))


@pytest.mark.parametrize(
    ("path", "expected_places"),
    [
        ([0.0, 0.01, 0.0, -0.01], [0, 0, 0, 0]),
        ([0.0, 0.1, 0.2, 0.3], [0, 1, 2, 3]),
        # slow motion counts from where the place began, not from scan to scan
        ([0.0, 0.03, 0.06, 0.09], [0, 0, 1, 1]),
    ],
)
def test_a_new_place_begins_where_the_ranges_differ(path, expected_places):
    assert places(room(x) for x in path).tolist() == expected_places


def test_scans_that_cannot_be_compared_are_places_of_their_own():
    silent = np.full(80, np.inf)
    assert places([silent, silent]).tolist() == [0, 1]
    assert places([]).tolist() == []


def corner(first, step, count, x=0.0):
    """A scan from inside a room of 6 m by 10 m, whose ranges change from beam to beam, and its layout."""
    angles = first + step * np.arange(count)
    with np.errstate(divide="ignore"):
        sides = np.where(np.cos(angles) > 0, 3.0 - x, 3.0 + x) / np.abs(np.cos(angles))
        return np.minimum(sides, 5.0 / np.abs(np.sin(angles))), (first, step)


def numbered(*scans):
    return places((ranges for ranges, _ in scans), [layout for _, layout in scans]).tolist()


@pytest.mark.parametrize("count", [233, 240, 247])
def test_beams_of_one_bearing_are_compared_where_their_number_varies(count):
    turn = 2.0 * np.pi
    still, again = corner(0.0, turn / 240, 240), corner(0.0006, turn / count, count)
    assert numbered(still, again) == [0, 0]
    assert numbered(still, corner(0.0006, turn / count, count, x=0.3)) == [0, 1]


def test_where_a_turn_begins_and_which_way_it_goes_does_not_matter():
    step = 2.0 * np.pi / 360
    still = corner(-np.pi, step, 360)
    assert numbered(still, corner(0.0, step, 360), corner(np.pi - step, -step, 360)) == [0, 0, 0]
    assert numbered(corner(-0.01, step, 90), corner(np.pi, step, 90)) == [0, 1]  # nothing in common


def test_a_few_beams_more_or_less_do_not_matter():
    assert places([np.full(80, 2.0), np.full(77, 2.0)]).tolist() == [0, 0]


@given(st.integers(1, 200), st.data())
def test_fewer_independent_trials_widen_the_interval(trials, data):
    successes = data.draw(st.integers(0, trials))
    independent = data.draw(st.integers(1, trials))
    wide, narrow = wilson(successes, trials, independent), wilson(successes, trials)
    assert wide.value == narrow.value
    assert wide.low <= narrow.low + 1e-12
    assert wide.high >= narrow.high - 1e-12
    assert wide.low <= wide.value <= wide.high


@pytest.mark.parametrize("independent", [0, 6])
def test_impossible_numbers_of_independent_trials(independent):
    with pytest.raises(ValueError, match=f"{independent} independent ones among 5 trials"):
        wilson(3, 5, independent)
