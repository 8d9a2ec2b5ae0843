"""Text logs of pi-map looked over."""

from collections.abc import Sequence

from glassslam.records import Damage
from glassslam.sources.carmenlines import UNREADABLE_LINE
from glassslam.sources.formats import Piece
from glassslam.sources.pimap import POSE_VALUES, read_pimap
from glassslam.sources.report import Plan, RecordingReport, TopicReport


def inspect_pimap(pieces: Sequence[Piece], plan: Plan, *, strict: bool = False) -> RecordingReport:
    """Read logs and report what they hold.

    Raises
    ------
    RecordingError
        A file cannot be read; or is damaged, and `strict` was said.
    """
    topics, begin, end = [], float("inf"), float("-inf")
    damage: list[Damage] = []
    dropped = 0
    for piece in pieces:
        log = read_pimap(piece.path, strict=strict)
        times, values = log.sweep_times, log.values
        damage += log.damage
        dropped += log.dropped
        begin, end = min(begin, float(times[0])), max(end, float(times[-1]))
        length = float(times[-1] - times[0])
        kind = "pi-map poses" if values.shape[1] == POSE_VALUES else "pi-map ranges"
        rate = len(times) / length if length > 0.0 else 0.0
        topics.append(TopicReport(piece.path.name, kind, len(times), rate))
    return RecordingReport(
        paths=tuple(str(piece.path) for piece in pieces),
        format="pimap",
        size=sum(piece.path.stat().st_size for piece in pieces),
        begin=begin,
        duration=end - begin,
        topics=tuple(topics),
        scans=(),
        odometry=(),
        imus=(),
        transforms=(),
        plan=plan,
        dropped={UNREADABLE_LINE: dropped} if dropped else {},
        warnings=(),
        damage=tuple(damage),
    )
