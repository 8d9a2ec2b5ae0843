import hashlib
import json
from pathlib import Path

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from tiny_scene import scene

from glassslam.errors import OutputError
from glassslam.outputs import read_tum
from glassslam.records import LaserScan, Odometry
from glassslam.simulation import simulate, truth_paths, write_recording, write_rosbag1

LASER = (0.2, -0.1, 0.3)


def messages(bag, topic):
    with AnyReader([bag]) as reader:
        wanted = [connection for connection in reader.connections if connection.topic == topic]
        return [
            (stamp, reader.deserialize(raw, connection.msgtype))
            for connection, stamp, raw in reader.messages(wanted)
        ]


def seconds(header):
    return header.stamp.sec + header.stamp.nanosec * 1e-9


def yaw(rotation):
    return 2 * np.arctan2(rotation.z, rotation.w)


@pytest.fixture(scope="module")
def simulation():
    return simulate(scene(laser_pose=LASER), "rplidar", seed=7)


@pytest.fixture(scope="module")
def written(simulation, tmp_path_factory):
    return write_recording(simulation, tmp_path_factory.mktemp("bag") / "room.bag")


def test_scans_read_back_as_they_were_simulated(simulation, written):
    scans = [record for record in simulation.records() if isinstance(record, LaserScan)]
    read = messages(written.bag, "/scan")
    assert written.scans == len(read) == len(scans)
    for (recorded, message), scan in zip(read, scans, strict=True):
        assert seconds(message.header) == pytest.approx(scan.stamp, abs=1e-6)
        assert recorded * 1e-9 == pytest.approx(scan.record_stamp, abs=1e-6)
        assert message.ranges.tobytes() == scan.ranges.tobytes()
        assert message.intensities.tobytes() == scan.intensities.tobytes()
        assert message.header.frame_id == "laser"
    first = read[0][1]
    assert (first.angle_min, first.angle_increment) == pytest.approx((-np.pi, np.deg2rad(1)))
    assert first.angle_max == pytest.approx(np.deg2rad(179))
    assert first.time_increment == pytest.approx(1 / 5.8 / 360)
    assert (first.range_min, first.range_max) == pytest.approx((0.15, 5.0))


def test_odometry_is_written_as_message_and_as_transform(simulation, written):
    odometry = [record for record in simulation.records() if isinstance(record, Odometry)]
    read, transforms = messages(written.bag, "/odom"), messages(written.bag, "/tf")
    assert len(read) == len(transforms) == len(odometry)
    for (_, message), (_, tf), record in zip(read, transforms, odometry, strict=True):
        pose = message.pose.pose
        assert (pose.position.x, pose.position.y, yaw(pose.orientation)) == pytest.approx(record.pose)
        (link,) = tf.transforms
        assert (link.header.frame_id, link.child_frame_id) == ("odom", "base_link")
        translation = link.transform.translation
        assert (translation.x, translation.y, yaw(link.transform.rotation)) == pytest.approx(record.pose)
        assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")


def test_the_pose_of_the_laser_is_written_once(written):
    ((_, message),) = messages(written.bag, "/tf_static")
    (link,) = message.transforms
    assert (link.header.frame_id, link.child_frame_id) == ("base_link", "laser")
    translation = link.transform.translation
    assert (translation.x, translation.y, yaw(link.transform.rotation)) == pytest.approx(LASER)


def test_the_true_trajectory_reads_back(simulation, written):
    truth = read_tum(written.true_trajectory)
    assert written.true_trajectory.name == "room.bag.truth.tum"
    assert truth.stamps == pytest.approx(simulation.truth.stamps, abs=1e-6)
    assert truth.poses == pytest.approx(simulation.truth.poses, abs=1e-8)


def test_the_true_plan_names_every_surface(simulation, written):
    plan = json.loads(written.true_plan.read_text())
    assert (plan["scene"], plan["sensor"], plan["seed"]) == ("room", "rplidar", 7)
    assert plan["laser_pose"] == list(LASER)
    (wall,) = plan["walls"]
    assert (wall["name"], wall["material"]) == ("room", "plaster")
    assert wall["segments"] == simulation.plan.segments.tolist()
    assert plan["materials"] == {"plaster": {"kind": "diffuse", "reflectance": 0.85}}


def test_the_same_seed_gives_the_same_bytes(simulation, written, tmp_path):
    again = write_recording(simulate(scene(laser_pose=LASER), "rplidar", seed=7), tmp_path / "room.bag")
    for one, two in zip(
        (written.bag, *truth_paths(written.bag)), (again.bag, *truth_paths(again.bag)), strict=True
    ):
        assert hashlib.sha256(one.read_bytes()).digest() == hashlib.sha256(two.read_bytes()).digest()


def test_progress_is_told_in_recorded_seconds(simulation, tmp_path):
    told = []
    write_recording(simulation, tmp_path / "room.bag", told.append)
    assert told[0] == pytest.approx(0.0)
    assert told[-1] == pytest.approx(simulation.motion.times[-1], abs=0.5)


class Killed(BaseException):
    """Ends everything at once."""


def test_no_bag_ever_stands_beside_the_truth_of_another(simulation, tmp_path, monkeypatch):
    bag = write_recording(simulation, tmp_path / "room.bag").bag
    before, beside = bag.read_bytes(), []

    def watched(unlink, path, **more):
        beside.append(bag.read_bytes() == before)
        unlink(path, **more)

    def killed(*_):
        raise Killed

    unlink = Path.unlink
    monkeypatch.setattr(Path, "unlink", lambda path, **more: watched(unlink, path, **more))
    monkeypatch.setattr("glassslam.simulation.recording.write_truth", killed)
    with pytest.raises(Killed):
        write_recording(simulate(scene(laser_pose=LASER), "rplidar", seed=8), bag)
    truths = len(truth_paths(bag))
    assert beside[: truths + 1] == [True] * (truths + 1)  # what a killed run has left, and every truth
    assert bag.read_bytes() != before
    assert list(tmp_path.iterdir()) == [bag]


def test_a_recording_that_fails_keeps_the_bag_and_its_truth(simulation, tmp_path):
    bag = write_recording(simulation, tmp_path / "room.bag").bag
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}

    def breaks(_seconds):
        raise Killed

    with pytest.raises(Killed):
        write_recording(simulate(scene(laser_pose=LASER), "rplidar", seed=8), bag, breaks)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.parametrize("end", [MemoryError, KeyboardInterrupt, OutputError])
def test_a_bag_whose_truth_fails_goes_with_it(simulation, tmp_path, monkeypatch, end):
    def fails(*_):
        (tmp_path / "room.bag.truth.json").write_text("{}")
        raise end("no more")

    monkeypatch.setattr("glassslam.simulation.recording.write_truth", fails)
    with pytest.raises(end):
        write_recording(simulation, tmp_path / "room.bag")
    assert list(tmp_path.iterdir()) == []


def test_an_interrupted_recording_leaves_nothing_behind(simulation, tmp_path):
    def breaks(_record):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_rosbag1(simulation.records(), tmp_path / "room.bag", LASER, breaks)
    assert list(tmp_path.iterdir()) == []


def test_a_bag_that_cannot_be_written_is_one_clear_line(simulation, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match=r"cannot write .*/file/room\.bag: "):
        write_recording(simulation, tmp_path / "file" / "room.bag")
