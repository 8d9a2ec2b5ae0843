"""How a recording is known again: by its size and by a digest of its content."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from glassslam.errors import SessionError

_BLOCK = 1 << 18
_BLOCKS = 64
_DATABASE = b"SQLite format 3\0"
_LOGS = ("-wal", "-journal")

_ANEW = "map it anew, with --overwrite"
_MERGED = (
    "a program that opens a database merges the log beside it (-wal): bring back both files as they were,"
    f" or {_ANEW}"
)
_RING = f"bring it back as it was, or {_ANEW}"


@dataclass(frozen=True, slots=True)
class Recorded:
    """A file or directory that a run reads.

    Attributes
    ----------
    given : str
        Its path as the user named it.
    path : str
        The same, absolute and without symbolic links.
    digest : str
        Of its size and content.
    """

    given: str
    path: str
    digest: str

    def found(self) -> str:
        """Where it is now: as named, if that still leads there."""
        return self.given if str(Path(self.given).resolve()) == self.path else self.path


def identify(path: str | Path) -> Recorded:
    """Look at a recording.

    Parameters
    ----------
    path : str or Path
        A file, or a directory of files.

    Raises
    ------
    OSError
        It cannot be read.
    """
    return Recorded(str(path), str(Path(path).resolve()), digest(path))


def digest(path: str | Path) -> str:
    """Digest of size and content: whole up to 16 MB, beyond that of 64 blocks spread evenly.

    Names count within a directory only, where one file may refer to another. The logs that a recorder has
    left beside a database are part of it.

    Raises
    ------
    OSError
        It cannot be read.
    """
    total, folder = hashlib.blake2b(digest_size=20), Path(path)
    for file in _files(folder):
        size, name = file.stat().st_size, file.name if folder.is_dir() else file.name[len(folder.name) :]
        total.update(f"{name} {size}\n".encode(errors="surrogateescape"))
        for block in _blocks(file, size):
            total.update(block)
    return total.hexdigest()


def checked(
    known: Sequence[Recorded],
    now: Sequence[str | Path] | None,
    sonar: Recorded | None,
    ring: Recorded | None = None,
) -> list[str]:
    """Paths to read the recordings of a run from, when they are the same as ever.

    Parameters
    ----------
    known : sequence of Recorded
        What the run has read.
    now : sequence of str or Path, optional
        Where that is now; where it was when left out.
    sonar : Recorded, optional
        The second file with sonar readings.
    ring : Recorded, optional
        The file that tells where the sonars sit.

    Raises
    ------
    SessionError
        One is missing or has changed.
    """
    paths = [recorded.found() for recorded in known] if now is None else [*map(str, now)]
    if len(paths) != len(known):
        raise SessionError(
            f"the run reads {len(known)} recordings, not {len(paths)}", "name all, in their order"
        )
    for path, recorded in zip(paths, known, strict=True):
        _check_same(path, recorded)
    if sonar is not None:
        _check_same(sonar.found(), sonar)
    if ring is not None and not _is_same(ring.path, ring, _RING):
        raise SessionError(f"{ring.path} is not the ring of sonars that the run has read", _RING)
    return paths


def _check_same(path: str, known: Recorded) -> None:
    if not _is_same(path, known, "name the recording where it is now, before --resume"):
        hint = _MERGED if any(map(_is_database, _files(Path(path)))) else _ANEW
        raise SessionError(f"{path} is not the recording the run has read", hint)


def _is_same(path: str, known: Recorded, hint: str) -> bool:
    try:
        return digest(path) == known.digest
    except OSError as error:
        raise SessionError(f"cannot read {path}: {error.strerror}", hint) from error


def _files(path: Path) -> Sequence[Path]:
    if not path.is_dir():
        return [path, *(_logs(path) if _is_database(path) else ())]
    # what a database keeps beside it while it is read is no part of a recording
    return sorted(file for file in path.iterdir() if file.is_file() and not file.name.endswith("-shm"))


def _logs(database: Path) -> Iterator[Path]:
    """Logs beside a database; an empty one is as good as none."""
    for ending in _LOGS:
        log = database.with_name(f"{database.name}{ending}")
        if log.is_file() and log.stat().st_size:
            yield log


def _is_database(file: Path) -> bool:
    with file.open("rb") as stream:
        return stream.read(len(_DATABASE)) == _DATABASE


def _blocks(file: Path, size: int) -> Iterator[bytes]:
    with file.open("rb") as stream:
        if size <= _BLOCK * _BLOCKS:
            yield from iter(lambda: stream.read(_BLOCK), b"")
            return
        for k in range(_BLOCKS):
            stream.seek((size - _BLOCK) * k // (_BLOCKS - 1))
            yield stream.read(_BLOCK)
