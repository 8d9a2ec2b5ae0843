"""Breaks of the recording, and loop closures that failed: where a map may be torn, in words."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from glassslam.geometry import between
from glassslam.slam.degeneracy import Trace, in_order, scan_degeneracies
from glassslam.slam.motion_degeneracy import motion_degeneracies
from glassslam.slam.rejoin import joined
from glassslam.slam.result import Degeneracy
from glassslam.slam.search_outcome import SearchOutcome
from glassslam.slam.tracking import Event

_LONG_GAP, _MANY_STEPS = 5.0, 10.0
_NEAR, _LEAST_TRAVEL, _SAME_PLACE = 1.0, 4.0, 3.0


def find_degeneracies(trace: Trace) -> list[Degeneracy]:
    """All that a reader of the map should know of a run, in the order of the recording.

    Parameters
    ----------
    trace : Trace
        The run.
    """
    every = scan_degeneracies, motion_degeneracies, break_degeneracies, closure_degeneracies
    return in_order(one for kind in every for one in kind(trace))


def break_degeneracies(trace: Trace) -> Iterator[Degeneracy]:
    """Times at which the clock was set or nothing was recorded, and whether the run is in one piece again.

    Parameters
    ----------
    trace : Trace
        The run.
    """
    labels = joined(trace.begins, trace.used)
    stretch_of = {int(trace.node_scans[begin]): k for k, begin in enumerate(trace.begins, start=1)}
    steps = np.diff(trace.stamps, prepend=trace.stamps[:1])
    usual = float(np.median(steps[1:])) if len(steps) > 1 else 0.0
    is_long = steps > max(_LONG_GAP, _MANY_STEPS * usual)
    is_back = trace.matches.event & Event.CLOCK_BACK != 0
    for scan in np.flatnonzero(is_long | is_back).tolist():
        kind = "clock jump" if is_back[scan] else "silence"
        what = (
            f"stamps step back by {_duration(-steps[scan])}"
            if is_back[scan]
            else f"no scan for {_duration(steps[scan])}"
        )
        stretch = stretch_of.get(scan)
        if stretch is None:
            yield trace.told(kind, scan - 1, scan, f"{what}: tracking went on across it")
        elif labels[stretch] < stretch:
            yield trace.told(kind, scan - 1, scan, f"{what}: split, and {_rejoined(trace, stretch, scan)}")
        else:
            text = f"{what}: split, and not rejoined: {_loose(trace, stretch, scan)}"
            yield trace.told(f"{kind}, not rejoined", scan - 1, scan, text)


def closure_degeneracies(trace: Trace) -> Iterator[Degeneracy]:
    """Places where loop closures failed, contradicted the rest or leave a direction free.

    Parameters
    ----------
    trace : Trace
        The run.
    """
    near = [search for search in trace.searches if search.distance < _NEAR]
    accepted = [search for search in trace.searches if not search.rejected]
    for members in _places(trace, near, lambda every: all(search.rejected for search in every)):
        if _length(trace, members) >= _LEAST_TRAVEL:
            reasons = Counter(search.rejected for search in members)
            detail = ", ".join(f"{count} x {reason}" for reason, count in sorted(reasons.items()))
            text = f"the map of an earlier visit was not recognised in {len(members)} searches ({detail})"
            yield _told(trace, "closure rejected", members, text)
    wrong = [search for search in trace.searches if search.rejected == "inconsistent"]
    for members in _places(trace, wrong, lambda _: True):
        text = (
            f"{_closures(len(members))} found here contradicted what was known, and {_were(members)} not used"
        )
        yield _told(trace, "closure inconsistent", members, text)
    for members in _places(trace, accepted, lambda every: all(search.ambiguous for search in every)):
        if _length(trace, members) >= _LEAST_TRAVEL:
            text = f"{_closures(len(members))} could slide along a line: they hold the map across it only"
            yield _told(trace, "closure ambiguous", members, text)
    taken_out = [SearchOutcome(node, anchor, "", False, 0.0) for anchor, node in trace.taken_out.tolist()]
    for members in _places(trace, taken_out, lambda _: True):
        text = f"{_closures(len(members))} did not fit the others and {_were(members)} taken out"
        yield _told(trace, "closure taken out", members, text)


def _places(
    trace: Trace, searches: Sequence[SearchOutcome], fails: Callable[[list[SearchOutcome]], bool]
) -> Iterator[list[SearchOutcome]]:
    """Searches of nodes that follow each other within a few metres and fail, node by node."""
    by_node: dict[int, list[SearchOutcome]] = {}
    for search in searches:
        by_node.setdefault(search.node, []).append(search)
    members: list[SearchOutcome] = []
    for _, every in sorted(by_node.items()):
        if members and (not fails(every) or _length(trace, [members[-1], every[0]]) > _SAME_PLACE):
            yield members
            members = []
        if fails(every):
            members = members + every
    if members:
        yield members


def _length(trace: Trace, members: Sequence[SearchOutcome]) -> float:
    first, last = (int(trace.node_scans[members[k].node]) for k in (0, -1))
    return float(trace.travelled[last] - trace.travelled[first])


def _told(trace: Trace, kind: str, members: Sequence[SearchOutcome], text: str) -> Degeneracy:
    first, last = (int(trace.node_scans[members[k].node]) for k in (0, -1))
    return trace.told(kind, first, last, text)


def _rejoined(trace: Trace, stretch: int, scan: int) -> str:
    begin = trace.begins[stretch - 1]
    crossing = int(((trace.used.min(axis=1) < begin) & (trace.used.max(axis=1) >= begin)).sum())
    step = between(trace.final[scan - 1], trace.final[scan])
    moved, turned = math.hypot(step[0], step[1]), math.degrees(abs(step[2]))
    return f"rejoined by {_closures(crossing)}, {moved:.2f} m and {turned:.0f} deg on"


def _loose(trace: Trace, stretch: int, scan: int) -> str:
    nexts = [int(trace.node_scans[begin]) for begin in trace.begins[stretch:]]
    last = (nexts[0] if nexts else len(trace.stamps)) - 1
    length = trace.travelled[last] - trace.travelled[scan]
    return f"scans {scan} to {last} ({length:.1f} m) hang loose, their place in the map is a guess"


def _closures(count: int) -> str:
    return f"{count} loop closure{'s' * (count != 1)}"


def _were(members: Sequence[SearchOutcome]) -> str:
    return "was" if len(members) == 1 else "were"


def _duration(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.1f} s"
    return f"{seconds / 60.0:.1f} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"
