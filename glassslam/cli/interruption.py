"""Signals that ask a run to end: once, and it comes to an orderly end; twice, and it ends at once."""

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Terminated(BaseException):
    """The process was asked to end (SIGTERM)."""


@dataclass(slots=True)
class Bell:
    """Which signal came first.

    Attributes
    ----------
    rung : int
        Its number; 0 as long as none has come.
    """

    rung: int = 0

    @property
    def exit_code(self) -> int:
        """As shells tell of programs that a signal has ended."""
        return 128 + (self.rung or signal.SIGINT)


@contextmanager
def stopping(stop: Callable[[], None]) -> Iterator[Bell]:
    """Call `stop` at the first signal while the block runs, and raise at every further one.

    Parameters
    ----------
    stop : callable
        Asks for an orderly end.

    Raises
    ------
    KeyboardInterrupt, Terminated
        By the second signal.
    """
    bell = Bell()

    def ring(number: int, _: FrameType | None) -> None:
        if bell.rung:
            raise KeyboardInterrupt if number == signal.SIGINT else Terminated
        bell.rung = number
        stop()

    before: list[tuple[signal.Signals, Any]] = []
    # other threads cannot hear signals
    if threading.current_thread() is threading.main_thread():
        before = [(number, signal.signal(number, ring)) for number in _SIGNALS]
    try:
        yield bell
    finally:
        for number, handler in before:
            signal.signal(number, handler)
