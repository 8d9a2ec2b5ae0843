"""Where along a line glass stands, by the observations on it and the beams through it."""

import numpy as np
from numpy.typing import NDArray

from glassslam.config import GlassWallConfig

STEP = 0.1
"""Length of the pieces that lines are divided into, m."""

_RELIABLE = 0.3
_SOLID_RETURNS = 3


def glass_stretches(
    seen: NDArray[np.int64],
    solid: NDArray[np.int64],
    passed: NDArray[np.int64],
    passed_normal: NDArray[np.int64],
    gone: NDArray[np.bool_],
    config: GlassWallConfig,
) -> NDArray[np.bool_]:
    """Pieces of a line that are glass: observed, bridged, or up to the frame that holds them.

    Parameters
    ----------
    seen : ndarray of int64, shape (b,)
        Observations by piece of `STEP`; at least one piece has some.
    solid, passed, passed_normal : ndarray of int64, shape (b,)
        Returns on the line, beams through it, and beams through it at normal incidence, by piece.
    gone : ndarray of bool, shape (b,)
        Pieces that were glass once and are open now.
    config : GlassWallConfig
        Tolerances.

    Returns
    -------
    ndarray of bool, shape (b,)
        True for glass.
    """
    observed = (seen > 0) & ~gone
    glass = observed.copy()
    if not observed.any():
        return glass
    # the share of beams at normal incidence that this glass answered, from the stretches where it did; but
    # those are chosen for having answered, and it is no more than the mean of all pieces of the line
    answers, met = int(seen[observed].sum()), seen + passed_normal
    reach = slice(int(np.argmax(observed)), len(seen) - int(np.argmax(observed[::-1])))
    rate = min(
        answers / int(met[observed].sum()),
        float(np.mean((seen[reach] / np.maximum(met[reach], 1))[met[reach] > 0])),
    )
    opaque = opaque_pieces(seen, solid, passed)
    for first, last in runs(~observed):
        inner = slice(first, last + 1)
        between = first > 0 and last < len(seen) - 1
        if gone[inner].any():
            continue
        if between and _may_bridge(opaque[inner], passed[inner], passed_normal[inner], rate, config):
            glass[inner] = True
            continue
        if first > 0:
            glass[_way_to_frame(range(first, last + 1), opaque, passed, config.max_extension)] = True
        if last < len(seen) - 1:
            glass[_way_to_frame(range(last, first - 1, -1), opaque, passed, config.max_extension)] = True
    return glass


def opaque_pieces(
    seen: NDArray[np.int64], solid: NDArray[np.int64], passed: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Pieces of a line that stop beams and are not observed as glass, shape (b,)."""
    return np.asarray((seen == 0) & (solid >= _SOLID_RETURNS) & (solid > passed))


def _may_bridge(
    opaque: NDArray[np.bool_],
    passed: NDArray[np.int64],
    passed_normal: NDArray[np.int64],
    rate: float,
    config: GlassWallConfig,
) -> bool:
    """Whether a gap between observed pieces is glass that nobody met at normal incidence."""
    length = len(opaque) * STEP
    if length > config.max_gap:
        return False
    widest = max((last - first + 1 for first, last in runs(opaque)), default=0) * STEP
    if widest > config.max_mullion:
        return False
    # glass that seldom answers even where it stands proves nothing by its silence
    if rate > _RELIABLE and rate * int(passed_normal.sum()) > config.opening_evidence:
        return False
    silent = ~opaque & (passed == 0)
    return bool(silent.sum() * STEP <= max(config.max_mullion, 0.5 * length))


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
