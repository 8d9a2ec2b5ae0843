"""What a lidar reports of the surfaces its beams met: ranges and intensities."""

import numpy as np

from glassslam.records import Float32Array, FloatArray
from glassslam.simulation.raycast import Hits
from glassslam.simulation.sensors import LidarModel


def echoes(
    hits: Hits, reflectance: FloatArray, model: LidarModel, random: np.random.Generator
) -> tuple[Float32Array, Float32Array]:
    """Ranges and intensities of beams on diffuse surfaces.

    A beam square on a white surface gives back light in proportion to 1 / r^2; reflectance and the
    cosine of incidence (Lambert) weaken it, and an echo below the sensor's limit is lost.

    Parameters
    ----------
    hits : Hits
        What n beams met.
    reflectance : ndarray of float64, shape (n,)
        Reflectance of the surface met; any value where there is none.
    model : LidarModel
        Noise, resolution and limits.
    random : numpy.random.Generator
        Three draws per beam, whatever it met, so that one beam does not change the noise of others.

    Returns
    -------
    ranges : ndarray of float32, shape (n,)
        Metres; +inf where no echo came back.
    intensities : ndarray of float32, shape (n,) or (0,)
        Echo strength, 0 where no echo came back; empty when the lidar reports none.
    """
    noise = random.standard_normal((3, hits.distance.size))
    met = hits.segment >= 0
    distance = np.where(met, hits.distance, 1.0)
    share = np.where(met, reflectance * hits.cosine, 0.0)
    flicker = np.exp(model.intensity_noise * noise[0])
    seen = met & (distance <= model.range_max) & (share * flicker / distance**2 >= model.weakest_echo)
    spread = np.hypot(model.noise_floor, model.noise_slope * distance)
    measured = np.round((distance + spread * noise[1]) / model.resolution) * model.resolution
    seen &= (measured >= model.range_min) & (measured <= model.range_max)
    ranges = np.where(seen, measured, np.inf).astype(np.float32)
    if model.intensity_at_1m == 0.0:
        return ranges, np.empty(0, dtype=np.float32)
    level = model.intensity_at_1m * share * distance**-model.intensity_falloff
    level *= np.exp(model.intensity_noise * noise[2])
    return ranges, np.where(seen, np.clip(np.round(level), 1, model.intensity_max), 0).astype(np.float32)
