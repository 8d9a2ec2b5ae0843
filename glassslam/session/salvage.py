"""What is left of a damaged session: a new one with the longest beginning of the run that can be trusted."""

import json
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from glassslam.errors import SessionError
from glassslam.session import schema
from glassslam.session.database import create
from glassslam.session.rows import closure_of, node_of, scan_outcome
from glassslam.session.salvage_pages import views
from glassslam.session.store import FINISHED
from glassslam.sources.sqlitepages import Cell, PageFile, values
from glassslam.sources.windows import BrokenRecordError

_NEEDED = ("glassslam", "config", "recordings", "sonar", "options")
_NAMED = ("facts", "arrays")
_ANEW = "map the recording anew, with --overwrite"

Rows = dict[Any, tuple[Any, ...]]


@dataclass(frozen=True, slots=True)
class Salvage:
    """What was saved.

    Attributes
    ----------
    scans, nodes, rounds : int
        Scans, nodes and rounds of searches from the beginning of the run.
    scans_beyond : int
        Further scans that can be read and are of no use, for one before them is lost.
    is_finished : bool
        Whether everything about a finished run is there.
    """

    scans: int
    nodes: int
    rounds: int
    scans_beyond: int
    is_finished: bool


def salvage(path: Path, target: Path) -> Salvage:
    """Write what can be trusted of a damaged session to a new one.

    Every row has a seal. Rows are found page by page, wherever they stand, and only those with a sound seal
    are taken: what is saved is what was written.

    Parameters
    ----------
    path : Path
        The damaged session; it is not changed.
    target : Path
        The new session; it must not exist.

    Raises
    ------
    SessionError
        Not even the recording and the configuration of the run are left.
    OutputError
        The new session cannot be written.
    """
    found = _rows(path)
    facts = found["facts"]
    if missing := [name for name in _NEEDED if name not in facts]:
        raise SessionError(f"{path} cannot be saved: what tells its {missing[0]} is lost", _ANEW)
    scans, nodes = _beginning(found["scans"], found["nodes"])
    rounds, searches = _whole_rounds(found["rounds"], found["searches"])
    whole = len(scans) == len(found["scans"]) and _is_complete(facts, found["arrays"], len(nodes))
    kept = {name: row for name, row in facts.items() if whole or name not in FINISHED}

    def fill(database: sqlite3.Connection) -> None:
        tables = {"scans": scans, "nodes": nodes, "rounds": rounds, "searches": searches}
        if whole:
            tables["arrays"] = [*found["arrays"].values()]
        for table, rows in {"facts": [kept[name] for name in sorted(kept)], **tables}.items():
            schema.insert(database, table, rows)

    create(target, fill).close()
    return Salvage(len(scans), len(nodes), len(rounds), len(found["scans"]) - len(scans), whole)


def scans_found(path: Path) -> int:
    """How many scans could be saved of a session: more than it holds where a part of its log is passed over.

    Raises
    ------
    SessionError
        It cannot be read.
    """
    found = _rows(path)
    return len(_beginning(found["scans"], found["nodes"])[0])


def _rows(path: Path) -> dict[str, Rows]:
    """All rows with a sound seal, by table and by number or name.

    Numbered rows are never changed: it does not matter where they are found. Named ones are, and belong
    together: they are those of the first view that tells what the run is.
    """
    found: dict[str, Rows] = {table: {} for table in schema.TABLES}
    is_told = False
    try:
        for pages in views(path):
            seen = _rows_of(pages)
            if not is_told:
                is_told = all(name in seen["facts"] for name in _NEEDED)
                found |= {table: seen[table] for table in _NAMED}
            for table, rows in seen.items():
                if table not in _NAMED:
                    found[table] = {**rows, **found[table]}
    except OSError as error:
        raise SessionError(f"cannot read {path}: {error.strerror}") from error
    return found


