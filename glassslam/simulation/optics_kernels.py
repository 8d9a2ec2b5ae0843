"""Kernels of optics: how strongly a surface answers a beam, and what it mirrors."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from glassslam.accelerate import kernel
from glassslam.records import FloatArray

_HALO_NEAR, _HALO_NEAR_FALL = 0.93, 3.7
_HALO_WIDE, _HALO_WIDE_FALL = 0.068, 0.45
_HALO_SPREAD = 2.0
_SPIKE = 3.3
_PATCH, _PATCH_SPREAD = 0.3, 0.25
_WANDER_PATCH = 0.12
_OF_PANE, _OF_PATCH = 0.8, 0.6
_PANE_FLICKER = 0.05


class Surfaces(NamedTuple):
    """What every segment of a plan is made of, one entry per segment (angles in rad)."""

    reflectance: FloatArray
    gloss: FloatArray
    gloss_width: FloatArray
    retro: FloatArray
    mirrored: FloatArray
    haze: FloatArray
    glint: FloatArray
    lean: FloatArray
    """Angle of the surface with the vertical, rad."""
    glass: NDArray[np.bool_]
    sends_on: NDArray[np.bool_]
    """Whether a beam goes on from here, mirrored or through."""


class Receiver(NamedTuple):
    """The figures of a lidar that decide what it hears (see `LidarModel`)."""

    range_max: float
    weakest_echo: float
    intensity_falloff: float
    intensity_noise: float
    glint_gain: float
    weakest_glint: float
    glint_wander: float
    aperture: float
    divergence: float
    strongest: bool
    """Whether the strongest echo is reported, else the first."""


@kernel
def fresnel(mirrored: float, cosine: float) -> float:
    """Share mirrored at an incidence, from the share at normal incidence (Schlick)."""
    return mirrored + (1.0 - mirrored) * (1.0 - cosine) ** 5


@kernel
def lattice(seed: int, index: int) -> float:
    """Nearly normal number of unit variance that belongs to a place of an endless lattice."""
    z = np.uint64(seed) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(index) * np.uint64(0xD1B54A32D192ED03)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    total = 0.0
    for part in range(4):
        total += float((z >> np.uint64(16 * part)) & np.uint64(0xFFFF)) / 65536.0
    return float((total - 2.0) * np.sqrt(3.0))


@kernel
def patchy(seed: int, position: float) -> float:
    """Nearly normal number that varies slowly with the position, given in patches."""
    cell = int(np.floor(position))
    w = position - cell
    a, b = lattice(seed, cell), lattice(seed, cell + 1)
    return float(((1.0 - w) * a + w * b) / np.sqrt((1.0 - w) ** 2 + w**2))


@kernel
def scatter(cosine: float, reflectance: float, gloss: float, gloss_width: float, retro: float) -> float:
    """Level of an opaque surface against white paper square on: Lambert, gloss lobe, retroreflection."""
    angle = np.arccos(min(cosine, 1.0))
    return float(reflectance * cosine + gloss * np.exp(-0.5 * (angle / gloss_width) ** 2) + retro)


@kernel
def halo(path: float, tangent: float) -> float:
    """Level of the light a pane sends beside its mirror direction.

    The mirrored bundle comes back beside the receiver by an offset that grows as the range times the
    tangent of incidence, so one curve over this offset holds for wide angles near and small ones far.
    """
    offset = path * tangent
    near = _HALO_NEAR * np.exp(-_HALO_NEAR_FALL * offset)
    wide = _HALO_WIDE * np.exp(-_HALO_WIDE_FALL * offset)
    return float((near + wide) / np.sqrt(1.0 + (path / _HALO_SPREAD) ** 2))


@kernel
def spike(path: float, tangent: float, aperture: float, divergence: float) -> float:
    """Level of the mirrored bundle itself: narrow, widened by the lens when near and by the beam when far."""
    width = np.sqrt((aperture / (2.0 * path)) ** 2 + divergence**2)
    return float(_SPIKE * np.exp(-0.5 * (np.arctan(tangent) / width) ** 2))


@kernel
def pane_level(
    path: float,
    angle: float,
    lean: float,
    haze: float,
    glint: float,
    seed: int,
    along: float,
    receiver: Receiver,
) -> float:
    """Level of a pane at a signed incidence (rad) and a place along it (m), before the fall with range."""
    upright = np.tan(lean) ** 2
    dirt = np.exp(_PATCH_SPREAD * patchy(2 * seed, along / _PATCH))
    glow = haze * dirt * halo(path, np.sqrt(np.tan(angle) ** 2 + upright))
    sideways = upward = 0.0
    if receiver.glint_wander > 0.0:
        sideways = receiver.glint_wander * patchy(4 * seed + 1, along / _WANDER_PATCH)
        # A part belongs to the whole pane: a pane that leans badly is missed from end to end.
        upward = _OF_PANE * lattice(4 * seed + 2, 0) + _OF_PATCH * patchy(4 * seed + 3, along / _WANDER_PATCH)
        upward *= receiver.glint_wander
    tangent = np.sqrt(np.tan(angle + sideways) ** 2 + np.tan(lean + upward) ** 2)
    flash = glint * spike(path, tangent, receiver.aperture, receiver.divergence)
    return float(receiver.glint_gain * (glow + flash))


@kernel
def pane_is_heard(level: float, flicker: float, receiver: Receiver) -> bool:
    """Whether a pane of that level, range included, gives an echo; flicker is a normal number."""
    return bool(level * np.exp(_PANE_FLICKER * flicker) >= receiver.weakest_glint)


@kernel
def surface_is_heard(share: float, path: float, flicker: float, receiver: Receiver) -> bool:
    """Whether light scattered into the half space gives an echo: its power falls with the range squared."""
    power = share * np.exp(receiver.intensity_noise * flicker) / path**2
    return bool(power >= receiver.weakest_echo)
