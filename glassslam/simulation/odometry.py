"""Wheel odometry with a known drift (velocity motion model)."""

from collections.abc import Iterator

import numpy as np

from glassslam.geometry import wrap_angle
from glassslam.records import FloatArray, Odometry
from glassslam.simulation.drive import Motion
from glassslam.simulation.scene import OdometryModel

_DELAY = 0.001


def drifting_poses(motion: Motion, times: FloatArray, model: OdometryModel, seed: int) -> FloatArray:
    """Odometry poses at the given times.

    Over each interval the wheels measure the distance d and the turn a; what they report is
    d' = scale_d d + N(0, s_d^2 |d|),  a' = scale_a a + N(0, s_a^2 |a| + s_drift^2 |d|)
    and a sideways shift N(0, s_side^2 |a|): variances grow with the motion, whatever the rate.

    Parameters
    ----------
    motion : Motion
        The true motion.
    times : ndarray of float64, shape (n,)
        Increasing, s since the start.
    model : OdometryModel
        Scale errors and noise.
    seed : int
        Same seed, same drift.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Poses in the odometry frame, which is the base frame at the first time.
    """
    random = np.random.default_rng([seed, 1])
    true = motion.at(times)
    step = np.diff(true, axis=0)
    turn = step[:, 2]
    heading = true[:-1, 2] + 0.5 * turn
    distance = step[:, 0] * np.cos(heading) + step[:, 1] * np.sin(heading)
    noise = random.standard_normal((len(step), 3))
    moved, turned = np.abs(distance), np.abs(turn)
    forward = model.distance_scale * distance + noise[:, 0] * model.distance_noise * np.sqrt(moved)
    spread = np.sqrt(model.turn_noise**2 * turned + model.drift_noise**2 * moved)
    rotation = model.turn_scale * turn + noise[:, 1] * spread
    aside = noise[:, 2] * model.side_slip * np.sqrt(turned)
    theta = np.concatenate(([0.0], np.cumsum(rotation)))
    middle = theta[:-1] + 0.5 * rotation
    x = np.cumsum(forward * np.cos(middle) - aside * np.sin(middle))
    y = np.cumsum(forward * np.sin(middle) + aside * np.cos(middle))
    poses = np.zeros((len(times), 3))
    poses[1:, 0], poses[1:, 1] = x, y
    poses[:, 2] = wrap_angle(theta)
    return poses


def odometry_records(
    motion: Motion, model: OdometryModel, seed: int, start_time: float
) -> Iterator[Odometry]:
    """Odometry messages from the first to the last moment of the motion, in the order of their stamps."""
    times = np.arange(0.0, motion.times[-1], 1.0 / model.rate)
    poses = drifting_poses(motion, times, model, seed)
    for time, pose in zip(times, poses, strict=True):
        stamp = start_time + float(time)
        x, y, theta = (float(v) for v in pose)
        yield Odometry(stamp=stamp, pose=(x, y, theta), record_stamp=stamp + _DELAY)
