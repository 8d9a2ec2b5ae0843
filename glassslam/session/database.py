"""Opening session files, and every error of the database in words."""

import sqlite3
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from glassslam.errors import OutputError, SessionError
from glassslam.session import schema
from glassslam.session.aside import remove_logs
from glassslam.session.log import is_lost

_MAGIC = b"SQLite format 3\0"
_HEADER_BYTES = 100
_ONE = (1).to_bytes(4, "big")
_PLACES = (60, 68)  # of the user version and the application id: the file format of SQLite

_FULL = ("database or disk is full", "disk I/O error", "unable to open database", "readonly database")


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn errors of the database into those of glassslam.

    Raises
    ------
    OutputError
        The disk is full or cannot be written.
    SessionError
        The file is damaged.
    """
    try:
        yield
    except sqlite3.Error as error:
        if any(words in str(error) for words in _FULL):
            hint = "free some space, or make it writable"
            raise OutputError(f"cannot write {path}: {error}", hint) from error
        if "locked" in str(error):
            raise OutputError(f"another program is using {path}", "wait for it") from error
        raise damaged(path, str(error)) from error
    except UnicodeDecodeError as error:  # SQLite quotes what it has found in the file
        raise damaged(path, "a text in it is none") from error


def damaged(path: Path, why: str) -> SessionError:
    """The error of a file that holds no whole session any more."""
    folder = path.parent.name.removesuffix(".partial")
    return SessionError(f"{path} is damaged: {why}", f"save what there is: glassslam recover {folder}")


def _begun(path: Path) -> SessionError:
    return SessionError(f"{path} is empty: the run ended as it began", "map the recording again")


def create(path: Path, fill: Callable[[sqlite3.Connection], None]) -> sqlite3.Connection:
    """A new session file; it is one from the moment it is filled, and an empty file before.

    Parameters
    ----------
    path : Path
        The file; it must not exist.
    fill : callable
        Writes what a session has from the start.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    with explained(path):
        database = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
        with schema.transaction(database):
            schema.create_tables(database)
            fill(database)
        _set_up(database)
    return database


def open_existing(path: Path) -> sqlite3.Connection:
    """An existing session file, brought to the present version.

    Raises
    ------
    SessionError
        There is none, it is no session, a newer one, or damaged.
    OutputError
        It cannot be written.
    """
    check_header(path)
    if is_lost(path, int.from_bytes(_head(path)[16:18], "big")):
        raise damaged(path, "the log beside it has lost its header")
    with explained(path):
        database = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
        try:
            _check_filled(database, path)
            _set_up(database)
            _bring_up(database, path)
        except BaseException:
            database.close()
            raise
    return database


def _check_filled(database: sqlite3.Connection, path: Path) -> None:
    # a process that ends while it makes a session leaves one that is undone when it is opened
    if database.execute("PRAGMA user_version").fetchone()[0] < 1:
        raise _begun(path)


def _bring_up(database: sqlite3.Connection, path: Path) -> None:
    """Make a database of any version one of this version, with all its tables."""
    schema.migrate(database)
    known = {row[0] for row in database.execute("SELECT name FROM sqlite_schema WHERE type = 'table'")}
    if missing := sorted(schema.TABLES.keys() - known):
        raise damaged(path, f"it has no table {missing[0]!r}")


@contextmanager
def reading(path: Path) -> Iterator[sqlite3.Connection]:
    """An existing session file, of any version, that is not changed.

    Raises
    ------
    SessionError
        There is none, it is no session, a newer one, or damaged.
    """
    check_header(path)
    with explained(path):
        database = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, isolation_level=None)
    try:
        yield database
    finally:
        database.close()


def check_header(path: Path) -> None:
    """Make sure that a file is a session this version can read, by its first bytes alone.

    Raises
    ------
    SessionError
        It is none, or a newer one.
    """
    try:
        head = _head(path)
    except FileNotFoundError as error:
        raise SessionError(f"there is no session {path}", "it is written by glassslam map") from error
    except OSError as error:
        raise SessionError(f"cannot read {path}: {error.strerror}") from error
    if not head:
        raise _begun(path)
    if not head.startswith(_MAGIC):
        raise SessionError(
            f"{path} is no session of glassslam", "if it was one that is damaged: glassslam recover"
        )
    if len(head) < _HEADER_BYTES:
        raise damaged(path, "it is cut off")
    version, application = _numbers(head)
    if application != schema.APPLICATION_ID:
        raise SessionError(f"{path} is no session of glassslam: it is a database of another program")
    if version > schema.VERSION:
        raise SessionError(
            f"{path} was written by a newer glassslam (format {version}; this one knows {schema.VERSION})",
            "update glassslam",
        )


def is_begun(path: Path) -> bool:
    """Whether a file, or the log beside it, holds anything: the session of a run, sound or damaged."""
    files = path, path.with_name(f"{path.name}-wal")
    return any(file.is_file() and file.stat().st_size for file in files)


def is_session(path: Path) -> bool:
    """Whether a file is a session of any version, as far as its first bytes tell."""
    try:
        head = _head(path)
    except OSError:
        return False
    return head.startswith(_MAGIC) and _numbers(head)[1] == schema.APPLICATION_ID


def _set_up(database: sqlite3.Connection) -> None:
    # one writer, no readers beside it: the log then needs no shared memory, which network disks do not have
    database.execute("PRAGMA locking_mode = EXCLUSIVE")
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA synchronous = NORMAL")


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(_HEADER_BYTES)


def _numbers(head: bytes) -> tuple[int, int]:
    """Version of the format, and number of the program a database belongs to."""
    version, application = (int.from_bytes(head[at : at + 4], "big") for at in _PLACES)
    return version, application


def complete_file(database: sqlite3.Connection, path: Path) -> None:
    """Bring everything from the log into the file of a session, so that nothing is lost without the log.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    with explained(path):
        database.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()


def write_compact(database: sqlite3.Connection, path: Path, target: Path) -> None:
    """Write the content of a session to a new file, the same bytes for the same content.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    with suppress(FileNotFoundError):
        target.unlink()
    remove_logs(target)  # of a copy that was killed
    with explained(path):
        database.execute("VACUUM INTO ?", (str(target),))
    # what the header tells of the way of the file: logs, changes, tables made, changes again
    with target.open("r+b") as file:
        for place, value in ((18, b"\1\1"), (24, _ONE), (40, _ONE), (92, _ONE)):
            file.seek(place)
            file.write(value)
