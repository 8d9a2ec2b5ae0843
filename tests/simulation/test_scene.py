import numpy as np
import pytest
import yaml
from tiny_scene import SQUARE, scene

from glassslam.errors import ConfigError
from glassslam.simulation import Scene, find_scene
from glassslam.simulation.floorplan import build_floor_plan


def write(tmp_path, text):
    path = tmp_path / "scene.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def plan_of(**wall):
    return build_floor_plan(scene(walls=[{"name": "w", "material": "wood"} | wall]))


def test_a_closed_line_has_a_segment_per_side():
    plan = build_floor_plan(scene())
    assert plan.segments.tolist() == [[0, 0, 6, 0], [6, 0, 6, 6], [6, 6, 0, 6], [0, 6, 0, 0]]
    assert plan.names == ("room",) * 4
    assert [plan.materials[k] for k in plan.material] == ["plaster"] * 4


def test_an_opening_leaves_a_gap():
    plan = plan_of(points=[[0, 0], [5, 0]], openings=[{"at": 2, "width": 1}])
    assert plan.segments.tolist() == [[0, 0, 2, 0], [3, 0, 5, 0]]


def test_openings_are_measured_along_the_line_and_may_pass_a_corner():
    plan = plan_of(
        points=[[0, 0], [2, 0], [2, 2]], openings=[{"at": 1.5, "width": 1}, {"at": 0.5, "width": 0.5}]
    )
    assert plan.segments.tolist() == [[0, 0, 0.5, 0], [1, 0, 1.5, 0], [2, 0.5, 2, 2]]


def test_a_thick_wall_has_two_faces_and_jambs():
    plan = plan_of(points=[[0, 0], [4, 0]], thickness=0.2, openings=[{"at": 1, "width": 1}])
    left, right = plan.segments[:4], plan.segments[4:]
    assert left[:, [0, 2]].min() == pytest.approx(-0.1), "reaches past its end by half the thickness"
    assert left[:, [1, 3]].min() == pytest.approx(-0.1)
    assert left[:, [0, 2]].max() == pytest.approx(1.0)
    assert right[:, [0, 2]].min() == pytest.approx(2.0)
    assert right[:, [0, 2]].max() == pytest.approx(4.1)


def test_boxes_turn_about_their_centre():
    box = {"name": "b", "material": "wood", "size": [2, 1], "at": [[5, 5]], "yaw_deg": 90}
    plan = build_floor_plan(scene(walls=[], boxes=[box]))
    assert plan.segments[:, [0, 2]].min() == pytest.approx(4.5)
    assert plan.segments[:, [1, 3]].max() == pytest.approx(6.0)


