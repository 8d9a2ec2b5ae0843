"""Small runs whose session is killed, cut and taken up again, and what counts as the same results."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "slam"))
from slam_worlds import RING, drive, odometry, recording

from glassslam.cli import main
from glassslam.records import LaserScan
from glassslam.session import SESSION_FILE
from glassslam.simulation import write_rosbag1
from glassslam.slam import mapper

PROGRAM = [sys.executable, "-c", "import sys; from glassslam.cli import main; sys.exit(main())"]

_RESTING = """
import sys, time
from glassslam.cli import main
from glassslam.slam.mapper import Mapper
place = Mapper._place
def resting(self, timed):
    time.sleep({pause})
    return place(self, timed)
Mapper._place = resting
sys.exit(main())
"""

_CORNERS = [(1.25, 1.25), (14.75, 1.25), (14.75, 10.75), (1.25, 10.75), (1.25, 1.25), (6.0, 1.25)]
PATH = drive(*_CORNERS, step=0.2)
"""Once around the corridor of RING and on, so that the loop closes."""

WORDS = [
    *("--set", "submap.num_range_data=15", "--set", "optimization.optimize_every_n_nodes=25"),
    *("--set", "loop_closure.min_node_gap=40", "--set", "loop_closure.sampling_stride=2"),
    *("--set", "glass.detector=intensity_peak", "--set", "glass.scheme=local", "--quiet"),
]
"""Submaps and rounds of searches as small as the run."""
SHORT = ["--set", "glass.detector=off", "--quiet"]
"""Options of runs over a few scans."""


def write_ring(bag, path=PATH):
    """The recording of a lidar with intensities and of wheels that err, on PATH or another one."""
    random = np.random.default_rng(3)
    wheels = odometry(path, scale=1.01, drift=0.004)

    def bright(record):
        if not isinstance(record, LaserScan):
            return record
        strength = random.uniform(500, 3500, len(record.ranges)).astype(np.float32)
        return replace(record, intensities=strength)

    write_rosbag1(map(bright, recording(RING, path, wheels, beams=240)), bag)
    return bag


def results(folder):
    """Every file of a results directory without what the run has cost."""
    content = {path.name: path.read_bytes() for path in folder.iterdir()}
    report = json.loads(content["report.json"])
    content["report.json"] = {k: v for k, v in report.items() if k not in ("stages", "resources")}
    page = content["report.html"].decode()
    costless, count = re.subn(r"<section>\s*<h2>Time and memory</h2>.*?</section>", "", page, flags=re.DOTALL)
    assert count == 1
    content["report.html"] = costless
    return content


def assert_same_results(folder, expected):
    """Bytes of all files as expected; names what differs."""
    found = results(folder)
    assert found.keys() == expected.keys()
    assert [name for name in found if found[name] != expected[name]] == []


@contextmanager
def ringing_after(scans, number=signal.SIGINT, times=1):
    """Send this process a signal at a scan of a run, or several at that scan and those after it."""
    place, count = mapper.Mapper._place, 0

    def counted(self, timed):
        nonlocal count
        count += 1
        if scans <= count < scans + times:
            signal.raise_signal(number)
        return place(self, timed)

    mapper.Mapper._place = counted
    try:
        yield
    finally:
        mapper.Mapper._place = place


def interrupted(words, after, number=signal.SIGINT):
    """Run a command that is interrupted after so many scans; its exit code."""
    with ringing_after(after, number):
        return main(words)


def session_files(folder):
    """The session of a working directory with what the database keeps beside it."""
    return [path for path in folder.iterdir() if path.name.startswith(SESSION_FILE)]


def rows_of(database, table):
    """Number of rows of a table."""
    return database.execute(f"SELECT count(*) FROM {table}").fetchone()[0]  # noqa: S608  (own names only)


def snapshot(folder, target):
    """What a process killed in this moment would leave of a session."""
    target.mkdir(parents=True)
    for path in session_files(folder):
        shutil.copyfile(path, target / path.name)
    return target


def start(words, folder, pause=0.0, **options):
    """`glassslam` in a process of its own, which may rest after every scan, s."""
    program = [sys.executable, "-c", _RESTING.format(pause=pause)] if pause else PROGRAM
    return subprocess.Popen(
        [*program, *map(str, words)],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **options,
    )  # fmt: skip


def ended(process, timeout=300):
    """Exit code and standard error of a process."""
    _, error = process.communicate(timeout=timeout)
    return process.returncode, error


def environment(**more):
    """The environment with one computing thread."""
    names = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
    return {**os.environ, **dict.fromkeys(names, "1"), **more}
