"""Recordings that break off: the run is split there, and joined again where the robot knows the place."""

from dataclasses import replace

import numpy as np
import pytest
from slam_worlds import CORRIDOR, RING, ROOM, drive, in_first_frame, odometry, recording, round_trip

from glassslam.config import Config
from glassslam.geometry import between
from glassslam.slam.journal import NoJournal
from glassslam.slam.mapper import Mapper

TOUR = drive((1.2, 0.8), (5.5, 0.8), (5.5, 4.2), (2.0, 4.2), (2.0, 1.0))
"""14 m through the room."""
CARRIED = drive((4.6, 4.3), (1.2, 4.3), (1.2, 1.0), (5.0, 1.0))
"""12 m more, begun 3.3 m from the end of the tour and looking the other way."""
HOUR = 3600.0


def mapped(records, **sections):
    """The result of a run."""
    mapper = Mapper(Config.from_mapping(sections))
    for record in records:
        mapper.add(record)
    return mapper.finish()


def worst(result, poses):
    """Largest distance, m, and turn, rad, from the truth, both seen from the first pose."""
    off = between(in_first_frame(poses), result.trajectory.poses)
    return np.hypot(off[:, 0], off[:, 1]).max(), np.abs(off[:, 2]).max()


def kinds(result):
    return [one.kind for one in result.statistics.degeneracies]


def told(result, kind):
    return next(one for one in result.statistics.degeneracies if one.kind == kind)


def set_back(records, after, seconds):
    """The records with the clock set back after a stamp."""
    return [replace(r, stamp=r.stamp - seconds if r.stamp > after else r.stamp) for r in records]


@pytest.mark.parametrize("has_wheels", [True, False], ids=["with odometry", "without odometry"])
def test_a_clock_set_back_while_the_robot_drives(has_wheels):
    records = recording(ROOM, TOUR, odometry(TOUR, scale=1.02) if has_wheels else None)
    result = mapped(set_back(records, records[0].stamp + 0.05 * len(TOUR), HOUR))
    distance, turn = worst(result, TOUR)
    assert distance < 0.08
    assert turn < 0.03
    assert result.statistics.tracking["stretches"] == 2
    assert "clock jump" in kinds(result)
    assert "stamps step back by 60.0 min: split, and rejoined by" in told(result, "clock jump").text
    assert any(
        "the recording breaks off once; what follows is joined" in w for w in result.statistics.warnings
    )


@pytest.mark.parametrize("seconds", [-HOUR, 60.0], ids=["clock set back", "silent for a minute"])
def test_a_robot_carried_elsewhere_in_between(seconds):
    poses = np.vstack((TOUR, CARRIED))
    gap = abs(between(TOUR[-1], CARRIED[0]))
    assert np.hypot(gap[0], gap[1]) > 3.0
    records = recording(ROOM, poses)
    records = [replace(r, stamp=r.stamp + seconds * (k >= len(TOUR))) for k, r in enumerate(records)]
    result = mapped(records)
    distance, turn = worst(result, poses)
    assert distance < 0.1
    assert turn < 0.03
    one = told(result, "clock jump" if seconds < 0 else "silence")
    assert (one.first_scan, one.last_scan) == (len(TOUR) - 1, len(TOUR))
    assert float(one.text.split(", ")[-1].split(" m and ")[0]) == pytest.approx(np.hypot(*gap[:2]), abs=0.1)
    assert one.length == pytest.approx(0.0)
    assert one.start_place == pytest.approx(tuple(in_first_frame(poses)[len(TOUR) - 1, :2]), abs=0.1)


