"""Which detector a run gets, and what it says where there is none."""

import math

import numpy as np
import pytest
from glass_scans import COARSE, FINE, scan, walls

from glassslam.config import GlassConfig
from glassslam.errors import RecordingError
from glassslam.slam.glass_choice import DetectorChoice


def settled(scans, **config):
    choice = DetectorChoice(GlassConfig(**config))
    for one in scans:
        choice.add(one, is_node=True)
    choice.settle()
    return choice


def test_fine_scans_are_calibrated_on_themselves():
    choice = settled(walls(FINE, count=12))
    assert (choice.name, choice.reason) == ("calibrated_peak", "calibrated on 12 scans of this recording")
    assert choice.calibration.intensity_scale == pytest.approx(4000.0, rel=0.1)
    assert choice.detect(walls(FINE, count=1)[0]) is not None


def test_coarse_scans_are_searched_for_narrow_returns():
    choice = settled(walls(COARSE, count=12))
    assert (choice.name, choice.reason) == ("narrow_return", "beams 1 deg apart are too few for a peak")


def test_a_shipped_calibration_is_used_where_it_is_named():
    choice = settled(walls(FINE, count=3), sensor="utm30lx")
    assert (choice.name, choice.reason, choice.calibration) == (
        "calibrated_peak",
        "the calibration given",
        None,
    )


@pytest.mark.parametrize(
    ("intensities", "reason"),
    [
        (None, "the recording has no intensities"),
        (np.zeros, "all intensities are 0"),
        (lambda n: np.full(n, 7.0), "all intensities are 7"),
        (lambda n: np.arange(n) % 2, "the intensities know two values only, 0 and 1"),
        (lambda n: np.full(n, math.nan), "no intensity is a finite number"),
        (lambda n: np.minimum(np.arange(n), 254.0 * (np.arange(n) % 3 > 0)), "saturated"),
    ],
)
def test_intensities_that_tell_nothing_are_told(intensities, reason):
    one = walls(FINE, count=1)[0]
    values = () if intensities is None else intensities(len(one.ranges))
    choice = settled([scan(one.ranges, values, FINE)])
    assert (choice.name, choice.detect) == ("off", None)
    assert reason in choice.reason
    assert choice.warnings == []


def test_a_detector_asked_for_that_cannot_work_is_a_warning():
    choice = settled([scan(np.ones(100), (), FINE)], detector="intensity_peak")
    assert choice.warnings == ["glass is not looked for: the recording has no intensities"]


@pytest.mark.parametrize("given", [{"sensor": "utm30lx"}, {}])
def test_beams_too_far_apart_for_the_detector_asked_for_are_a_warning(given):
    choice = settled(walls(COARSE, count=12), detector="calibrated_peak", **given)
    assert choice.name == "calibrated_peak"
    assert choice.warnings == [
        "glass can hardly be found: beams 1 deg apart are too few for a peak, "
        "calibrated_peak needs 0.75 deg or less (see glass.detector)"
    ]
    assert settled(walls(FINE, count=12), detector="calibrated_peak", **given).warnings == []


def test_required_intensities_that_are_not_there_are_an_error():
    with pytest.raises(RecordingError) as caught:
        settled([scan(np.ones(100), (), FINE)], require_intensity=True)
    assert caught.value.message == "glass cannot be looked for: the recording has no intensities"
    assert caught.value.hint == "map without --require-intensity"


def test_too_few_flat_surfaces_are_told():
    random = np.random.default_rng(1)
    clutter = scan(random.uniform(1.0, 9.0, 1081), random.uniform(500.0, 4000.0, 1081), FINE)
    assert settled([clutter]).reason.startswith("a diffuse curve needs 40 returns from flat surfaces")


def test_nothing_is_decided_before_there_are_enough_nodes():
    choice = DetectorChoice(GlassConfig())
    for one in walls(COARSE, count=59):
        choice.add(one, is_node=True)
    assert choice.is_pending
    choice.add(walls(COARSE, count=1)[0], is_node=True)
    assert not choice.is_pending


def test_a_lidar_that_calibrates_itself_learns_from_the_whole_run():
    choice = DetectorChoice(GlassConfig())
    for one in walls(FINE, count=250):
        choice.add(one, is_node=True)
    assert choice.is_pending
    assert choice.wants_nodes_only
    choice.settle()
    assert choice.reason == "calibrated on 125 scans of this recording"


@pytest.mark.parametrize("needs", [{"scheme": "local"}, {"ghosts_in_matching": False}])
def test_who_needs_glass_on_the_way_cannot_wait_so_long(needs):
    choice = DetectorChoice(GlassConfig(**needs))
    for one in walls(FINE, count=60):
        choice.add(one, is_node=True)
    assert choice.name == "calibrated_peak"


def test_a_lidar_that_stands_is_judged_by_other_scans_too():
    choice = DetectorChoice(GlassConfig())
    for k, one in enumerate(walls(FINE, count=40)):
        choice.add(one, is_node=k == 0)
    choice.settle()
    assert choice.reason == "calibrated on 4 scans of this recording"


def test_off_looks_at_nothing():
    choice = settled(walls(FINE, count=3), detector="off")
    assert (choice.name, choice.reason, choice.detect) == ("off", "not asked for", None)


def test_a_detector_asked_for_works_from_the_first_scan():
    choice = DetectorChoice(GlassConfig(detector="narrow_return"))
    assert not choice.is_pending
    assert choice.detect is not None