def _rows_of(pages: PageFile) -> dict[str, Rows]:
    found: dict[str, Rows] = {table: {} for table in schema.TABLES}
    with closing(sqlite3.connect(":memory:", isolation_level=None)) as memory:
        schema.create_tables(memory)
        for table, row in _shaped(pages):
            with suppress(ValueError):
                read = _as_read(memory, table, row)
                found[table][read[0]] = read
    return found


def _shaped(pages: PageFile) -> Iterator[tuple[str, list[Any]]]:
    """Whatever has the shape of a row of one of the tables.

    Numbered rows are never changed and looked for on all pages. Of named ones there may be earlier versions
    on pages that are no longer in use: they are taken from their tables, as long as these can be found.
    """
    roots = {str(row[1]): row[3] for _, row in _records(pages, pages.table(1)) if len(row) == 5}
    named = {len(schema.TABLES[table]): table for table in _NAMED}
    numbered = {len(columns): table for table, columns in schema.TABLES.items() if table not in _NAMED}
    everywhere = [cell for page in pages.leaves() for cell in pages.cells(page)]
    for cell, row in _records(pages, everywhere):
        if row and row[0] is None and len(row) in numbered:
            yield numbered[len(row)], [cell.rowid, *row[1:]]
        elif len(row) in named and named[len(row)] not in roots:
            yield named[len(row)], row
    for table in _NAMED:
        if isinstance(root := roots.get(table), int):
            for _, row in _records(pages, pages.table(root)):
                if len(row) == len(schema.TABLES[table]):
                    yield table, row


def _records(pages: PageFile, cells: Iterable[Cell]) -> Iterator[tuple[Cell, list[Any]]]:
    for cell in cells:
        with suppress(BrokenRecordError):
            yield cell, [*values(pages.record(cell))]


def _as_read(memory: sqlite3.Connection, table: str, row: list[Any]) -> tuple[Any, ...]:
    """A row as the database gives it: on its pages whole real numbers are integers.

    Raises
    ------
    ValueError
        Its seal is broken.
    """
    try:
        memory.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(row))})", row)  # noqa: S608
        read = memory.execute(f"SELECT * FROM {table}").fetchone()  # noqa: S608  (own names only)
        memory.execute(f"DELETE FROM {table}")  # noqa: S608
    except (sqlite3.Error, OverflowError) as error:
        raise ValueError(str(error)) from error
    return schema.unsealed(read)


def _beginning(scans: Rows, nodes: Rows) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
    """Scans from the first on without a gap, as far as their nodes are there as well; and these nodes."""
    kept: list[tuple[Any, ...]] = []
    with_node: list[tuple[Any, ...]] = []
    for row in _numbered(scans):
        try:
            is_node = scan_outcome(row).is_node
            if is_node:
                node = nodes[len(with_node)]
                if node_of(node).scan != row[0]:
                    break
                with_node.append(node)
        except (KeyError, ValueError, TypeError):
            break
        kept.append(row)
    return kept, with_node


def _whole_rounds(rounds: Rows, searches: Rows) -> tuple[list[tuple[Any, ...]], list[tuple[Any, ...]]]:
    """Rounds from the first on without a gap, with all their searches."""
    kept: list[tuple[Any, ...]] = []
    made: list[tuple[Any, ...]] = []
    for row in _numbered(rounds):
        numbers = range(len(made), len(made) + row[1])
        try:
            own = [searches[number] for number in numbers]
            for search in own:
                closure_of(search)
        except (KeyError, ValueError, TypeError):
            break
        kept.append(row)
        made += own
    return kept, made


def _numbered(rows: Rows) -> Iterable[tuple[Any, ...]]:
    """Rows 0, 1, 2 ... up to the first that is missing."""
    number = 0
    while number in rows:
        yield rows[number]
        number += 1


def _is_complete(facts: Rows, arrays: Rows, nodes: int) -> bool:
    """Whether a finished run is all there."""
    if any(name not in facts for name in FINISHED):
        return False
    names = json.loads(facts["arrays"][1])
    return all(name in arrays for name in names) and json.loads(arrays["tracks.nodes"][2])[0] == nodes
