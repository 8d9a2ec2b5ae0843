from dataclasses import replace

import numpy as np
import pytest

from glassslam.errors import UsageError
from glassslam.simulation import LIDARS, lidar
from glassslam.simulation.echo import echoes
from glassslam.simulation.raycast import Hits

UST = lidar("ust10lx")
N = 20_000


def beams(distance, cosine=1.0, met=True, n=N):
    segment = np.full(n, 0 if met else -1)
    return Hits(np.full(n, np.inf if not met else distance), segment, np.full(n, cosine if met else 0.0))


def measure(distance, cosine=1.0, reflectance=1.0, model=UST, seed=0, n=N):
    random = np.random.default_rng(seed)
    return echoes(beams(distance, cosine, n=n), np.full(n, reflectance), model, random)


@pytest.mark.parametrize("distance", [1.0, 8.0])
def test_the_noise_of_a_range_has_the_spread_of_the_sensor(distance):
    ranges, _ = measure(distance)
    expected = np.hypot(UST.noise_floor, UST.noise_slope * distance)
    assert ranges.mean() == pytest.approx(distance, abs=1e-3)
    assert ranges.std() == pytest.approx(expected, rel=0.03)


@pytest.mark.parametrize("name", LIDARS)
def test_ranges_are_whole_steps_of_the_sensor(name):
    model = lidar(name)
    ranges, _ = measure(2.0, model=model)
    steps = ranges.astype(float) / model.resolution
    assert np.abs(steps - np.round(steps)).max() < 2e-3


def test_a_beam_that_meets_nothing_gives_no_echo():
    ranges, intensities = echoes(beams(0, met=False), np.ones(N), UST, np.random.default_rng(0))
    assert np.isposinf(ranges).all()
    assert (intensities == 0).all()


def test_a_surface_beyond_the_range_gives_no_echo():
    assert np.isposinf(measure(31.0)[0]).all()


def test_a_dark_or_grazed_surface_is_lost_before_a_white_one():
    def share(**surface):
        return np.isfinite(measure(8.0, **surface)[0]).mean()

    assert share() == 1.0
    assert share(reflectance=0.1) == 0.0
    assert share(cosine=0.05) == 0.0
    assert 0.0 < share(reflectance=UST.weakest_echo * 64.0) < 1.0


@pytest.mark.parametrize("name", [name for name, model in LIDARS.items() if model.intensity_at_1m])
def test_intensity_follows_reflectance_incidence_and_range(name):
    model = lidar(name)

    def level(**surface):
        return np.median(measure(model=model, **surface)[1])

    full = level(distance=1.0)
    assert full == pytest.approx(model.intensity_at_1m, rel=0.01)
    assert level(distance=1.0, reflectance=0.5) == pytest.approx(full / 2, rel=0.02)
    assert level(distance=1.0, cosine=0.5) == pytest.approx(full / 2, rel=0.02)
    assert level(distance=3.0) == pytest.approx(full * 3.0**-model.intensity_falloff, rel=0.02)


def test_intensities_saturate():
    model = replace(UST, intensity_max=1000.0)
    assert measure(0.5, model=model)[1].max() == 1000.0


def test_the_sick_reports_no_intensity():
    assert measure(1.0, model=lidar("lms200"))[1].size == 0


def test_one_beam_does_not_change_the_noise_of_the_others():
    hits = beams(3.0, n=5)
    hidden = Hits(np.array([3, np.inf, 3, 3, 3.0]), np.array([0, -1, 0, 0, 0]), np.array([1, 0, 1, 1, 1.0]))
    one, _ = echoes(hits, np.ones(5), UST, np.random.default_rng(4))
    two, _ = echoes(hidden, np.ones(5), UST, np.random.default_rng(4))
    assert np.delete(one, 1).tolist() == np.delete(two, 1).tolist()


@pytest.mark.parametrize("name", LIDARS)
def test_every_lidar_is_consistent_and_says_where_its_figures_come_from(name):
    model = lidar(name)
    assert model.name == name
    assert model.beams * abs(model.angle_increment) <= 2 * np.pi + model.angle_increment
    assert model.sweep <= model.scan_period
    assert 0 < model.range_min < model.range_max
    assert len(model.sources) >= 3


def test_an_unknown_lidar_is_refused():
    with pytest.raises(UsageError) as caught:
        lidar("vlp16")
    assert caught.value.message == "no lidar 'vlp16'"
    assert caught.value.hint == "known: ust10lx, utm30lx, lms200, rplidar"
