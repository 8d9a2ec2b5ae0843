"""What drivers write into scans."""

import math
from dataclasses import replace

import numpy as np
import pytest

from glassslam.records import LaserScan
from glassslam.slam.scan_check import defect, mended, sweep_time

SCAN = LaserScan(1.0, np.ones(11, dtype=np.float32), -0.5, 0.1, 0.1, 10.0, time_increment=0.01)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({}, ""),
        ({"angle_increment": -0.1}, ""),
        ({"ranges": np.full(11, np.nan, dtype=np.float32)}, ""),
        ({"stamp": math.nan}, "stamp not finite"),
        ({"stamp": math.inf}, "stamp not finite"),
        ({"ranges": np.empty(0, dtype=np.float32)}, "no beams"),
        ({"angle_min": math.inf}, "angles not usable"),
        ({"angle_increment": math.nan}, "angles not usable"),
        ({"angle_increment": 0.0}, "angles not usable"),
    ],
)
def test_reasons_to_drop_a_scan(changes, reason):
    assert defect(replace(SCAN, **changes)) == reason


def test_a_sound_scan_passes_untouched():
    assert mended(SCAN) is SCAN
    assert sweep_time(SCAN) == pytest.approx(0.1)


@pytest.mark.parametrize("time_increment", [math.nan, math.inf, 0.11, -0.11])
def test_senseless_times_between_beams_count_as_unknown(time_increment):
    scan = mended(replace(SCAN, time_increment=time_increment))
    assert scan == replace(SCAN, time_increment=0.0)


@pytest.mark.parametrize("time_increment", [0.0, 0.1, -0.1])
def test_slow_and_backward_sweeps_are_possible(time_increment):
    scan = replace(SCAN, time_increment=time_increment)
    assert mended(scan) is scan


@pytest.mark.parametrize("range_max", [0.0, -1.0, math.nan])
def test_a_largest_range_that_says_nothing_is_no_limit(range_max):
    assert mended(replace(SCAN, range_max=range_max)) == replace(SCAN, range_max=math.inf)


@pytest.mark.parametrize(
    "ranges", [[1.0] * 11, np.ones(11), np.ones(11, dtype=">f4"), np.ones(22, dtype=np.float32)[::2]]
)
def test_ranges_of_any_kind_become_what_kernels_read(ranges):
    scan = mended(replace(SCAN, ranges=ranges))
    assert scan.ranges.dtype == np.float32
    assert scan.ranges.dtype.isnative
    assert scan.ranges.flags.c_contiguous
    np.testing.assert_array_equal(scan.ranges, np.ones(11))
