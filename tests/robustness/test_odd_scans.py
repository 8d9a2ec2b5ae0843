"""Scans, stamps and odometry as no sensor should send them: a whole map, or one clear line."""

from dataclasses import replace

import numpy as np
import pytest
from odd_runs import PATH, changed, is_whole, length, plain, run, with_intensities
from slam_worlds import CORRIDOR, drive, odometry, recording

from glassslam.errors import GridError, NoScansError
from glassslam.records import Odometry

DETECTORS = ("auto", "intensity_peak", "wang_wang", "calibrated_peak", "narrow_return")


def strewn(value):
    """Puts a value into every fifth beam of a scan."""

    def change(_, scan):
        ranges = scan.ranges.copy()
        ranges[::5] = value
        return replace(scan, ranges=ranges)

    return change


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, -3.0, 1e-30, 31.0, 65.533, 1e30])
def test_beams_of_odd_values_are_left_out(value):
    result = run(changed(plain(), strewn(value)))
    assert is_whole(result)
    assert length(result) == pytest.approx(3.3, abs=0.2)


@pytest.mark.parametrize("increment", [0.0, np.nan, np.inf])
def test_scans_without_angles_are_dropped_and_counted(increment):
    def change(k, scan):
        return replace(scan, angle_increment=increment) if k % 4 == 1 else scan

    result = run(changed(plain(), change))
    assert is_whole(result)
    assert set(result.statistics.scans_dropped) == {"angles not usable"}


def test_a_scan_whose_beams_go_round_more_than_once_is_used():
    """The increment does not fit the count: the beams lie where the header says."""
    result = run(changed(plain(), lambda _, scan: replace(scan, angle_increment=3 * scan.angle_increment)))
    assert is_whole(result)


def test_a_flipped_increment_mirrors_the_room():
    scan = plain(wheels=False)[0]
    forward, backward = run([scan]).map, run([replace(scan, angle_increment=-scan.angle_increment)]).map
    known, mirrored = (np.isfinite(grid.probability) for grid in (forward, backward))
    rows, columns = np.minimum(known.shape, mirrored.shape)
    same = known[:rows, :columns] == mirrored[::-1][:rows, :columns]
    assert same.mean() > 0.9
    assert (known[:rows, :columns] == mirrored[:rows, :columns]).mean() < same.mean() - 0.1


@pytest.mark.parametrize("detector", DETECTORS)
def test_a_layout_that_changes_in_the_middle(detector):
    def change(k, scan):
        scan = with_intensities(scan, 500 + np.arange(len(scan.ranges)) % 7)
        if k < 30:
            return scan
        return replace(
            scan,
            ranges=scan.ranges[::2].copy(),
            intensities=scan.intensities[::2].copy(),
            angle_increment=2 * scan.angle_increment,
        )

    glass = {"detector": detector, "sensor": "utm30lx" if detector == "calibrated_peak" else ""}
    assert is_whole(run(changed(plain(), change), glass=glass))


def strengths():
    """Odd intensities by name: from the number of the scan and of its beams."""
    random = np.random.default_rng(0)
    return {
        "none": lambda k, n: [],
        "constant": lambda k, n: np.full(n, 47.0),
        "zero": lambda k, n: np.zeros(n),
        "infinite": lambda k, n: np.full(n, np.inf),
        "some infinite": lambda k, n: np.where(np.arange(n) % 9 == 0, np.inf, 900.0 + np.arange(n) % 13),
        "not a number": lambda k, n: np.full(n, np.nan),
        "some not numbers": lambda k, n: np.where(np.arange(n) % 5 == 0, np.nan, random.uniform(1, 5000, n)),
        "negative": lambda k, n: -random.uniform(1, 5000, n),
        "huge": lambda k, n: np.full(n, 3e38),
        "missing now and then": lambda k, n: [] if k % 3 else random.uniform(1, 5000, n),
    }


@pytest.mark.parametrize("detector", DETECTORS)
@pytest.mark.parametrize("kind", strengths())
def test_odd_intensities_never_stop_a_run(detector, kind):
    strength = strengths()[kind]
    records = changed(plain()[:60], lambda k, scan: with_intensities(scan, strength(k, len(scan.ranges))))
    glass = {"detector": detector, "sensor": "utm30lx" if detector == "calibrated_peak" else ""}
    assert is_whole(run(records, glass=glass))


def test_infinite_intensities_are_no_glass():
    """One beam of infinite strength in each scan is a peak by every rule but that of being a number."""

    def change(_, scan):
        return with_intensities(scan, np.where(np.arange(360) == 180, np.inf, 900.0 + np.arange(360) % 97))

    result = run(changed(plain(), change), glass={"detector": "intensity_peak"})
    assert result.statistics.glass_detector == "intensity_peak"
    assert len(result.glass.observations.position) == 0


