"""What damage costs, told from what an index says or from what stands around it."""

from collections.abc import Sequence
from dataclasses import dataclass

from glassslam.records import Damage

# More parts than a user would read of one file are told as one.
MOST_PARTS = 50


@dataclass(slots=True)
class Gap:
    """A part of a file without readable messages.

    Attributes
    ----------
    offset, bytes : int
        Where it is in the file.
    reason : str
        What is wrong.
    before, after : int or None
        Record times of the messages around it, ns; None where there is none.
    missing : int
        Bytes that should follow and that the file does not hold.
    expected : int or None
        Messages the index announces for the part; None without one.
    found : int
        Messages that were read from it after all.
    """

    offset: int
    bytes: int
    reason: str
    before: int | None = None
    after: int | None = None
    missing: int = 0
    expected: int | None = None
    found: int = 0


def joined(gaps: Sequence[Gap]) -> list[Gap]:
    """Gaps in the order of the file; those without a message between them become one."""
    result: list[Gap] = []
    for gap in sorted(gaps, key=lambda gap: gap.offset):
        last = result[-1] if result else None
        adjacent = last is not None and last.offset + last.bytes == gap.offset
        if last is not None and adjacent and last.expected is None and gap.expected is None:
            last.bytes, last.after = last.bytes + gap.bytes, gap.after
            last.missing += gap.missing
        else:
            result.append(gap)
    return result


def damages(file: str, gaps: Sequence[Gap], times: Sequence[int], readable: int) -> list[Damage]:
    """Damage as it is told to a user.

    Parameters
    ----------
    file : str
        The file, as given.
    gaps : sequence of Gap
        What could not be read.
    times : sequence of int
        Record times of all messages that were read, ns.
    readable : int
        Bytes of the file that hold them; with the times they tell how many messages a byte holds.
    """
    per_byte = len(times) / max(readable, 1)
    seconds_per_byte = (max(times) - min(times)) / 1e9 / max(readable, 1) if times else 0.0
    return [_damage(file, gap, per_byte, seconds_per_byte) for gap in joined(gaps)]


def shortened(parts: Sequence[Damage]) -> tuple[Damage, ...]:
    """Damage of one file, the last of very many parts joined into one."""
    if len(parts) <= MOST_PARTS:
        return tuple(parts)
    kept, rest = parts[: MOST_PARTS - 1], parts[MOST_PARTS - 1 :]
    firsts = [part.first_stamp for part in rest if part.first_stamp is not None]
    lasts = [part.last_stamp for part in rest if part.last_stamp is not None]
    joint = Damage(
        file=rest[0].file,
        offset=min(part.offset for part in rest),
        bytes=sum(part.bytes for part in rest),
        first_stamp=min(firsts, default=None),
        last_stamp=max(lasts, default=None),
        messages_lost=sum(part.messages_lost for part in rest),
        reason=f"{len(rest)} more damaged parts",
    )
    return (*kept, joint)


def _damage(file: str, gap: Gap, per_byte: float, seconds_per_byte: float) -> Damage:
    size = gap.bytes + gap.missing
    expected = round(size * per_byte) if gap.expected is None else gap.expected
    lost = max(0, expected - gap.found)
    before = None if gap.before is None else gap.before / 1e9
    after = None if gap.after is None else gap.after / 1e9
    if after is None and before is not None:
        after = before + size * seconds_per_byte
    if before is None and after is not None:
        before = after - size * seconds_per_byte
    missing = f", {gap.missing} bytes are missing" if gap.missing else ""
    return Damage(file, gap.offset, gap.bytes, before, after, lost, gap.reason + missing)
