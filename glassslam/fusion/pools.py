"""Opinion pools: N maps of P(occupied) into one.

Equations are those of section 2.3 of the fusion framework for a 2D lidar and a 3D ultrasonic sensor.

A sensor that never saw a cell (NaN) has the opinion 0.5 there; a cell that none of them saw stays NaN.
Opinions are kept within 1e-6 of certainty, so that two sensors that are sure of the contrary end at 0.5.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from glassslam.errors import GridError
from glassslam.records import FloatArray

_EDGE = 1e-6


def linear_pool(opinions: FloatArray, weights: Sequence[float] | FloatArray | None = None) -> FloatArray:
    """LOP, the weighted mean sum w_i p_i / sum w_i (equation 4).

    Parameters
    ----------
    opinions : ndarray of float, shape (n, ...)
        P(occupied) by sensor.
    weights : sequence of float, shape (n,), optional
        Not negative, not all 0; equal when left out.

    Raises
    ------
    GridError
        Weights that do not fit.

    Examples
    --------
    >>> float(linear_pool([0.9, 0.5], [3.0, 1.0]).round(3))
    0.8
    """
    p, unseen = _opinions(opinions)
    return _known(np.tensordot(_weights(weights, len(p)), p, axes=1), unseen)


def logarithmic_pool(opinions: FloatArray, weights: Sequence[float] | FloatArray | None = None) -> FloatArray:
    """LIOP, the geometric mean normalised against that of the contrary (equations 5 and 6).

    Parameters
    ----------
    opinions : ndarray of float, shape (n, ...)
        P(occupied) by sensor.
    weights : sequence of float, shape (n,), optional
        Not negative, not all 0; scaled to the sum 1; equal when left out.

    Raises
    ------
    GridError
        Weights that do not fit.

    Examples
    --------
    >>> float(logarithmic_pool([0.7, 0.7]).round(3))
    0.7
    """
    p, unseen = _opinions(opinions)
    return _known(_probability(np.tensordot(_weights(weights, len(p)), _log_odds(p), axes=1)), unseen)


def independent_pool(opinions: FloatArray) -> FloatArray:
    """IOP, prod p_i / (prod p_i + prod (1 - p_i)) (equation 7).

    Parameters
    ----------
    opinions : ndarray of float, shape (n, ...)
        P(occupied) by sensor.

    Examples
    --------
    Two readings of 0.7 (the paper prints 0.83):

    >>> float(independent_pool([0.7, 0.7]).round(3))
    0.845
    """
    p, unseen = _opinions(opinions)
    occupied, free = np.prod(p, axis=0), np.prod(1.0 - p, axis=0)
    return _known(occupied / (occupied + free), unseen)


def bayes_pool(opinions: FloatArray, prior: float = 0.5) -> FloatArray:
    """Bayes filter in log odds, l = l_0 + sum (l_i - l_0) (equations 14 and 15, the sign of a textbook).

    Parameters
    ----------
    opinions : ndarray of float, shape (n, ...)
        P(occupied) by sensor, each of which started from the prior.
    prior : float
        P(occupied) before any measurement; a cell unseen by a sensor has it as its opinion.

    Raises
    ------
    GridError
        A prior that is no probability between 0 and 1.

    Examples
    --------
    >>> float(bayes_pool([0.7, 0.7]).round(3))
    0.845
    """
    if not 0.0 < prior < 1.0:
        raise GridError(f"prior of the Bayes pool is {prior}", "it must be between 0 and 1")
    p, unseen = _opinions(opinions, prior)
    start = float(np.log(prior / (1.0 - prior)))
    return _known(_probability(start + (_log_odds(p) - start).sum(axis=0)), unseen)


def _opinions(opinions: FloatArray, unseen_as: float = 0.5) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Opinions within the edges, and the cells without any."""
    p = np.asarray(opinions, dtype=np.float64)
    missing = np.isnan(p)
    return np.clip(np.where(missing, unseen_as, p), _EDGE, 1.0 - _EDGE), np.asarray(missing.all(axis=0))


def _known(pooled: FloatArray, unseen: NDArray[np.bool_]) -> FloatArray:
    return np.where(unseen, np.nan, pooled)


def _weights(weights: Sequence[float] | FloatArray | None, count: int) -> FloatArray:
    """Weights with the sum 1."""
    w = np.ones(count) if weights is None else np.asarray(weights, dtype=np.float64)
    if w.shape != (count,) or not np.isfinite(w).all() or (w < 0).any() or w.sum() <= 0:
        raise GridError(f"weights {w.tolist()} for {count} maps", "give one per map, not negative, not all 0")
    return np.asarray(w / w.sum())


def _log_odds(p: FloatArray) -> FloatArray:
    return np.asarray(np.log(p) - np.log1p(-p))


def _probability(log_odds: FloatArray) -> FloatArray:
    return np.asarray(1.0 / (1.0 + np.exp(-log_odds)))
