"""Tables of a session file, and how files of earlier versions become files of this one."""

import sqlite3
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final

APPLICATION_ID: Final = 0x474C5353  # "GLSS"
VERSION: Final = 1

TABLES: Final = {
    "facts": {"name": "TEXT PRIMARY KEY", "value": "TEXT NOT NULL", "seal": "INTEGER"},
    "scans": {
        "number": "INTEGER PRIMARY KEY",
        "stamp": "REAL", "x": "REAL", "y": "REAL", "theta": "REAL", "residual": "REAL",
        "points": "INTEGER", "hold": "REAL", "free_heading": "REAL", "overlap": "REAL",
        "how": "INTEGER", "event": "INTEGER", "doubtful": "INTEGER",
        "returns": "INTEGER", "is_node": "INTEGER",
        "usual_residual": "REAL", "since_gap": "INTEGER", "since_start": "INTEGER", "in_doubt": "INTEGER",
        "searches": "INTEGER", "searches_taken": "INTEGER", "relocalisations": "INTEGER",
        "relocalised": "INTEGER", "coasted": "INTEGER", "unmatched": "INTEGER", "seal": "INTEGER",
    },
    "nodes": {
        "number": "INTEGER PRIMARY KEY",
        "scan": "INTEGER", "stamp": "REAL", "x": "REAL", "y": "REAL", "theta": "REAL",
        "sensor_x": "REAL", "sensor_y": "REAL", "residual": "REAL",
        "doubtful": "INTEGER", "begins": "INTEGER",
        "returns": "BLOB", "free_ends": "BLOB", "ghosts": "BLOB", "seal": "INTEGER",
    },
    "rounds": {"number": "INTEGER PRIMARY KEY", "searches": "INTEGER", "seal": "INTEGER"},
    "searches": {
        "number": "INTEGER PRIMARY KEY",
        "round": "INTEGER", "node": "INTEGER", "anchor": "INTEGER", "submap": "INTEGER",
        "rejected": "TEXT", "ambiguous": "INTEGER", "searched": "INTEGER", "numbers": "BLOB",
        "seal": "INTEGER",
    },
    "arrays": {
        "name": "TEXT PRIMARY KEY", "type": "TEXT", "shape": "TEXT", "data": "BLOB", "seal": "INTEGER",
    },
}  # fmt: skip
"""Columns of every table. The rows of `scans`, `nodes`, `rounds` and `searches` are written as the run
goes and never changed; `facts` and `arrays` hold what describes the run, and at its end what it found. The
last column seals a row: the database itself does not notice a byte that is changed."""

MIGRATIONS: Mapping[int, Callable[[sqlite3.Connection], None]] = {}
"""Version -> what makes a file of this version one of the next."""


@contextmanager
def transaction(database: sqlite3.Connection) -> Iterator[None]:
    """All that is done in the block, or nothing of it."""
    database.execute("BEGIN IMMEDIATE")
    try:
        yield
    except BaseException:
        # a full disk may have ended the transaction already
        if database.in_transaction:
            database.execute("ROLLBACK")
        raise
    database.execute("COMMIT")


def create_tables(database: sqlite3.Connection) -> None:
    """Make the tables of a new session, within a transaction of the caller."""
    database.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    database.execute(f"PRAGMA user_version = {VERSION}")
    for name, columns in TABLES.items():
        described = ", ".join(f"{column} {kind}" for column, kind in columns.items())
        database.execute(f"CREATE TABLE {name} ({described})")


def insert(database: sqlite3.Connection, table: str, rows: Iterable[Sequence[Any]]) -> None:
    """Add rows to a table, each with its seal."""
    places = ", ".join("?" * len(TABLES[table]))
    database.executemany(
        f"INSERT INTO {table} VALUES ({places})",  # noqa: S608  (own names only)
        ((*row, seal(row)) for row in rows),
    )


def unsealed(row: Sequence[Any]) -> tuple[Any, ...]:
    """A row without its seal.

    Raises
    ------
    ValueError
        The seal is broken: the row is not what was written.
    """
    *values, mark = row
    if seal(values) != mark:
        raise ValueError("a row is not what was written")
    return tuple(values)


def seal(row: Sequence[Any]) -> int:
    """Checksum of a row: of its numbers and texts as Python writes them, then of its bytes."""
    mark = zlib.crc32(repr([value for value in row if not isinstance(value, bytes)]).encode())
    for value in row:
        if isinstance(value, bytes):
            mark = zlib.crc32(value, mark)
    return mark


def migrate(database: sqlite3.Connection) -> None:
    """Bring a file of an earlier version to this one, step by step, all steps or none."""
    version = database.execute("PRAGMA user_version").fetchone()[0]
    if version == VERSION:
        return
    with transaction(database):
        for step in range(version, VERSION):
            MIGRATIONS[step](database)
        database.execute(f"PRAGMA user_version = {VERSION}")
