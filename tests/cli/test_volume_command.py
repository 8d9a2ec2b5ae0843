"""`glassslam volume`: what it reads, writes and says."""

import json
import math
import time
from itertools import pairwise

import numpy as np
import pytest

from glassslam.cli.app import main
from glassslam.cli.standing import Standing
from glassslam.cli.volume import _followed
from glassslam.config import Config
from glassslam.outputs import read_map
from glassslam.records import LaserScan, Odometry, PointSet, RecordingInfo
from glassslam.simulation import Scene, simulate, write_recording
from glassslam.volume.storage import load_volume

ROOM = {
    "name": "room",
    "walls": [
        {"name": "room", "material": "plaster", "points": [[0, 0], [6, 0], [6, 6], [0, 6]], "closed": True}
    ],
    "posts": [
        {"name": "lamp", "material": "wood", "radius": 0.2, "at": [[4.5, 3]], "z_low": 0.8, "z_high": 1.2}
    ],
    "drive": {"waypoints": [{"at": [2, 3]}, {"at": [4, 3]}]},
    "ultrasonic": {},
    "laser_height": 0.35,
}
FILES = [
    "volume.npz",
    "volume.bt",
    "volume.ply",
    "volume.png",
    "slices.png",
    "volume_map.yaml",
    "volume_map.pgm",
]


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """A recording with scans and points, its truth beside it."""
    path = tmp_path_factory.mktemp("bags") / "room.bag"
    write_recording(simulate(Scene.model_validate(ROOM), "rplidar"), path)
    return path


def truth(bag):
    return str(bag.with_name("room.bag.truth.tum"))


@pytest.fixture
def command(bag, tmp_path):
    """A volume of the recording along its true trajectory, into `run`."""
    return ["volume", str(bag), "--trajectory", truth(bag), "-o", str(tmp_path / "run")]


def test_a_recording_becomes_a_volume(command, tmp_path, capsys):
    assert main(command) == 0
    out = capsys.readouterr().out
    assert sorted(path.name for path in (tmp_path / "run").iterdir()) == sorted(FILES)
    assert all(f"wrote {tmp_path / 'run' / name}\n" in out for name in FILES)
    assert "occupied voxels of 0.05 m" in out


def test_the_map_holds_the_lamp_and_the_volume_its_height(command, tmp_path):
    main(command)
    grid = read_map(tmp_path / "run" / "volume_map.yaml")
    column, row = (int((v - o) / 0.05) for v, o in zip((4.3, 3.0), grid.origin, strict=True))
    assert (grid.probability[row - 2 : row + 3, column - 1 : column + 2] == 1.0).any()
    tree = load_volume(tmp_path / "run" / "volume.npz")
    centres = tree.centres(tree.occupied().voxels())
    centres = centres[(centres[:, 2] > 0.2) & (centres[:, 2] < 2.3)]  # neither floor nor ceiling
    lamp = centres[(abs(centres[:, 0] - 4.4) < 0.2) & (abs(centres[:, 1] - 3.0) < 0.2)]
    assert 0.7 < lamp[:, 2].min() < lamp[:, 2].max() < 1.3


