import math

import numpy as np
import pytest
import scan_worlds
from scan_worlds import SENSOR, STEP, bearings, inside, pane, wall

from detectors.calibrated_peak import calibrated_peak
from detectors.labels import GHOST, GLASS, NO_RETURN, SOLID


def detect(world, calibration=SENSOR, **options):
    ranges, intensities = world
    angle_min = float(scan_worlds.bearings()[0])
    return calibrated_peak(ranges, intensities, angle_min, STEP, calibration=calibration, **options)


def replaced(base, other, mask):
    """The first world with the beams of a mask taken from the second."""
    return np.where(mask, other[0], base[0]), np.where(mask, other[1], base[1])


@pytest.mark.parametrize("distance", [0.8, 1.2, 2.0])
@pytest.mark.parametrize("normal_deg", [-40, 0, 25])
def test_a_pane_is_found_where_it_stands(distance, normal_deg):
    normal = math.radians(normal_deg)
    found = detect(pane(distance, normal=normal))
    assert len(found) > 0
    assert (found.probability > 0.9).all()
    np.testing.assert_allclose(np.degrees(found.normal), normal_deg, atol=1.0)
    away = found.range * np.cos(found.bearing - normal)
    np.testing.assert_allclose(away, distance, atol=0.015)
    np.testing.assert_allclose(found.incidence, np.abs(found.bearing - found.normal))


def test_its_pieces_prove_the_whole_part_that_answers_and_no_more():
    found = detect(pane(1.2))
    along = 1.2 * np.tan(found.bearing - found.normal)
    reach = 1.2 * math.tan(math.radians(28.0))
    assert along.min() - found.extent[along.argmin()] == pytest.approx(-reach, abs=0.02)
    assert along.max() + found.extent[along.argmax()] == pytest.approx(reach, abs=0.02)
    assert 2.0 * found.extent.sum() == pytest.approx(2.0 * reach, rel=0.05)
    assert (found.extent <= 0.16).all()


def test_every_return_of_the_pane_is_labelled_and_nothing_else():
    labels = detect(pane(1.2)).labels
    answered = np.isfinite(pane(1.2)[0])
    assert (labels[~answered] == NO_RETURN).all()
    assert np.mean(labels[answered] == GLASS) > 0.98


def test_the_uncertainties_are_those_of_a_good_line():
    found = detect(pane(1.2, noise=0.02))
    assert (found.position_sigma < 0.02).all()
    assert (found.normal_sigma < math.radians(2.0)).all()
    assert (found.position_sigma >= 0.005).all()


def test_a_matte_wall_is_none():
    assert len(detect(wall())) == 0


def test_nor_is_a_dark_one():
    assert len(detect(wall(level=0.1))) == 0


def test_glossy_paint_shines_over_a_bright_floor():
    ranges, intensities = wall()
    shine = 1.0 + 4.0 * np.exp(-((bearings() / math.radians(4.0)) ** 2))
    assert len(detect((ranges, intensities * shine))) == 0


def test_polished_metal_shines_over_a_dark_floor():
    ranges, intensities = wall()
    shine = 0.01 + 2.5 * np.exp(-0.5 * (bearings() / math.radians(3.0)) ** 2)
    assert len(detect((ranges, intensities * shine))) == 0


def test_a_retroreflector_on_a_wall_has_no_faint_shoulders():
    shine = wall(level=5.0)
    assert len(detect(replaced(wall(), shine, inside(-4, 4)))) == 0


def test_a_post_with_nothing_behind_it_is_none():
    nothing = np.full(bearings().size, np.inf), np.zeros(bearings().size)
    assert len(detect(replaced(nothing, wall(level=1.0), inside(-2, 2)))) == 0


def test_a_mullion_before_the_pane_is_solid():
    mullion = inside(8, 11)
    found = detect(replaced(pane(1.2), wall(1.12, level=2.0), mullion))
    assert len(found) > 0
    assert (found.labels[mullion] == SOLID).all()
    assert (found.labels[inside(13, 20)] == GLASS).mean() > 0.95


def test_a_frame_flush_with_the_pane_is_too_bright_to_be_glass():
    frame = inside(14, 17)
    found = detect(replaced(pane(1.2), wall(1.2), frame))
    assert (found.labels[frame] == SOLID).all()
    assert (found.labels[inside(18, 24)] == GLASS).mean() > 0.95


