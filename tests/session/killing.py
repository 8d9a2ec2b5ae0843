"""Processes that are killed for good, and what they leave behind."""

import random
import shutil
import signal
import sqlite3
import time
from collections import Counter

from session_worlds import assert_same_results, ended, rows_of, snapshot, start

_WAITING = 30
BEFORE, READING, FINISHING, WRITING = "before", "reading", "finishing", "writing"


def found_state(partial, scratch, total):
    """How far a killed run had come, as its session tells."""
    if not partial.exists():
        return BEFORE
    shutil.rmtree(scratch, ignore_errors=True)
    copy = snapshot(partial, scratch) / "session.db"
    if not copy.exists() or not copy.stat().st_size:
        return BEFORE
    database = sqlite3.connect(copy)
    try:
        if database.execute("SELECT count(*) FROM facts WHERE name = 'is_whole'").fetchone()[0]:
            return WRITING
        # the last scans wait for odometry and are placed when reading has come to its end
        return READING if rows_of(database, "scans") < total - _WAITING else FINISHING
    except sqlite3.OperationalError:  # its tables were not there yet
        return BEFORE
    finally:
        database.close()


class Killer:
    """Starts a run, kills it, goes on with it, kills it again ... until it ends; then begins anew.

    Parameters
    ----------
    words : list of str
        The command; results go into `home` / "run".
    home : Path
        An empty folder.
    total : int
        Scans of the recording.
    expected : dict
        The results of a run that nothing stops.
    seconds : float
        About how long a run takes.
    """

    def __init__(self, words, home, total, expected, seconds, seed, pause=0.0):
        self._words, self._home, self._total = [*words, "-o", home / "run"], home, total
        self._expected, self._seconds, self._pause = expected, seconds, pause
        self._random = random.Random(seed)
        self.found, self.whole = Counter(), 0

    @property
    def kills(self):
        return self.found.total()

    def kill_once(self, aim):
        """Start or go on, and kill at a random moment, or soon after a state is reached."""
        process = self._started()
        partial, scratch = self._home / "run.partial", self._home.with_name(f"{self._home.name}-copy")
        delay = self._random.random() * {None: 0.6 * self._seconds, BEFORE: 0.3, WRITING: 0.1}.get(aim, 0.0)
        while aim not in (None, BEFORE) and process.poll() is None:
            try:
                if found_state(partial, scratch, self._total) == aim:
                    break
            except (OSError, sqlite3.Error):  # it changes while it is copied
                pass
            time.sleep(0.01)
        self._wait(process, delay)
        process.send_signal(signal.SIGKILL)
        code, error = ended(process)
        if code == -signal.SIGKILL and not (self._home / "run").exists():
            self.found[found_state(partial, scratch, self._total)] += 1
        elif code in (0, -signal.SIGKILL):  # it was too late
            self._check()
        else:
            raise AssertionError(error)

    def finish(self):
        """Go on to the end without any further kill."""
        process = self._started()
        code, error = ended(process)
        assert (code, error) == (0, "")
        self._check()

    def _started(self):
        if self._is_waiting():
            return start(["map", "--resume", self._home / "run", "-q"], self._home, self._pause)
        return start(self._words, self._home, self._pause)

    def _is_waiting(self):
        """Whether there is something to go on with; otherwise the command is given once more."""
        session = self._home / "run.partial" / "session.db"
        return found_state(session.parent, self._home.with_name("look"), self._total) != BEFORE

    @staticmethod
    def _wait(process, delay):
        until = time.monotonic() + delay
        while process.poll() is None and time.monotonic() < until:
            time.sleep(0.002)

    def _check(self):
        assert_same_results(self._home / "run", self._expected)
        self.whole += 1
        shutil.rmtree(self._home / "run")
        left = {path.name for path in self._home.iterdir()}
        # a process that is killed with its last breath leaves its lock, which nobody holds any more
        assert left <= {".run.lock", ".run.replaced"}
