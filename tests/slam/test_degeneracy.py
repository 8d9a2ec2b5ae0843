"""Where the scans did not say enough: found in the arrays of a run, told with time and place."""

from dataclasses import replace

import numpy as np
import pytest

from glassslam.slam.closure_degeneracy import find_degeneracies
from glassslam.slam.degeneracy import Trace
from glassslam.slam.degeneracy_words import summarised
from glassslam.slam.search_outcome import SearchOutcome
from glassslam.slam.tracking import Event, How, MatchArrays

COUNT = 200
NO_EDGES = np.empty((0, 2), dtype=np.int64)


def good(count=COUNT, **changes):
    """A drive of 0.1 m per scan along x, ten scans a second, a node every other scan, nothing odd."""
    poses = np.zeros((count, 3))
    poses[:, 0] = 0.1 * np.arange(count)
    how = np.full(count, How.MATCHED, dtype=np.int64)
    how[0] = How.FIRST
    ones = np.ones(count)
    points = np.where(how == How.FIRST, 0, 200)
    matches = MatchArrays(
        0.35 * ones, ones, 0 * ones, 0.9 * ones, points, how, np.zeros(count, dtype=np.int64)
    )
    trace = Trace(
        50.0 + 0.1 * np.arange(count), poses, poses.copy(), matches, np.arange(0, count, 2), [], [],
        NO_EDGES, NO_EDGES,
    )  # fmt: skip
    return replace(trace, **changes)


def where(trace, span, **values):
    """The run with values of its matches changed from scan to scan."""
    arrays = {name: getattr(trace.matches, name).copy() for name in values}
    for name, value in values.items():
        arrays[name][slice(*span)] = value
    return replace(trace, matches=replace(trace.matches, **arrays))


def found(trace):
    return [(one.kind, one.first_scan, one.last_scan) for one in find_degeneracies(trace)]


def test_a_good_run_has_nothing_to_tell():
    assert find_degeneracies(good()) == []
    assert summarised([]) == []


class TestFeatureless:
    def test_a_bare_corridor_is_told_with_time_place_and_direction(self):
        (one,) = find_degeneracies(where(good(), (40, 91), hold=0.01))
        assert (one.kind, one.first_scan, one.last_scan) == ("featureless", 40, 90)
        assert (one.start, one.end) == pytest.approx((54.0, 59.0))
        assert one.start_place == pytest.approx((4.0, 0.0))
        assert one.end_place == pytest.approx((9.0, 0.0))
        assert one.length == pytest.approx(5.0)
        assert one.text == "5.0 m along bare walls at 0 deg: there the odometry alone tells how far"

    def test_without_odometry_velocity_decides(self):
        (one,) = find_degeneracies(where(good(with_odometry=False), (40, 91), hold=0.0))
        assert one.text.endswith("there constant velocity alone tells how far")

    def test_the_direction_is_that_in_the_map(self):
        trace = where(good(), (40, 91), hold=0.01)
        turned = trace.final.copy()
        turned[:, 2] += np.pi / 2
        (one,) = find_degeneracies(replace(trace, final=turned))
        assert "at 90 deg" in one.text

    def test_a_short_glance_at_a_bare_wall_is_not_worth_a_word(self):
        assert found(where(good(), (40, 55), hold=0.01)) == []

    def test_nor_is_a_drive_across_the_free_direction(self):
        assert found(where(good(), (40, 91), hold=0.01, free_heading=np.pi / 2)) == []

    def test_nor_a_robot_that_stands(self):
        trace = where(good(), (40, 91), hold=0.01)
        still = trace.local.copy()
        still[40:] = still[40]
        assert found(replace(trace, local=still, final=still)) == []

    def test_a_door_on_the_way_does_not_cut_it_in_two(self):
        trace = where(where(good(), (40, 91), hold=0.01), (60, 63), hold=1.0)
        assert found(trace) == [("featureless", 40, 90)]
        assert found(where(trace, (60, 70), hold=1.0)) == [("featureless", 70, 90)]


@pytest.mark.parametrize(
    ("values", "kind", "text"),
    [
        (
            {"how": How.UNMATCHED, "points": 0},
            "unmatched",
            "10 scans with too few returns: poses are predictions",
        ),
        ({"overlap": 0.3}, "low overlap", "10 scans saw little of the map, at least 30% of it"),
        (
            {"residual": 0.6},
            "poor fit",
            "10 scans fit the map badly: residual up to 0.60, usual is 0.35",
        ),
        (
            {"how": How.RELOCALISED},
            "lost",
            "tracking was lost and found again 10 times by search in the submap",
        ),
        (
            {"event": Event.ODOMETRY_JUMP | Event.GAP},
            "odometry jump",
            "the odometry jumped 10 times: the step is not used",
        ),
    ],
)
def test_scans_that_say_too_little(values, kind, text):
    (one,) = find_degeneracies(where(good(), (40, 50), **values))
    assert (one.kind, one.first_scan, one.last_scan) == (kind, 40, 49)
    assert one.text == text


@pytest.mark.parametrize("values", [{"overlap": 0.3}, {"residual": 0.6}])
def test_a_few_bad_scans_are_usual(values):
    assert found(where(good(), (40, 44), **values)) == []


def test_one_scan_is_told_as_one():
    (one,) = find_degeneracies(where(good(), (40, 41), how=How.UNMATCHED, points=0))
    assert one.text == "1 scan with too few returns: poses are predictions"
    (one,) = find_degeneracies(where(good(), (40, 41), how=How.RELOCALISED))
    assert "found again once" in one.text


