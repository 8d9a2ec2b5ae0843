import json

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from tiny_scene import SQUARE, scene

from detectors.labels import GHOST, GLASS, NAMES, NO_RETURN, SOLID
from glassslam.errors import OutputError
from glassslam.geometry import inverse, transform_points
from glassslam.outputs import read_map, read_tum
from glassslam.outputs.labels import read_labels
from glassslam.simulation import TruthLog, simulate, truth_paths, write_recording, write_truth

GLASS_ROOM = {
    "walls": [
        {"name": "room", "material": "plaster", "points": SQUARE, "closed": True},
        {"name": "front", "material": "glass", "points": [[1, 4.2], [5, 4.2]], "panes": {"width": 1.0}},
        {"name": "case", "material": "clean_glass", "points": [[2, 2], [4, 2]], "lean_deg": 20.0},
    ],
    "laser_pose": [0.1, 0.0, 0.2],
    "drive": {"waypoints": [{"at": [2, 3]}, {"at": [4, 3.1]}]},
}


@pytest.fixture(scope="module")
def simulation():
    return simulate(scene(**GLASS_ROOM), "utm30lx", seed=3, scan_rate=8.0)


@pytest.fixture(scope="module")
def written(simulation, tmp_path_factory):
    return write_recording(simulation, tmp_path_factory.mktemp("truth") / "room.bag")


@pytest.fixture(scope="module")
def truth(written):
    return dict(np.load(written.true_labels))


@pytest.fixture(scope="module")
def ranges(written):
    with AnyReader([written.bag]) as reader:
        wanted = [c for c in reader.connections if c.topic == "/scan"]
        return np.array([reader.deserialize(raw, c.msgtype).ranges for c, _, raw in reader.messages(wanted)])


@pytest.fixture(scope="module")
def glass(written):
    return json.loads(written.true_glass.read_text())


def test_the_files_of_truth_are_named_after_the_bag(written):
    assert [path.name for path in truth_paths(written.bag)] == [
        "room.bag.truth.tum",
        "room.bag.truth.json",
        "room.bag.truth.labels.npz",
        "room.bag.truth.glass.geojson",
        "room.bag.truth.map.yaml",
        "room.bag.truth.map.pgm",
        "room.bag.truth.map.labels.png",
    ]
    assert all(path.is_file() for path in truth_paths(written.bag))


def test_every_beam_of_every_scan_has_a_label_with_the_numbers_of_the_detectors(written, truth, ranges):
    assert truth["labels"].shape == truth["mirrored"].shape == ranges.shape
    assert truth["labels"].dtype == np.uint8
    assert tuple(truth["names"]) == NAMES
    assert set(np.unique(truth["labels"])) == {SOLID, GLASS, GHOST, NO_RETURN} - (
        set() if np.isinf(ranges).any() else {NO_RETURN}
    )
    assert np.array_equal(truth["stamps"], read_tum(written.true_trajectory).stamps.round(6))


def test_beams_without_echo_are_those_labelled_so(truth, ranges):
    assert np.array_equal(np.isposinf(ranges), truth["labels"] == NO_RETURN)


def test_beams_labelled_glass_end_on_the_pane_and_ghosts_do_not(simulation, truth, ranges):
    sensor = simulation.sensor
    beam = np.arange(sensor.beams)
    for k, stamp in enumerate(simulation.truth.stamps):
        time = stamp - simulation.scene.start_time + beam * sensor.time_increment
        poses = simulation.motion.at(time)
        angle = poses[:, 2] + 0.2 + sensor.angle_min + beam * sensor.angle_increment
        y = poses[:, 1] + 0.1 * np.sin(poses[:, 2]) + ranges[k] * np.sin(angle)
        on_glass = truth["labels"][k] == GLASS
        assert np.abs(y[on_glass] - 4.2).max() < 0.1
        through = (truth["labels"][k] == GHOST) & (truth["mirrored"][k] == 0)
        assert ((y[through] > 4.1) | (y[through] < 2.0)).all()


def test_the_glass_is_in_the_frame_of_the_first_pose(simulation, glass):
    first = simulation.truth.poses[0]
    assert glass["world_from_map"] == pytest.approx(first, abs=1e-6)
    assert glass["frame"] == "map: the base at the first scan; metres"
    ends = np.array([f["geometry"]["coordinates"] for f in glass["features"]])
    world = transform_points(first, ends.reshape(-1, 2)).reshape(-1, 4)
    expected = simulation.plan.segments[[n in ("front", "case") for n in simulation.plan.names]]
    assert world == pytest.approx(expected, abs=1e-5)
    assert {f["geometry"]["type"] for f in glass["features"]} == {"LineString"}


def test_every_pane_says_how_much_of_it_was_ever_seen(glass):
    panes = {"front": [], "case": []}
    for feature in glass["features"]:
        panes[feature["properties"]["name"]].append(feature["properties"])
    assert len(panes["front"]) == 4
    assert all(p["kind"] == "wall" for p in panes["front"])
    assert [p["answered_m"] for p in panes["case"]] == [0.0]
    assert panes["case"][0]["lean_deg"] == 20.0
    seen = sum(p["answered_m"] for p in panes["front"])
    assert 2.5 < seen <= sum(p["length_m"] for p in panes["front"]) + 1e-9


def test_the_plan_sums_up_the_glass(simulation, written):
    plan = json.loads(written.true_plan.read_text())
    assert plan["glass_m"] == pytest.approx(2.0 + 4.0 - 5 * 0.06)
    total = np.hypot(*(simulation.plan.segments[:, 2:] - simulation.plan.segments[:, :2]).T).sum()
    assert plan["opaque_m"] + plan["glass_m"] == pytest.approx(total, abs=2e-3)
    assert plan["world_from_map"] == pytest.approx(simulation.truth.poses[0], abs=1e-6)


def test_a_rate_thins_the_scans_but_not_the_sweep(simulation):
    stamps = simulation.truth.stamps
    assert np.diff(stamps) == pytest.approx(np.full(stamps.size - 1, 0.125), abs=2e-6)
    scan = next(record for record in simulation.records() if hasattr(record, "ranges"))
    assert scan.time_increment == pytest.approx(0.025 / 1440)


def test_the_true_map_lies_in_the_frame_of_the_first_pose(simulation, written):
    grid = read_map(written.true_map)
    places = transform_points(
        inverse(simulation.truth.poses[0]), np.array([[2.5, 3.5], [6.0, 3.0], [3.0, 6.4]])
    )
    columns, rows = np.floor((places - grid.origin) / grid.resolution).astype(int).T
    assert grid.probability[rows[0], columns[0]] == 0.0
    assert (grid.probability[rows[1], columns[1] - 1 : columns[1] + 2] == 1.0).any()
    assert np.isnan(grid.probability[rows[2], columns[2]])


def test_the_classes_of_the_true_map_tell_glass_from_walls(simulation, written):
    labels, grid = read_labels(written.true_classes), read_map(written.true_map)
    assert np.array_equal(np.isin(labels, (2, 3)), grid.probability == 1.0)
    glass = 0.05 * (labels == 3).sum()
    assert glass == pytest.approx(2.0 + 4.0 - 5 * 0.06, rel=0.15)


def test_truth_that_cannot_be_written_is_one_clear_line(simulation, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot write the truth beside .*room\.bag: "):
        write_truth(simulation, tmp_path / "file" / "room.bag", TruthLog(simulation.plan.segments))
