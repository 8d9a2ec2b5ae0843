"""How well a glass detector labels single beams, against what they truly met."""

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from detectors.labels import GHOST, GLASS, NAMES
from detectors.rates import Rate, wilson
from glassslam.errors import EvaluationError
from glassslam.glass.beam_labels import GlassBeams
from glassslam.outputs.beam_labels import read_arrays
from glassslam.records import FloatArray

LARGEST_DIFFERENCE = 0.001
"""Largest difference of the stamps of a scan and its truth, s."""

RANGE_BANDS = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 10.0, np.inf)
"""Borders of the bands of range, m."""

INCIDENCE_BANDS = (0.0, 2.0, 5.0, 10.0, 20.0, 30.0, 40.0, 90.0)
"""Borders of the bands of incidence, deg."""

_HINT = "true labels are written by simulate beside the bag: BAG.truth.labels.npz"

BoolArray = NDArray[np.bool_]
LabelArray = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class TrueLabels:
    """What every beam of a simulated recording truly met.

    Attributes
    ----------
    stamps : ndarray of float64, shape (s,)
        Of the scans, s.
    labels : ndarray of uint8, shape (s, n)
        See `detectors.labels`.
    range_m : ndarray of float32, shape (s, n), or None
        Measured ranges, m; None where the file does not tell.
    incidence_deg : ndarray of uint8, shape (s, n), or None
        Incidence on the pane, for beams that a pane answered, deg.
    """

    stamps: FloatArray
    labels: LabelArray
    range_m: NDArray[np.float32] | None = None
    incidence_deg: LabelArray | None = None