def test_odometry_that_starts_from_zero_after_the_break_says_nothing_of_it():
    poses = np.vstack((TOUR, CARRIED))
    wheels = np.vstack((odometry(TOUR) + np.array([20.0, 5.0, 0.0]), odometry(CARRIED)))
    records = [
        replace(r, stamp=r.stamp + 60.0 * (k // 2 >= len(TOUR)))
        for k, r in enumerate(recording(ROOM, poses, wheels))
    ]
    assert worst(mapped(records), poses)[0] < 0.1


def test_a_place_never_seen_before_is_not_joined_and_told():
    first, second = drive((1.2, 0.8), (5.5, 0.8)), drive((-5.0, 1.0), (5.0, 1.0))
    records = recording(ROOM, first)
    later = recording(CORRIDOR, second, start=400.0)
    result = mapped([*records, *later])
    assert "silence, not rejoined" in kinds(result)
    text = told(result, "silence, not rejoined").text
    loose = f"split, and not rejoined: scans {len(first)} to {len(first) + len(second) - 1} ("
    assert loose in text
    assert "m) hang loose, their place in the map is a guess" in text
    assert any(
        "breaks off once, and the map is in pieces that may be drawn over each other" in warning
        for warning in result.statistics.warnings
    )
    assert np.isfinite(result.trajectory.poses).all()


def test_a_break_does_not_smear_the_map_of_before():
    """Scans between the last node of one stretch and the break stay with that stretch."""
    poses = np.vstack((TOUR, CARRIED))
    records = [
        replace(r, stamp=r.stamp + 60.0 * (k >= len(TOUR))) for k, r in enumerate(recording(ROOM, poses))
    ]
    result = mapped(records)
    steps = between(result.trajectory.poses[:-1], result.trajectory.poses[1:])
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    assert lengths.argmax() == len(TOUR) - 1
    assert np.delete(lengths, len(TOUR) - 1).max() < 0.15


def test_two_clocks_in_one_recording_do_not_tear_every_scan():
    records = recording(ROOM, TOUR[:80])
    result = mapped([replace(r, stamp=r.stamp - HOUR * (k % 2)) for k, r in enumerate(records)])
    assert result.statistics.tracking["stretches"] < 12
    assert worst(result, TOUR[:80])[0] < 0.2


def test_a_silent_lidar_beside_talking_wheels_is_no_break():
    poses = round_trip(0.6)
    records = recording(RING, poses, odometry(poses))
    silent = [r for r in records if not (hasattr(r, "ranges") and 105.0 < r.stamp < 112.0)]
    result = mapped(silent)
    assert result.statistics.tracking["stretches"] == 1
    assert "tracking went on across it" in told(result, "silence").text
    kept = [k for k in range(len(poses)) if not 105.0 < 100.0 + 0.1 * k < 112.0]
    assert worst(result, poses[kept])[0] < 0.25


def test_without_loop_closures_a_break_stays_open():
    records = recording(ROOM, TOUR)
    broken = set_back(records, records[0].stamp + 5.0, HOUR)
    result = mapped(broken, loop_closure={"enabled": False})
    assert "clock jump, not rejoined" in kinds(result)


def test_the_same_records_give_the_same_poses():
    records = [
        replace(r, stamp=r.stamp + 60.0 * (k >= len(TOUR)))
        for k, r in enumerate(recording(ROOM, np.vstack((TOUR, CARRIED))))
    ]
    one, two = mapped(records), mapped(records)
    np.testing.assert_array_equal(one.trajectory.poses, two.trajectory.poses)
    assert one.statistics.degeneracies == two.statistics.degeneracies


class Notes(NoJournal):
    """Remembers outcomes, and gives them back to a second run."""

    def __init__(self, scans=(), rounds=()):
        self.scans, self.rounds = [], []
        self._scans, self._rounds = list(scans), list(rounds)

    def recall_scan(self):
        return self._scans.pop(0) if self._scans else None

    def keep_scan(self, stamp, outcome, node):
        self.scans.append(outcome)

    def recall_round(self):
        return self._rounds.pop(0) if self._rounds else None

    def keep_round(self, closures):
        self.rounds.append(list(closures))


def test_a_run_with_a_break_that_is_taken_up_again_is_the_same():
    records = set_back(recording(ROOM, TOUR), 100.0 + 0.05 * len(TOUR), HOUR)

    def run(notes):
        mapper = Mapper(Config(), journal=notes)
        for record in records:
            mapper.add(record)
        return mapper.finish()

    first = Notes()
    whole = run(first)
    assert len(first.scans) == len(TOUR)
    assert len(first.rounds) > 0
    resumed = run(Notes(first.scans[: len(TOUR) * 3 // 4], first.rounds))
    np.testing.assert_array_equal(whole.trajectory.poses, resumed.trajectory.poses)
    assert whole.statistics.degeneracies == resumed.statistics.degeneracies
    assert whole.statistics.tracking == resumed.statistics.tracking
