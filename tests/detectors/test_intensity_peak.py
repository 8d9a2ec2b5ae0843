import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from detectors.intensity_peak import intensity_peak, wang_wang
from detectors.labels import GLASS, INVALID, NO_RETURN, SOLID
from detectors.peak_kernels import peaks

RULE = {"thresh": 3000, "grad": 500, "width": 4, "angle_min": 0.0, "angle_increment": 0.01}


def found(intensities, ranges=None, rule=RULE, detect=intensity_peak):
    ranges = [2.0] * len(intensities) if ranges is None else ranges
    return detect(ranges, intensities, **rule).beam.tolist()


def test_a_narrow_peak_is_glass_at_its_middle():
    assert found([900, 900, 5000, 5200, 5100, 900, 900]) == [3]


def test_the_middle_is_rounded_down_between_rise_and_fall():
    assert found([900, 5000, 900]) == [1]
    assert found([900, 5000, 5000, 900]) == [2]


@pytest.mark.parametrize(
    ("intensities", "why"),
    [
        ([4000] * 8, "a flat bright wall has no edge"),
        ([900, 2999, 900, 900], "too low"),
        ([900, 5000, 5000, 5000, 5000, 5000, 900], "too wide"),
        ([2900, 3100, 2900, 2900], "too gentle"),
        ([900, 5000, 5000, 5000, 5000], "never falls"),
        ([5000, 5000, 900, 900], "never rises"),
    ],
)
def test_no_glass(intensities, why):
    assert found(intensities) == [], why


def test_a_rise_is_used_once():
    assert found([900, 5000, 3500, 3000, 900]) == [1]


def test_the_last_step_of_a_rise_is_where_it_begins():
    assert found([900, 4000, 6000, 6000, 900]) == [3]


def test_no_edge_is_seen_across_invalid_beams():
    intensities = [900, 5000, 5000, 900, 900]
    assert found(intensities, [2.0, 2.0, math.nan, 2.0, 2.0]) == []
    assert found(intensities, [2.0, 0.0, 2.0, 2.0, 2.0]) == []


def test_a_spike_with_nothing_beside_it_is_a_peak():
    assert found([0, 5000, 4800, 0], [math.inf, 2.0, 2.0, math.inf]) == [2]


def test_the_intensity_of_a_beam_without_return_does_not_count():
    assert found([5000, 5000, 900], [math.inf, 2.0, 2.0]) == [1]


def test_an_observation_says_where_and_how_strong():
    detection = intensity_peak([2.0, 2.0, 2.5, 2.0], [900, 4000, 4400, 900], **RULE)
    assert detection.strength.tolist() == [4400.0]
    assert detection.range.tolist() == [2.5]
    assert detection.bearing.tolist() == detection.normal.tolist() == [0.02]
    assert detection.extent == pytest.approx([0.025])
    assert detection.labels.tolist() == [SOLID, SOLID, GLASS, SOLID]


def test_wang_wang_wants_both_edge_beams_at_one_range():
    intensities = [900, 5000, 5000, 900]
    assert found(intensities, [2.0, 2.0, 2.09, 2.0], detect=wang_wang) == [2]
    assert found(intensities, [2.0, 2.0, 2.11, 2.0], detect=wang_wang) == []


def test_wang_wang_looks_no_farther_than_its_limit():
    intensities = [900, 5000, 900]
    assert found(intensities, [10.0] * 3, detect=wang_wang) == [1]
    assert found(intensities, [10.1] * 3, detect=wang_wang) == []


def test_arrays_that_do_not_belong_together_are_refused():
    with pytest.raises(ValueError, match="3 intensities do not fit 2 ranges"):
        intensity_peak([1.0, 2.0], [1, 2, 3], **RULE)
    with pytest.raises(ValueError, match=r"one scan are needed, not an array of shape \(1, 2\)"):
        intensity_peak([[1.0, 2.0]], [[1.0, 2.0]], **RULE)


def naive_peaks(intensities, labels, thresh, grad, width):
    """Every pair of a rise and the first fall after it, without another rise or an invalid beam between."""
    value = np.where(labels == NO_RETURN, 0.0, intensities)
    steps = range(1, value.size)
    valid = [p for p in steps if INVALID not in (labels[p], labels[p - 1])]
    rises = [p for p in valid if value[p] >= thresh and value[p] - value[p - 1] >= grad]
    falls = [
        p for p in valid if value[p - 1] >= thresh and value[p - 1] - value[p] >= grad and p not in rises
    ]
    pairs = []
    for h in rises:
        after = [p for p in falls if p > h]
        if not after or any(h < r < after[0] for r in rises):
            continue
        if (labels[h : after[0] + 1] != INVALID).all() and after[0] - h <= width:
            pairs.append((h, after[0]))
    return pairs


@given(
    arrays(np.float64, 30, elements=st.sampled_from([0.0, 900.0, 2900.0, 3100.0, 5000.0, 9000.0])),
    arrays(np.uint8, 30, elements=st.sampled_from([SOLID, SOLID, SOLID, SOLID, INVALID, NO_RETURN])),
    st.integers(1, 6),
)
def test_the_kernel_agrees_with_its_naive_twin(intensities, labels, width):
    rises, falls = peaks(intensities, labels, 3000.0, 500.0, width)
    expected = naive_peaks(intensities, labels, 3000.0, 500.0, width)
    assert list(zip(rises.tolist(), falls.tolist(), strict=True)) == expected
