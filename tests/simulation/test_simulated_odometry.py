import numpy as np
import pytest

from glassslam.simulation.drive import Motion
from glassslam.simulation.odometry import drifting_poses, odometry_records
from glassslam.simulation.scene import OdometryModel

EXACT = OdometryModel(
    distance_scale=1.0, turn_scale=1.0, distance_noise=0, turn_noise=0, drift_noise=0, side_slip=0
)
TIMES = np.arange(0.0, 10.0, 0.02)


def straight(metres=9.0):
    poses = np.stack((metres * TIMES / TIMES[-1], 0 * TIMES, 0 * TIMES), axis=1)
    return Motion(TIMES, poses, 0 * TIMES, 0 * TIMES)


def circle(turn=2 * np.pi, radius=1.0):
    heading = turn * TIMES / TIMES[-1]
    poses = np.stack((radius * np.sin(heading), radius * (1 - np.cos(heading)), heading), axis=1)
    return Motion(TIMES, poses, 0 * TIMES, 0 * TIMES)


def ends(motion, model, seeds=400):
    return np.array([drifting_poses(motion, TIMES, model, seed)[-1] for seed in range(seeds)])


def test_without_errors_odometry_is_the_motion_seen_from_the_start():
    assert drifting_poses(straight(), TIMES, EXACT, 0)[-1] == pytest.approx([9.0, 0, 0])
    assert drifting_poses(circle(), TIMES, EXACT, 0)[-1] == pytest.approx([0, 0, 0], abs=1e-3)


def test_scale_errors_are_systematic():
    long = EXACT.model_copy(update={"distance_scale": 1.01})
    assert drifting_poses(straight(), TIMES, long, 0)[-1, 0] == pytest.approx(9.09)
    slipping = EXACT.model_copy(update={"turn_scale": 0.9})
    assert drifting_poses(circle(np.pi / 2), TIMES, slipping, 0)[-1, 2] == pytest.approx(0.9 * np.pi / 2)


@pytest.mark.parametrize(
    ("noise", "motion", "axis", "expected"),
    [
        ({"distance_noise": 0.02}, straight(), 0, 0.02 * np.sqrt(9.0)),
        ({"drift_noise": 0.01}, straight(), 2, 0.01 * np.sqrt(9.0)),
        ({"turn_noise": 0.03}, circle(1.5, 0.0), 2, 0.03 * np.sqrt(1.5)),
    ],
)
def test_noise_grows_with_the_root_of_the_motion(noise, motion, axis, expected):
    spread = ends(motion, EXACT.model_copy(update=noise))[:, axis].std()
    assert spread == pytest.approx(expected, rel=0.15)


def test_slip_shifts_the_robot_aside_only_where_it_turns():
    slip = EXACT.model_copy(update={"side_slip": 0.02})
    assert np.abs(ends(straight(), slip, 20)[:, 1]).max() == 0.0
    turned = ends(circle(1.5, 0.0), slip)
    assert np.hypot(turned[:, 0].std(), turned[:, 1].std()) == pytest.approx(0.02 * np.sqrt(1.5), rel=0.15)


def test_the_drift_does_not_depend_on_the_rate():
    noisy = EXACT.model_copy(update={"drift_noise": 0.01})
    sparse = [drifting_poses(straight(), TIMES[::25], noisy, seed)[-1, 2] for seed in range(400)]
    assert np.std(sparse) == pytest.approx(ends(straight(), noisy)[:, 2].std(), rel=0.15)


def test_records_carry_stamps_at_the_rate_of_the_model():
    records = list(odometry_records(straight(), OdometryModel(rate=10.0), seed=1, start_time=100.0))
    assert len(records) == 100
    assert records[0].pose == (0.0, 0.0, 0.0)
    assert [r.stamp for r in records[:3]] == pytest.approx([100.0, 100.1, 100.2])
    assert all(r.record_stamp > r.stamp for r in records)
