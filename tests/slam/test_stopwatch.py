"""Seconds per stage."""

import threading
from contextlib import suppress

import pytest

from glassslam.slam.stopwatch import Stages


def test_seconds_of_a_stage_add_up():
    stages = Stages()
    stages.add("matching", 1.0, 0.5)
    stages.add("matching", 2.0, 0.25)
    stages.add("drawing", 4.0, 4.0)
    assert (stages.times["matching"].wall, stages.times["matching"].cpu) == (3.0, 0.75)
    assert stages.times["drawing"].wall == 4.0


def test_a_measured_stage_is_read_from_the_clocks(monkeypatch):
    wall, cpu = iter([10.0, 13.0]), iter([1.0, 1.5])
    monkeypatch.setattr("time.perf_counter", lambda: next(wall))
    monkeypatch.setattr("time.thread_time", lambda: next(cpu))
    stages = Stages()
    with stages.measure("matching"):
        pass
    assert (stages.times["matching"].wall, stages.times["matching"].cpu) == (3.0, 0.5)


def test_a_stage_that_fails_is_counted_too():
    stages = Stages()
    with suppress(ValueError), stages.measure("matching"):
        raise ValueError
    assert "matching" in stages.times


def test_threads_lose_nothing():
    stages = Stages()
    threads = [
        threading.Thread(target=lambda: [stages.add("search", 1.0, 1.0) for _ in range(2000)])
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert stages.times["search"].cpu == pytest.approx(8000.0)