def test_posts_are_round():
    post = {"name": "p", "material": "wood", "radius": 0.3, "at": [[1, 1], [2, 2]]}
    plan = build_floor_plan(scene(walls=[], posts=[post]))
    first = plan.segments[: len(plan.segments) // 2]
    assert np.hypot(first[:, 0] - 1, first[:, 1] - 1) == pytest.approx(np.full(len(first), 0.3))
    assert first[0, :2] == pytest.approx(first[-1, 2:])


@pytest.mark.parametrize(
    ("wall", "message"),
    [
        ({"openings": [{"at": 4, "width": 2}]}, "wall 'w': an opening ends at 6 m, the wall at 5 m"),
        ({"openings": [{"at": 1, "width": 2}, {"at": 2, "width": 1}]}, "wall 'w': two openings overlap"),
        ({"points": [[0, 0], [0, 0], [1, 0]]}, "wall 'w' has two equal points in a row"),
    ],
)
def test_a_contradictory_wall_is_refused(wall, message):
    with pytest.raises(ConfigError) as caught:
        plan_of(**({"points": [[0, 0], [5, 0]]} | wall))
    assert caught.value.message == message


def test_a_scene_may_define_and_redefine_materials():
    own = scene(materials={"velvet": {"reflectance": 0.02}, "wood": {"reflectance": 0.9}})
    assert own.palette()["velvet"].reflectance == 0.02
    assert own.palette()["wood"].reflectance == 0.9
    assert own.palette()["plaster"].reflectance == 0.85


HEAD = "name: x\nwalls: [{name: w, material: wood, points: [[0, 0], [1, 0]]}]\n"
DRIVE = "drive: {waypoints: [{at: [0, 1]}, {at: [1, 1]}]}\n"


@pytest.mark.parametrize(
    ("text", "message", "hint"),
    [
        (HEAD + DRIVE + "senser: lms200\n", "unknown name 'senser'", "did you mean 'sensor'?"),
        (
            HEAD + DRIVE.replace("{at: [1, 1]}", "{at: [1, 1], sped: 2}"),
            "unknown name 'drive.waypoints.1.sped'",
            "did you mean 'speed'?",
        ),
        (HEAD, "drive: Field required", ""),
        (
            HEAD + DRIVE.replace("{at: [1, 1]}", "{at: [1, .nan]}"),
            "drive.waypoints.1.at.1: Input should be a finite number",
            "found nan",
        ),
        ("- 1\n", "expected a mapping, found list", ""),
        (HEAD.replace("wood", "glas") + DRIVE, "'w' is made of unknown 'glas' (known: ", ""),
        ("name: x\n" + DRIVE, "nothing to see: give walls, boxes or posts", ""),
    ],
)
def test_an_unfit_scene_is_refused_with_the_place(tmp_path, text, message, hint):
    path = write(tmp_path, text)
    with pytest.raises(ConfigError) as caught:
        Scene.load(path)
    assert caught.value.message.startswith(f"{path}: {message}")
    assert caught.value.hint == hint
    assert caught.value.exit_code == 2


def test_a_scene_that_is_no_yaml_is_refused(tmp_path):
    path = write(tmp_path, "name: [\n")
    with pytest.raises(ConfigError, match=r"cannot read .*scene\.yaml: "):
        Scene.load(path)


def test_a_missing_scene_is_refused_with_what_is_shipped(tmp_path):
    with pytest.raises(ConfigError) as caught:
        find_scene("castle")
    assert caught.value.message == "no scene 'castle'"
    assert "office" in caught.value.hint
    with pytest.raises(ConfigError, match=r"cannot read .*: No such file or directory"):
        Scene.load(tmp_path / "nothing.yaml")


def test_a_scene_is_found_by_name_or_by_path(tmp_path):
    assert find_scene("office").name == "office.yaml"
    path = write(tmp_path, HEAD + DRIVE)
    assert find_scene(path) == path
    assert Scene.load(path).walls[0].points == ((0, 0), (1, 0))


def test_the_world_of_these_tests_is_a_room():
    assert scene().walls[0].points == tuple(tuple(p) for p in SQUARE)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"at": [9000.0, 1.0], "speed": 10.0}, "the plan covers 9000 x 500 m"),
        (
            {"at": [100.0, 1.0], "speed": 10.0},
            "the plan covers 100 x 500 m, up to 180000 m2 of map when turned",
        ),
        ({"at": [1e6, 1.0]}, "drive.waypoints.1.at.0: Input should be less than or equal to 10000"),
        ({"speed": 1e-7}, "drive: the drive takes "),
        ({"stop": 1e6}, "drive: the drive takes 277.8 h, at most are 4 h"),
    ],
)
def test_a_scene_beyond_all_memory_and_patience_is_refused(tmp_path, change, message):
    path = tmp_path / "scene.yaml"
    walls = [{"name": "w", "material": "plaster", "points": [[0, 0], [6, 0], [6, 500]]}]
    drive = {"waypoints": [{"at": [1.0, 1.0]}, {"at": [2.0, 1.0], **change}]}
    path.write_text(yaml.safe_dump({"name": "s", "walls": walls, "drive": drive}))
    with pytest.raises(ConfigError) as caught:
        Scene.load(path)
    assert message in caught.value.message
    assert "\n" not in caught.value.message


@pytest.mark.parametrize("rate", ["1.0e6", "0.0", ".nan"])
def test_rates_that_no_sensor_has_are_refused(tmp_path, rate):
    path = write(tmp_path, f"{HEAD}{DRIVE}scan_rate: {rate}\n")
    with pytest.raises(ConfigError, match="scan_rate"):
        Scene.load(path)
