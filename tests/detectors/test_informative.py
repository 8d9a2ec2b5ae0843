import numpy as np
import pytest

from detectors.informative import is_intensity_informative
from detectors.self_calibration import suggest_detector

RANGES = np.linspace(0.5, 6.0, 200)


def judge(intensities, ranges=RANGES):
    return is_intensity_informative([(ranges, intensities)])


@pytest.mark.parametrize(
    ("intensities", "kind", "reason"),
    [
        ([], "empty", "the recording has no intensities"),
        (np.full(200, np.nan), "not finite", "no intensity is a finite number"),
        (np.zeros(200), "zero", "all intensities are 0"),
        (np.full(200, 47.0), "constant", "all intensities are 47"),
        (np.repeat([0.0, 1.0], 100), "two-valued", "the intensities know two values only, 0 and 1"),
        (RANGES, "range", "the intensities are a copy of the ranges"),
        (1000.0 * RANGES, "range", "the intensities are a copy of the ranges"),
        (np.minimum(40.0 * RANGES, 100.0), "saturated", "64% of the intensities are saturated at 100"),
    ],
)
def test_useless_intensities_are_recognised(intensities, kind, reason):
    verdict = judge(intensities)
    assert not verdict
    assert (verdict.kind, verdict.reason) == (kind, reason)


def test_useful_ones_too():
    verdict = judge(np.round(4000.0 / RANGES))
    assert verdict.informative
    assert verdict.kind == "informative"
    assert verdict.reason.endswith("distinct intensities up to 8000")


def test_beams_without_return_do_not_count():
    ranges = np.where(np.arange(200) < 100, np.inf, RANGES)
    intensities = np.where(np.arange(200) < 100, 0.0, 300.0)
    assert judge(intensities, ranges).kind == "constant"


def test_some_saturated_beams_are_normal():
    assert judge(np.minimum(40.0 * RANGES, 220.0))


def test_no_scan_at_all():
    assert is_intensity_informative([]).kind == "empty"


def test_only_the_first_scans_are_looked_at():
    def scans():
        for _ in range(50):
            yield RANGES, np.zeros(200)
        yield RANGES, 4000.0 / RANGES

    assert is_intensity_informative(scans()).kind == "zero"


def test_intensities_must_fit():
    with pytest.raises(ValueError, match="3 intensities do not fit 200 ranges"):
        judge([1.0, 2.0, 3.0])


def test_the_detector_follows_from_the_intensities_and_the_resolution():
    assert suggest_detector(judge(np.zeros(200)), 0.0044) == "off"
    assert suggest_detector(judge(4000.0 / RANGES), -0.0044) == "calibrated_peak"
    assert suggest_detector(judge(4000.0 / RANGES), 0.0175) == "narrow_return"
