"""Simulated sonars: what answers ultrasound, what is lost, and how it is written."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.highlevel import AnyReader
from tiny_scene import SQUARE, scene

from glassslam.cli import main
from glassslam.errors import UsageError
from glassslam.records import LaserScan, Odometry, RangeRing, SonarRing
from glassslam.simulation import SonarModel, simulate, sonar_model, write_recording
from glassslam.simulation.floorplan import build_floor_plan
from glassslam.simulation.sonar import SonarArray
from glassslam.simulation.sonar_kernels import fire, incidence, mirror, ray_echo
from glassslam.sources.recording import open_recording

NOBODY = np.empty((0, 5))
FAR = {"name": "far", "material": "plaster", "points": [[-50, -50], [-50, -49]]}


def ring(*poses, view_deg=30.0):
    return SonarRing(np.array(poses, dtype=np.float64), math.radians(view_deg), 0.1, 5.0, "test")


def array(walls, sonars=None, **model):
    world = scene(walls=[*walls, FAR])
    return SonarArray.build(
        build_floor_plan(world), world.palette(), SonarModel(sonars or ring([0, 0, 0]), **model)
    )


def heard(walls, *poses, circles=NOBODY, view_deg=30.0):
    """Exact ranges of sonars that fire together from poses in the world."""
    ears = array(walls, ring(*poses, view_deg=view_deg))
    ranges = np.empty(len(poses))
    fire(np.array(poses, dtype=np.float64), ears.plan, ears.acoustics, circles, ears.cone, ranges)
    return ranges


def wall(*points, material="plaster", **more):
    return {"name": "wall", "material": material, "points": [list(point) for point in points], **more}


def test_a_wall_square_on_answers_at_its_distance():
    assert heard([wall((2, -3), (2, 3))], [0, 0, 0]) == pytest.approx([2.0])


@pytest.mark.parametrize("material", ["glass", "clean_glass", "acrylic"])
def test_glass_answers_as_a_wall_does(material):
    assert heard([wall((2, -3), (2, 3), material=material)], [0, 0, 0]) == pytest.approx([2.0])


def test_the_nearest_place_in_the_cone_that_faces_the_sonar_answers():
    """A wall turned by 10 deg shows its normal to a ray 10 deg off the axis."""
    turned = np.deg2rad(10.0)
    foot = 2.0 * np.array([np.cos(turned), np.sin(turned)])
    along = 3.0 * np.array([-np.sin(turned), np.cos(turned)])
    assert heard([wall(foot - along, foot + along)], [0, 0, 0]) == pytest.approx([2.0], abs=1e-3)


@pytest.mark.parametrize(("material", "answers"), [("plaster", False), ("glass", False), ("brick", True)])
def test_a_smooth_wall_beyond_its_limit_mirrors_the_sound_away(material, answers):
    slanted = wall((1, -2), (5, 2), material=material)
    assert np.isfinite(heard([slanted], [0, 0, 0])[0]) == answers


def test_the_echo_of_a_slanted_wall_comes_by_a_second_bounce():
    """Mirrored by 45 deg up to a wall that faces it: 3 m ahead and 1.5 m aside make 4.5 m."""
    walls = [wall((2, -1), (4, 1)), wall((1, 1.5), (5, 1.5))]
    assert heard(walls, [0, 0, 0], view_deg=1.0) == pytest.approx([4.5], abs=0.05)


def test_a_right_angled_corner_answers_at_its_own_distance():
    corner = [wall((2, 0), (0.5, 1.5)), wall((2, 0), (0.5, -1.5))]
    assert heard(corner, [0, 0, 0], view_deg=4.0) == pytest.approx([2.0], abs=0.02)


def test_a_pane_that_leans_beyond_the_cone_is_not_heard():
    assert heard([wall((2, -3), (2, 3), material="glass", lean_deg=14.0)], [0, 0, 0]) == pytest.approx([2.0])
    assert np.isinf(heard([wall((2, -3), (2, 3), material="glass", lean_deg=40.0)], [0, 0, 0]))


def test_soft_things_are_heard_less_far():
    assert np.isinf(heard([wall((3, -3), (3, 3), material="fabric")], [0, 0, 0]))
    assert heard([wall((2, -3), (2, 3), material="fabric")], [0, 0, 0]) == pytest.approx([2.0])


def test_nothing_is_heard_beyond_the_limit_and_legs_answer_first():
    assert np.isinf(heard([wall((5.2, -3), (5.2, 3))], [0, 0, 0]))
    legs = np.array([[1.5, 0.0, 0.0, 0.0, 0.06]])
    assert heard([wall((2, -3), (2, 3))], [0, 0, 0], circles=legs) == pytest.approx([1.44], abs=1e-3)


def test_sonars_fired_together_take_the_echo_of_each_other():
    """Two sonars 2 m apart look at one spot of a wall under 45 deg: neither hears itself, each the other."""
    walls = [wall((2, -3), (2, 3))]
    left, right = [1.0, 1.0, -np.pi / 4], [1.0, -1.0, np.pi / 4]
    assert np.isinf(heard(walls, left)).all()
    assert np.isinf(heard(walls, right)).all()
    assert heard(walls, left, right) == pytest.approx([math.sqrt(2)] * 2, abs=0.02)


def test_a_plate_on_the_way_keeps_two_sonars_apart():
    walls = [wall((2, -3), (2, 3)), wall((1.5, -0.2), (1.5, -0.9))]
    alone = [heard(walls, [1.0, 1.0, -np.pi / 4])[0], heard(walls, [1.0, -1.0, np.pi / 4])[0]]
    both = heard(walls, [1.0, 1.0, -np.pi / 4], [1.0, -1.0, np.pi / 4])
    assert np.array_equal(both, alone)


def meets(x, y, dx, dy, segment):
    """Distance along a ray to one segment by solving the two equations, inf for none."""
    a, b = segment[:2], segment[2:]
    system = np.array([[dx, a[0] - b[0]], [dy, a[1] - b[1]]])
    if abs(np.linalg.det(system)) < 1e-12:
        return np.inf
    t, share = np.linalg.solve(system, a - [x, y])
    return t if t > 1e-6 and 0.0 <= share <= 1.0 else np.inf


def naive_echo(x, y, dx, dy, ears, bounces=0, before=0.0, first=None):
    """A ray with at most one mirror on its way, and corners."""
    segments, limit, reach = ears.plan.segments, ears.acoustics.limit, ears.acoustics.reach
    distances = [meets(x, y, dx, dy, segment) for segment in segments]
    k = int(np.argmin(distances))
    path = before + distances[k]
    if path > ears.cone.range_max:
        return np.inf
    tangent = segments[k, 2:] - segments[k, :2]
    tangent = tangent / np.hypot(*tangent)
    normal = np.array([-tangent[1], tangent[0]])
    ahead = np.array([dx, dy])
    if np.arccos(min(1.0, abs(ahead @ normal))) <= limit[k] and path <= reach[k]:
        return path
    spot = np.array([x, y]) + distances[k] * ahead
    away = ahead - 2.0 * (ahead @ normal) * normal
    if bounces == 0:
        return naive_echo(*spot, *away, ears, 1, path, (np.array([x, y]), ahead, reach[k]))
    start, out, first_reach = first
    back = start - spot
    half = 0.5 * (path + np.hypot(*back))
    passes = abs(back[0] * away[1] - back[1] * away[0]) <= 0.15 and back @ away > 0.0
    returns = -(away @ out) >= np.cos(ears.cone.half_angle)
    return half if passes and returns and half <= min(first_reach, reach[k]) else np.inf


ROOM = [
    wall((0, 0), (3, 0), (3, 2), (0.4, 2.6), (0, 0)),
    wall((2.2, 0.8), (2.5, 1.4), material="brick"),
    wall((0.9, 1.6), (1.4, 1.5), material="fabric"),
]


@given(st.floats(0.6, 1.8), st.floats(0.2, 1.2), st.floats(-3.14, 3.14))
def test_rays_agree_with_their_naive_twin(x, y, angle):
    ears = array(ROOM)
    dx, dy = math.cos(angle), math.sin(angle)
    found = ray_echo(x, y, dx, dy, ears.plan, ears.acoustics, NOBODY, ears.cone)
    nearby = [naive_echo(x, y, math.cos(angle + d), math.sin(angle + d), ears) for d in (-1e-7, 0.0, 1e-7)]
    assert any(found == pytest.approx(value, abs=1e-4) for value in nearby)


@given(st.floats(-3.1, 3.1))
def test_a_mirror_keeps_the_angle_and_turns_the_normal(angle):
    ears = array([wall((2, -3), (2, 3))])
    dx, dy = math.cos(angle), math.sin(angle)
    mx, my = mirror(dx, dy, 0, ears.plan)
    assert (mx, my) == pytest.approx((-dx, dy))
    assert incidence(mx, my, 0, ears.plan) == pytest.approx(incidence(dx, dy, 0, ears.plan), abs=1e-7)


def test_readings_are_off_by_at_most_5_percent_and_11_cm_in_steps_of_1_cm():
    random = np.random.default_rng(1)
    for distance, bound in ((1.0, 0.06), (4.0, 0.11)):
        ears = array([wall((distance, -3), (distance, 3))])
        readings = np.array([ears.fire(np.zeros(3), np.array([0]), NOBODY, random)[0] for _ in range(500)])
        assert np.abs(readings - distance).max() <= bound + 1e-6
        assert np.abs(readings - distance).max() > 0.8 * bound
        assert np.std(readings) == pytest.approx(0.45 * bound, rel=0.15)
        assert 100 * readings == pytest.approx(np.round(100 * readings), abs=1e-3)


def test_silence_is_written_as_asked_and_sonars_that_rest_say_nothing():
    random, two = np.random.default_rng(1), ring([0, 0, 0], [0, 0, np.pi])
    for silence in (math.inf, 5.0):
        ears = array([wall((2, -3), (2, 3))], two, no_echo=silence)
        assert ears.fire(np.zeros(3), np.array([1]), NOBODY, random).tolist() == [
            pytest.approx(np.nan, nan_ok=True),
            silence,
        ]


def test_a_sweep_fires_every_sonar_once():
    model = sonar_model("pioneer-3dx")
    fired = np.concatenate(model.groups())
    assert sorted(fired.tolist()) == list(range(16))
    assert [group.tolist() for group in model.groups()][:2] == [[0, 8], [1, 9]]
    assert model.sweep_period == pytest.approx(0.32)
    nine = sonar_model("turtlebot-9")
    assert sorted(np.concatenate(nine.groups()).tolist()) == list(range(9))


@pytest.fixture(scope="module")
def simulation():
    return simulate(scene(), "rplidar", seed=7, sonar="pioneer-3dx")


@pytest.fixture(scope="module")
def readings(simulation):
    return [record for record in simulation.records() if isinstance(record, RangeRing)]


def test_readings_come_group_after_group_in_the_order_of_recording(simulation, readings):
    stamps = np.array([reading.stamp for reading in readings])
    assert np.diff(stamps) == pytest.approx(np.full(stamps.size - 1, 0.04), abs=2e-6)
    assert [np.flatnonzero(~np.isnan(r.ranges)).tolist() for r in readings[:9]] == [
        [k % 8, 8 + k % 8] for k in range(9)
    ]
    order = [record.record_stamp for record in simulation.records()]
    assert order == sorted(order)


def test_the_side_sonars_measure_the_room(readings):
    """The robot drives along y = 3 in a room of 6 m: 3 m to both sides, less the 0.136 m of the mounting."""
    sides = np.array([reading.ranges[0] for reading in readings if not np.isnan(reading.ranges[0])])
    assert np.median(sides) == pytest.approx(3.0 - 0.136, abs=0.05)


def test_sonars_change_nothing_of_what_else_is_recorded(simulation):
    without = simulate(scene(), "rplidar", seed=7)
    pairs = zip(
        (r for r in simulation.records() if not isinstance(r, RangeRing)), without.records(), strict=True
    )
    for one, two in pairs:
        assert type(one) is type(two)
        assert one.record_stamp == two.record_stamp
        if isinstance(one, LaserScan):
            assert one.ranges.tobytes() == two.ranges.tobytes()
        elif isinstance(one, Odometry):
            assert one.pose == two.pose


def test_every_sonar_has_a_topic_and_a_frame(simulation, readings, tmp_path):
    written = write_recording(simulation, tmp_path / "room.bag")
    with AnyReader([written.bag]) as reader:
        sonars = [c for c in reader.connections if c.msgtype == "sensor_msgs/msg/Range"]
        assert sorted(c.topic for c in sonars) == [f"/sonar_{k:02d}" for k in range(16)]
        fifth = [
            reader.deserialize(raw, c.msgtype)
            for c, _, raw in reader.messages(sonars)
            if c.topic == "/sonar_05"
        ]
        static = [c for c in reader.connections if c.topic == "/tf_static"]
        ((c, _, raw),) = reader.messages(static)
        links = reader.deserialize(raw, c.msgtype).transforms
    expected = [r for r in readings if not np.isnan(r.ranges[5])]
    assert [m.range for m in fifth] == [pytest.approx(r.ranges[5]) for r in expected]
    stamps = [m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for m in fifth]
    assert stamps == pytest.approx([r.stamp for r in expected], abs=1e-6)
    first = fifth[0]
    assert first.header.frame_id == "sonar_05"
    assert (first.radiation_type, first.min_range, first.max_range) == (0, pytest.approx(0.1), 5.0)
    assert first.field_of_view == pytest.approx(math.radians(30))
    assert [link.child_frame_id for link in links] == ["laser", *(f"sonar_{k:02d}" for k in range(16))]
    assert {link.header.frame_id for link in links} == {"base_link"}
    place = links[6].transform
    yaw = 2 * math.atan2(place.rotation.z, place.rotation.w)
    assert (place.translation.x, place.translation.y, yaw) == pytest.approx(
        (0.148, -0.078, math.radians(-30))
    )


def test_a_recording_reads_back_with_its_ring(simulation, readings, tmp_path):
    written = write_recording(simulation, tmp_path / "room.bag")
    recording = open_recording([written.bag])
    read = [record for record in recording.records() if isinstance(record, RangeRing)]
    assert recording.info.sonar_ring.poses == pytest.approx(simulation.sonar.ring.poses)
    assert [record.stamp for record in read] == pytest.approx([r.stamp for r in readings], abs=1e-6)
    both = zip(read, readings, strict=True)
    assert all(np.array_equal(one.ranges, two.ranges, equal_nan=True) for one, two in both)


def test_simulate_takes_a_ring_and_refuses_unknown_ones(tmp_path, capsys):
    room = tmp_path / "room.yaml"
    room.write_text(
        json.dumps(
            {
                "name": "room",
                "walls": [{"name": "room", "material": "plaster", "points": SQUARE, "closed": True}],
                "drive": {"waypoints": [{"at": [2, 3]}, {"at": [4, 3]}]},
            }
        )
    )
    words = ["simulate", str(room), "-o", str(tmp_path / "room.bag"), "--sensor", "rplidar", "--json"]
    assert main([*words, "--sonar", "pioneer-2dx"]) == 0
    assert json.loads(capsys.readouterr().out)["sonar"] == "pioneer-2dx"
    assert main([*words, "--overwrite", "--sonar", "bat"]) == 2
    assert capsys.readouterr().err.startswith("error: unknown sonar ring 'bat'")
    with pytest.raises(UsageError, match="unknown sonar ring"):
        simulate(scene(), sonar="bat")
