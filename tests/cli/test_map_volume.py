"""`glassslam map` of a robot with a 3D ultrasonic sensor."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from glassslam.cli.app import main
from glassslam.outputs.directory import VOLUME_FILES
from glassslam.simulation import Scene, simulate, write_recording
from glassslam.volume.storage import load_volume

ROOM = {
    "name": "room",
    "walls": [
        {"name": "room", "material": "plaster", "points": [[0, 0], [6, 0], [6, 5], [0, 5]], "closed": True},
        {"name": "stub", "material": "wood", "points": [[3, 0], [3, 1.2]]},
    ],
    "posts": [
        {"name": "lamp", "material": "wood", "radius": 0.2, "at": [[4.5, 3]], "z_low": 0.8, "z_high": 1.2}
    ],
    "drive": {"waypoints": [{"at": [2, 3]}, {"at": [4, 3]}]},
    "laser_height": 0.35,
}


def write(path, **more):
    write_recording(simulate(Scene.model_validate({**ROOM, **more}), "rplidar"), path)
    return path


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    """Scans and points of a sensor that looks back over the left shoulder of the robot."""
    sensor = {"pose": [0.0, 0.1, 0.4], "height": 0.5}
    return write(tmp_path_factory.mktemp("bags") / "room.bag", ultrasonic=sensor)


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    """The same without the sensor."""
    return write(tmp_path_factory.mktemp("bags") / "flat.bag")


@pytest.fixture(scope="module")
def mapped(bag, tmp_path_factory):
    """The results, and the report that was printed."""
    folder = tmp_path_factory.mktemp("maps") / "room"
    assert main(["map", str(bag), "-o", str(folder), "--quiet"]) == 0
    return folder, json.loads((folder / "report.json").read_text())


def files(folder):
    return {path.name for path in Path(folder).iterdir()}


def test_the_volume_is_written_beside_the_map(mapped):
    assert set(VOLUME_FILES) < files(mapped[0])


def test_the_report_tells_where_it_came_from(mapped):
    report = mapped[1]
    assert report["source"]["points_topics"] == ["/ultrasonic"]
    assert report["volume"]["lidar_height_m"] == pytest.approx(0.35)
    assert report["volume"]["points"] > 500
    assert report["volume"]["dropped"] == {}
    assert "volume" in report["stages"]


def test_the_lamp_hangs_where_the_robot_met_it(mapped):
    tree = load_volume(mapped[0] / "volume.npz")
    centres = tree.centres(tree.occupied().voxels())
    # the map begins at the first pose, (2, 3) and heading along x
    lamp = centres[(abs(centres[:, 0] - 2.5) < 0.3) & (abs(centres[:, 1]) < 0.3) & (centres[:, 2] < 2.0)]
    lamp = lamp[lamp[:, 2] > 0.5]
    assert len(lamp) > 5
    assert 0.7 < lamp[:, 2].min() < lamp[:, 2].max() < 1.3


def test_parameters_are_those_of_the_configuration(bag, tmp_path):
    words = [
        "--set",
        "volume.resolution=0.2",
        "--set",
        "volume.band_high=0.6",
        "--set",
        "volume.lidar_height=0.5",
    ]
    assert main(["map", str(bag), "-o", str(tmp_path / "run"), "--quiet", *words]) == 0
    config = yaml.safe_load((tmp_path / "run" / "config.yaml").read_text())["volume"]
    assert (config["resolution"], config["band_high"], config["lidar_height"]) == (0.2, 0.6, 0.5)
    told = json.loads((tmp_path / "run" / "report.json").read_text())["volume"]
    assert (told["resolution"], told["band_m"], told["lidar_height_m"]) == (0.2, [0.1, 0.6], 0.5)


def test_points_can_be_left_out_and_earlier_volumes_go(bag, tmp_path):
    target = tmp_path / "run"
    assert main(["map", str(bag), "-o", str(target), "--quiet", "--points-topic", "ultrasonic"]) == 0
    assert set(VOLUME_FILES) < files(target)
    assert main(["map", str(bag), "-o", str(target), "--quiet", "--overwrite", "--points-topic", "none"]) == 0
    assert not set(VOLUME_FILES) & files(target)
    assert json.loads((target / "report.json").read_text())["volume"] is None


def test_the_volume_changes_nothing_of_the_map(bag, mapped, tmp_path):
    assert main(["map", str(bag), "-o", str(tmp_path / "run"), "--quiet", "--points-topic", "none"]) == 0
    for name in ("map.pgm", "map.yaml", "trajectory.tum", "graph.g2o"):
        assert (tmp_path / "run" / name).read_bytes() == (mapped[0] / name).read_bytes(), name


def test_the_command_volume_finds_the_same_along_the_trajectory_of_the_map(bag, mapped, tmp_path):
    folder = mapped[0]
    words = [
        "volume",
        str(bag),
        "--trajectory",
        str(folder / "trajectory.tum"),
        "-o",
        str(tmp_path / "again"),
    ]
    assert main([*words, "--config", str(folder / "config.yaml"), "--quiet"]) == 0
    ours, theirs = (load_volume(path / "volume.npz") for path in (folder, tmp_path / "again"))
    centres = ours.centres(ours.occupied().voxels())
    # all scans instead of nodes: the same places, told more often
    again = theirs.log_odds_at(centres)
    assert (again >= 0.0).mean() > 0.95


def test_inspect_tells_points_and_height(bag, capsys):
    assert main(["inspect", str(bag)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "3D points /ultrasonic, height of the laser 0.350 m above the base" in told
    assert "points /ultrasonic" in told
    assert "sonar /ultrasonic" not in told
    assert main(["inspect", str(bag), "--points-topic", "none"]) == 0
    assert "3D points" not in capsys.readouterr().out


def test_a_recording_without_points_loads_nothing_of_volumes(flat, tmp_path):
    program = (
        "import sys; from glassslam.cli.app import main; code = main(sys.argv[1:]); "
        "loaded = [name for name in sys.modules if name.startswith('glassslam.volume')]; "
        "assert not loaded, loaded; sys.exit(code)"
    )
    words = ["map", str(flat), "-o", str(tmp_path / "run"), "--quiet"]
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run(
        [sys.executable, "-c", program, *words],
        env=os.environ | {"PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert not set(VOLUME_FILES) & files(tmp_path / "run")