def test_the_summary_is_json_on_request(command, capsys):
    command += ["--json", "--pool", "iop", "--resolution", "0.1"]
    assert main([*command, "--projection", "pool", "--band", "0.5", "1.5"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["resolution"] == 0.1
    assert summary["scans"] > 10
    assert summary["point_sets"] > 50
    assert summary["dropped"] == {}
    assert [path.rsplit("/", 1)[-1] for path in summary["written"]] == FILES


def test_earlier_results_are_replaced_only_when_asked(command, tmp_path, capsys):
    command += ["--resolution", "0.2"]
    assert main(command) == 0
    capsys.readouterr()
    assert main(command) == 2
    assert "already holds volume.npz (use --overwrite to replace it)" in capsys.readouterr().err
    assert main([*command, "--overwrite"]) == 0


def test_a_band_must_hold_some_height(bag, tmp_path, capsys):
    assert main(["volume", str(bag), "-o", str(tmp_path / "run"), "--band", "1", "1"]) == 2
    assert "error: --band 1 1: no height lies between (give the lower one first)" in capsys.readouterr().err


def test_a_trajectory_of_another_day_is_refused(bag, tmp_path, capsys):
    other = tmp_path / "other.tum"
    other.write_text("1.0 0 0 0 0 0 0 1\n2.0 0 0 0 0 0 0 1\n")
    assert main(["volume", str(bag), "--trajectory", str(other), "-o", str(tmp_path / "run")]) == 1
    err = capsys.readouterr().err
    assert "could be placed" in err
    assert "scan outside of the trajectory" in err
    assert not (tmp_path / "run").exists()


def test_points_without_scans_are_enough(data_dir, tmp_path, capsys):
    recording = data_dir / "toposens" / "test.bag"
    if not recording.is_file():
        pytest.skip(f"{recording} is absent")
    assert main(["volume", str(recording), "-o", str(tmp_path / "run"), "--band", "-2.5", "3"]) == 0
    assert "0 scans, 4036 points of 1239 pings, 0 pairs" in capsys.readouterr().out


def test_a_recording_without_points_is_a_volume_of_the_lidar(tmp_path, capsys):
    bag = tmp_path / "flat.bag"
    scene = {key: value for key, value in ROOM.items() if key != "ultrasonic"}
    write_recording(simulate(Scene.model_validate(scene), "rplidar"), bag)
    words = ["volume", str(bag), "--trajectory", f"{bag}.truth.tum", "-o", str(tmp_path / "run")]
    assert main(words) == 0
    assert "0 points of 0 pings" in capsys.readouterr().out


def made(bag, tmp_path, capsys, *words):
    """Summary of a volume along the true trajectory."""
    target = str(tmp_path / "run")
    command = ["volume", str(bag), "--trajectory", truth(bag), "-o", target, "--overwrite", "--json"]
    assert main([*command, "--resolution", "0.2", *words]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_height_of_the_lidar_is_recorded_or_said(bag, tmp_path, capsys):
    assert made(bag, tmp_path, capsys)["lidar_height"] == pytest.approx(0.35)
    assert made(bag, tmp_path, capsys, "--lidar-height", "0.9")["lidar_height"] == 0.9
    assert made(bag, tmp_path, capsys, "--set", "volume.lidar_height=0.8")["lidar_height"] == 0.8


def test_a_robot_that_moves_without_a_trajectory_is_told(bag, tmp_path, capsys):
    words = ["volume", str(bag), "-o", str(tmp_path / "run"), "--resolution", "0.2"]
    assert main(words) == 0
    text = "warning: by its odometry the robot moves 2.0 m, and all was placed as if it stood at the origin: "
    assert f"{text}give its poses with --trajectory, as map writes them\n" in capsys.readouterr().out
    assert made(bag, tmp_path, capsys)["warnings"] == []


def test_a_lidar_outside_of_the_band_is_told(bag, tmp_path, capsys):
    assert made(bag, tmp_path, capsys, "--lidar-height=-5")["warnings"] == [
        "the plane of the lidar, -5 m above the base, lies outside of the heights 0.1 to 1.8 m of the map of "
        "the volume (volume.lidar_height, volume.band_low)"
    ]


@pytest.mark.parametrize(
    ("poses", "words"),
    [
        ([(1.0, 2.0, 0.3), (1.05, 2.0, 0.35)], []),
        ([(math.nan, 2.0, 0.3)], []),
        ([(1.0, 2.0, 3.1), (1.0, 2.0, -3.1)], []),
        ([(1.0, 2.0, 0.0), (4.0, 6.0, 0.0), (1.0, 2.0, 0.0)], ["by its odometry the robot moves 5.0 m"]),
        ([(1.0, 2.0, 0.0), (1.0, 2.0, 0.5)], ["by its odometry the robot moves 29 deg"]),
    ],
)
def test_whether_a_robot_stands_is_told_by_its_odometry(poses, words):
    robot, ways = Standing(), [Odometry(float(k), pose) for k, pose in enumerate(poses)]
    assert list(robot.watched(ways)) == ways
    assert [text.partition(", and all")[0] for text in robot.warnings] == words


def test_parameters_come_from_the_configuration_and_options_go_before_it(bag, tmp_path, capsys):
    file = tmp_path / "mine.yaml"
    file.write_text("volume: {lidar_height: 0.7, lidar_max_range: 1.5, resolution: 0.5}\n", encoding="utf-8")
    usual, mine = made(bag, tmp_path, capsys), made(bag, tmp_path, capsys, "--config", str(file))
    assert (mine["lidar_height"], mine["resolution"]) == (0.7, 0.2)
    assert mine["occupied_voxels"] < usual["occupied_voxels"]
    said = made(bag, tmp_path, capsys, "--config", str(file), "--set", "volume.resolution=0.4")
    assert said["resolution"] == 0.2


def test_what_the_lidar_is_believed_is_configured_as_for_map(bag, tmp_path, capsys):
    near = made(bag, tmp_path, capsys, "--set", "sensor.max_range=1.0", "--band", "0.3", "0.4")
    assert near["occupied_voxels"] < made(bag, tmp_path, capsys)["occupied_voxels"]


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            ["--set", "volume.pool=mean"],
            "--set: volume.pool: Input should be 'bayes', 'iop', 'lop' or 'liop'",
        ),
        (["--set", "volume.heigth=1"], "--set: unknown parameter 'volume.heigth'"),
        (["--band", "1", "nan"], "--band 1 nan: no height lies between"),
        (
            ["--points-topic", "/other"],
            "points topic /other is not in the recording; candidates: /ultrasonic",
        ),
        (["--resolution", "1.5"], "--resolution"),
        (["--laser-pose", "0.1,0,90"], "90 rad is more than a turn (90 deg is 1.5708 rad)"),
        (["--laser-pose", "1,2"], "--laser-pose 1,2: not three numbers x,y,yaw"),
    ],
)
def test_wrong_parameters_are_refused(bag, tmp_path, capsys, words, text):
    assert main(["volume", str(bag), "-o", str(tmp_path / "run"), *words]) == 2
    assert text in capsys.readouterr().err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("option", ["--points-topic", "--sonar-topic"])
