"""Cell values mean the published odds."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from glassslam.errors import GridError
from glassslam.grid import OddsModel
from glassslam.grid.kernels import updated
from glassslam.grid.odds import LOG_ODDS_STEP, log_odds


def odds(p):
    return p / (1.0 - p)


def probability(o):
    return o / (1.0 + o)


def after(model, observations):
    """Cell value after hits (True) and misses (False), from never observed."""
    value = np.uint16(0)
    for hit in observations:
        step = model.hit_step if hit else model.miss_step
        value = updated(value, step, model.prior, model.top)
    return int(value)


def published(model, observations):
    """M_new = clamp(odds^-1(odds(M_old) odds(p))), from even odds."""
    p = 0.5
    for hit in observations:
        q = model.hit_probability if hit else model.miss_probability
        p = probability(odds(p) * odds(q))
        p = min(max(p, model.lower_probability), model.upper_probability)
    return p


@given(st.lists(st.booleans(), min_size=1, max_size=300))
def test_updates_are_the_published_formula(observations):
    model = OddsModel()
    p = float(model.table()[after(model, observations)])
    # every update rounds to half a step of the log odds
    slack = (len(observations) + 2) * LOG_ODDS_STEP / 2
    assert log_odds(p) == pytest.approx(log_odds(published(model, observations)), abs=slack)


@pytest.mark.parametrize(("hit", "p"), [(True, 0.55), (False, 0.49)])
def test_the_first_observation_of_a_cell_sets_its_probability(hit, p):
    model = OddsModel(hit_probability=0.55, miss_probability=0.49)
    assert float(model.table()[after(model, [hit])]) == pytest.approx(p, abs=2e-4)


@pytest.mark.parametrize(("hit", "p"), [(True, 0.98), (False, 0.12)])
def test_certainty_ends_at_the_clamp(hit, p):
    model = OddsModel(lower_probability=0.12, upper_probability=0.98)
    assert float(model.table()[after(model, [hit] * 1000)]) == pytest.approx(p, abs=2e-4)


def test_one_observation_beyond_the_clamp_is_clamped():
    model = OddsModel(hit_probability=0.99, miss_probability=0.05)
    assert after(model, [True]) == model.top
    assert after(model, [False]) == 1


def test_a_known_cell_never_becomes_unknown():
    model = OddsModel()
    assert after(model, [False] * 1000) == 1


def test_the_table_rises_from_clamp_to_clamp_and_starts_with_the_unknown():
    model = OddsModel(unknown_probability=0.4)
    table = model.table()
    assert table.dtype == np.float32
    assert table.shape == (model.top + 2,)
    assert table[0] == np.float32(0.4)
    assert (np.diff(table[1 : model.top + 1]) > 0).all()
    assert table[1] == pytest.approx(0.12, abs=1e-4)
    assert table[model.prior] == pytest.approx(0.5, abs=2e-4)
    assert table[model.top] == pytest.approx(0.98, abs=1e-4)


def test_a_locked_cell_reads_as_sure_as_any():
    model = OddsModel()
    assert model.locked == model.top + 1
    assert model.table()[model.locked] == model.table()[model.top]


@given(st.floats(0.01, 0.99))
def test_log_odds(p):
    assert math.exp(log_odds(p)) == pytest.approx(odds(p))


@pytest.mark.parametrize(
    ("wrong", "message", "hint"),
    [
        ({"hit_probability": 0.4}, "hit_probability is 0.4", "it must be from 0.5 to below 1"),
        ({"hit_probability": 1.0}, "hit_probability is 1.0", "it must be from 0.5 to below 1"),
        ({"miss_probability": 0.6}, "miss_probability is 0.6", "it must be above 0, at most 0.5"),
        ({"miss_probability": 0.0}, "miss_probability is 0.0", "it must be above 0, at most 0.5"),
        ({"lower_probability": 0.5}, "lower_probability is 0.5", "it must be between 0 and 0.5"),
        ({"upper_probability": 0.5}, "upper_probability is 0.5", "it must be between 0.5 and 1"),
        ({"unknown_probability": float("nan")}, "unknown_probability is nan", "it must be between 0 and 1"),
        (
            {"lower_probability": 1e-15, "upper_probability": 1 - 1e-15},
            "cells cannot span 1e-15 to 0.999999999999999",
            "keep the clamp away from 0 and 1",
        ),
    ],
)
def test_senseless_odds_are_refused(wrong, message, hint):
    with pytest.raises(GridError) as caught:
        OddsModel(**wrong)
    assert (caught.value.message, caught.value.hint) == (message, hint)
