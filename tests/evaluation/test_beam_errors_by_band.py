"""Labels of beams against what the beams truly met."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from detectors.labels import GHOST, GLASS
from glassslam.errors import EvaluationError
from glassslam.evaluation.beam_labels import TrueLabels, evaluate_beams, read_true_labels
from glassslam.glass.beam_labels import BeamLabelLog

LABELS = st.integers(0, 4)
TABLES = arrays(np.uint8, (3, 6), elements=LABELS)


def scans(*rows):
    """Labels drawn as text: . solid, g glass, h ghost, - no return."""
    names = {".": 1, "g": 2, "h": 3, "-": 4}
    return np.array([[names[beam] for beam in row] for row in rows], np.uint8)


def compare(said, true, stamps=None, true_stamps=None, **more):
    stamps = np.arange(len(said), dtype=np.float64) if stamps is None else np.array(stamps)
    true_stamps = np.arange(len(true), dtype=np.float64) if true_stamps is None else np.array(true_stamps)
    return evaluate_beams(BeamLabelLog.of(stamps, said).beams(), TrueLabels(true_stamps, true, **more))


def counts(score):
    return score.true_positives, score.false_positives, score.false_negatives


def test_beams_are_right_wrong_or_missed():
    errors = compare(scans("ggg..."), scans(".gghg-"))
    assert counts(errors.glass) == (2, 1, 1)
    assert (errors.glass.precision.value, errors.glass.recall.value) == pytest.approx((2 / 3, 2 / 3))
    assert (errors.scans, errors.beams) == (1, 6)


def test_ghosts_are_counted_by_themselves():
    errors = compare(scans("hhg."), scans("hgh."))
    assert counts(errors.ghosts) == (1, 1, 1)
    assert counts(errors.glass) == (0, 1, 1)


def test_false_glass_is_told_apart_by_what_the_beams_met():
    assert compare(scans("ggggg"), scans("..h-g")).false_glass == {"solid": 2, "ghost": 1, "no_return": 1}


@given(TABLES, TABLES)
def test_every_beam_is_counted_once(said, true):
    errors = compare(said, true)
    for score, label in ((errors.glass, GLASS), (errors.ghosts, GHOST)):
        hits = sum(a == b == label for a, b in zip(said.flat, true.flat, strict=True))
        assert score.true_positives == hits
        assert score.true_positives + score.false_positives == np.count_nonzero(said == label)
        assert score.true_positives + score.false_negatives == np.count_nonzero(true == label)
    assert sum(errors.false_glass.values()) == errors.glass.false_positives


def test_intervals_rest_on_scans_for_beams_of_one_scan_meet_the_same_pane():
    one = compare(scans("g" * 100), scans("g" * 50 + "." * 50)).glass.precision
    many = compare(scans(*["g"] * 100), scans(*["g"] * 50, *["."] * 50)).glass.precision
    assert (one.value, one.trials, one.independent) == (0.5, 100, 1)
    assert many.high - many.low < 0.25 < one.high - one.low


def test_scans_are_found_by_their_stamps():
    """The run has thinned the scans; the second stamp differs by rounding."""
    errors = compare(scans("g.", "g."), scans("..", "g.", "..", "gg"), stamps=[1.0, 3.0000005])
    assert (errors.scans, errors.beams) == (2, 4)
    assert counts(errors.glass) == (2, 0, 1)


def test_scans_that_the_truth_does_not_know_are_left_out():
    errors = compare(scans("g", "g"), scans("g"), stamps=[0.0, 8.0])
    assert (errors.scans, counts(errors.glass)) == (1, (1, 0, 0))


def test_the_order_of_the_truth_does_not_matter():
    errors = compare(scans("g.", ".g"), scans(".g", "g."), true_stamps=[1.0, 0.0])
    assert counts(errors.glass) == (2, 0, 0)


def test_other_stamps_are_an_error_that_tells_both():
    with pytest.raises(EvaluationError) as caught:
        compare(scans("g"), scans("g"), stamps=[5.0], true_stamps=[7.0])
    assert caught.value.message == "no scan of the run has the stamp of a true one"
    assert caught.value.hint == "the run spans 5.000 to 5.000 s, truth spans 7.000 to 7.000 s"


def test_a_run_without_scans_is_an_error():
    with pytest.raises(EvaluationError) as caught:
        compare(np.empty((0, 1), np.uint8), scans("g"))
    assert caught.value.hint.startswith("the run has none, ")


def test_beams_that_the_truth_does_not_have_are_an_error():
    with pytest.raises(EvaluationError) as caught:
        compare(scans("..g"), scans("g."))
    assert caught.value.message == "beam 2 is labelled, but true scans have 2 beams"
    assert caught.value.hint == "the truth belongs to another recording"


def by_border(bands):
    return {(band.low, band.high): counts(band.score) for band in bands if any(counts(band.score))}


def test_bands_of_range_hold_the_beams_within_them():
    ranges = np.array([[0.5, 1.0, 1.9, 12.0]], np.float32)
    errors = compare(scans("ggg."), scans("g..g"), range_m=ranges)
    assert by_border(errors.by_range) == {
        (0.0, 1.0): (1, 0, 0),
        (1.0, 2.0): (0, 2, 0),
        (10.0, None): (0, 0, 1),
    }


def test_bands_of_incidence_tell_what_is_missed():
    incidence = np.array([[0, 1, 25, 255]], np.uint8)
    errors = compare(scans("g..g"), scans("ggg."), incidence_deg=incidence)
    assert by_border(errors.by_incidence) == {(0.0, 2.0): (1, 0, 1), (20.0, 30.0): (0, 0, 1)}


def test_without_ranges_and_incidences_there_are_no_bands():
    errors = compare(scans("g"), scans("g"))
    assert (errors.by_range, errors.by_incidence) == ((), ())


HINT = "true labels are written by simulate beside the bag: BAG.truth.labels.npz"
TRUTH = {"stamps": np.array([1.0, 2.0]), "labels": scans("g.", "..")}


def saved(tmp_path, **arrays):
    path = tmp_path / "truth.npz"
    np.savez_compressed(path, **arrays)
    return path


def test_truth_is_read_with_what_it_has(tmp_path):
    bare = read_true_labels(saved(tmp_path, **TRUTH))
    assert (bare.labels.tolist(), bare.range_m, bare.incidence_deg) == ([[2, 1], [1, 1]], None, None)
    tables = {"range_dm": np.array([[10, 255], [3, 4]], np.uint8), "incidence_deg": TRUTH["labels"]}
    full = read_true_labels(saved(tmp_path, **TRUTH, **tables, names=np.array(["a"])))
    assert full.range_m == pytest.approx(np.array([[1.0, 25.5], [0.3, 0.4]]))
    assert full.incidence_deg.tolist() == TRUTH["labels"].tolist()


@pytest.mark.parametrize(
    "change",
    [
        {"labels": np.zeros((2, 2))},
        {"labels": np.zeros(2, np.uint8)},
        {"stamps": np.zeros(3)},
        {"stamps": np.array(["a", "b"])},
        {"range_dm": np.zeros((2, 3), np.uint8)},
        {"incidence_deg": np.zeros((2, 2), np.float32)},
    ],
)
def test_truth_of_another_shape_is_refused(tmp_path, change):
    path = saved(tmp_path, **{**TRUTH, **change})
    with pytest.raises(EvaluationError) as caught:
        read_true_labels(path)
    assert (caught.value.message, caught.value.hint) == (
        f"{path} does not hold the labels of all beams",
        HINT,
    )


def test_a_foreign_npz_is_refused(tmp_path):
    path = saved(tmp_path, pictures=np.zeros(3))
    with pytest.raises(EvaluationError) as caught:
        read_true_labels(path)
    assert (caught.value.message, caught.value.hint) == (f"{path} has no array 'stamps'", HINT)
