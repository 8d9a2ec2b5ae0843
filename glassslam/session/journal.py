"""The journal of a run in its session file."""

import sqlite3
import struct
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from glassslam.errors import SessionError
from glassslam.session.database import damaged, explained
from glassslam.session.rows import (
    closure_of,
    node_row,
    same_points,
    scan_outcome,
    scan_row,
    scan_stamps,
    search_row,
)
from glassslam.session.schema import insert, transaction, unsealed
from glassslam.slam.closure import Closure
from glassslam.slam.journal import ScanOutcome
from glassslam.slam.node import Node

_SECONDS_BETWEEN_COMMITS = 1.0
_TABLES = ("scans", "nodes", "rounds", "searches")
_HINT = "go on with the recording as it was, or map this one anew, with --overwrite"


class SessionJournal:
    """Reads what is known of a run, then adds what is new, about once a second.

    Whatever is written is a beginning of the run: rows are added in the order of the run, and those of one
    moment in one transaction.

    Parameters
    ----------
    database : sqlite3.Connection
        The session.
    path : Path
        Its file, for errors.
    seconds : float
        Time between two commits, s.
    clock : callable
        Tells the time, s.
    """

    def __init__(
        self,
        database: sqlite3.Connection,
        path: Path,
        seconds: float = _SECONDS_BETWEEN_COMMITS,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._database, self._path = database, path
        self._seconds, self._clock = seconds, clock
        self._recalled = self._recalled_nodes = self._recalled_rounds = self._recalled_searches = 0
        self.scans, self._nodes, self._rounds, self._searches = (
            database.execute(f"SELECT count(*) FROM {table}").fetchone()[0]  # noqa: S608  (own names only)
            for table in _TABLES
        )
        self._known, self._known_rounds = self.scans, self._rounds
        self._last_scan: tuple[Any, ...] = ()
        self._last_node: tuple[Any, ...] | None = None
        self._last_searched: list[int] = []
        self._new: dict[str, list[tuple[Any, ...]]] = {table: [] for table in _TABLES}
        self._due = clock() + seconds

    def recall_scan(self) -> ScanOutcome | None:
        """What became of the next scan; None past the end of what is known.

        Raises
        ------
        SessionError
            It cannot be read any more.
        """
        if self._recalled == self._known:
            return None
        row, self._recalled = self._row("scans", self._recalled), self._recalled + 1
        with self._sensible():
            outcome = scan_outcome(row)
        self._last_scan, self._last_node = row, None
        if outcome.is_node:
            self._last_node = self._row("nodes", self._recalled_nodes)
            self._recalled_nodes += 1
        return outcome

    def confirm_scan(self, stamp: float, returns: int, node: Node | None) -> None:
        """Make sure that the scan recalled last is this one, and became this node.

        Raises
        ------
        SessionError
            It is another scan.
        """
        number, before = self._recalled - 1, float(scan_stamps([self._last_scan])[0])
        known = scan_outcome(self._last_scan)
        if stamp != before:
            raise _other(f"scan {number} is of {stamp:.6f} s, and was of {before:.6f} s")
        if returns != known.returns:
            raise _other(f"scan {number} has {returns} returns, and had {known.returns}")
        if (node is None) != (self._last_node is None):
            raise _other(f"scan {number} {'adds' if node else 'does not add'} to the map, unlike before")
        if node is not None and self._last_node is not None:
            with self._sensible():
                same = same_points(self._last_node, node_row(node))
            if not same:
                raise _other(f"scan {number} has other returns")

    def confirm_end(self) -> None:
        """Make sure, at the end of the records, that all scans that are known have come.

        Raises
        ------
        SessionError
            Some have not.
        """
        if self._recalled < self._known:
            raise _other(f"it ends after {self._recalled} of the {self._known} scans known of it")

    def keep_scan(self, stamp: float, outcome: ScanOutcome, node: Node | None) -> None:
        """Write down what became of a scan, and the node it became."""
        self._new["scans"].append(scan_row(self.scans, stamp, outcome))
        self.scans += 1
        if node is not None:
            self._new["nodes"].append(node_row(node))
        if self._clock() >= self._due:
            self.flush()

    def recall_round(self) -> list[Closure] | None:
        """What the next round of searches found; None past the end of what is known.

        Raises
        ------
        SessionError
            It cannot be read any more.
        """
        if self._recalled_rounds == self._known_rounds:
            return None
        number, count = self._row("rounds", self._recalled_rounds)
        self._recalled_rounds += 1
        first = self._recalled_searches
        self._recalled_searches += count
        with self._sensible():
            rows = [self._row("searches", first + k) for k in range(count)]
            closures = [closure_of(row) for row in rows]
        if any(row[1] != number for row in rows):
            raise damaged(self._path, f"a search of round {number} is of another one")
        self._last_searched = [closure.candidate.node for closure in closures]
        return closures

    def confirm_round(self, nodes: range) -> None:
        """Make sure that the round recalled last is one for these nodes.

        Raises
        ------
        SessionError
            It has searched for others.
        """
        number = self._recalled_rounds - 1
        if others := [node for node in self._last_searched if node not in nodes]:
            raise _other(f"round {number} of searches was made for node {others[0]}, which is not due there")

    def keep_round(self, closures: Sequence[Closure]) -> None:
        """Write down what a round of searches found."""
        self._new["rounds"].append((self._rounds, len(closures)))
        self._new["searches"] += [
            search_row(self._searches + k, self._rounds, closure) for k, closure in enumerate(closures)
        ]
        self._rounds += 1
        self._searches += len(closures)

    def flush(self) -> None:
        """Commit what is new.

        Raises
        ------
        OutputError
            The disk is full; what was committed before stays.
        """
        with explained(self._path), transaction(self._database):
            for table, rows in self._new.items():
                insert(self._database, table, rows)
        for rows in self._new.values():
            rows.clear()
        self._due = self._clock() + self._seconds

    def _row(self, table: str, number: int) -> tuple[Any, ...]:
        # no statement stays open: beside one the database refuses to be copied
        with explained(self._path):
            row: tuple[Any, ...] | None = self._database.execute(
                f"SELECT * FROM {table} WHERE number = ?",  # noqa: S608  (own names only)
                (number,),
            ).fetchone()
        if row is None:
            raise damaged(self._path, f"row {number} of {table!r} is missing")
        with self._sensible():
            return unsealed(row)

    @contextmanager
    def _sensible(self) -> Iterator[None]:
        try:
            yield
        except (ValueError, TypeError, struct.error) as error:
            raise damaged(self._path, f"{type(error).__name__} {error}") from error


def _other(why: str) -> SessionError:
    return SessionError(f"the recording is not what it was when the run began: {why}", _HINT)
