import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.simulation import LIDARS, lidar
from glassslam.simulation import optics_kernels as kernels
from glassslam.simulation.echo import receiver_of

cosine = st.floats(0.0, 1.0)
share = st.floats(0.0, 1.0)


def naive_scatter(c, reflectance, gloss, width, retro):
    return reflectance * c + gloss * math.exp(-(math.acos(c) ** 2) / (2 * width**2)) + retro


@given(cosine, share, st.floats(0, 3), st.floats(0.02, 1), st.floats(0, 6))
def test_scatter_agrees_with_the_naive_twin(c, reflectance, gloss, width, retro):
    expected = naive_scatter(c, reflectance, gloss, width, retro)
    assert kernels.scatter(c, reflectance, gloss, width, retro) == pytest.approx(expected, abs=1e-12)


@given(share)
def test_everything_is_mirrored_at_grazing_incidence_and_the_given_share_square_on(mirrored):
    assert kernels.fresnel(mirrored, 1.0) == pytest.approx(mirrored)
    assert kernels.fresnel(mirrored, 0.0) == pytest.approx(1.0)


@given(share, cosine, cosine)
def test_more_is_mirrored_the_more_slanted_the_beam(mirrored, a, b):
    low, high = sorted((a, b))
    assert kernels.fresnel(mirrored, low) >= kernels.fresnel(mirrored, high) - 1e-12


@given(st.floats(0.3, 30), st.floats(0, 3), st.floats(0, 3))
def test_the_halo_falls_with_incidence_and_with_range(path, a, b):
    low, high = sorted((a, b))
    assert kernels.halo(path, low) >= kernels.halo(path, high)
    assert kernels.halo(path, low) >= kernels.halo(1.5 * path, low)


@given(st.floats(0.5, 10), st.floats(0.0, 1.0))
def test_wide_angles_near_look_like_small_angles_far(path, offset):
    far = 2.0 * path
    near_level = kernels.halo(path, offset / path) * math.sqrt(1 + (path / 2) ** 2)
    far_level = kernels.halo(far, offset / far) * math.sqrt(1 + (far / 2) ** 2)
    assert near_level == pytest.approx(far_level)


def test_the_spike_is_widened_by_the_lens_when_near_and_by_the_beam_when_far():
    model = lidar("utm30lx")

    def width(path):
        angles = np.linspace(0, 0.03, 3001)
        levels = [kernels.spike(path, math.tan(a), model.aperture, model.divergence) for a in angles]
        return angles[np.argmax(np.array(levels) < 0.5 * levels[0])]

    assert width(0.5) > 2 * width(10.0)
    assert width(10.0) == pytest.approx(math.sqrt(2 * math.log(2)) * model.divergence, rel=0.02)


def test_the_numbers_of_a_lattice_are_nearly_normal_and_do_not_depend_on_their_neighbours():
    numbers = np.array([[kernels.lattice(seed, place) for place in range(-200, 200)] for seed in range(20)])
    assert numbers.mean() == pytest.approx(0.0, abs=0.03)
    assert numbers.std() == pytest.approx(1.0, abs=0.03)
    assert abs(np.corrcoef(numbers[:, :-1].ravel(), numbers[:, 1:].ravel())[0, 1]) < 0.04
    assert abs(np.corrcoef(numbers[:-1].ravel(), numbers[1:].ravel())[0, 1]) < 0.04


def test_patches_vary_slowly_and_keep_the_spread():
    places = np.arange(0, 400, 0.05)
    values = np.array([kernels.patchy(7, place) for place in places])
    assert values.std() == pytest.approx(1.0, abs=0.12)
    assert np.abs(np.diff(values)).max() < 0.35
    assert kernels.patchy(7, 3.0) == kernels.lattice(7, 3)


def naive_pane_level(path, angle, lean, haze, glint, seed, along, r):
    upright = math.tan(lean) ** 2
    tangent = math.sqrt(math.tan(angle) ** 2 + upright)
    dirt = math.exp(0.25 * kernels.patchy(2 * seed, along / 0.3))
    d = path * tangent
    halo = (0.93 * math.exp(-3.7 * d) + 0.068 * math.exp(-0.45 * d)) / math.hypot(1, path / 2)
    aside = r.glint_wander * kernels.patchy(4 * seed + 1, along / 0.12)
    up = 0.8 * kernels.lattice(4 * seed + 2, 0) + 0.6 * kernels.patchy(4 * seed + 3, along / 0.12)
    off = math.atan(math.hypot(math.tan(angle + aside), math.tan(lean + r.glint_wander * up)))
    width = math.hypot(r.aperture / (2 * path), r.divergence)
    spike = 3.3 * math.exp(-0.5 * (off / width) ** 2)
    return r.glint_gain * (haze * dirt * halo + glint * spike)


@given(
    st.sampled_from(list(LIDARS)), st.floats(0.3, 20), st.floats(-1.4, 1.4), st.floats(-0.3, 0.3),
    share, share, st.integers(0, 500), st.floats(0, 3),
)  # fmt: skip
def test_the_level_of_a_pane_agrees_with_the_naive_twin(name, path, angle, lean, haze, glint, seed, along):
    receiver = receiver_of(lidar(name))
    expected = naive_pane_level(path, angle, lean, haze, glint, seed, along, receiver)
    found = kernels.pane_level(path, angle, lean, haze, glint, seed, along, receiver)
    assert found == pytest.approx(expected, rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("flicker", [-2.0, 0.0, 2.0])
def test_an_echo_counts_from_the_limits_of_the_lidar_on(flicker):
    receiver = receiver_of(lidar("utm30lx"))
    limit = receiver.weakest_echo * 4.0 / math.exp(receiver.intensity_noise * flicker)
    assert kernels.surface_is_heard(1.001 * limit, 2.0, flicker, receiver)
    assert not kernels.surface_is_heard(0.999 * limit, 2.0, flicker, receiver)
    level = receiver.weakest_glint / math.exp(0.05 * flicker)
    assert kernels.pane_is_heard(1.001 * level, flicker, receiver)
    assert not kernels.pane_is_heard(0.999 * level, flicker, receiver)
