from dataclasses import replace

import numpy as np
import pytest
from optics_worlds import facing, look, many, plan_of

from detectors.labels import NO_RETURN, SOLID
from glassslam.errors import UsageError
from glassslam.simulation import LIDARS, lidar
from glassslam.simulation.materials import Material

UST = lidar("ust10lx")
N = 20_000


def measure(distance, cosine=1.0, reflectance=1.0, model=UST, seed=0):
    angle = np.rad2deg(np.arccos(cosine))
    table = {"sheet": Material(reflectance=reflectance)}
    return facing(
        many("sheet"), model, (distance, distance), (angle, angle), n=N, seed=seed, material_table=table
    )


@pytest.mark.parametrize("distance", [1.0, 8.0])
def test_the_noise_of_a_range_has_the_spread_of_the_sensor(distance):
    ranges = measure(distance).ranges
    expected = np.hypot(UST.noise_floor, UST.noise_slope * distance)
    assert ranges.mean() == pytest.approx(distance, abs=1e-3)
    assert ranges.std() == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("name", LIDARS)
def test_ranges_are_whole_steps_of_the_sensor(name):
    model = lidar(name)
    steps = measure(2.0, model=model).ranges.astype(float) / model.resolution
    assert np.abs(steps - np.round(steps)).max() < 2e-3


def test_a_beam_that_meets_nothing_gives_no_echo():
    seen = look(plan_of(("plaster", 0, 1, 1, 1)), UST, 0.5, 0.0, [-90.0] * 100)
    assert np.isposinf(seen.ranges).all()
    assert (seen.intensities == 0).all()
    assert set(seen.labels) == {NO_RETURN}
    assert set(seen.segment) == {-1}


def test_a_surface_beyond_the_range_gives_no_echo():
    bright = {"sheet": Material(kind="retroreflective", reflectance=1.0, retro=6.0)}
    near = facing(many("sheet"), UST, (29.0, 29.0), (0.0, 0.0), n=50, material_table=bright)
    far = facing(many("sheet"), UST, (31.0, 31.0), (0.0, 0.0), n=50, material_table=bright)
    assert np.isfinite(near.ranges).all()
    assert np.isposinf(far.ranges).all()


def test_a_dark_or_grazed_surface_is_lost_before_a_white_one():
    def share(**surface):
        return np.isfinite(measure(8.0, **surface).ranges).mean()

    assert share() == 1.0
    assert share(reflectance=0.1) == 0.0
    assert share(cosine=0.05) == 0.0
    assert 0.0 < share(reflectance=UST.weakest_echo * 64.0) < 1.0


@pytest.mark.parametrize("name", [name for name, model in LIDARS.items() if model.intensity_at_1m])
def test_intensity_follows_reflectance_incidence_and_range(name):
    model = lidar(name)

    def level(**surface):
        return np.median(measure(model=model, **surface).intensities)

    full = level(distance=1.0)
    assert full == pytest.approx(model.intensity_at_1m, rel=0.01)
    assert level(distance=1.0, reflectance=0.5) == pytest.approx(full / 2, rel=0.02)
    assert level(distance=1.0, cosine=0.5) == pytest.approx(full / 2, rel=0.02)
    assert level(distance=3.0) == pytest.approx(full * 3.0**-model.intensity_falloff, rel=0.02)


def test_a_beam_on_a_wall_is_solid_and_says_where_it_met_which_surface():
    plan = plan_of(("plaster", 0, -1, 4, -1), ("wood", 0, 2, 4, 2))
    seen = look(plan, UST, 1.5, 0.0, [90.0, -90.0])
    assert seen.labels.tolist() == [SOLID, SOLID]
    assert seen.segment.tolist() == [1, 0]
    assert seen.along == pytest.approx([1.5, 1.5])
    assert seen.mirrored.tolist() == [0, 0]


def test_intensities_saturate():
    assert measure(0.5, model=replace(UST, intensity_max=1000.0)).intensities.max() == 1000.0


def test_the_sick_reports_no_intensity():
    assert measure(1.0, model=lidar("lms200")).intensities.size == 0


def test_one_beam_does_not_change_the_noise_of_the_others():
    plan = plan_of(("plaster", 0, 3, 9, 3))
    one = look(plan, UST, 4.0, 0.0, [90.0] * 5, seed=4).ranges
    two = look(plan, UST, 4.0, 0.0, [90.0, -90.0, 90.0, 90.0, 90.0], seed=4).ranges
    assert np.isposinf(two[1])
    assert np.delete(one, 1).tolist() == np.delete(two, 1).tolist()


@pytest.mark.parametrize("name", LIDARS)
def test_every_lidar_is_consistent_and_says_where_its_figures_come_from(name):
    model = lidar(name)
    assert model.name == name
    assert model.beams * abs(model.angle_increment) <= 2 * np.pi + model.angle_increment
    assert model.sweep <= model.scan_period
    assert 0 < model.range_min < model.range_max
    assert any(source.startswith("panes: ") for source in model.sources)
    assert len(model.sources) >= 4


def test_an_unknown_lidar_is_refused():
    with pytest.raises(UsageError) as caught:
        lidar("vlp16")
    assert caught.value.message == "no lidar 'vlp16'"
    assert caught.value.hint == "known: ust10lx, utm30lx, lms200, rplidar"
