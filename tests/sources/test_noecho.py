"""The no-echo value is found where there is one, and nothing is taken for it where there is none."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.sources.noecho import NoEcho, detect_no_echo

RNG = np.random.default_rng(7)


def scenes(count=100, beams=180, silent=None, share=0.1, far=12.0, step=0.01):
    """Scans of a robot that drives: ranges in steps, some beams silent all over the field of view."""
    for _ in range(count):
        ranges = np.round(RNG.uniform(0.5, far, beams) / step) * step
        if silent is not None:
            ranges[RNG.random(beams) < share] = RNG.choice(silent) if np.ndim(silent) else silent
        yield ranges.astype(np.float32)


@pytest.mark.parametrize("silent", [81.83, 50.0, 81.91, 65.533, 12.5])
@pytest.mark.parametrize("share", [0.02, 0.5])
def test_repeated_farthest_value(silent, share):
    value = float(np.float32(silent))
    assert detect_no_echo(scenes(silent=silent, share=share)) == NoEcho(value, value)


def test_the_limit_covers_values_smeared_by_a_conversion_of_units():
    shades = np.repeat(np.float32([51.06, 51.05, 51.07, 51.11]), [40, 4, 3, 5])
    found = detect_no_echo(scenes(400, silent=shades))
    assert found.value == np.float32(51.06)
    assert found.ceiling == np.float32(51.05)


def test_infinite_ranges():
    assert detect_no_echo(scenes(silent=math.inf)) == NoEcho(math.inf, math.inf)


def test_a_finite_value_goes_before_infinity():
    mixed = [*scenes(silent=50.0), np.float32([math.inf, 1.0])]
    assert detect_no_echo(mixed).value == 50.0


@pytest.mark.parametrize("empty", [[], [np.empty(0, np.float32)], [np.float32([math.nan, 0.0, -1.0])] * 50])
def test_nothing_to_see(empty):
    assert detect_no_echo(empty) == NoEcho()


def test_every_beam_answers():
    assert detect_no_echo(scenes()) == NoEcho()


def test_a_wall_in_front_of_a_standing_robot_is_no_silence():
    one = next(scenes(1, far=5.0))
    one[85:95] = 12.34
    assert detect_no_echo([one] * 100) == NoEcho()


def test_a_room_around_a_standing_robot_is_no_silence():
    angles = np.linspace(-np.pi / 2, np.pi / 2, 181)
    wall = np.minimum(4.0 / np.maximum(np.cos(angles), 1e-6), 3.0 / np.maximum(np.abs(np.sin(angles)), 1e-6))
    one = np.round(wall, 2).astype(np.float32)
    assert detect_no_echo([one] * 100) == NoEcho()


def test_a_few_wild_ranges_do_not_hide_the_value():
    scans = list(scenes(silent=50.0))
    scans[3][7], scans[50][9] = 64.7, 61.4
    assert detect_no_echo(scans).value == 50.0


@given(st.lists(st.lists(st.floats(width=32), max_size=30), max_size=10))
def test_any_ranges_are_met_without_complaint(scans):
    found = detect_no_echo(np.float32(scan) for scan in scans)
    assert found.value is None or found.value > 0
    assert found.ceiling > 0
