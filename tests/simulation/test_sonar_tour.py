"""tools/sonar_tour.py: a real run becomes the path and the world of a recording with sonars."""

import numpy as np
import pytest
import sonar_tour as tool
from rosbags.highlevel import AnyReader
from tiny_scene import scene

from glassslam.errors import UsageError
from glassslam.evaluation import read_map
from glassslam.geometry import inverse, transform_points
from glassslam.outputs import read_tum, write_map, write_tum
from glassslam.records import Trajectory
from glassslam.simulation import draw_true_map, simulate


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Results of a run that went around a pillar for half a minute, with one step back in time."""
    folder = tmp_path_factory.mktemp("run")
    outline = simulate(scene()).plan.segments
    pillar = np.array(
        [[2.5, 2.5, 3.5, 2.5], [3.5, 2.5, 3.5, 3.5], [3.5, 3.5, 2.5, 3.5], [2.5, 3.5, 2.5, 2.5]]
    )
    walls = 0.025 + np.vstack((outline, pillar))
    angle = np.linspace(-np.pi, np.pi, 301)
    poses = np.stack((3 + 1.5 * np.cos(angle), 3 + 1.5 * np.sin(angle), angle + np.pi / 2), axis=1)
    drawn = draw_true_map(walls, np.zeros(len(walls), dtype=bool), poses[:, :2])
    write_map(drawn.grid, folder / "map.yaml")
    stamps = 1e9 + 0.1 * np.arange(301)
    stamps[100] -= 0.5
    write_tum(Trajectory(stamps, poses), folder / "trajectory.tum")
    return folder


def test_the_path_is_even_and_smooth_and_turns_the_short_way(run):
    motion = tool.motion_of(read_tum(run / "trajectory.tum"), 5.0, 20.0)
    assert np.diff(motion.times) == pytest.approx(np.full(motion.times.size - 1, 0.02))
    assert np.hypot(*(motion.poses[50:-50, :2] - 3.0).T) == pytest.approx(1.5, abs=0.02)
    assert motion.speeds[50:-50] == pytest.approx(2 * np.pi * 1.5 / 30.0, abs=0.02)
    assert motion.yaw_rates[50:-50] == pytest.approx(2 * np.pi / 30.0, abs=0.02)
    with pytest.raises(UsageError, match=r"the run lasts 0\.4 minutes from there on"):
        tool.motion_of(read_tum(run / "trajectory.tum"), 5.0, 60.0)


def test_jumps_no_robot_makes_are_left_out():
    poses = np.zeros((50, 3))
    poses[:, 0] = 0.05 * np.arange(50)
    poses[20, 0] = 40.0
    motion = tool.motion_of(Trajectory(0.1 * np.arange(50), poses), 0.0, 4.0)
    assert motion.poses[:, 0].max() < 2.1


def test_the_world_is_the_outline_of_the_map_without_what_stands_on_the_path(draw_map):
    grid = draw_map(
        """
        ############
        #..........#
        #..........#
        #....##....#
        #..........#
        ############
        """,
        resolution=0.5,
    )
    whole = list(tool.world_of(grid, np.empty((0, 2))))
    assert max(np.ptp(outline, axis=0).tolist() for outline in whole) == [5.5, 2.5]
    assert not any((np.abs(outline - [3.0, 1.25]).max() < 0.6) for outline in whole), "a speck of two cells"
    kept = np.concatenate(list(tool.world_of(grid, np.array([[0.25, 1.25]]))))
    assert not (np.hypot(*(kept - [0.25, 1.25]).T) < 0.4).any()


@pytest.mark.parametrize(
    ("sweeps", "together", "period_ms"), [(125, 1, 30.0), (666, 6, 30.0), (200, 2, 37.5)]
)
def test_so_many_sonars_fire_together_as_the_sweeps_need(sweeps, together, period_ms):
    model = tool.sonars_of(tool.Tour(minutes=1.0, sweeps=sweeps))
    assert model.fired_together == together
    assert 1000 * model.firing_period == pytest.approx(period_ms, abs=0.5)
    assert model.sweep_period == pytest.approx(60.0 / sweeps)


def test_sound_is_too_slow_for_some_wishes():
    with pytest.raises(UsageError, match=r"a sweep of 0\.006 s is too short for sound"):
        tool.sonars_of(tool.Tour(minutes=1.0, sweeps=10_000))


def test_a_tour_is_a_recording_with_laser_odometry_and_sonars(run, tmp_path, capsys):
    words = [str(run), "-o", str(tmp_path), "--minutes", "0.4", "--sweeps", "266", "--lidar", "rplidar"]
    assert tool.main(words) == 0
    assert (
        "120 scans of a rplidar, 266 sweeps of 16 sonars (6 fired together every 30 ms)"
        in capsys.readouterr().out
    )
    with AnyReader([tmp_path / "tour.bag"]) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        ranges = [
            reader.deserialize(raw, connection.msgtype).range
            for connection, _, raw in reader.messages()
            if connection.topic == "/sonar_00"
        ]
    assert counts["/scan"] == 120
    assert {counts[f"/sonar_{k:02d}"] for k in range(16)} <= {266, 267}
    # the left sonar looks at the pillar, 1 m to its nearest face at most, or past its corners
    assert 0.6 < np.nanmedian(ranges) < 1.2
    truth = read_map(tmp_path / "tour.bag.truth.map.yaml")
    first = read_tum(tmp_path / "tour.bag.truth.tum").poses[0]
    place = transform_points(inverse(first), np.array([[5.0, 5.0]]))[0]
    column, row = np.floor((place - truth.origin) / truth.resolution).astype(int)
    assert truth.probability[row, column] == 0.0


def test_what_cannot_be_toured_is_one_clear_line(run, tmp_path, capsys):
    assert tool.main([str(run), "-o", str(tmp_path), "--minutes", "3"]) == 2
    assert capsys.readouterr().err.startswith("error: the run lasts 0.5 minutes")
    assert tool.main([str(tmp_path), "-o", str(tmp_path)]) == 1
    assert "cannot read" in capsys.readouterr().err
