"""The same bytes of every output, on one computing thread or two, on one core or two."""

import os

import pytest
from session_worlds import WORDS, ended, environment, results, start, write_ring

CORES = sorted(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else [0]


def mapped(words, folder, name, threads, cores):
    """Results of a run in a process of its own with so many threads on some cores."""
    counts = dict.fromkeys(("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), str(threads))
    if len(CORES) < 2:
        pytest.skip("this machine has one core")
    process = start(
        [*words, "-o", folder / name], folder, env=environment(**counts),
        preexec_fn=lambda: os.sched_setaffinity(0, cores),
    )  # fmt: skip
    assert ended(process, timeout=1500) == (0, "")
    return results(folder / name)


def assert_equal_on_one_and_two(words, folder):
    one = mapped(words, folder, "one", 1, CORES[:1])
    two = mapped(words, folder, "two", 2, CORES[:2])
    assert one.keys() == two.keys()
    assert [name for name in one if one[name] != two[name]] == []
    return one


def test_a_simulated_recording(tmp_path):
    words = ["map", write_ring(tmp_path / "ring.bag"), *WORDS]
    found = assert_equal_on_one_and_two(words, tmp_path)
    assert found["report.json"]["closures"]["accepted"] >= 5
    assert {"glass.geojson", "glass_beams.npz", "labels.png", "session.db"} <= set(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    "log", ["freiburg/mit-csail.clf.gz", "freiburg/aces.clf.gz", "glass_corridor/57068e0c49.bag"]
)
def test_a_real_log(data_dir, tmp_path, log):
    found = assert_equal_on_one_and_two(["map", data_dir / log, "-q"], tmp_path)
    assert len(found["trajectory.tum"]) > 2000


@pytest.mark.slow
def test_a_real_log_with_sonars(data_dir, tmp_path):
    folder = data_dir / "pimap"
    words = ["map", folder / "scene4.bag", "--sonar", folder / "scene4_sonar.txt", "-q"]
    found = assert_equal_on_one_and_two(words, tmp_path)
    assert {"sonar_map.pgm", "fused_map.pgm"} <= set(found)
