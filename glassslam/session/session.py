"""The session of a run: one file that holds all it needs to be taken up, and all that is drawn from it."""

import os
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from importlib import metadata
from pathlib import Path
from typing import Any, Final, Self

from glassslam.config import Config
from glassslam.errors import OutputError, SessionError
from glassslam.finished import FinishedRun
from glassslam.records import FloatArray
from glassslam.session.aside import remove_damaged, remove_logs
from glassslam.session.database import (
    complete_file,
    create,
    damaged,
    explained,
    open_existing,
    reading,
    write_compact,
)
from glassslam.session.identity import Recorded, checked, identify
from glassslam.session.journal import SessionJournal
from glassslam.session.options import options_of, ring_file, stored_ring
from glassslam.session.schema import transaction
from glassslam.session.store import (
    forget_finished,
    load_finished,
    read_facts,
    read_nodes,
    read_scans,
    save_finished,
    write_facts,
)
from glassslam.slam.closure import Closure
from glassslam.slam.node import Node
from glassslam.sources import SourceOptions
from glassslam.yamltext import parse_yaml

SESSION_FILE: Final = "session.db"


class Session:
    """A session file that is open; no other process can open it meanwhile.

    Attributes
    ----------
    path : Path
        The file.
    config : Config
        The resolved configuration.
    options : SourceOptions
        Which part of the recordings is read, and how.
    recordings : tuple of Recorded
        The recordings, in their order.
    version : str
        The version of glassslam that has begun the run.
    journal : SessionJournal
        What is known of the run, and where the rest is written down.

    Examples
    --------
    >>> import glassslam as gs
    >>> with gs.Session.create("run.db", ["run.bag"]) as session:  # doctest: +SKIP
    ...     result = gs.map_recording("run.bag", session=session)
    """

    def __init__(self, path: Path, database: Any) -> None:
        self.path, self._database, self._is_closed = path, database, False
        try:
            with explained(path):
                self._read()
        except BaseException:  # whoever asks again must find the file free
            self.abandon()
            raise

    def _read(self) -> None:
        path, database = self.path, self._database
        try:
            self._facts = read_facts(database)
            self.config = Config.from_mapping(parse_yaml(self._facts["config"]), str(path))
            self.recordings = tuple(Recorded(**known) for known in self._facts["recordings"])
            self._sonar = self._facts["sonar"] and Recorded(**self._facts["sonar"])
            self._ring = ring_file(self._facts["options"])
            self.options = options_of(self._facts["options"], self._sonar)
            self.version = str(self._facts["glassslam"])
        except (KeyError, TypeError, ValueError) as error:
            raise damaged(path, f"it does not tell the recording ({error})") from error
        self.journal = SessionJournal(database, path)

    @classmethod
    def create(
        cls,
        path: str | Path,
        recordings: Sequence[str | Path],
        config: Config | None = None,
        options: SourceOptions | None = None,
    ) -> Self:
        """Begin a session in a new file.

        Parameters
        ----------
        path : str or Path
            The file; it must not exist.
        recordings : sequence of str or Path
            The recordings, in their order.
        config : Config, optional
            Parameters; the defaults when left out.
        options : SourceOptions, optional
            Topics, extrinsics and the part of the recording to use.

        Raises
        ------
        OutputError
            The file exists already, or cannot be written.
        OSError
            A recording cannot be read.
        """
        if Path(path).exists():
            raise OutputError(f"{path} exists already", "name a new file, or go on with it: Session.open")
        options = options or SourceOptions()
        facts = {
            "glassslam": metadata.version("glassslam"),
            "config": (config or Config()).dump(),
            "recordings": [asdict(identify(recording)) for recording in recordings],
            "sonar": None if options.sonar is None else asdict(identify(options.sonar)),
            "options": {**asdict(options), "sonar": None, "sonar_ring": stored_ring(options.sonar_ring)},
        }
        path = Path(path)
        return cls(path, create(path, lambda database: write_facts(database, facts)))

    @classmethod
    def open(cls, path: str | Path) -> Self:
        """Open a session, whether its run is finished or not.

        Parameters
        ----------
        path : str or Path
            The file; a file of an earlier version is brought to the present one.

        Raises
        ------
        SessionError
            There is none, or it is of another program, of a newer version, or damaged.
        """
        return cls(Path(path), open_existing(Path(path)))

    @staticmethod
    def copy(path: str | Path, target: Path) -> None:
        """Copy a session file that no run is using, whole or not at all; it may be of an earlier version.

        Raises
        ------
        SessionError
            There is none, or it is of another program, of a newer version, or damaged.
        OutputError
            The copy cannot be written.
        """
        fresh = target.with_name(f"{target.name}.new")
        with reading(Path(path)) as database:
            write_compact(database, Path(path), fresh)
        try:
            fresh.replace(target)
        except OSError as error:
            raise OutputError(f"cannot write {target}: {error.strerror}") from error

    @property
    def is_finished(self) -> bool:
        """Whether the run came to its end."""
        return "is_whole" in self._facts

    def check_recordings(self, recordings: Sequence[str | Path] | None = None) -> list[str]:
        """Paths to read the recordings from, when they are the same as ever.

        Parameters
        ----------
        recordings : sequence of str or Path, optional
            Where they are now; where they were when left out.

        Raises
        ------
        SessionError
            One is missing or has changed.
        """
        return checked(self.recordings, recordings, self._sonar, self._ring)

    def change(self, config: Config, *, keep_findings: bool) -> None:
        """Take another configuration for what is still to be done.

        Parameters
        ----------
        config : Config
            The configuration.
        keep_findings : bool
            Whether the finished run stays; otherwise it is open again, and what is known of SLAM stays.

        Raises
        ------
        OutputError
            The disk is full.
        """
        with explained(self.path), transaction(self._database):
            if not keep_findings:
                forget_finished(self._database)
            write_facts(self._database, {"config": config.dump()})
            self._facts = read_facts(self._database)
        self.config = config

    def save(self, run: FinishedRun) -> None:
        """Write down everything about a finished run.

        Raises
        ------
        OutputError
            The disk is full.
        """
        self.journal.flush()
        with explained(self.path), transaction(self._database):
            write_facts(self._database, {"config": run.config.dump()})
            save_finished(self._database, run)
            self._facts = read_facts(self._database)
        self.config = run.config

    def load(self) -> FinishedRun:
        """The finished run.

        Raises
        ------
        SessionError
            The run is not finished, or the file is damaged.
        """
        if not self.is_finished:
            raise SessionError(f"the run of {self.path} is not finished", "go on with glassslam map --resume")
        with self._sensible():
            return load_finished(self._database, self.config)

    def nodes(self) -> tuple[Node, ...]:
        """The nodes known so far.

        Raises
        ------
        SessionError
            The file is damaged.
        """
        with self._sensible():
            return read_nodes(self._database)

    def scans(self) -> tuple[FloatArray, FloatArray]:
        """Stamps, s, shape (n,), and local poses, m and rad, shape (n, 3), of the scans known so far.

        Raises
        ------
        SessionError
            The file is damaged.
        """
        with self._sensible():
            return read_scans(self._database)

    def rounds(self) -> list[list[Closure]]:
        """What the rounds of searches known so far have found.

        Raises
        ------
        SessionError
            The file is damaged.
        """
        journal = SessionJournal(self._database, self.path)
        return [*iter(journal.recall_round, None)]

    def check(self) -> None:
        """Read everything once.

        Raises
        ------
        SessionError
            Something is not what was written.
        """
        with self._sensible():
            complaint = self._database.execute("PRAGMA integrity_check").fetchone()[0]
            if complaint != "ok":
                raise ValueError(" ".join(complaint.split()))
            if self.is_finished:
                load_finished(self._database, self.config)
        self.nodes(), self.scans(), self.rounds()

    def settle_in(self, folder: Path) -> Path:
        """Close the session and leave it in a folder, the same bytes for the same run however it came about.

        Parameters
        ----------
        folder : Path
            Where it shall be; its own folder or another one.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        OutputError
            It cannot be written; the session is then open as before.
        """
        settled, compact = folder / SESSION_FILE, folder / f"{SESSION_FILE}.new"
        write_compact(self._database, self.path, compact)
        complete_file(self._database, self.path)
        self.abandon()
        if settled == self.path:
            remove_logs(self.path)
        os.replace(compact, settled)  # noqa: PTH105  (tests make exactly this call fail)
        remove_damaged(settled)
        return settled

    def close(self) -> None:
        """Write what is left and close the file; a file that is closed stays so.

        Raises
        ------
        OutputError
            The disk is full.
        """
        if not self._is_closed:
            self.journal.flush()
            self.abandon()

    def abandon(self) -> None:
        """Close the file without writing anything more."""
        self._is_closed = True
        self._database.close()

    @contextmanager
    def _sensible(self) -> Iterator[None]:
        with explained(self.path):
            try:
                yield
            except (KeyError, ValueError, TypeError, IndexError, struct.error) as error:
                raise damaged(self.path, f"{type(error).__name__} {error}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        if kind is None:
            self.close()
        else:
            self.abandon()
