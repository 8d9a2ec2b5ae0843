"""GlassDetect and CornerAdjust: the sensitivity tables of the paper, and where glass is drawn.

Laser and ring are those of the paper: 512 beams over 180 degrees and nine sonars, 57 beams each.
Rows of Table I that contradict the algorithm (a larger D_go that finds more glass in a plane) are left out.
"""

import math

import numpy as np
import pytest
from fusion_worlds import ring
from hypothesis import given
from hypothesis import strategies as st

from glassslam.config import ScanFilterConfig
from glassslam.errors import GridError
from glassslam.fusion.filter_stream import ScanFilter, filtered_records
from glassslam.fusion.scan_filter import filter_scan, sectors
from glassslam.geometry import compose, inverse
from glassslam.records import LaserScan, Odometry, RangeRing

AXES = np.radians(np.arange(-80, 81, 20))
RING = ring(*AXES)
BEAMS, FIRST, STEP = 512, -0.5 * math.pi, math.pi / 511
ANGLES = FIRST + STEP * np.arange(BEAMS)
MIDDLE = 4
SECTOR = sectors(AXES, ANGLES, math.radians(20.0))[MIDDLE]
BASE = np.zeros(3)


def scan(ranges, stamp=0.0):
    ranges = np.broadcast_to(np.asarray(ranges, dtype=np.float32), BEAMS).copy()
    return LaserScan(stamp, ranges, FIRST, STEP, 0.02, 5.6)


def only_middle(ranges):
    """A scan with the given ranges in the middle sector, and a sweep in which only its sonar answers."""
    beams = np.full(BEAMS, 1.0)
    beams[SECTOR] = ranges
    return scan(beams)


def sweep(middle, others=math.inf):
    ranges = np.full(9, others)
    ranges[MIDDLE] = middle
    return ranges


def filtered(beams, heard, **config):
    return filter_scan(beams, BASE, RING, heard, ScanFilterConfig(**config))


def across_sector(low, high):
    return np.linspace(low, high, len(SECTOR))


GLASS = only_middle(across_sector(1.0, 2.2)), sweep(1.0)
"""A pane at 1 m and a slanted wall behind it: 75 % of the beams are longer by 0.3 m, 58 % by 0.5 m."""
PLANE = only_middle(1.0), sweep(0.89)
"""A wall at 1 m that the sonar, at its largest error of 11 cm, hears too near."""
CORNERS = only_middle(1.0 + 0.22 + 0.08 * (np.arange(len(SECTOR)) % 2)), sweep(1.0)
"""A jagged wall whose nearest edge the sonar hears: beams are longer by 0.22 and by 0.3 m in turn."""


@pytest.mark.parametrize(
    ("case", "config", "is_glass"),
    [
        (GLASS, {"glass_offset": 0.3}, True),
        (PLANE, {"glass_offset": 0.3}, False),
        (CORNERS, {"glass_offset": 0.31}, False),
        (PLANE, {"glass_offset": 0.1}, True),
        (CORNERS, {"glass_offset": 0.1}, True),
        (GLASS, {"glass_offset": 0.5}, True),
        (GLASS, {"min_share": 0.5}, True),
        (PLANE, {"min_share": 0.5}, False),
        (GLASS, {"min_share": 0.8}, False),
        (PLANE, {"min_share": 0.8}, False),
        (CORNERS, {"min_share": 0.8}, False),
        (GLASS, {"min_difference": 0.08}, True),
        (PLANE, {"min_difference": 0.08}, False),
        (GLASS, {"min_difference": 0.15}, True),
        (PLANE, {"min_difference": 0.15}, False),
    ],
)
def test_table_i(case, config, is_glass):
    beams, heard = case
    result = filtered(beams, heard, **config)
    assert result.glass[MIDDLE] == is_glass
    assert not np.delete(result.glass, MIDDLE).any()


@pytest.mark.parametrize("case", [GLASS, PLANE, CORNERS])
@pytest.mark.parametrize("name", ["glass_offset", "min_share", "min_difference"])
def test_a_stricter_setting_never_finds_more_glass(case, name):
    beams, heard = case
    found = [
        bool(filtered(beams, heard, **{"glass_offset": 0.1, name: value}).glass[MIDDLE])
        for value in (0.05, 0.1, 0.2, 0.3, 0.5, 0.8)
    ]
    assert found == sorted(found, reverse=True)


@pytest.mark.parametrize(("limit", "fewest", "most"), [(2.0, 6, 60), (10.0, 3, 5), (15.0, 0, 0)])
def test_table_ii(limit, fewest, most):
    """Four steps of 12 m/rad and ten of 4 m/rad behind glass: many corners, 3 to 5, none."""
    steps = np.zeros(len(SECTOR))
    steps[5:45:4], steps[46:54:2] = 4.0 * STEP, 12.0 * STEP
    result = filtered(only_middle(1.5 + np.cumsum(steps)), sweep(1.0), corner_slope=limit)
    assert fewest <= result.steep_slopes[MIDDLE] <= most
    assert result.glass[MIDDLE]


