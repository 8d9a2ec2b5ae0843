"""Rays through voxels: which they cross, what a measurement says of each, and how two are joined."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from volume_worlds import crossed, naive_code, voxel

from glassslam.errors import GridError
from glassslam.volume.evidence import Evidence, joined, observe
from glassslam.volume.octree import CENTRE, decode
from glassslam.volume.ray_kernels import RECENT, first_crossing, merge_first, trace_ray, trace_rays
from glassslam.volume.sensors import LIDAR, ULTRASONIC, InverseModel

MODEL = InverseModel(max_range=100.0)
NOTHING = np.empty((0, 3))
FREE, OCCUPIED = MODEL.free_log_odds, MODEL.occupied_log_odds

# whole numbers and their neighbours: rays along and through the corners of voxels
borders = st.integers(1, 12).flatmap(
    lambda k: st.sampled_from([float(k), math.nextafter(k, 0), math.nextafter(k, 40), k + 0.5])
)
coordinate = st.one_of(st.floats(0.0, 12.0), borders)
point = st.tuples(coordinate, coordinate, coordinate)


def visited(start, end):
    path = np.empty(64, dtype=np.int64)
    count = trace_ray(np.array(start), np.array(end), path)
    return [tuple(key) for key in decode(path[:count]).tolist()]


@settings(max_examples=300)
@given(point, point)
def test_a_ray_goes_from_voxel_to_voxel_over_faces(start, end):
    first, last = (tuple(math.floor(v) for v in p) for p in (start, end))
    path = visited(start, end)
    assert (path[0], path[-1]) == (first, last)
    assert len(path) == 1 + sum(abs(a - b) for a, b in zip(first, last, strict=True))
    for one, two in itertools.pairwise(path):
        assert sorted(abs(a - b) for a, b in zip(one, two, strict=True)) == [0, 0, 1]


@settings(max_examples=300)
@given(point, point)
def test_a_ray_visits_the_voxels_it_crosses_and_no_others(start, end):
    path = set(visited(start, end))
    assert all(crossed(start, end, key, 1e-9) >= 0.0 for key in path)
    low, high = np.floor(np.minimum(start, end)), np.floor(np.maximum(start, end))
    box = [np.arange(a, b + 1) for a, b in zip(low, high, strict=True)]
    inside = {
        tuple(int(v) for v in key)
        for key in np.stack(np.meshgrid(*box), axis=-1).reshape(-1, 3)
        if crossed(start, end, key, -1e-9) > 1e-9
    }
    assert inside <= path


@given(coordinate, coordinate)
def test_the_first_crossing_lies_on_a_face(start, end):
    when, step = first_crossing(start, end)
    if math.floor(start) == math.floor(end):
        assert when == step == math.inf
    else:
        assert -1e-9 <= when <= 1.0 + 1e-9
        place = start + when * (end - start)
        assert place == pytest.approx(round(place), abs=1e-6)
        assert step == pytest.approx(1.0 / abs(end - start))


@given(point, st.lists(point, min_size=1, max_size=5), st.integers(0, 5))
def test_the_entries_of_rays_are_those_of_their_paths(start, ends, echoes):
    echoes = min(echoes, len(ends))
    out, path = np.empty(64 * len(ends), dtype=np.int64), np.empty(64, dtype=np.int64)
    recent = np.full(RECENT, -1, dtype=np.int64)
    count = trace_rays(np.array(start), np.array(ends), echoes, path, recent, out)
    naive = set()
    for k, end in enumerate(ends):
        codes = [naive_code(key) for key in visited(start, end)]
        if k < echoes:
            naive.add(2 * codes.pop())
        naive |= {2 * code + 1 for code in codes}
    assert set(out[:count].tolist()) == naive


@given(st.lists(st.integers(0, 30), max_size=30))
def test_of_each_voxel_the_first_entry_stays(entries):
    sorted_entries = np.array(sorted(entries), dtype=np.int64)
    count = merge_first(sorted_entries)
    naive = {e >> 1: e for e in sorted(entries, reverse=True)}
    assert sorted_entries[:count].tolist() == [naive[k] for k in sorted(naive)]


def said(origin, echoes, silent=NOTHING, model=MODEL):
    """What a measurement says, as steps from the origin -> log odds, in voxels of 1 m."""
    arrays = (np.array(p, dtype=np.float64).reshape(-1, 3) for p in (echoes, silent))
    evidence = observe(np.array(origin, dtype=np.float64), *arrays, model, 1.0)
    assert (np.diff(evidence.codes) > 0).all()
    keys = (decode(evidence.codes) - CENTRE).tolist()
    return {tuple(key): value for key, value in zip(keys, evidence.log_odds, strict=True)}


def test_a_ray_frees_what_it_passes_and_fills_where_it_ends():
    assert said([0.5, 0.5, 0.5], [[3.5, 0.5, 0.5]]) == {
        (0, 0, 0): FREE, (1, 0, 0): FREE, (2, 0, 0): FREE, (3, 0, 0): OCCUPIED,
    }  # fmt: skip


def test_the_inverse_models_are_those_of_the_paper():
    for model in (LIDAR, ULTRASONIC):
        assert model.free_log_odds == pytest.approx(math.log(0.4 / 0.6))
        assert model.occupied_log_odds == pytest.approx(math.log(0.7 / 0.3))
    assert (ULTRASONIC.max_range, ULTRASONIC.half_angle) == (4.0, math.pi / 2)


def test_a_voxel_is_told_once_and_an_echo_wins():
    seen = said([0.5, 0.5, 0.5], [[2.5, 0.5, 0.5], [4.5, 0.5, 0.6], [2.4, 0.4, 0.4]])
    assert seen[2, 0, 0] == OCCUPIED
    assert [seen[k, 0, 0] for k in (0, 1, 3)] == [FREE] * 3


def test_a_silent_ray_is_free_to_its_end():
    assert said([0.5, 0.5, 0.5], NOTHING, [[2.5, 0.5, 0.5]]) == dict.fromkeys(
        [(0, 0, 0), (1, 0, 0), (2, 0, 0)], FREE
    )


def test_an_echo_beyond_the_range_is_free_space_up_to_there():
    seen = said([0.5, 0.5, 0.5], [[0.5, 9.5, 0.5]], model=InverseModel(max_range=3.2))
    assert seen == dict.fromkeys([(0, 0, 0), (0, 1, 0), (0, 2, 0), (0, 3, 0)], FREE)


def test_an_echo_at_the_sensor_is_one_voxel():
    assert said([0.5, 0.5, 0.5], [[0.6, 0.5, 0.5]]) == {(0, 0, 0): OCCUPIED}


def test_no_ray_says_nothing():
    assert said([0.5, 0.5, 0.5], NOTHING) == {}


# numbers that stay what they are when they are moved to the middle of the tree
exact = st.tuples(*[st.integers(0, 95).map(lambda k: k / 8 + 1 / 16)] * 3)


@given(st.lists(exact, max_size=6), st.lists(exact, max_size=6))
def test_evidence_is_that_of_the_single_rays(echoes, silent):
    origin = (4.3125, 5.125, 6.1875)
    naive = {}
    for end in silent:
        naive |= dict.fromkeys(visited(origin, end), FREE)
    for end in echoes:
        naive |= dict.fromkeys(visited(origin, end)[:-1], FREE)
    naive |= {tuple(math.floor(v) for v in end): OCCUPIED for end in echoes}
    assert said(origin, echoes, silent) == naive


@pytest.mark.parametrize("end", [[np.nan, 0, 0], [40000.0, 0, 0]])
def test_a_measurement_outside_of_the_volume_is_refused(end):
    with pytest.raises(GridError, match="a measurement is not finite or outside of the volume"):
        observe(np.zeros(3), NOTHING, np.array([end], dtype=np.float64), InverseModel(max_range=1e5), 1.0)


evidence = st.dictionaries(st.integers(0, 40), st.floats(-3, 3, width=32), max_size=12)


@given(evidence, evidence)
def test_joined_evidence_is_the_union_padded_with_zeros(one, other):
    first, second = (
        Evidence(np.array(sorted(d), dtype=np.int64), np.array([d[k] for k in sorted(d)], dtype=np.float32))
        for d in (one, other)
    )
    codes, a, b = joined(first, second)
    assert codes.tolist() == sorted({*one, *other})
    assert a.tolist() == [one.get(k, 0.0) for k in codes.tolist()]
    assert b.tolist() == [other.get(k, 0.0) for k in codes.tolist()]


def test_evidence_of_nobody_is_empty():
    assert joined(Evidence.nothing(), Evidence.nothing())[0].size == 0


@pytest.mark.parametrize(("free", "occupied"), [(0.6, 0.7), (0.4, 0.3), (0.0, 0.7), (0.4, 1.0)])
def test_a_sensor_must_say_free_below_and_occupied_above_even_odds(free, occupied):
    with pytest.raises(GridError, match="a sensor cannot say"):
        InverseModel(free=free, occupied=occupied)


@pytest.mark.parametrize(("reach", "angle"), [(0.0, 1.0), (math.inf, 1.0), (4.0, 0.0), (4.0, 3.2)])
def test_a_sensor_must_see_some_way_at_some_angle(reach, angle):
    with pytest.raises(GridError, match="a sensor cannot see"):
        InverseModel(max_range=reach, half_angle=angle)


def test_codes_of_rays_are_those_of_the_tree():
    path = np.empty(4, dtype=np.int64)
    assert trace_ray(np.full(3, CENTRE + 0.5), np.full(3, CENTRE + 0.5), path) == 1
    assert path[0] == voxel(0, 0, 0)
