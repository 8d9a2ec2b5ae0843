"""Labels of beams kept as runs."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from detectors.labels import GHOST, GLASS
from glassslam.glass.beam_labels import BeamLabelLog


def table(beams, scans, width):
    """Labels (scans, width) written out; 0 where none was given."""
    out = np.zeros((scans, width), np.uint8)
    for label in (GLASS, GHOST):
        out[beams.of_label(label)] = label
    return out


@given(st.integers(0, 4).flatmap(lambda s: arrays(np.uint8, (s, 9), elements=st.integers(0, 4))))
def test_runs_hold_every_label_and_nothing_else(labels):
    stamps = np.arange(len(labels), dtype=np.float64)
    beams = BeamLabelLog.of(stamps, labels).beams()
    kept = np.where((labels == GLASS) | (labels == GHOST), labels, 0)
    assert table(beams, len(labels), 9).tolist() == kept.tolist()
    assert len(beams) == np.count_nonzero(kept)
    assert beams.stamps.tolist() == stamps.tolist()
    assert (np.diff(beams.scan) >= 0).all()


def test_neighbours_of_one_label_are_one_run():
    log = BeamLabelLog()
    log.add(7.0, np.array([2, 2, 3, 3, 3, 0, 2], np.uint8))
    beams = log.beams()
    assert (beams.beam.tolist(), beams.count.tolist()) == ([0, 2, 6], [2, 3, 1])
    assert beams.label.tolist() == [GLASS, GHOST, GLASS]
    assert (beams.beam.dtype, beams.label.dtype, beams.scan.dtype) == (np.int32, np.uint8, np.int64)


def test_scans_may_differ_in_length_and_hold_nothing():
    log = BeamLabelLog()
    for stamp, labels in ((1.0, [2]), (2.0, []), (3.0, [1, 1, 3])):
        log.add(stamp, np.array(labels, np.uint8))
    beams = log.beams()
    assert beams.stamps.tolist() == [1.0, 2.0, 3.0]
    assert [column.tolist() for column in beams.of_label(GHOST)] == [[2], [2]]
    assert [column.tolist() for column in beams.of_label(GLASS)] == [[0], [0]]


def test_a_log_without_scans_is_empty():
    beams = BeamLabelLog().beams()
    assert (len(beams), beams.stamps.size) == (0, 0)
    assert [column.size for column in beams.of_label(GLASS)] == [0, 0]
