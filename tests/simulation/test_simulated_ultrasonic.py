"""The 3D ultrasonic sensor: what answers, from where, how often, and what the bag holds of it."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.rosbag1 import Reader
from rosbags.typesys import Stores, get_typestore
from tiny_scene import scene

from glassslam.errors import ConfigError
from glassslam.records import LaserScan, PointSet
from glassslam.simulation import Scene, simulate, write_recording
from glassslam.simulation.floorplan import build_floor_plan
from glassslam.simulation.scene import UltrasonicMount
from glassslam.simulation.solids import build_surfaces
from glassslam.simulation.ultrasonic import TS_ALPHA, Ear
from glassslam.simulation.ultrasonic_kernels import Surfaces, answer_chance, listen, meet
from glassslam.sources import open_recording

MOUNT = {"pose": [0.1, 0.05, 0.3], "height": 0.4}


def one_face(origin, first, second, *, is_round=False, limit=0.2, reach=4.0):
    return Surfaces(
        *(np.array([v], dtype=np.float64) for v in (origin, first, second)),
        np.array([is_round]), np.array([limit]), np.array([reach]),
    )  # fmt: skip


def naive_meet(eye, ray, origin, first, second, is_round):
    """Where a ray meets a face, by solving three equations."""
    system = np.stack((first, second, -ray), axis=1)
    if abs(np.linalg.det(system)) < 1e-12:
        return None
    a, b, distance = np.linalg.solve(system, eye - origin)
    if is_round:
        border = (1.0 - math.hypot(a, b)) * min(np.linalg.norm(first), np.linalg.norm(second))
    else:
        border = min(
            a * np.linalg.norm(first), (1 - a) * np.linalg.norm(first),
            b * np.linalg.norm(second), (1 - b) * np.linalg.norm(second),
        )  # fmt: skip
    normal = np.cross(first, second)
    return distance, abs(normal @ ray) / np.linalg.norm(normal), border


unit = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@given(unit, st.floats(-math.pi, math.pi), st.floats(0.2, 3), st.floats(0.2, 3), unit, st.booleans())
def test_a_ray_meets_a_face_where_three_equations_say(direction, yaw, wide, high, place, is_round):
    ray = np.array(direction) / np.linalg.norm(direction)
    first = wide * np.array([math.cos(yaw), math.sin(yaw), 0.0])
    second = np.array([0.0, 0.0, high])
    origin, eye = 2.0 * np.array(place), np.array([0.1, -0.2, 0.3])
    got = meet(eye, ray, one_face(origin, first, second, is_round=is_round), 0)
    naive = naive_meet(eye, ray, origin, first, second, is_round)
    if naive is None or naive[0] <= 0.0 or naive[2] < -1e-9:
        assert got[0] == math.inf
    elif naive[2] > 1e-9:
        assert got == pytest.approx(naive, rel=1e-6, abs=1e-9)


def test_sound_comes_back_square_on_and_fades_beyond_the_limit():
    chances = [
        answer_chance(math.radians(d), 1.0, math.radians(8), math.radians(8), 0.03) for d in (0, 8, 16, 40)
    ]
    assert chances == pytest.approx([1.0, 1.0, math.exp(-0.5), math.exp(-8.0)])


def test_an_edge_answers_half_of_the_time_at_any_incidence():
    assert answer_chance(1.2, 0.02, 0.1, 0.1, 0.03) == 0.5
    assert answer_chance(0.0, 0.02, 0.1, 0.1, 0.03) == 1.0


def heard(faces, rays, draws, reach=4.0):
    out = np.empty(len(rays))
    listen(np.zeros(3), np.array(rays), np.array(draws), faces, reach, 0.9, 0.1, 0.03, out)
    return out.tolist()


def test_the_first_face_hides_what_is_behind_it():
    near = one_face([1, -1, -1], [0, 2, 0], [0, 0, 2])
    far = one_face([2, -1, -1], [0, 2, 0], [0, 0, 2])
    both = Surfaces(*(np.concatenate(pair) for pair in zip(far, near, strict=True)))
    assert heard(both, [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]], [0.5, 0.5]) == [1.0, math.inf]


def test_echoes_get_lost_and_end_at_the_reach():
    wall = one_face([3, -1, -1], [0, 2, 0], [0, 0, 2])
    ray = [1.0, 0.0, 0.0]
    assert heard(wall, [ray, ray], [0.89, 0.91]) == [3.0, math.inf]
    assert heard(wall, [ray], [0.0], reach=2.9) == [math.inf]
    assert heard(wall._replace(reach=np.array([2.0])), [ray], [0.0]) == [math.inf]


@given(st.lists(unit, min_size=1, max_size=6), st.lists(st.floats(0.0, 0.999), min_size=6, max_size=6))
def test_listening_is_taking_the_nearest_face_of_all(directions, draws):
    table = {
        "name": "table",
        "material": "wood",
        "size": [1, 2],
        "at": [[4, 4]],
        "z_low": 0.7,
        "z_high": 0.75,
    }
    faces = build_surfaces(room(boxes=[table]), 4.0)
    rays = np.array([np.array(d) / np.linalg.norm(d) for d in directions])
    eye = np.array([3.1, 3.2, 0.4])
    out = np.empty(len(rays))
    listen(eye, rays, np.array(draws[: len(rays)]), faces, 4.0, 0.9, 0.14, 0.03, out)
    for ray, draw, got in zip(rays, draws, out, strict=False):
        met = [(*meet(eye, ray, faces, k), k) for k in range(faces.limit.size)]
        distance, cosine, border, k = min(met, key=lambda m: m[0])
        chance = 0.9 * answer_chance(math.acos(min(cosine, 1.0)), border, faces.limit[k], 0.14, 0.03)
        assert got == (distance if distance <= 4.0 and draw < chance else math.inf)


def test_faces_out_of_range_are_never_missed():
    ear = Ear.build(room(), UltrasonicMount(pose=(0.0, 0.0, 0.0)))
    assert ear._near(3.0, 3.0).limit.size == ear.surfaces.limit.size
    far = Ear.build(scene(walls=[
        {"name": "near", "material": "wood", "points": [[0, 0], [1, 0]]},
        {"name": "far", "material": "wood", "points": [[30, 0], [31, 0]]},
    ], ultrasonic={}), UltrasonicMount())  # fmt: skip
    assert far._near(0.0, 1.0).origin[0, 0] == 0.0
    assert far._near(0.0, 1.0).limit.size == far.surfaces.limit.size - 1


def room(**changes):
    return scene(ultrasonic=MOUNT, **changes)


def test_faces_are_sides_lids_floor_and_ceiling():
    table = {
        "name": "table",
        "material": "wood",
        "size": [1, 2],
        "at": [[4, 5]],
        "z_low": 0.7,
        "z_high": 0.75,
    }
    lamp = {"name": "lamp", "material": "wood", "radius": 0.2, "at": [[2, 5]], "z_low": 1.5, "z_high": 1.8}
    faces = build_surfaces(room(boxes=[table], posts=[lamp]), 4.0)
    assert len(faces.limit) == 4 + (4 + 2) + (12 + 2) + 2
    assert faces.round.sum() == 2
    assert faces.origin[4:10, 2].tolist() == [0.7] * 5 + [0.75]
    assert faces.origin[-2:, 2].tolist() == [0.0, 2.5]
    assert len(build_surfaces(room(ceiling=None), 4.0).limit) == 4 + 1


def test_a_leaning_pane_throws_sound_up_or_down():
    pane = {"name": "pane", "material": "glass", "points": [[1, 1], [5, 1]], "lean_deg": 10.0}
    faces = build_surfaces(room(walls=[pane]), 4.0)
    normal = np.cross(faces.first[0], faces.second[0])
    assert math.degrees(math.asin(abs(normal[2]) / np.linalg.norm(normal))) == pytest.approx(10.0)
    assert faces.first[0] @ faces.second[0] == pytest.approx(0.0)


def test_a_square_room_answers_where_its_walls_are_square_on():
    ear = Ear.build(room(ceiling=None), UltrasonicMount(pose=(0.0, 0.0, 0.0), height=0.4))
    random = np.random.default_rng(0)
    points = np.concatenate([ear.ping(np.array([4.0, 3.0, 0.0]), random) for _ in range(200)])
    foot = np.linalg.norm(points - [2.0, 0.0, 0.0], axis=1)
    assert (foot < 0.6).mean() > 0.05
    assert np.linalg.norm(points, axis=1).max() < 4.05
    assert points[:, 0].min() >= 0.0


def test_a_glass_front_is_heard_like_a_wall():
    counts = {}
    for material in ("glass", "plaster"):
        wall = {"name": "front", "material": material, "points": [[4, 0], [4, 6]]}
        ear = Ear.build(room(walls=[wall], ceiling=None), UltrasonicMount(pose=(0.0, 0.0, 0.0)))
        random = np.random.default_rng(1)
        points = np.concatenate([ear.ping(np.array([2.0, 3.0, 0.0]), random) for _ in range(100)])
        counts[material] = (np.abs(points[:, 0] - 2.0) < 0.1).sum()
    assert counts["glass"] == counts["plaster"] > 50


def test_points_are_in_the_frame_of_the_base():
    records = [r for r in simulate(room(ceiling=None), "rplidar").records() if isinstance(r, PointSet)]
    assert records[0].origin.tolist() == [0.1, 0.05, 0.4]
    assert all(r.points.dtype == np.float32 and r.points.shape[1] == 3 for r in records)
    stamps = np.diff([r.stamp for r in records])
    assert stamps == pytest.approx(np.full(stamps.size, 0.05), abs=2e-6)
    ahead = np.concatenate([r.points for r in records]) - records[0].origin
    assert (ahead[:, :2] @ [math.cos(0.3), math.sin(0.3)]).min() > -1e-6


def test_the_same_seed_hears_the_same_and_another_one_does_not():
    first, again, other = (
        np.concatenate(
            [r.points for r in simulate(room(), "rplidar", seed).records() if isinstance(r, PointSet)]
        )
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first[:50], other[:50])


def test_without_the_sensor_nothing_changes():
    with_sensor, without = (
        [r for r in simulate(s, "rplidar", 3).records() if isinstance(r, LaserScan)]
        for s in (room(), scene())
    )
    assert all(
        np.array_equal(a.ranges, b.ranges, equal_nan=True) for a, b in zip(with_sensor, without, strict=True)
    )
    assert not any(isinstance(r, PointSet) for r in simulate(scene(), "rplidar").records())


def test_what_does_not_reach_the_plane_of_the_lidar_is_not_seen_by_it():
    low = {"name": "pallet", "material": "wood", "size": [1, 1], "at": [[5, 5]], "z_high": 0.15}
    high = {"name": "lamp", "material": "wood", "radius": 0.2, "at": [[1, 5]], "z_low": 1.5, "z_high": 1.8}
    world = scene(boxes=[low], posts=[high])
    assert set(build_floor_plan(world).names) == {"room"}
    assert set(build_floor_plan(world, (0.0, 0.6)).names) == {"room", "pallet"}
    assert set(build_floor_plan(world.model_copy(update={"laser_height": 0.1})).names) == {"room", "pallet"}


def test_the_robot_passes_below_a_lamp_but_not_over_a_pallet():
    lamp = {"name": "lamp", "material": "wood", "radius": 0.2, "at": [[3, 3]], "z_low": 1.5, "z_high": 1.8}
    assert simulate(scene(posts=[lamp]), "rplidar").driven == pytest.approx(2.0, abs=0.1)
    pallet = {"name": "pallet", "material": "wood", "size": [0.5, 0.5], "at": [[3, 3]], "z_high": 0.15}
    with pytest.raises(ConfigError, match=r"the robot comes within 0\.00 m"):
        simulate(scene(boxes=[pallet]), "rplidar")


def test_a_scene_without_anything_at_the_lidar_is_refused():
    with pytest.raises(ConfigError, match=r"nothing of the scene reaches the height of 3 m"):
        build_floor_plan(scene(laser_height=3.0))


def test_a_thing_must_have_a_height():
    with pytest.raises(ValueError, match="z_low 2 is not below z_high 1"):
        Scene.model_validate(
            scene().model_dump() | {"posts": [{"name": "p", "material": "wood", "radius": 1, "at": [[0, 0]],
                                               "z_low": 2, "z_high": 1}]}
        )  # fmt: skip


def test_pings_tell_where_the_sensor_looks(tmp_path):
    turned = scene(ultrasonic={"pose": [0.1, 0.0, 0.5]})
    simulation = simulate(turned, "rplidar", seed=5)
    pings = [record for record in simulation.records() if isinstance(record, PointSet)]
    assert {ping.axis for ping in pings} == {(math.cos(0.5), math.sin(0.5), 0.0)}
    written = write_recording(simulation, tmp_path / "turned.bag")
    recorded = [r for r in open_recording(written.bag).records() if isinstance(r, PointSet)]
    assert len(recorded) == len(pings)
    np.testing.assert_allclose(recorded[0].axis, pings[0].axis, atol=1e-9)


def test_the_bag_holds_the_points_in_the_frame_of_the_sensor(tmp_path):
    simulation = simulate(room(), "rplidar", seed=5)
    written = write_recording(simulation, tmp_path / "room.bag")
    records = [r for r in simulation.records() if isinstance(r, PointSet)]
    store = get_typestore(Stores.ROS1_NOETIC)
    clouds, frames = [], {}
    with Reader(written.bag) as reader:
        for connection, _, raw in reader.messages():
            if connection.topic == "/ultrasonic":
                clouds.append(store.deserialize_ros1(raw, connection.msgtype))
            elif connection.topic == "/tf_static":
                frames = transforms(raw)
    assert len(clouds) == len(records) > 50
    assert clouds[0].header.frame_id == "ultrasonic"
    assert [(f.name, f.offset, f.datatype) for f in clouds[0].fields] == [
        ("x", 0, 7),
        ("y", 4, 7),
        ("z", 8, 7),
    ]
    assert frames["ultrasonic"] == pytest.approx((0.1, 0.05, 0.4, math.sin(0.15), math.cos(0.15)))
    assert frames["laser"][2] == pytest.approx(0.2)
    for cloud, record in zip(clouds[:20], records, strict=False):
        local = cloud.data.view("<f4").reshape(-1, 3)
        turned = local[:, :2] @ np.array([[math.cos(0.3), math.sin(0.3)], [-math.sin(0.3), math.cos(0.3)]])
        assert np.column_stack((turned, local[:, 2])) + record.origin == pytest.approx(
            record.points, abs=1e-5
        )


def test_the_truth_names_the_heights_of_all_things(tmp_path):
    lamp = {"name": "lamp", "material": "wood", "radius": 0.2, "at": [[3, 3]], "z_low": 1.5, "z_high": 1.8}
    written = write_recording(simulate(room(posts=[lamp]), "rplidar"), tmp_path / "room.bag")
    plan = json.loads(written.true_plan.read_text())
    heights = {(solid["name"], solid["z_low"], solid["z_high"]) for solid in plan["solids"]}
    assert heights == {("room", 0.0, 2.5), ("lamp", 1.5, 1.8)}
    assert (plan["laser_height"], plan["ceiling"]) == (0.2, 2.5)
    assert [wall["name"] for wall in plan["walls"]] == ["room"]
    flat = write_recording(simulate(scene(), "rplidar"), tmp_path / "flat.bag")
    assert "solids" not in json.loads(flat.true_plan.read_text())


def transforms(raw):
    """Child -> x, y, z and the z, w of its quaternion, of a serialised TFMessage."""
    from rosbags.typesys import get_types_from_msg

    store = get_typestore(Stores.ROS1_NOETIC)
    store.register(
        get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
    )
    found = {}
    for stamped in store.deserialize_ros1(raw, "tf2_msgs/msg/TFMessage").transforms:
        move, turn = stamped.transform.translation, stamped.transform.rotation
        found[stamped.child_frame_id] = (move.x, move.y, move.z, turn.z, turn.w)
    return found


def test_the_figures_of_the_sensor_say_where_they_are_from():
    assert (TS_ALPHA.range_max, TS_ALPHA.half_angle) == (4.0, math.pi / 2)
    assert len(TS_ALPHA.sources) == 4
