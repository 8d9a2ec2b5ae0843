"""What is told of uncertain stretches in a line, and how they are counted."""

from collections.abc import Sequence

from glassslam.slam.result import Degeneracy

_SUMMARIES = (
    (("featureless",), "{where} could slide along a featureless corridor"),
    (
        ("featureless, no odometry",),
        "for {seconds} nothing told how far the robot drove along bare walls: the map may be much too short",
    ),
    (
        ("odometry stuck",),
        "the odometry stood still for {seconds} while the scans changed: the map may be squeezed"
        " (--odom-topic none maps without it)",
    ),
    (
        ("motion missed",),
        "for {seconds} the robot rests in the map while the scans change: what it drove there is missing",
    ),
    (
        ("odometry contradicted",),
        "{where} of odometry that the scans contradict: the map may be wrong"
        " (--odom-topic none maps without it)",
    ),
    (("low overlap", "poor fit"), "{where} fit the map badly"),
    (("lost",), "tracking was lost and found again, {times}"),
    (
        ("clock jump", "silence"),
        "the recording breaks off {times}; what follows is joined with what was before",
    ),
    (
        ("clock jump, not rejoined", "silence, not rejoined"),
        "the recording breaks off {times}, and the map is in pieces that may be drawn over each other:"
        " how they lie is a guess",
    ),
    (("closure rejected",), "{where} passed places known from before without recognising them"),
)


def summarised(found: Sequence[Degeneracy]) -> list[str]:
    """One line for every kind of stretch that makes a map less certain.

    Parameters
    ----------
    found : sequence of Degeneracy
        Stretches of a run.
    """
    lines = []
    for kinds, words in _SUMMARIES:
        those = [one for one in found if one.kind in kinds]
        if those:
            count, metres = len(those), sum(one.length for one in those)
            where = f"{count} stretch{'es' * (count != 1)}, {metres:.0f} m,"
            seconds = f"{sum(abs(one.end - one.start) for one in those):.0f} s"
            lines.append(f"{words.format(where=where, times=times(count), seconds=seconds)}: see report")
    return lines


def scans_of(count: int) -> str:
    """Scans, counted."""
    return f"{count} scan{'s' * (count != 1)}"


def times(count: int) -> str:
    """How often, counted."""
    return "once" if count == 1 else f"{count} times"
