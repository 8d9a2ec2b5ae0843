"""What all tests share: where real recordings are, and a tiny finished run."""

import os
import signal
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import settings

from glassslam.config import Config
from glassslam.posegraph.graph import Constraint
from glassslam.records import RecordingInfo, Trajectory
from glassslam.session.identity import Recorded
from glassslam.slam.result import MapResult, OccupancyMap, RunStatistics, StageTime
from glassslam.slam.trajectory import PoseTracks

ROOT = Path(__file__).resolve().parents[1]

# the first call of a kernel compiles it, which no deadline foresees
settings.register_profile("glassslam", deadline=None)
settings.load_profile("glassslam")

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # a shell lets jobs in the background ignore Ctrl-C, and so would every process that tests begin
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of the real recordings; tests that need it are skipped where it is absent."""
    folder = Path(os.environ.get("GLASSSLAM_DATA", ROOT.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"no real recordings at {folder}; set GLASSSLAM_DATA")
    return folder


@pytest.fixture
def asked_runs(monkeypatch, tiny_result):
    """Runs asked for on the command line: recordings, options, config; each gives the tiny result."""
    asked = []

    class Run:
        def __init__(self, source, config, **_):
            source.config = config

        def hurry(self):
            raise AssertionError

        def finished(self):
            return SimpleNamespace(is_whole=True, config=tiny_result.config, result=lambda: tiny_result)

    def opened(recordings, options):
        asked.append(SimpleNamespace(recordings=recordings, options=options, config=None))
        return asked[-1]

    monkeypatch.setattr("glassslam.sources.open_recording", opened)
    monkeypatch.setattr("glassslam.api.RunInProgress", Run)
    monkeypatch.setattr("glassslam.session.session.identify", lambda path: Recorded(str(path), str(path), ""))
    return asked


def occupancy_map(drawing: str, resolution: float = 0.5, origin: tuple[float, float] = (0.0, 0.0)):
    """A map drawn with the highest y on top: # occupied, . free, + undecided, ? never observed."""
    values = {"#": 0.9, ".": 0.1, "+": 0.5, "?": np.nan}
    rows = [[values[cell] for cell in line.strip()] for line in drawing.strip().splitlines()]
    return OccupancyMap(np.array(rows[::-1], dtype=np.float32), resolution, origin)


@pytest.fixture
def draw_map():
    return occupancy_map


@pytest.fixture
def tiny_result() -> MapResult:
    """Two scans, one submap with two nodes, a map of 4 x 3 cells."""
    grid = occupancy_map("####\n #..+\n ####\n".replace(" ", ""), origin=(-1.0, -0.5))
    track = Trajectory(
        np.array([1031745824.658, 1031745825.097833]), np.array([[0.0, 0.0, 0.0], [0.3, 0.4, 0.1]])
    )
    return MapResult(
        map=grid,
        lidar_map=grid,
        closed_map=None,
        tracks=PoseTracks(track, track, track, track),
        submap_nodes=(0,),
        constraints=(
            Constraint(0, 1, np.array([0.3, 0.4, 0.1]), np.diag([2.0, 2.0, 4.0]), "odometry"),
            Constraint(0, 1, np.array([0.3, 0.4, 0.1]), np.diag([2.0, 3.0, 4.0]), "loop"),
        ),
        config=Config(),
        statistics=RunStatistics(
            scans_read=2,
            scans_used=2,
            recording_seconds=0.44,
            stages={"matching": StageTime(0.25, 0.5)},
            nodes=2,
            submaps=1,
            closures_tried=3,
            closures_accepted=1,
            closures_rejected={"low score": 2},
            residuals={"loop_translation_rms": 0.01},
            warnings=["no odometry"],
        ),
        info=RecordingInfo(("run.clf.gz",), "carmen", 0.44, 2),
    )
