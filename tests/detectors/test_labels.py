import numpy as np
import pytest

from detectors.detection import COLUMNS, Detection, from_table
from detectors.labels import GHOST, GLASS, INVALID, NAMES, NO_RETURN, SOLID, base_labels


def test_beams_are_sorted_by_what_their_range_says():
    ranges = [1.0, np.inf, 65.5, 0.0, -np.inf, np.nan, 0.04, -1.0]
    labels = base_labels(ranges, range_min=0.05, no_echo=30.0)
    invalid = [INVALID] * 5
    assert labels.tolist() == [SOLID, NO_RETURN, NO_RETURN, *invalid]


def test_every_label_has_a_name():
    assert [NAMES[label] for label in (INVALID, SOLID, GLASS, GHOST, NO_RETURN)] == [
        "invalid",
        "solid",
        "glass",
        "ghost",
        "no_return",
    ]


def two():
    table = np.arange(2.0 * len(COLUMNS)).reshape(2, -1)
    return from_table(np.array([3, 5]), table, np.ones(8, dtype=np.uint8))


def test_a_table_becomes_columns():
    assert two().range.tolist() == [0.0, 9.0]
    assert two().extent.tolist() == [8.0, 17.0]
    assert len(two()) == 2


def test_detections_compare_by_value():
    assert two() == two()
    assert two() != two().select([0])
    assert two() != "glass"


def test_selecting_observations_keeps_all_labels():
    chosen = two().select(np.array([False, True]))
    assert chosen.beam.tolist() == [5]
    assert chosen.labels.size == 8


def test_positions_are_end_points_in_the_laser_frame():
    found = two()
    np.testing.assert_allclose(found.positions[1], [9 * np.cos(10.0), 9 * np.sin(10.0)])


def test_columns_of_different_length_are_refused():
    columns = {name: np.zeros(2) for name in COLUMNS} | {"extent": np.zeros(3)}
    with pytest.raises(ValueError, match="extent has 3 entries for 2 beams"):
        Detection(beam=np.arange(2), labels=np.zeros(4, dtype=np.uint8), **columns)
