"""The pages of a damaged session: those the database would see, and those it would not any more.

The formats are described in "Database File Format" of the SQLite documentation, sections 1.3 and 4.1.
"""

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path

from glassslam.session.log import frames
from glassslam.sources.sqlitelogs import Overlay, logs_beside, read_overlay
from glassslam.sources.sqlitepages import HEADER_BYTES, PageFile

_MAGIC = b"SQLite format 3\0"
_PAGE_BYTES = 4096


def views(path: Path) -> Iterator[PageFile]:
    """Ways to look at the pages of a session and of the log beside it, from the surest on.

    First the pages that the database would see; where its header is lost, those of a file of the usual pages.
    Then, should that be wrong as well, the same with every page of the log, for the checksums of a log begin
    with its own header, and one that does not fit hides all that follows.

    Parameters
    ----------
    path : Path
        The session; it is not changed.

    Raises
    ------
    OSError
        It cannot be read.
    """
    content = path.read_bytes()
    told = int.from_bytes(content[16:18], "big") if content.startswith(_MAGIC) else 0
    sizes = [size for size in (told, _PAGE_BYTES) if size >= 512 and size & (size - 1) == 0]
    wal, _ = logs_beside(path)
    log = wal.read_bytes() if wal.is_file() else b""
    for size in dict.fromkeys(sizes):
        file = _with_header(content, size)
        yield PageFile(path, BytesIO(file), read_overlay(path, size, len(content) // size))
        if log:
            yield PageFile(path, BytesIO(file), _whole_log(wal, log, size, len(content) // size))


def _with_header(content: bytes, size: int) -> bytes:
    """A file whose header tells the size of its pages, whatever it told before."""
    mended = bytearray(content.ljust(HEADER_BYTES, b"\0"))
    mended[16:21] = size.to_bytes(2, "big") + b"\1\1\0"
    return bytes(mended)


def _whole_log(path: Path, log: bytes, size: int, pages: int) -> Overlay:
    """The last version of every page in a log, whether its checksum fits or not."""
    overlay = Overlay(path, size)
    for _, _, place, number in frames(log, size):
        overlay.stage(number, log[place : place + size])
        pages = max(pages, number)
    overlay.commit(pages)
    return overlay
