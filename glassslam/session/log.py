"""The write-ahead log beside a session: whether the database would pass over it without a word.

The format is described in "Database File Format" of the SQLite documentation, section 4.1.
"""

import struct
from pathlib import Path

HEADER_BYTES, FRAME_BYTES = 32, 24
MOST_PAGES = 1 << 22

_ORDERS = {0x377F0682: "<", 0x377F0683: ">"}
_frame = struct.Struct(">3I").unpack_from


def is_lost(session: Path, page_bytes: int) -> bool:
    """Whether a log holds finished transactions, and a header by which they would not be found.

    Parameters
    ----------
    session : Path
        The file of the session.
    page_bytes : int
        Length of its pages.
    """
    try:
        log = session.with_name(f"{session.name}-wal").read_bytes()
    except FileNotFoundError:
        return False
    return not _is_header(log[:HEADER_BYTES]) and any(count for _, count, _, _ in frames(log, page_bytes))


def frames(log: bytes, page_bytes: int) -> list[tuple[int, int, int, int]]:
    """Frames of a log, the latest last, whether their checksums fit or not.

    A log is written from its beginning again and again, each time with a first salt one greater: behind the
    frames of this time there are those of earlier ones.

    Parameters
    ----------
    log : bytes
        The whole log.
    page_bytes : int
        Length of a page.

    Returns
    -------
    list of tuple
        First salt; size of the database in pages where a transaction ends here, else 0; place of the page
        in the log, bytes; number of the page.
    """
    found = []
    for place in range(HEADER_BYTES, len(log) - FRAME_BYTES - page_bytes + 1, FRAME_BYTES + page_bytes):
        number, count, salt = _frame(log, place)
        if 0 < number < MOST_PAGES:
            found.append((salt, place + FRAME_BYTES, count, number))
    return [(salt, count, place, number) for salt, place, count, number in sorted(found)]


def _is_header(head: bytes) -> bool:
    order = _ORDERS.get(int.from_bytes(head[:4], "big"))
    if order is None or len(head) < HEADER_BYTES:
        return False
    words = struct.unpack(f"{order}6I", head[:24])
    first = second = 0
    for a, b in zip(words[::2], words[1::2], strict=True):
        first = (first + a + second) & 0xFFFFFFFF
        second = (second + b + first) & 0xFFFFFFFF
    return (first, second) == struct.unpack(">2I", head[24:])
