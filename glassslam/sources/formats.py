"""Which kind of recording a path is, told by its content."""

import difflib
import re
import zlib
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias

from glassslam.errors import RecordingError
from glassslam.regularfile import regular
from glassslam.sources.failures import reading

Format: TypeAlias = Literal["rosbag1", "rosbag2-sqlite3", "rosbag2-mcap", "carmen", "player", "pimap"]

GZIP_MAGIC = b"\x1f\x8b"
KNOWN = "glassslam reads ROS1 bags, ROS2 bags (sqlite3, mcap; file or directory), CARMEN and Player logs"

_MAGIC: tuple[tuple[bytes, Format], ...] = (
    (b"#ROSBAG V2.0", "rosbag1"),
    (b"\x89MCAP0\r\n", "rosbag2-mcap"),
    (b"SQLite format 3\x00", "rosbag2-sqlite3"),
)
_REFUSED: tuple[tuple[bytes, str, str], ...] = (
    (b"#ROSBAG", "a ROS1 bag of an old version", "convert it with 'rosbag fix'"),
    (
        b"\x28\xb5\x2f\xfd",
        "zstd-compressed",
        "give the directory with its metadata.yaml, or unpack it with zstd",
    ),
    (b"BZh", "bzip2-compressed as a whole", "unpack it with bunzip2"),
    (b"PK\x03\x04", "a zip archive", "unpack it"),
)
_CARMEN_LINE = re.compile(rb"^(?:FLASER|RLASER|ROBOTLASER\d|RAWLASER\d|ODOM|PARAM|SYNC)\s", re.MULTILINE)
_PLAYER_LINE = re.compile(
    rb"^## Player version|^\d+\.\d+ \S+ \d+ (?:laser|sonar|ranger|position|position2d) +\d+ [\d.]+ ",
    re.MULTILINE,
)
# Index, counter, counter, ticks of 100 ns since the year 1, then readings.
_PIMAP_LINE = re.compile(rb"^\d+ \d+ \d+ 6\d{17}(?: -?[\d.]+){3,}\s*$", re.MULTILINE)
_PART = re.compile(r"\.mcap|\.db3|^metadata\.yaml$")
_HEAD_BYTES = 1 << 16
# Fed in small steps: a decompressor that meets damage returns nothing of that step.
_STEP_BYTES = 256


@dataclass(frozen=True, slots=True)
class Piece:
    """One file (or ROS2 directory with metadata) of a recording.

    Attributes
    ----------
    path : Path
        Where it is.
    format : str
        What it is.
    size : int or None
        Bytes of the file when it was opened; None for a directory.
    """

    path: Path
    format: Format
    size: int | None = None


def resolve(paths: Sequence[str | Path]) -> tuple[Piece, ...]:
    """The consecutive pieces the paths stand for, all of one format.

    Raises
    ------
    RecordingError
        A path is missing, empty, foreign, no file, or of another format than the rest.
    """
    pieces = tuple(piece for path in paths for piece in _expand(Path(path)))
    if not pieces:
        raise RecordingError("no recording was named", KNOWN)
    formats = sorted({piece.format for piece in pieces})
    if len(formats) > 1:
        raise RecordingError(
            f"the pieces of one recording must be of one format, found {' and '.join(formats)}",
            "convert them to one format, or map them one by one",
        )
    return pieces


def _expand(path: Path) -> tuple[Piece, ...]:
    with reading(path):
        if not path.exists():
            raise RecordingError(f"{path} does not exist", _likely(path))
        if not path.is_dir():
            return (_file(path),)
        for part in path.iterdir():
            if _PART.search(part.name):
                _check_kind(part)
        files = sorted((p for p in path.iterdir() if p.suffix in {".mcap", ".db3"}), key=natural_order)
        if (path / "metadata.yaml").exists():
            return (Piece(path, _directory_format(path, files)),)
        if not files:
            raise RecordingError(
                f"{path} is a directory without a ROS2 bag in it", "name the files themselves"
            )
        return tuple(map(_file, files))


def _likely(path: Path) -> str:
    """What may have been meant by a name that is not there; empty where nothing is called alike."""
    if not path.parent.is_dir():
        return f"there is no folder {path.parent}"
    names = [other.name for other in path.parent.iterdir()]
    near = difflib.get_close_matches(path.name, names, n=1, cutoff=0.8)
    return f"did you mean {path.with_name(near[0])}?" if near else ""


def _file(path: Path) -> Piece:
    for ending in ("", "-wal", "-journal"):  # a database is read with its logs
        _check_kind(path.with_name(f"{path.name}{ending}"))
    return Piece(path, _detect(path), path.stat().st_size)


def _check_kind(path: Path) -> None:
    try:
        regular(path)
    except OSError as error:
        raise RecordingError(
            f"cannot read {path}: {error.strerror}", "a pipe or device is copied to a file first"
        ) from error


def natural_order(path: Path) -> list[tuple[int, str]]:
    """Key by which `part_2` comes before `part_10`."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]


def _directory_format(path: Path, files: Sequence[Path]) -> Format:
    """The storage of a directory with metadata; the compressed ones show it in the name only."""
    names = [file.name for file in files] or [file.name for file in path.iterdir()]
    if any(".mcap" in name for name in names):
        return "rosbag2-mcap"
    if any(".db3" in name for name in names):
        return "rosbag2-sqlite3"
    raise RecordingError(f"{path} has a metadata.yaml but neither .mcap nor .db3 files")


def _detect(path: Path) -> Format:
    with path.open("rb") as file:
        head = file.read(_HEAD_BYTES)
    if not head:
        raise RecordingError(f"{path} is empty")
    for magic, name in _MAGIC:
        if head.startswith(magic):
            return name
    for magic, what, hint in _REFUSED:
        if head.startswith(magic):
            raise RecordingError(f"{path} is {what}", hint)
    text = _inflate(head) if head.startswith(GZIP_MAGIC) else head
    if _is_text(text):
        if _CARMEN_LINE.search(text):
            return "carmen"
        if _PLAYER_LINE.search(text):
            return "player"
        if _PIMAP_LINE.search(text):
            return "pimap"
    raise RecordingError(f"{path} is no recording known here", KNOWN)


def _is_text(head: bytes) -> bool:
    """Whether there is next to no zero byte; a power cut leaves many of them at the end of a log."""
    text = head.rstrip(b"\x00")
    return text.count(b"\x00") * 1000 <= len(text)


def _inflate(head: bytes) -> bytes:
    """What the beginning of a gzip file unpacks to, up to its first damage."""
    inflate, text = zlib.decompressobj(wbits=31), bytearray()
    with suppress(zlib.error):
        for k in range(0, len(head), _STEP_BYTES):
            text += inflate.decompress(head[k : k + _STEP_BYTES], _HEAD_BYTES)
            if inflate.unconsumed_tail or len(text) > 4 * _HEAD_BYTES:
                break
    return bytes(text)