@pytest.mark.parametrize(("edges", "is_corner"), [(0, False), (1, True), (2, True), (3, False), (6, False)])
def test_one_or_two_edges_are_a_corner_and_the_laser_is_put_back(edges, is_corner):
    ranges = np.full(len(SECTOR), 2.0)
    for k in range(edges):
        ranges[8 * (k + 1) :] += 0.2
    beams = only_middle(ranges)
    result = filtered(beams, sweep(1.0))
    assert result.steep_slopes[MIDDLE] == edges
    assert (result.corner[MIDDLE], result.glass[MIDDLE]) == (is_corner, not is_corner)
    assert np.array_equal(result.scan.ranges, beams.ranges) == is_corner


def test_a_lone_pane_stands_across_the_axis_of_its_sonar():
    result = filtered(only_middle(2.5), sweep(1.2))
    x = result.scan.ranges[SECTOR] * np.cos(ANGLES[SECTOR])
    assert x == pytest.approx(np.full(len(SECTOR), 1.2), abs=1e-5)
    outside = np.setdiff1d(np.arange(BEAMS), SECTOR)
    assert (result.scan.ranges[outside] == 1.0).all()


def test_neighbours_that_hear_glass_share_the_straight_segment_between_their_ends():
    """A pane that runs askew: x = 1 + 0.5 y."""
    heard = 1.0 / (np.cos(AXES) - 0.5 * np.sin(AXES))
    chosen = [3, 4, 5]
    ranges = np.full(9, math.inf)
    ranges[chosen] = heard[chosen]
    result = filtered(scan(4.0), ranges)
    assert np.flatnonzero(result.glass).tolist() == chosen
    beams = np.concatenate([sectors(AXES, ANGLES, math.radians(20.0))[k] for k in chosen])
    x, y = (result.scan.ranges[beams] * f(ANGLES[beams]) for f in (np.cos, np.sin))
    assert x == pytest.approx(1.0 + 0.5 * y, abs=1e-5)


def test_neighbours_at_different_ranges_are_joined_at_their_end_points():
    ranges = np.full(9, math.inf)
    ranges[3], ranges[4] = 1.0, 1.3
    result = filtered(scan(4.0), ranges)
    for sonar in (3, 4):
        beam = int(np.abs(ANGLES - AXES[sonar]).argmin())
        assert result.scan.ranges[beam] == pytest.approx(ranges[sonar], abs=0.01)


@pytest.mark.parametrize("heard", [math.nan, math.inf, 3.2, 0.005])
def test_a_sonar_that_hears_nothing_near_leaves_its_sector(heard):
    beams = scan(5.0)
    result = filtered(beams, sweep(heard))
    assert not result.glass.any()
    assert np.array_equal(result.scan.ranges, beams.ranges)


def test_silent_beams_see_through_glass():
    result = filtered(only_middle(math.inf), sweep(1.0))
    assert result.glass[MIDDLE]
    assert np.isfinite(result.scan.ranges[SECTOR]).all()
    assert result.check[MIDDLE] > 1.0


@pytest.mark.parametrize("value", [math.nan, 0.0, -math.inf, 0.001])
def test_invalid_beams_prove_nothing(value):
    assert not filtered(only_middle(value), sweep(1.0)).glass.any()


def test_everything_else_of_the_scan_is_kept():
    beams = scan(4.0, stamp=7.5)
    result = filtered(beams, sweep(1.0))
    assert (result.scan.stamp, result.scan.angle_min, result.scan.range_max) == (7.5, FIRST, 5.6)
    assert result.scan.ranges.dtype == np.float32
    assert (beams.ranges == 4.0).all()


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0))
def test_sonars_and_laser_may_sit_anywhere_on_the_robot(x, y, yaw):
    base_from_laser = np.array([x, y, yaw])
    poses = compose(base_from_laser[None], RING.poses)
    moved = type(RING)(poses, RING.field_of_view, RING.range_min, RING.range_max)
    beams, heard = GLASS
    there = filter_scan(beams, base_from_laser, moved, heard, ScanFilterConfig())
    assert there.scan.ranges == pytest.approx(filtered(beams, heard).scan.ranges, abs=1e-4)
    assert compose(inverse(base_from_laser), poses[0]) == pytest.approx(RING.poses[0], abs=1e-9)


def test_a_sector_is_no_wider_than_allowed_and_belongs_to_one_sonar():
    own = sectors(np.radians([0.0, 60.0, 60.0]), np.radians(np.arange(-90, 91)), math.radians(20.0))
    assert [np.arange(-90, 91)[s][[0, -1]].tolist() for s in own[:2]] == [[-10, 10], [50, 70]]
    assert len(own[2]) == 0


