"""Lines of a log of the Player robot server, as its writelog driver writes them, are told apart.

All versions begin a line with time, host, robot (the port), interface and index. Up to Player 1.6 the time of
the data follows; from Player 2 on it is the first time, and type and subtype of the message follow.
"""

import math
from dataclasses import dataclass
from typing import Literal, TypeAlias

from glassslam.sources.carmenlines import UNREADABLE_LINE
from glassslam.sources.messages import BAD_STAMP, UnusableMessageError

Kind: TypeAlias = Literal[
    "scan", "scan with pose", "laser geometry", "pose", "sweep", "ring and sweep", "ring",
    "ranges", "ranger geometry", "ranger configuration",
]  # fmt: skip

_DATA, _ANSWER = 1, 4
_OLD_KINDS: dict[bytes, Kind] = {
    b"laser": "scan",
    b"position": "pose",
    b"position2d": "pose",
    b"sonar": "ring and sweep",
}
_KINDS: dict[tuple[bytes, int, int], Kind] = {
    (b"laser", _DATA, 1): "scan",
    (b"laser", _DATA, 2): "scan with pose",
    (b"laser", _ANSWER, 1): "laser geometry",
    (b"position", _DATA, 1): "pose",
    (b"position2d", _DATA, 1): "pose",
    (b"sonar", _DATA, 1): "sweep",
    (b"sonar", _DATA, 2): "ring",
    (b"sonar", _ANSWER, 1): "ring",
    (b"ranger", _DATA, 1): "ranges",
    (b"ranger", _DATA, 2): "ranges",
    (b"ranger", _ANSWER, 1): "ranger geometry",
    (b"ranger", _ANSWER, 5): "ranger configuration",
}
DESCRIPTIONS: frozenset[Kind] = frozenset(
    {"laser geometry", "ring", "ranger geometry", "ranger configuration"}
)


@dataclass(frozen=True, slots=True)
class PlayerLine:
    """A line whose beginning has been read.

    Attributes
    ----------
    device : str
        Interface and index, like "laser:0".
    kind : str
        What the rest holds.
    logged, stamp : float
        When it was written, and the time of its data, s.
    text : bytes
        The rest, without plus signs.
    """

    device: str
    kind: Kind
    logged: float
    stamp: float
    text: bytes


def split_line(line: bytes) -> PlayerLine | None:
    """What a line is; None for comments and for interfaces that are not used.

    Raises
    ------
    UnusableMessageError
        The beginning of the line makes no sense.
    """
    words = line.split(None, 6)
    if not words or words[0].startswith(b"#") or len(words) < 6:
        return None
    interface, rest = words[3], words[6] if len(words) > 6 else b""
    try:
        logged, index = float(words[0]), int(words[4])
        if b"." in words[5]:
            kind, stamp = _OLD_KINDS.get(interface), float(words[5])
        else:
            subtype, _, rest = rest.partition(b" ")
            kind, stamp = _KINDS.get((interface, int(words[5]), int(subtype or 0))), logged
    except ValueError as error:
        raise UnusableMessageError(UNREADABLE_LINE) from error
    if kind is None:
        return None
    if not (math.isfinite(logged) and math.isfinite(stamp)):
        raise UnusableMessageError(BAD_STAMP)
    device = f"{interface.decode('ascii', 'replace')}:{index}"
    return PlayerLine(device, kind, logged, stamp, rest.replace(b"+", b""))