@pytest.mark.parametrize("size", [1, 100, 359, 361, 1000])
@pytest.mark.parametrize("detector", DETECTORS)
def test_intensities_of_a_wrong_length_are_ignored(detector, size):
    records = changed(plain()[:60], lambda _, scan: with_intensities(scan, np.arange(size)))
    glass = {"detector": detector, "sensor": "utm30lx" if detector == "calibrated_peak" else ""}
    assert is_whole(run(records, glass=glass))


def stamped(change):
    """The plain run with stamps changed, those of the odometry as well: k counts records."""
    return [replace(record, stamp=change(k, record.stamp)) for k, record in enumerate(plain())]


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda k, stamp: 100.0, id="all equal"),
        pytest.param(lambda k, stamp: 0.0, id="zero"),
        pytest.param(lambda k, stamp: stamp - 0.03 * (k % 3), id="backward by milliseconds"),
        pytest.param(lambda k, stamp: stamp - 7200.0 * (k >= 60), id="backward by hours"),
        pytest.param(lambda k, stamp: stamp + 1e6 * (k >= 60), id="a gap of days"),
        pytest.param(lambda k, stamp: 200.0 - stamp, id="all backward"),
        pytest.param(lambda k, stamp: 1e18 + stamp, id="nanoseconds"),
    ],
)
def test_odd_stamps(change):
    result = run(stamped(change))
    assert is_whole(result)
    assert len(result.trajectory.stamps) == len(PATH)
    assert length(result) == pytest.approx(3.3, abs=0.3)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_stamps_that_are_not_finite_are_dropped_and_counted(value):
    records = changed(plain(), lambda k, scan: replace(scan, stamp=value) if k == 5 else scan)
    result = run(records)
    assert is_whole(result)
    assert result.statistics.scans_dropped == {"stamp not finite": 1}


def moved_wheels(change):
    """The plain run with odometry poses changed."""
    return [
        replace(r, pose=change(k, r.pose)) if isinstance(r, Odometry) else r for k, r in enumerate(plain())
    ]


@pytest.mark.parametrize("jump", [50.0, 5000.0, 1e9, 1e200])
def test_odometry_that_jumps_is_not_believed_and_told(jump):
    result = run(moved_wheels(lambda k, pose: (pose[0] + jump * (k >= 60), pose[1], pose[2])))
    assert is_whole(result)
    assert length(result) == pytest.approx(3.3, abs=0.3)
    assert any("odometry jumped" in warning for warning in result.statistics.warnings)


def test_no_silence_is_long_enough_for_a_jump_of_kilometres():
    """Hours between two scans: the robot may have been driven, but not by odometry of 5 km."""
    records = [
        replace(r, stamp=r.stamp + 7200.0 * (k >= 60))
        for k, r in enumerate(moved_wheels(lambda k, pose: (pose[0] + 5000.0 * (k >= 60), *pose[1:])))
    ]
    result = run(records)
    assert length(result) < 10.0
    assert any("odometry jumped" in warning for warning in result.statistics.warnings)


def test_a_featureless_corridor_is_about_as_long_as_the_wheels_say():
    path = drive((-5.0, 1.0), (5.0, 1.0), step=0.1)
    result = run(recording(CORRIDOR, path, odometry(path), beams=180))
    assert is_whole(result)
    assert length(result) == pytest.approx(9.9, abs=1.2)  # bare walls say nothing of the way along them
    told = [one for one in result.statistics.degeneracies if one.kind == "featureless"]
    assert sum(one.length for one in told) > 7.0
    assert any("could slide along a featureless corridor" in text for text in result.statistics.warnings)


def test_a_lifted_robot_keeps_its_place():
    """Nothing comes back for a while: the poses are those of the odometry, and the report says so."""

    def change(k, scan):
        return replace(scan, ranges=np.full_like(scan.ranges, 30.0)) if 20 <= k < 40 else scan

    result = run(changed(plain(), change))
    assert is_whole(result)
    assert any("too few returns to match" in warning for warning in result.statistics.warnings)


def test_a_robot_lifted_all_the_time_has_no_map():
    with pytest.raises(NoScansError, match=r"not one of .* scans has a return"):
        run(changed(plain(), lambda _, scan: replace(scan, ranges=np.full_like(scan.ranges, 30.0))))


def far_beam(metres):
    """One beam of some scans, between the axes, is far away; the lidar claims to see so far."""

    def change(k, scan):
        ranges = scan.ranges.copy()
        ranges[225] = metres if 8 <= k < 16 else ranges[225]
        return replace(scan, ranges=ranges, range_max=1e6)

    return changed(plain(), change)


def test_one_beam_at_10_km_is_no_return_by_default():
    assert is_whole(run(far_beam(10_000.0)))


def test_one_beam_at_10_km_is_refused_with_the_size_it_would_take():
    with pytest.raises(
        GridError, match=r"a map of \d{4} x \d{4} m in cells of 0.05 m would take 1\d\d\.\d GB"
    ) as caught:
        run(far_beam(10_000.0), sensor={"max_range": 20_000.0})
    assert "sensor.max_range" in caught.value.hint
