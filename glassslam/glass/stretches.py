"""Where along a line glass stands, by the observations on it and the beams through it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from glassslam.config import GlassWallConfig

STEP = 0.1
"""Length of the pieces that lines are divided into, m."""

_RELIABLE = 0.3
_SOLID_RETURNS = 3


@dataclass(frozen=True, slots=True)
class LineEvidence:
    """What a run tells about a line, by pieces of `STEP`.

    Attributes
    ----------
    seen : ndarray of int64, shape (b,)
        Observations of glass; at least one piece has some.
    answers : ndarray of int64, shape (b,)
        Those of them that the lidar made.
    solid, passed, passed_normal : ndarray of int64, shape (b,)
        Returns on the line, beams through it, and beams through it at normal incidence.
    blocked : ndarray of int64, shape (b,)
        Returns from things just before the line.
    gone : ndarray of bool, shape (b,)
        Pieces that were glass once and are open now.
    """

    seen: NDArray[np.int64]
    answers: NDArray[np.int64]
    solid: NDArray[np.int64]
    passed: NDArray[np.int64]
    passed_normal: NDArray[np.int64]
    blocked: NDArray[np.int64]
    gone: NDArray[np.bool_]

    @property
    def opaque(self) -> NDArray[np.bool_]:
        """Pieces that stop beams and are not observed as glass."""
        return np.asarray((self.seen == 0) & (self.solid >= _SOLID_RETURNS) & (self.solid > self.passed))

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """Pieces that most beams do not reach: nothing looked there, or something stands before them."""
        return np.asarray(~self.opaque & (self.blocked >= self.passed))


def glass_stretches(line: LineEvidence, config: GlassWallConfig) -> NDArray[np.bool_]:
    """Pieces of a line that are glass: observed, bridged, or up to the frame that holds them.

    Parameters
    ----------
    line : LineEvidence
        What is known of it.
    config : GlassWallConfig
        Tolerances.

    Returns
    -------
    ndarray of bool, shape (b,)
        True for glass.
    """
    seen, gone, opaque = line.seen, line.gone, line.opaque
    observed = (seen > 0) & ~gone
    glass = observed.copy()
    if not observed.any():
        return glass
    rate = _answer_rate(line.answers, line.passed_normal, observed)
    for first, last in runs(~observed):
        if gone[first : last + 1].any():
            continue
        if first > 0 and last < len(seen) - 1 and _may_bridge(line, slice(first, last + 1), rate, config):
            glass[first : last + 1] = True
            continue
        longest = config.max_extension
        if first > 0:
            glass[_way_to_frame(range(first, last + 1), opaque, line.passed, longest)] = True
        if last < len(seen) - 1:
            glass[_way_to_frame(range(last, first - 1, -1), opaque, line.passed, longest)] = True
    return glass


def _answer_rate(
    answers: NDArray[np.int64], passed_normal: NDArray[np.int64], observed: NDArray[np.bool_]
) -> float:
    """Share of the beams at normal incidence that the glass of a line answers.

    It is taken from the pieces that were observed; but those are chosen for having answered, so it is no more
    than the mean over all pieces from the first of them to the last.
    """
    met = answers + passed_normal
    if not int(answers.sum()):
        return 0.0
    reach = slice(int(np.argmax(observed)), len(observed) - int(np.argmax(observed[::-1])))
    shares = (answers[reach] / np.maximum(met[reach], 1))[met[reach] > 0]
    return min(int(answers[observed].sum()) / max(int(met[observed].sum()), 1), float(np.mean(shares)))


def _may_bridge(line: LineEvidence, gap: slice, rate: float, config: GlassWallConfig) -> bool:
    """Whether a gap between observed pieces is glass that nobody met at normal incidence."""
    opaque = line.opaque[gap]
    length = len(opaque) * STEP
    if length > config.max_gap:
        return False
    widest = max((last - first + 1 for first, last in runs(opaque)), default=0) * STEP
    if widest > config.max_mullion:
        return False
    # glass that seldom answers even where it stands proves nothing by its silence
    if rate > _RELIABLE and rate * int(line.passed_normal[gap].sum()) > config.opening_evidence:
        return False
    return bool(line.hidden[gap].sum() * STEP <= max(config.max_mullion, 0.5 * length))


def _way_to_frame(
    way: range, opaque: NDArray[np.bool_], passed: NDArray[np.int64], longest: float
) -> list[int]:
    """Pieces from a wall to the frame next to it; none when no frame is near or beams stop on the way."""
    reach: list[int] = []
    for k in way:
        if opaque[k]:
            return reach if len(reach) * STEP <= longest else []
        if passed[k] == 0:
            return []
        reach.append(k)
    return []


def runs(mask: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], mask.astype(np.int8), [0]))))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
