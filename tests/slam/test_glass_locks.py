"""What the published schemes lock, when, and where it lies after the map was corrected."""

import math

import numpy as np
import pytest

from glassslam.config import Config
from glassslam.slam.glass_locks import GlassLocks, locks_submaps, miss_probability

SEEN = np.array([[1.0, 2.0], [3.0, 4.0]])
HERE = np.zeros(3)


def config(scheme, **sensor):
    return Config.from_mapping({"glass": {"scheme": scheme}, "sensor": sensor})


@pytest.mark.parametrize("scheme", ["local", "global", "lite"])
def test_the_published_schemes_lock_what_a_scan_sees(scheme):
    assert locks_submaps(scheme)
    assert GlassLocks(config(scheme)).seen(SEEN).tolist() == SEEN.tolist()


@pytest.mark.parametrize("scheme", ["off", "anchored"])
def test_the_others_leave_submaps_alone(scheme):
    locks = GlassLocks(config(scheme))
    assert not locks_submaps(scheme)
    assert locks.seen(SEEN).shape == (0, 2)
    assert locks.known(HERE).shape == (0, 2)


@pytest.mark.parametrize("scheme", ["local", "lite"])
def test_only_the_global_scheme_remembers(scheme):
    locks = GlassLocks(config(scheme))
    locks.seen(SEEN)
    assert locks.known(HERE).shape == (0, 2)


def test_the_global_scheme_brings_known_glass_into_the_local_frame():
    locks = GlassLocks(config("global"))
    locks.map_from_local = np.array([10.0, 0.0, 0.5 * math.pi])
    locks.seen(SEEN)
    assert locks.known(HERE) == pytest.approx(SEEN)


def test_stored_points_stay_behind_when_the_map_is_corrected():
    """As published: the place in the map is fixed when the glass is seen, whatever loops close later."""
    locks = GlassLocks(config("global"))
    locks.seen(SEEN)
    locks.map_from_local = np.array([0.5, 0.0, 0.0])
    assert locks.known(HERE) == pytest.approx(SEEN - [0.5, 0.0])


def test_a_submap_spans_the_range_of_the_sensor():
    locks = GlassLocks(config("global", max_range=4.0))
    locks.seen(SEEN)
    assert locks.known(HERE) == pytest.approx(SEEN[:1])
    assert locks.known(np.array([3.0, 3.0, 0.0])) == pytest.approx(SEEN)


def test_a_cell_is_remembered_once():
    locks = GlassLocks(config("global"))
    for shift in (0.0, 0.001, 0.002):
        locks.seen(SEEN + shift)
    assert locks.known(HERE) == pytest.approx(SEEN)


def test_lite_hardly_fades():
    assert miss_probability(config("lite")) == 0.499
    assert miss_probability(config("local")) == Config().submap.miss_probability