@dataclass(frozen=True, slots=True)
class LabelScore:
    """Agreement of one label with the truth, in beams.

    Attributes
    ----------
    true_positives, false_positives, false_negatives : int
        Beams labelled rightly, wrongly, and not although they should be.
    precision, recall : Rate
        With their 95 % intervals, as if every scan told one new thing: beams of a scan meet the same panes.
    """

    true_positives: int
    false_positives: int
    false_negatives: int
    precision: Rate
    recall: Rate

    @classmethod
    def of(cls, said: BoolArray, true: BoolArray) -> "LabelScore":
        """Score of the beams (s, n) labelled against those that should be."""
        hits = int(np.count_nonzero(said & true))
        labelled, wanted = int(np.count_nonzero(said)), int(np.count_nonzero(true))
        return cls(
            hits, labelled - hits, wanted - hits,
            wilson(hits, labelled, _scans_with(said)), wilson(hits, wanted, _scans_with(true)),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Band:
    """Score of the beams between two borders, the upper one excluded; the last band has no end when None."""

    low: float
    high: float | None
    score: LabelScore


@dataclass(frozen=True, slots=True)
class BeamErrors:
    """Agreement of the labels of a run with the truth.

    Attributes
    ----------
    scans, beams : int
        Scans compared, and their beams.
    glass, ghosts : LabelScore
        Of the two labels a detector gives.
    false_glass : dict
        Beams wrongly labelled glass, by what they truly met.
    by_range : tuple of Band
        Score of the glass label by measured range, m; empty where the truth does not tell.
    by_incidence : tuple of Band
        The same by incidence on the pane, deg; only beams that a pane answered have one, so that the recall
        counts and the precision is that of nothing.
    """

    scans: int
    beams: int
    glass: LabelScore
    ghosts: LabelScore
    false_glass: dict[str, int]
    by_range: tuple[Band, ...]
    by_incidence: tuple[Band, ...]


def read_true_labels(path: str | Path) -> TrueLabels:
    """Read the labels that `glassslam simulate` writes.

    Raises
    ------
    EvaluationError
        The file cannot be read, is no npz, or does not hold the labels of all beams.
    """
    optional = ("range_dm", "incidence_deg")
    arrays = read_arrays(path, ("stamps", "labels"), _HINT, optional, EvaluationError)
    labels, stamps = arrays["labels"], arrays["stamps"]
    tables = [labels, *(arrays[name] for name in optional if name in arrays)]
    if any(table.dtype != np.uint8 or table.shape != labels.shape for table in tables) or (
        labels.ndim != 2 or stamps.shape != labels.shape[:1] or stamps.dtype.kind != "f"
    ):
        raise EvaluationError(f"{path} does not hold the labels of all beams", _HINT)
    decimetres = arrays.get("range_dm")
    return TrueLabels(
        stamps.astype(np.float64),
        labels.astype(np.uint8),
        None if decimetres is None else (0.1 * decimetres.astype(np.float32)).astype(np.float32),
        None if "incidence_deg" not in arrays else arrays["incidence_deg"].astype(np.uint8),
    )


def evaluate_beams(found: GlassBeams, truth: TrueLabels) -> BeamErrors:
    """Compare the labels of a run with the truth, beam by beam, over the scans that both know.

    Parameters
    ----------
    found : GlassBeams
        What the detector said; see `glassslam.outputs.beam_labels.read_beam_labels`.
    truth : TrueLabels
        What the beams met.

    Raises
    ------
    EvaluationError
        No stamps agree, or a beam is labelled that the truth does not have.

    Examples
    --------
    >>> import numpy as np
    >>> from glassslam.evaluation.beam_labels import TrueLabels, evaluate_beams
    >>> from glassslam.glass.beam_labels import BeamLabelLog
    >>> labels = np.array([[1, 2, 2, 3]], dtype=np.uint8)
    >>> log = BeamLabelLog.of(np.array([5.0]), np.array([[1, 1, 2, 2]], dtype=np.uint8))
    >>> errors = evaluate_beams(log.beams(), TrueLabels(np.array([5.0]), labels))
    >>> errors.glass.precision.value, errors.glass.recall.value, errors.false_glass
    (0.5, 0.5, {'ghost': 1})
    """
    own, other = _paired(found.stamps, truth.stamps)
    labels = truth.labels[other]
    glass, ghosts = (_said(found, label, own, labels.shape) for label in (GLASS, GHOST))
    true_glass = labels == GLASS
    wrong = np.bincount(labels[glass & ~true_glass], minlength=len(NAMES))
    ranges = None if truth.range_m is None else truth.range_m[other]
    incidence = None if truth.incidence_deg is None else truth.incidence_deg[other]
    return BeamErrors(
        scans=len(own),
        beams=labels.size,
        glass=LabelScore.of(glass, true_glass),
        ghosts=LabelScore.of(ghosts, labels == GHOST),
        false_glass={NAMES[k]: int(wrong[k]) for k in np.flatnonzero(wrong)},
        by_range=_bands(RANGE_BANDS, ranges, glass, true_glass),
        by_incidence=_bands(INCIDENCE_BANDS, incidence, glass & true_glass, true_glass),
    )


def _paired(stamps: FloatArray, true: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Indices of scans and of their truths, each scan and each truth once at most."""
    if len(stamps) and len(true):
        order = np.argsort(true, kind="stable")
        known = true[order]
        after = np.searchsorted(known, stamps).clip(0, len(known) - 1)
        before = (after - 1).clip(0)
        pick = np.where(np.abs(stamps - known[before]) <= np.abs(known[after] - stamps), before, after)
        own = np.flatnonzero(np.abs(known[pick] - stamps) <= LARGEST_DIFFERENCE)
        other, first = np.unique(order[pick[own]], return_index=True)
        if len(other):
            return own[first], other
    raise EvaluationError(
        "no scan of the run has the stamp of a true one",
        f"{_span('the run', stamps)}, {_span('truth', true)}",
    )


def _span(name: str, stamps: FloatArray) -> str:
    return f"{name} spans {stamps.min():.3f} to {stamps.max():.3f} s" if len(stamps) else f"{name} has none"


def _said(found: GlassBeams, label: int, own: NDArray[np.intp], shape: tuple[int, ...]) -> BoolArray:
    """Beams (s, n) of the chosen scans that have a label."""
    row = np.full(len(found.stamps), -1, dtype=np.int64)
    row[own] = np.arange(len(own))
    scan, beam = found.of_label(label)
    kept = row[scan] >= 0
    if kept.any() and int(beam[kept].max()) >= shape[1]:
        raise EvaluationError(
            f"beam {int(beam[kept].max())} is labelled, but true scans have {shape[1]} beams",
            "the truth belongs to another recording",
        )
    said = np.zeros(shape, dtype=np.bool_)
    said[row[scan[kept]], beam[kept]] = True
    return said


def _bands(
    borders: tuple[float, ...],
    values: NDArray[np.float32] | LabelArray | None,
    said: BoolArray,
    true: BoolArray,
) -> tuple[Band, ...]:
    if values is None:
        return ()
    place = np.digitize(values, borders) - 1
    return tuple(
        Band(
            low, high if np.isfinite(high) else None, LabelScore.of(said & (place == k), true & (place == k))
        )
        for k, (low, high) in enumerate(pairwise(borders))
    )


def _scans_with(beams: BoolArray) -> int:
    return int(np.count_nonzero(beams.any(axis=1)))