def test_a_mullion_that_hides_the_foot_does_not_hide_the_pane():
    found = detect(replaced(pane(1.2), wall(1.12, level=2.0), inside(-2, 2)))
    assert len(found) > 0
    np.testing.assert_allclose(np.degrees(found.normal), 0.0, atol=2.0)


def test_one_shoulder_is_enough_where_the_other_is_hidden():
    found = detect(replaced(pane(1.2), wall(0.7), inside(-90, -4)))
    assert len(found) > 0
    assert (found.bearing > math.radians(-5)).all()


def test_but_not_where_the_other_is_a_bright_wall_in_the_same_plane():
    both = detect(pane(1.2)).probability.max()
    beside = detect(replaced(pane(1.2), wall(1.2), inside(-90, -4)))
    assert len(beside) == 0 or beside.probability.max() < min(both, 0.9)


def test_returns_through_the_pane_are_ghosts():
    behind = inside(-20, -12)
    world = replaced(pane(1.2), wall(3.0), behind)
    found = detect(world)
    assert (found.labels[behind] == GHOST).all()


def test_what_stands_before_the_pane_is_solid():
    leg = inside(-20, -18)
    found = detect(replaced(pane(1.2), wall(0.8, level=0.3), leg))
    assert (found.labels[leg] == SOLID).all()


def lone_peak(level=3.0, bearing_deg=0.0, distance=4.0):
    """A wall to the right of a mirror peak of three beams far away."""
    ranges, intensities = wall(2.0, half_deg=180.0, normal=math.pi / 2)
    degrees = np.degrees(bearings(180.0))
    peak = np.abs(degrees - bearing_deg) < 0.3
    return np.where(peak, distance, ranges), np.where(peak, 4000.0 * level, intensities)


def detect_around(world, **options):
    return calibrated_peak(*world, -math.pi, STEP, calibration=SENSOR, **options)


def test_a_far_pane_is_its_mirror_peak_parallel_to_a_wall():
    found = detect_around(lone_peak(bearing_deg=-90.0))
    assert np.degrees(found.bearing) == pytest.approx([-90.0], abs=0.3)
    assert found.strength == pytest.approx([3.0])
    assert found.range == pytest.approx([4.0])


@pytest.mark.parametrize("world", [lone_peak(level=1.0, bearing_deg=-90.0), lone_peak(bearing_deg=-60.0)])
def test_a_dim_or_slanting_one_is_not(world):
    assert len(detect_around(world)) == 0


def test_panes_beyond_the_limit_are_not_looked_for():
    assert len(detect(pane(1.2), range_limit=1.0)) == 0


def test_only_probable_panes_are_given():
    everything = detect(pane(1.2), min_probability=0.0)
    assert len(detect(pane(1.2), min_probability=0.999)) == 0
    assert len(everything) >= len(detect(pane(1.2)))


def test_a_scan_recorded_the_other_way_round_says_the_same():
    ranges, intensities = pane(1.2, normal=0.3)
    forward = detect((ranges, intensities))
    angle = float(bearings()[-1])
    backward = calibrated_peak(ranges[::-1], intensities[::-1], angle, -STEP, calibration=SENSOR)
    order = np.argsort(backward.bearing)
    np.testing.assert_array_equal(backward.labels[::-1], forward.labels)
    np.testing.assert_array_equal(ranges.size - 1 - backward.beam[order], forward.beam)
    np.testing.assert_allclose(backward.normal[order], forward.normal, atol=1e-9)


def test_the_unit_of_the_intensities_does_not_matter():
    from dataclasses import replace

    from detectors.diffuse import DiffuseCurve

    ranges, intensities = pane(1.2)
    other = replace(SENSOR, diffuse=DiffuseCurve((1.0,), (1000.0,)))
    assert detect((ranges, 0.25 * intensities), other) == detect((ranges, intensities))


@pytest.mark.parametrize("fill", [np.inf, np.nan, 0.0])
def test_scans_without_any_return(fill):
    found = detect((np.full(721, fill), np.zeros(721)))
    assert len(found) == 0
    assert SOLID not in found.labels


def test_an_empty_scan():
    assert len(calibrated_peak([], [], 0.0, STEP, calibration=SENSOR)) == 0
