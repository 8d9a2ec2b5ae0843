import math

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from scan_worlds import FLAT, SENSOR, STEP, bearings, inside, pane, wall

from detectors.calibration import Calibration, PaneModel
from detectors.diffuse import DiffuseCurve
from detectors.diffuse_fit import brightest_mode, fit_diffuse_curve, surface_samples
from detectors.expectation import CalibrationScan
from detectors.pane_lobe import faces, fit_pane_lobe
from detectors.panes import find_pane, pane_profile
from detectors.profiles import PROFILES, load_profile
from detectors.proposals import propose
from detectors.rates import wilson
from detectors.self_calibration import self_calibration

ANGLE_MIN = float(bearings()[0])


def test_a_calibration_survives_being_written_as_yaml():
    full = Calibration(
        "here",
        DiffuseCurve((1.0, 2.0), (900.0, 800.0), 0.2, 0.1),
        beams=1081,
        no_echo=65.5,
        pane=PaneModel(0.7, 5.0, 3.0),
        evidence={"scans": 3},
    )
    text = yaml.safe_dump(full.to_dict())
    assert Calibration.from_dict(yaml.safe_load(text)) == full
    assert yaml.safe_load(text)["intensity_scale"] == 900.0


def test_what_is_missing_keeps_its_default():
    assert Calibration.from_dict({"sensor": "flat", "diffuse": {"ranges": [1], "levels": [5]}}).faint == 0.45


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"sensor": "x"}, "a calibration needs 'diffuse'"),
        ({"sensor": "x", "diffuse": {"ranges": [1]}}, "a calibration needs 'diffuse.levels'"),
        ({"diffuse": {"ranges": [1], "levels": [1]}}, "a calibration needs 'sensor'"),
        (
            {"sensor": "x", "diffuse": {"ranges": [1], "levels": [1]}, "colour": 3},
            "not a calibration: .*colour",
        ),
        ({"sensor": "x", "diffuse": {"ranges": [2, 1], "levels": [1, 1]}}, "ranges .* must increase"),
        ({"sensor": "x", "diffuse": {"ranges": [1], "levels": [0]}}, "levels be positive"),
        ({"sensor": "x", "diffuse": {"ranges": [], "levels": []}}, "as many levels as ranges, not 0, 0"),
    ],
)
def test_damaged_calibrations_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        Calibration.from_dict(values)


def test_a_calibration_knows_its_sensor():
    assert SENSOR.mismatch(721, STEP) == SENSOR.mismatch(600, -STEP) == ""
    assert SENSOR.mismatch(721, 2 * STEP) == (
        "the calibration of flat is for steps of 0.004363 rad, the recording has 0.008727"
    )
    assert SENSOR.mismatch(1081, STEP) == "the calibration of flat is for 721 beams, the recording has 1081"
    assert Calibration("any", FLAT).mismatch(5, 1.0) == ""


@given(st.floats(0.1, 30.0))
def test_the_curve_stays_between_its_ends(distance):
    assert 800.0 <= DiffuseCurve((1.0, 5.0), (1000.0, 800.0)).level(distance) <= 1000.0


@pytest.mark.parametrize("name", PROFILES)
def test_profiles_are_whole(name):
    profile = load_profile(name)
    assert profile.sensor == name
    assert profile.beams > 0
    assert 0.0 < profile.range_min < profile.range_max < math.inf
    assert profile.evidence["recordings"]
    assert profile.evidence["notes"]
    assert Calibration.from_dict(profile.to_dict()) == profile


def test_an_unknown_profile_is_refused():
    with pytest.raises(ValueError, match="no profile of a sensor 'urg04'; there are utm30lx, ust10lx, "):
        load_profile("urg04")


def falling(distance, normal=0.0, seed=0):
    """A wall as a lidar sees it: brightness falls with range and a little with incidence."""
    ranges, _ = wall(distance, normal=normal)
    random = np.random.default_rng(seed)
    incidence = np.clip(np.abs(bearings() - normal), 0.0, 1.4)
    clean = 4000.0 / np.sqrt(np.where(np.isfinite(ranges), ranges, 1.0)) * np.cos(incidence) ** 0.3
    noisy = clean * np.exp(0.03 * random.standard_normal(ranges.size))
    return ranges, np.where(np.isfinite(ranges), noisy, 0.0)


WALLS = [falling(distance, seed=k) for k, distance in enumerate((0.6, 1.0, 1.6, 2.4, 3.5, 5.0))]


def fitted(scans):
    return fit_diffuse_curve(surface_samples(scans, ANGLE_MIN, STEP))


def test_the_diffuse_curve_is_read_from_walls():
    curve = fitted(WALLS)
    at = np.array([0.8, 1.5, 3.0, 5.0])
    np.testing.assert_allclose(curve.level(at), 4000.0 / np.sqrt(at), rtol=0.05)
    assert curve.incidence_exponent == pytest.approx(0.3, abs=0.05)
    assert curve.spread == pytest.approx(0.03, abs=0.02)


def test_panes_among_the_walls_do_not_bend_it():
    curve = fitted([*WALLS, pane(1.2), pane(1.2, seed=1)])
    assert curve.level(1.2) == pytest.approx(4000.0 / math.sqrt(1.2), rel=0.05)


def test_a_sensor_that_saturates_has_no_brighter_walls():
    clipped = [(ranges, np.minimum(intensities, 2500.0)) for ranges, intensities in WALLS]
    assert max(fitted(clipped).levels) <= 2500.0


