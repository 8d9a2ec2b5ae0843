"""The progress bar of a run, with its speed in multiples of real time."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from glassslam.api import Progress, ProgressCallback

_STAGES = {"mapping": "mapping", "finishing": "closing loops, optimising", "done": "done"}


@contextmanager
def progress_bar(*, quiet: bool = False) -> "Iterator[ProgressCallback | None]":
    """Show a bar on standard error while the block runs; lends None where there is no terminal."""
    if quiet or sys.stderr is None or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console  # noqa: PLC0415  (40 ms)
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn  # noqa: PLC0415
    from rich.progress import Progress as Bar  # noqa: PLC0415

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[speed]}"),
        TimeElapsedColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task, start = bar.add_task("reading", total=None, speed=""), time.monotonic()

        def show(progress: "Progress") -> None:
            done, total = amount(progress)
            bar.update(
                task,
                description=_STAGES[progress.stage],
                completed=done,
                total=total,
                speed=speed(progress.recorded_seconds, time.monotonic() - start),
            )

        yield show


def amount(progress: "Progress") -> tuple[float, float | None]:
    """How much is done and how much there is, in scans or else in seconds; None when not known."""
    if progress.info.scan_count:
        return min(progress.scans, progress.info.scan_count), progress.info.scan_count
    if progress.info.duration > 0.0:
        return min(progress.recorded_seconds, progress.info.duration), progress.info.duration
    return progress.scans, None


def speed(recorded_seconds: float, wall_seconds: float) -> str:
    """Recorded time per elapsed time, in words."""
    factor = recorded_seconds / max(wall_seconds, 1e-9)
    return f"{factor:.0f}x real time" if factor >= 10.0 else f"{factor:.1f}x real time"
