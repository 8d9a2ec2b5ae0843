"""Seconds per stage, added up over threads."""

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from glassslam.slam.result import StageTime


class Stages:
    """Wall and CPU seconds of named stages; the CPU seconds are those of the thread that measures."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self.times: dict[str, StageTime] = {}

    @contextmanager
    def measure(self, name: str) -> Iterator[None]:
        """Add the time spent inside to a stage."""
        wall, cpu = time.perf_counter(), time.thread_time()
        try:
            yield
        finally:
            self.add(name, time.perf_counter() - wall, time.thread_time() - cpu)

    def add(self, name: str, wall: float, cpu: float) -> None:
        """Add seconds to a stage."""
        with self._lock:
            stage = self.times.setdefault(name, StageTime())
            stage.wall += wall
            stage.cpu += cpu
