"""`import glassslam`: names, and a recording mapped in one call."""

import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest

import glassslam as gs
from glassslam import api, finished
from glassslam.errors import RecordingError
from glassslam.records import LaserScan, Odometry, RecordingInfo
from glassslam.slam.settled import SettledRun


def scan(stamp):
    return LaserScan(stamp, np.ones(3, np.float32), 0.0, 0.1, 0.1, 10.0)


class Source:
    """A recording that lives in memory, and remembers how it was opened."""

    def __init__(self, paths, options):
        self.paths, self.options = paths, options
        self.info = RecordingInfo(tuple(map(str, paths)), "carmen", 2.0, 3, (0.1, 0.2, 0.3))
        self.dropped, self.warnings, self.damage = {}, [], []

    def records(self):
        yield from (scan(10.0), Odometry(10.5, (0.0, 0.0, 0.0)), scan(12.0), scan(11.5))
        self.dropped["no numbers"] = 4
        self.warnings.append("stamps step back")


@pytest.fixture
def world(monkeypatch, tiny_result):
    """The source and the mapper, replaced by ones that take notes."""
    notes = SimpleNamespace(records=[])

    class Mapper:
        is_hurried = False

        def __init__(self, config, base_from_laser, journal):
            notes.config, notes.base_from_laser, notes.journal = config, base_from_laser, journal

        def add(self, record):
            notes.records.append(record)

        def settle(self):
            notes.settled = SettledRun(notes.config, (), (), (), None, None)
            return notes.settled

        def hurry(self):
            self.is_hurried = True

        def close(self):
            notes.closed = True

    def drawn(run, info, sources=()):
        notes.drawn = (run, info)
        return tiny_result

    def open_recording(paths, options):
        notes.source = Source(paths, options)
        return notes.source

    monkeypatch.setitem(sys.modules, "glassslam.slam.mapper", SimpleNamespace(Mapper=Mapper))
    monkeypatch.setattr(api, "open_recording", open_recording)
    monkeypatch.setattr(finished, "draw", drawn)
    return notes


def test_every_record_reaches_the_mapper_in_order(world, tiny_result):
    assert gs.map_recording("run.clf").map is tiny_result.map
    assert [record.stamp for record in world.records] == [10.0, 10.5, 12.0, 11.5]
    assert world.source.paths == ["run.clf"]
    assert world.config == gs.Config()
    assert world.base_from_laser == (0.1, 0.2, 0.3)
    assert world.drawn == (world.settled, world.source.info)
    assert world.journal is None


def test_results_of_one_run_can_be_drawn_again(world, tiny_result):
    told = []
    run = api.run_slam("run.clf", progress=told.append)
    assert run.settled is world.settled
    assert not hasattr(world, "drawn")
    assert told[-1].stage == "done"
    assert run.is_whole
    assert run.result().statistics == run.result().statistics
    assert run.with_config(gs.Config.from_mapping({"map": {"resolution": 0.2}})).config.map.resolution == 0.2
    assert len(world.records) == 4


def test_a_run_told_to_hurry_reads_no_further(world, monkeypatch):
    run = api.RunInProgress(Source(["run.clf"], None))

    def hurrying(self):
        yield scan(10.0)
        run.hurry()
        yield scan(12.0)

    monkeypatch.setattr(Source, "records", hurrying)
    assert not run.finished().is_whole
    assert [record.stamp for record in world.records] == [10.0]
    assert (run.scans, run.recorded_seconds) == (1, 0.0)


def test_configuration_options_and_several_paths_are_handed_on(world):
    config = gs.Config.from_mapping({"sensor": {"max_range": 7}})
    options = gs.SourceOptions(every=2)
    gs.map_recording(["a.clf", "b.clf"], config, source_options=options)
    assert world.config is config
    assert world.source.options is options
    assert world.source.paths == ["a.clf", "b.clf"]


def test_what_the_source_dropped_and_said_is_in_the_result(world):
    statistics = gs.map_recording("run.clf").statistics
    assert statistics.messages_dropped == {"no numbers": 4}
    assert statistics.warnings == ["stamps step back", "no odometry"]


def test_progress_is_told_to_the_end(world, monkeypatch):
    monkeypatch.setattr(api, "_SECONDS_BETWEEN_REPORTS", 0.0)
    told = []
    gs.map_recording("run.clf", progress=told.append)
    assert [(p.stage, p.scans, p.recorded_seconds) for p in told] == [
        ("mapping", 1, 0.0),
        ("mapping", 2, 2.0),
        ("mapping", 3, 2.0),
        ("finishing", 3, 2.0),
        ("done", 3, 2.0),
    ]
    assert told[0].info is world.source.info


def test_a_run_that_fails_leaves_no_work_in_the_background(world, monkeypatch):
    def fail(self):
        yield scan(10.0)
        raise RecordingError("cut short")

    monkeypatch.setattr(Source, "records", fail)
    with pytest.raises(RecordingError, match="cut short"):
        gs.map_recording("run.clf")
    assert world.closed


@pytest.mark.parametrize("name", gs.__all__)
def test_every_public_name_exists_and_is_documented(name):
    assert getattr(gs, name).__doc__
    assert name in dir(gs)


def test_unknown_names_are_refused():
    with pytest.raises(AttributeError, match="module 'glassslam' has no attribute 'nonsense'"):
        gs.nonsense  # noqa: B018


def test_importing_is_cheap():
    heavy = {"numpy", "scipy", "numba", "casadi", "rosbags", "cv2", "pydantic"}
    code = f"import glassslam, sys; print(sorted({heavy!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
