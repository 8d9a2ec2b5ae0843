"""What a run counts."""

import numpy as np

from glassslam.records import LaserScan
from glassslam.slam.tally import Tally

SCAN = LaserScan(4.5, np.ones(3, dtype=np.float32), 0.0, 0.1, 0.1, 10.0)


def test_scans_placed_are_counted():
    tally = Tally()
    tally.place(SCAN, 3, np.zeros(3))
    tally.place(SCAN, 2, None)
    assert tally.stamps == [4.5, 4.5]
    assert tally.returns == 5
    assert tally.without_odometry == 1


def test_a_run_with_nothing_to_show_says_what_came_in():
    tally = Tally()
    assert tally.excuse() == "0 scans read; dropped: none"
    tally.read = 5
    tally.dropped.update({"no beams": 3, "angles not usable": 2})
    assert tally.excuse() == "5 scans read; dropped: 2 x angles not usable, 3 x no beams"
