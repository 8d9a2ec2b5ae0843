import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from detectors.beams import directions
from detectors.labels import GLASS, INVALID, NO_RETURN, SOLID, base_labels
from detectors.narrow_kernels import find_narrow
from detectors.narrow_return import narrow_return
from detectors.wall_directions import BINS, share_along, wall_directions

STEP = math.radians(1.0)
ANGLES = -math.pi + STEP * np.arange(360)


def corridor(left=True):
    """Walls 1 m to the right and, unless open, 1.5 m to the left; nothing within 40 deg of both ends."""
    ranges = np.full(360, np.inf)
    for side, distance in ((-1.0, 1.0), (1.0, 1.5)):
        if side > 0 and not left:
            continue
        sine = side * np.sin(ANGLES)
        ranges = np.where(sine > 0.64, distance / np.maximum(sine, 0.1), ranges)
    return ranges


def detect(ranges, **options):
    return narrow_return(ranges, None, -math.pi, STEP, **options)


def test_a_lone_return_across_from_a_wall_is_glass():
    ranges = corridor(left=False)
    ranges[270] = 1.5
    found = detect(ranges)
    assert found.beam.tolist() == [270]
    assert found.labels[270] == GLASS
    assert found.probability[0] > 0.5
    assert math.degrees(found.normal[0]) == pytest.approx(90.0, abs=1.0)


def test_its_normal_is_that_of_the_walls_parallel_to_it():
    ranges = corridor(left=False)
    ranges[273] = 1.5
    found = detect(ranges)
    assert math.degrees(found.bearing[0]) == pytest.approx(93.0)
    assert math.degrees(found.normal[0]) == pytest.approx(90.0, abs=1.0)
    assert math.degrees(found.incidence[0]) == pytest.approx(3.0, abs=1.0)


def test_the_same_return_in_a_direction_without_walls_is_not():
    ranges = corridor(left=False)
    ranges[240] = 1.5
    assert len(detect(ranges)) == 0


@pytest.mark.parametrize("width", [1, 2, 3])
def test_up_to_three_beams_are_narrow(width):
    ranges = corridor(left=False)
    ranges[270 : 270 + width] = 1.5
    assert len(detect(ranges)) == 1


def test_four_beams_are_not():
    ranges = corridor(left=False)
    ranges[269:273] = 1.5
    assert len(detect(ranges)) == 0


def test_what_is_nearer_beside_a_return_hides_it():
    ranges = corridor(left=False)
    ranges[270] = 1.5
    ranges[268] = 1.2
    assert detect(ranges).beam.tolist() == [268]


def test_returns_far_behind_do_not():
    ranges = corridor(left=True)
    ranges[270] = 1.0
    found = detect(ranges)
    assert found.beam.tolist() == [270]


def test_silence_around_makes_it_likelier_than_something_behind():
    silent, filled = corridor(left=False), corridor(left=True)
    silent[270] = filled[270] = 1.0
    assert detect(silent).strength[0] > detect(filled).strength[0]


def test_a_plain_corridor_holds_no_glass():
    assert len(detect(corridor())) == 0


def test_returns_beyond_the_limit_are_left_out():
    ranges = corridor(left=False)
    ranges[270] = 1.5
    assert len(detect(ranges, range_limit=1.4)) == 0


def test_a_pane_across_the_seam_of_a_full_turn_is_seen():
    ranges = np.roll(corridor(left=False), 90)
    ranges[0] = 1.5
    assert narrow_return(ranges, None, -math.pi, STEP).beam.tolist() == [0]
    # without the neighbours beyond the seam there is nothing on one side to be open
    assert len(narrow_return(ranges[:350], None, -math.pi, STEP)) == 0


def naive_narrow(ranges, labels, max_beams, clearance):
    """First beams of all runs of few neighbouring beams with two open beams on both sides, no full turn."""

    def is_open(beam, depth):
        inside = 0 <= beam < ranges.size
        return inside and (labels[beam] == NO_RETURN or (labels[beam] == SOLID and ranges[beam] >= depth))

    runs, found = [], []
    for beam in np.flatnonzero(labels == SOLID):
        joins = runs and runs[-1][-1] == beam - 1 and len(runs[-1]) <= max_beams
        if joins and abs(ranges[beam] - ranges[beam - 1]) < 0.5 * clearance:
            runs[-1].append(beam)
        else:
            runs.append([beam])
    for run in runs:
        depth = ranges[run[0]] + clearance
        beside = (run[0] - 1, run[0] - 2, run[-1] + 1, run[-1] + 2)
        if len(run) <= max_beams and all(is_open(beam, depth) for beam in beside):
            found.append(int(run[0]))
    return found


@given(arrays(np.float64, 40, elements=st.sampled_from([1.0, 1.05, 1.3, 2.0, *[np.inf] * 3, np.nan])))
def test_the_kernel_agrees_with_its_naive_twin(ranges):
    labels = base_labels(ranges)
    cosines, sines = directions(40, -0.5, STEP)
    first, features = np.empty(40, dtype=np.int64), np.empty((40, 5))
    count = find_narrow(
        ranges, labels, cosines, sines, -0.5, STEP, 3, 0.15, False, np.empty(BINS), first, features
    )
    assert first[:count].tolist() == naive_narrow(ranges, labels, 3, 0.15)


@pytest.mark.parametrize("normal_deg", [0, 30, 90, 135])
def test_a_wall_counts_in_the_direction_of_its_normal(normal_deg):
    turned = ANGLES - math.radians(normal_deg)
    seen = np.cos(turned) > 0.5
    ranges = np.where(seen, 1.0 / np.maximum(np.cos(turned), 0.1), np.inf)
    histogram = np.empty(BINS)
    cosines, sines = directions(360, -math.pi, STEP)
    total = wall_directions(ranges, base_labels(ranges), cosines, sines, histogram)
    assert 2.0 < total < 2.0 * math.sqrt(3.0) + 0.01
    assert np.flatnonzero(histogram).tolist() == [normal_deg % 180]
    share, offset = share_along(histogram, total, math.radians(normal_deg + 3), 5)
    assert share == pytest.approx(1.0)
    assert math.degrees(offset) == pytest.approx(-3.0)
    assert share_along(histogram, total, math.radians(normal_deg + 6), 5) == (0.0, 0.0)


def test_a_ragged_surface_has_no_direction():
    ranges = 1.0 + 0.14 * (np.arange(360) % 2)
    cosines, sines = directions(360, -math.pi, STEP)
    assert wall_directions(ranges, base_labels(ranges), cosines, sines, np.empty(BINS)) == 0.0


def test_nothing_lies_along_any_direction_of_an_empty_scan():
    assert share_along(np.zeros(BINS), 0.0, 1.0, 5) == (0.0, 0.0)


def test_intensities_must_fit_even_though_they_are_not_used():
    with pytest.raises(ValueError, match="2 intensities do not fit 360 ranges"):
        narrow_return(corridor(), [1.0, 2.0], -math.pi, STEP)


def test_invalid_beams_beside_a_return_say_nothing():
    ranges = corridor(left=False)
    ranges[270], ranges[269] = 1.5, np.nan
    assert base_labels(ranges)[269] == INVALID
    assert len(detect(ranges)) == 0


def test_signalling_nans_of_damaged_recordings_are_invalid_without_a_word():
    ranges = np.full(360, 2.0, dtype=np.float32)
    ranges.view(np.uint32)[10] = 0x7FA00000
    found = narrow_return(ranges, ranges, -np.pi, np.radians(1.0))
    assert found.labels[10] == 0
