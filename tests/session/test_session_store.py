"""A finished run with everything a run can hold comes back from its session bit by bit."""

import os
import shutil
from dataclasses import replace

import numpy as np
import pytest
from sameness import differences

import glassslam as gs
from glassslam.errors import SessionError
from glassslam.records import Damage
from glassslam.session import Session
from glassslam.simulation import Scene, find_scene, simulate, write_recording
from glassslam.slam.result import MapResult

CONFIG = gs.Config.from_mapping(
    {
        "glass": {"scheme": "local"},
        "submap": {"num_range_data": 12},
        "sonar": {"scan_filter": {"enabled": True}},
    }
)
DAMAGE = (
    Damage("half.bag", 4096, 512, 10.5, None, 12, "checksum"),
    Damage("half\udcff.bag", 1 << 40, 1, None, None, 0, "cut 'off'\n"),
)


@pytest.fixture(scope="module")
def storeroom(tmp_path_factory):
    """Half a minute of a robot with lidar, ring of sonars and a 3D ultrasonic sensor before glass."""
    scene = Scene.load(find_scene("storeroom"))
    plan = scene.model_dump(exclude_unset=True)
    plan["drive"]["waypoints"] = plan["drive"]["waypoints"][:4]
    bag = tmp_path_factory.mktemp("storeroom") / "storeroom.bag"
    write_recording(simulate(Scene.model_validate(plan), seed=1, sonar="pioneer-3dx"), bag)
    return bag


@pytest.fixture(scope="module")
def run(storeroom, tmp_path_factory):
    """The run, and its session with some damage and warnings."""
    path = tmp_path_factory.mktemp("session") / "session.db"
    with Session.create(path, [storeroom], CONFIG) as session:
        whole = gs.run_slam(storeroom, CONFIG, session=session)
        facts = replace(
            whole.facts, damage=DAMAGE, dropped={"no range": 3, "a": 1}, warnings=("Gerät <b>", "x")
        )
        session.save(replace(whole, facts=facts))
    return replace(whole, facts=facts), path


def loaded(path):
    with Session.open(path) as session:
        return session.load()


def timeless(run):
    """A run without what it has cost."""
    statistics = replace(run.settled.statistics, stages={})
    return replace(run, settled=replace(run.settled, statistics=statistics, stages=None))


def plain(run, with_cells=True):
    """A run in which grids are arrays; their cells are kept only where glass is locked in them."""
    settled = timeless(run).settled
    submaps = [(s.index, s.local_pose, s.nodes, s.finished, s.grid.resolution) for s in settled.submaps]
    if with_cells:
        submaps.append([(s.grid.cells, s.grid.origin) for s in settled.submaps])
    lists = {"sweeps": list(run.sweeps), "points": list(run.points), "config": settled.config.dump()}
    return replace(settled, submaps=(), config=None), submaps, run.facts, run.is_whole, lists


def test_the_run_of_this_test_holds_everything(run):
    settled, whole = run[0].settled, run[0]
    assert min(map(len, (whole.sweeps, whole.points, settled.nodes, settled.constraints))) > 50
    assert len(settled.submaps) > 2
    assert len(settled.glass.observations) > 10
    assert len(settled.glass.beams) > 10
    assert settled.glass.calibration.evidence["scans"] > 0
    assert whole.facts.info.sonar_ring.name or len(whole.facts.info.sonar_ring.poses) == 16


def test_every_bit_comes_back(run):
    expected, path = run
    assert differences(plain(expected), plain(loaded(path))) == []


def same_result(found, expected):
    """Where the results of two runs differ; trees and models by what they print."""
    at = []
    for name in MapResult.__slots__:
        a, b = getattr(found, name), getattr(expected, name)
        if name == "volume":
            at += differences(a.tree.leaves(), b.tree.leaves(), name)
            at += differences(a.map, b.map, name)
        elif name == "config":
            at += differences(a.dump(), b.dump(), name)
        elif name == "statistics":
            at += differences(replace(a, stages={}), replace(b, stages={}), name)
        elif name == "glass":
            at += differences(replace(a, walls=tuple(a.walls)), replace(b, walls=tuple(b.walls)), name)
        else:
            at += differences(a, b, name)
    return at


def test_what_is_drawn_from_it_is_the_same(run):
    expected, path = run
    assert same_result(loaded(path).result(), expected.result()) == []


def test_saving_it_once_more_changes_no_byte(run, tmp_path):
    """However often a run is saved and loaded, its session is the same file."""
    files = []
    for name, times in (("once", 1), ("thrice", 3)):
        (tmp_path / name).mkdir()
        shutil.copyfile(run[1], tmp_path / name / "session.db")
        with Session.open(tmp_path / name / "session.db") as session:
            for _ in range(times):
                session.save(session.load())
            files.append(session.settle_in(tmp_path / name).read_bytes())
        assert os.listdir(tmp_path / name) == ["session.db"]  # noqa: PTH208
    assert files[0] == files[1]


def test_arrays_may_be_written_to(run):
    settled = loaded(run[1]).settled
    for array in (settled.tracks.final.poses, settled.glass.observations.position, settled.nodes[0].returns):
        array[0] = 1.0
    settled.submaps[0].grid.cells[0] = 1


SMALL = gs.Config()


def least_run():
    """The least there is: one scan, no odometry, no glass."""
    wall = 2.0 / np.cos(-0.8 + 0.0175 * np.arange(90)).astype(np.float32)
    mapper = gs.Mapper(SMALL)
    mapper.add(gs.LaserScan(0.0, wall, -0.8, 0.0175, 0.1, 10.0))
    return mapper.settle()


def test_the_least_run_comes_back(tmp_path):
    from glassslam.finished import FinishedRun, SourceFacts
    from glassslam.records import RecordingInfo

    facts = SourceFacts(RecordingInfo(("one.log",), "carmen", 0.0, 0, no_echo=float("inf")), {})
    recording = tmp_path / "one.log"
    recording.write_bytes(b"")
    run = FinishedRun(least_run(), facts)
    with Session.create(tmp_path / "session.db", [recording], SMALL) as session:
        for node in run.settled.nodes:
            session.journal.keep_scan(node.stamp, outcome_of(node), node)
        session.save(run)
    assert differences(plain(run, False), plain(loaded(tmp_path / "session.db"), False)) == []


def outcome_of(node):
    from glassslam.slam.journal import ScanOutcome
    from glassslam.slam.tracking import Match, Tracking

    return ScanOutcome(Match(node.pose_in_local, node.residual), Tracking(), 90, True)


def test_a_run_that_is_not_finished_has_no_result(tmp_path):
    recording = tmp_path / "one.log"
    recording.write_bytes(b"")
    with Session.create(tmp_path / "session.db", [recording]) as session:
        assert not session.is_finished
        with pytest.raises(SessionError, match="is not finished") as raised:
            session.load()
    assert raised.value.hint == "go on with glassslam map --resume"


def test_stages_are_not_kept(run):
    assert loaded(run[1]).settled.stages.times == {}