def test_they_come_in_the_order_of_the_recording():
    trace = where(where(good(), (120, 140), residual=0.7), (20, 30), overlap=0.1)
    assert found(trace) == [("low overlap", 20, 29), ("poor fit", 120, 139)]


class TestBreaks:
    def broken(self, step, event, *, splits=True, used=NO_EDGES):
        trace = good()
        stamps = trace.stamps + np.where(np.arange(COUNT) >= 100, step, 0.0)
        trace = where(trace, (100, 101), event=event, how=How.FIRST if splits else How.MATCHED)
        return replace(trace, stamps=stamps, begins=[50] if splits else [], used=np.array(used))

    def test_a_clock_set_back_and_rejoined(self):
        trace = self.broken(-3600.0, Event.CLOCK_BACK, used=[[20, 60], [21, 61]])
        (one,) = find_degeneracies(trace)
        assert (one.kind, one.first_scan, one.last_scan) == ("clock jump", 99, 100)
        assert one.text == (
            "stamps step back by 60.0 min: split, and rejoined by 2 loop closures, 0.10 m and 0 deg on"
        )
        assert one.length == 0.0

    def test_a_silence_that_is_not_rejoined(self):
        (one,) = find_degeneracies(self.broken(40.0, Event.GAP, used=[[3, 4], [60, 70]]))
        assert one.kind == "silence, not rejoined"
        assert one.text == (
            "no scan for 40.1 s: split, and not rejoined: scans 100 to 199 (9.9 m) hang loose,"
            " their place in the map is a guess"
        )

    def test_a_loose_stretch_ends_at_the_next_break(self):
        trace = replace(self.broken(40.0, Event.GAP), begins=[50, 80])
        (one,) = find_degeneracies(trace)
        assert "scans 100 to 159 (5.9 m) hang loose" in one.text

    def test_a_silence_bridged_by_odometry(self):
        (one,) = find_degeneracies(self.broken(9.0 * 3600, Event.NONE, splits=False))
        assert (one.kind, one.text) == ("silence", "no scan for 9.0 h: tracking went on across it")

    def test_a_slow_recording_is_not_silent(self):
        trace = good()
        assert found(replace(trace, stamps=50.0 + 30.0 * np.arange(COUNT))) == []

    def test_stretches_end_at_a_break(self):
        trace = where(self.broken(40.0, Event.GAP, used=[[20, 60]]), (70, 141), hold=0.0)
        trace = where(trace, (100, 101), hold=1.0)
        assert found(trace) == [
            ("featureless", 70, 99),
            ("silence", 99, 100),
            ("featureless", 101, 140),
        ]


class TestClosures:
    def searched(self, *searches, **changes):
        outcomes = [
            SearchOutcome(node, 1, rejected, ambiguous, 0.5) for node, rejected, ambiguous in searches
        ]
        return good(searches=outcomes, **changes)

    def test_a_place_that_is_not_recognised_for_long(self):
        failed = [(node, "low score", False) for node in range(20, 60, 4)] + [(60, "poor fit", False)]
        (one,) = find_degeneracies(self.searched(*failed))
        assert (one.kind, one.first_scan, one.last_scan) == ("closure rejected", 40, 120)
        assert one.text == (
            "the map of an earlier visit was not recognised in 11 searches (10 x low score, 1 x poor fit)"
        )

    def test_a_closure_in_between_is_enough(self):
        failed = [(node, "low score", False) for node in range(20, 60, 4)]
        assert found(self.searched(*failed, (40, "", False))) == []

    def test_searches_far_from_the_map_may_fail(self):
        far = [SearchOutcome(node, 1, "low score", False, 3.0) for node in range(20, 60, 4)]
        assert found(good(searches=far)) == []

    def test_every_contradiction_is_told_merged_by_place(self):
        wrong = [(20, "inconsistent", False), (22, "inconsistent", False), (80, "inconsistent", False)]
        both = find_degeneracies(self.searched(*wrong))
        assert [one.kind for one in both] == ["closure inconsistent"] * 2
        assert [one.text for one in both] == [
            "2 loop closures found here contradicted what was known, and were not used",
            "1 loop closure found here contradicted what was known, and was not used",
        ]

    def test_closures_that_slide_for_long(self):
        sliding = [(node, "", True) for node in range(20, 60, 4)]
        (one,) = find_degeneracies(self.searched(*sliding))
        assert one.kind == "closure ambiguous"
        assert one.text == "10 loop closures could slide along a line: they hold the map across it only"
        assert found(self.searched(*sliding, (40, "", False))) == []

    def test_closures_that_were_taken_out(self):
        (one,) = find_degeneracies(good(taken_out=np.array([[3, 50], [4, 51]])))
        assert (one.kind, one.first_scan, one.last_scan) == ("closure taken out", 100, 102)
        assert one.text == "2 loop closures did not fit the others and were taken out"


def test_the_summary_has_a_line_for_every_kind_that_matters():
    trace = where(where(good(), (20, 71), hold=0.0), (120, 130), residual=0.7)
    trace = where(trace, (150, 151), how=How.RELOCALISED)
    assert summarised(find_degeneracies(trace)) == [
        "1 stretch, 5 m, could slide along a featureless corridor: see report",
        "1 stretch, 1 m, fit the map badly: see report",
        "tracking was lost and found again, once: see report",
    ]