def test_a_sweep_of_another_ring_is_refused():
    with pytest.raises(GridError, match=r"sweep of shape \(3,\) for 9 sonars") as caught:
        filtered(scan(1.0), np.zeros(3))
    assert caught.value.hint == "give one range per sonar"


class TestStream:
    def sweeps_and_scan(self, age):
        first = np.full(9, np.nan, np.float32)
        first[MIDDLE] = 1.0
        return [
            RangeRing(1.0, first),
            RangeRing(1.0 + 0.5 * age, np.full(9, np.nan, np.float32)),
            scan(4.0, 1.0 + age),
        ]

    def run(self, records, **config):
        return list(filtered_records(records, BASE, RING, ScanFilterConfig(**config)))

    def test_scans_meet_the_latest_reading_of_every_sonar(self):
        records = self.sweeps_and_scan(0.2)
        out = self.run(records, enabled=True)
        assert out[:2] == records[:2]
        assert (out[2].ranges[SECTOR] < 1.1).all()

    def test_a_reading_that_is_too_old_is_not_used(self):
        records = self.sweeps_and_scan(0.6)
        assert np.array_equal(self.run(records, enabled=True)[2].ranges, records[2].ranges)

    def test_switched_off_everything_passes_as_it_is(self):
        records = [*self.sweeps_and_scan(0.2), Odometry(3.0, (0.0, 0.0, 0.0))]
        out = self.run(records)
        assert all(a is b for a, b in zip(out, records, strict=True))

    def test_sectors_are_counted(self):
        scan_filter = ScanFilter(BASE, RING, ScanFilterConfig())
        for record in self.sweeps_and_scan(0.2)[:2]:
            scan_filter.add_sweep(record)
        scan_filter.filter(scan(4.0, 1.2))
        step = np.full(BEAMS, 4.0)
        step[SECTOR[20] :] = 4.5
        scan_filter.filter(scan(step, 1.2))
        assert (scan_filter.glass_sectors, scan_filter.corner_sectors) == (1, 1)


def test_end_points_that_coincide_give_no_direction_and_leave_the_laser():
    there = ring(0.1, -0.1)
    poses = np.array([(0.0, -0.1, 0.1), (0.0, 0.1, -0.1)])
    crossing = type(there)(poses, there.field_of_view, there.range_min, there.range_max)
    reach = 0.1 / math.sin(0.1)
    result = filter_scan(scan(4.0), BASE, crossing, np.array([reach, reach]), ScanFilterConfig())
    assert result.glass.all()
    assert (result.scan.ranges == 4.0).all()


def test_a_laser_with_one_beam_in_a_sector_has_no_slopes():
    few = LaserScan(0.0, np.array([4.0], dtype=np.float32), 0.0, 0.1, 0.02, 5.6)
    result = filtered(few, sweep(1.0))
    assert result.steep_slopes[MIDDLE] == 0
    assert result.scan.ranges == pytest.approx([1.0])


@pytest.mark.parametrize("start", [0.0, 1.0, -math.pi, 3.0])
def test_a_full_circle_may_begin_anywhere_even_within_a_sector(start):
    """A glass sector, a corner sector and a plain one look the same whatever the first beam."""
    angles = np.linspace(start, start + 2.0 * math.pi, 1025)
    at = np.round(np.angle(np.exp(1j * angles)), 9)
    ranges = np.where(np.abs(at) < 0.2, 3.0, np.where(np.abs(at - 1.0) < 0.2, 2.0 + 0.5 * (at > 1.01), 1.0))
    circle = LaserScan(0.0, ranges.astype(np.float32), start, 2.0 * math.pi / 1024, 0.02, 5.6)
    sonars = ring(0.0, 1.0, 2.5)
    result = filter_scan(circle, BASE, sonars, np.array([1.2, 1.2, 1.0]), ScanFilterConfig())
    assert result.glass.tolist() == [True, False, False]
    assert result.corner.tolist() == [False, True, False]
    assert result.steep_slopes.tolist() == [0, 1, 0]
    inside = np.abs(at) < 0.17
    assert result.scan.ranges[inside] * np.cos(at[inside]) == pytest.approx(
        np.full(inside.sum(), 1.2), abs=1e-5
    )


def test_a_scan_that_turns_clockwise_is_filtered_alike():
    beams, heard = GLASS
    backwards = LaserScan(0.0, beams.ranges[::-1].copy(), -FIRST, -STEP, 0.02, 5.6)
    forth, back = filtered(beams, heard), filtered(backwards, heard)
    assert back.scan.ranges[::-1] == pytest.approx(forth.scan.ranges, abs=1e-5)
    assert back.check == pytest.approx(forth.check)