def test_the_points_can_be_named(bag, tmp_path, capsys, option):
    assert made(bag, tmp_path, capsys, option, "ultrasonic")["point_sets"] > 50
    assert made(bag, tmp_path, capsys, option, "none")["point_sets"] == 0


def test_it_can_be_quiet(command, tmp_path, capsys):
    assert main([*command, "--resolution", "0.2", "--quiet"]) == 0
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")
    assert (tmp_path / "run" / "volume.npz").is_file()


def test_the_defaults_of_the_help_are_those_of_the_configuration(capsys):
    main(["volume", "--help"])
    text = " ".join(capsys.readouterr().out.replace("│", " ").split())
    usual = Config().volume
    for default in (
        f"{usual.resolution:g}",
        f"{usual.band_low:g} {usual.band_high:g}",
        usual.pool,
        usual.projection,
    ):
        assert f"[default: {default}]" in text


def test_progress_is_told_now_and_then_and_no_record_is_lost(monkeypatch):
    clock = iter(0.03 * k for k in range(1000))
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    ranges = np.ones(3, np.float32)
    scans = [LaserScan(k, ranges, 0.0, 0.1, 0.0, 9.0, record_stamp=100.0 + k) for k in range(20)]
    records = [*scans, PointSet(20.0, np.zeros((1, 3), np.float32), np.zeros(3), 120.0)]
    told = []
    info = RecordingInfo(("run.bag",), "rosbag1", 20.0, 20)
    assert list(_followed(records, info, told.append)) == records
    assert 2 < len(told) < 21
    assert (told[0].scans, told[0].recorded_seconds, told[0].info) == (1, 0.0, info)
    assert all(a.scans < b.scans and a.recorded_seconds < b.recorded_seconds for a, b in pairwise(told))
    assert list(_followed(records, info, None)) == records