def test_a_curve_needs_surfaces():
    with pytest.raises(ValueError, match="a diffuse curve needs 40 returns from flat surfaces"):
        fitted([(np.full(721, np.inf), np.zeros(721))])


@given(st.lists(st.floats(-5.0, 9.0), min_size=0, max_size=4))
def test_the_mode_is_where_the_values_gather(outliers):
    assert brightest_mode(np.array([5.0] * 30 + outliers)) == pytest.approx(5.0, abs=0.02)


def test_of_two_modes_the_brighter_counts_though_it_is_smaller():
    walls, seen_through_glass = np.full(40, 8.0), np.full(100, 7.2)
    assert brightest_mode(np.concatenate((walls, seen_through_glass))) == pytest.approx(8.0)


def test_a_few_bright_reflectors_are_no_mode():
    assert brightest_mode(np.concatenate((np.full(100, 7.0), np.full(20, 9.0)))) == pytest.approx(7.0)


def test_one_value_is_its_own_mode():
    assert brightest_mode(np.array([3.25])) == 3.25


def test_a_recording_calibrates_its_own_sensor():
    own = self_calibration("walls", WALLS, ANGLE_MIN, STEP, range_max=30.0)
    assert own.beams == 721
    assert own.detector == "calibrated_peak"
    assert own.intensity_scale == pytest.approx(4000.0, rel=0.05)
    assert own.evidence["scans"] == 6


def test_not_without_informative_intensities():
    with pytest.raises(
        ValueError, match="no calibration without informative intensities: all intensities are 0"
    ):
        self_calibration("none", [(np.ones(721), np.zeros(721))], ANGLE_MIN, STEP)


def test_the_pane_in_front_is_found_at_its_stated_distance():
    ranges, intensities = pane(1.03, normal=0.1)
    found = find_pane(ranges, intensities, ANGLE_MIN, STEP, curve=FLAT, distance=1.0)
    assert found == pytest.approx((0.1, 1.03), abs=0.01)


@pytest.mark.parametrize("distance", [0.5, 2.0])
def test_but_not_at_another(distance):
    ranges, intensities = pane(1.03)
    assert find_pane(ranges, intensities, ANGLE_MIN, STEP, curve=FLAT, distance=distance) is None


def profile(world, **options):
    return pane_profile(*world, ANGLE_MIN, STEP, curve=FLAT, normal=0.0, distance=1.2, **options)


def test_the_profile_of_a_pane():
    read = profile(pane(1.2))
    degrees = np.degrees(read.angles)
    assert (np.diff(read.angles) > 0.0).all()
    assert read.answered[np.abs(degrees) < 27].all()
    assert read.passed[np.abs(degrees) > 29].all()
    assert faces(read)
    assert fit_pane_lobe(read) == pytest.approx((0.8, 7.5), rel=0.1)


def test_a_pane_ends_where_it_is_said_to():
    read = profile(pane(1.2), along=(-0.1, 0.3))
    place = 1.2 * np.tan(read.angles)
    assert place.min() == pytest.approx(-0.1, abs=0.01)
    assert place.max() == pytest.approx(0.3, abs=0.01)


def test_what_stands_before_it_neither_answers_nor_lets_pass():
    hidden = np.where(inside(-5, 5), 0.7, pane(1.2)[0])
    read = profile((hidden, pane(1.2)[1]))
    before = np.abs(np.degrees(read.angles)) < 4.9
    assert not (read.answered | read.passed)[before].any()
    assert not faces(read)


def calibration_scans():
    with_pane = [pane(1.2, seed=k) for k in range(6)]
    scans = [CalibrationScan(*world, ANGLE_MIN, STEP, (profile(world),)) for world in with_pane]
    return scans + [CalibrationScan(*world, ANGLE_MIN, STEP) for world in WALLS]


def test_thresholds_are_proposed_with_the_rates_to_expect():
    proposed = propose(SENSOR, calibration_scans())
    assert 4000.0 < proposed.thresh < 4.8 * 4000.0
    assert proposed.pane.decay == pytest.approx(7.5, rel=0.1)
    assert 0.2 <= proposed.faint <= 0.6
    for detector in ("intensity_peak", "calibrated_peak"):
        rates = proposed.evidence[detector]
        assert rates["detection"]["successes"] == rates["detection"]["trials"] == 6
        assert rates["detection"]["low"] == pytest.approx(0.61, abs=0.01)
        assert rates["false_alarm"]["successes"] == 0
        assert rates["false_alarm"]["trials"] == 12


def test_without_a_pane_nothing_can_be_proposed():
    with pytest.raises(ValueError, match="no pane is seen at normal incidence in these scans"):
        propose(SENSOR, calibration_scans()[6:])


@given(st.integers(0, 60), st.integers(0, 60))
def test_the_interval_holds_the_rate(successes, failures):
    rate = wilson(successes, successes + failures)
    if rate.trials:
        assert 0.0 <= rate.low <= rate.value <= rate.high <= 1.0
    else:
        assert (rate.low, rate.high) == (0.0, 1.0)


def test_more_trials_narrow_it():
    assert wilson(100, 100).low > wilson(10, 10).low > wilson(1, 1).low


def test_impossible_counts_are_refused():
    with pytest.raises(ValueError, match="3 successes in 2 trials"):
        wilson(3, 2)
