"""Opinion pools: what each of them promises."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from glassslam.errors import GridError
from glassslam.fusion.pools import bayes_pool, independent_pool, linear_pool, logarithmic_pool

sure = st.floats(0.01, 0.99)
opinions = st.lists(sure, min_size=1, max_size=6)
POOLS = (linear_pool, logarithmic_pool, independent_pool, bayes_pool)
every = pytest.mark.parametrize("pool", POOLS)
multiplying = pytest.mark.parametrize("pool", [independent_pool, bayes_pool])
averaging = pytest.mark.parametrize("pool", [linear_pool, logarithmic_pool])


@every
@given(opinions)
def test_a_pool_is_a_probability(pool, said):
    assert 0.0 <= float(pool(said)) <= 1.0


@every
@given(opinions, st.randoms())
def test_the_order_of_sensors_does_not_matter(pool, said, random):
    shuffled = list(said)
    random.shuffle(shuffled)
    assert float(pool(shuffled)) == pytest.approx(float(pool(said)))


@every
@given(opinions)
def test_occupied_and_free_are_treated_alike(pool, said):
    assert float(pool(1.0 - np.array(said))) == pytest.approx(1.0 - float(pool(said)))


@every
@given(sure, st.integers(1, 4))
def test_conflict_goes_to_even(pool, p, pairs):
    assert float(pool([p, 1.0 - p] * pairs)) == pytest.approx(0.5)


@multiplying
@given(opinions, st.integers(1, 4))
def test_a_sensor_without_opinion_is_ignored(pool, said, silent):
    assert float(pool(said + [0.5] * silent)) == pytest.approx(float(pool(said)))


@averaging
def test_averages_do_not_ignore_it(pool):
    """Equations 16 and 17: the paper's reason against LOP and LIOP."""
    assert float(pool([0.9, 0.5])) < 0.85


@multiplying
@given(st.floats(0.55, 0.95), st.floats(0.55, 0.95))
def test_agreement_strengthens(pool, p, q):
    assert float(pool([p, q])) > max(p, q)
    assert float(pool([1.0 - p, 1.0 - q])) < min(1.0 - p, 1.0 - q)


@averaging
@given(opinions)
def test_averages_stay_between_the_opinions(pool, said):
    assert min(said) - 1e-9 <= float(pool(said)) <= max(said) + 1e-9


@multiplying
def test_two_readings_of_07_give_0845(pool):
    assert float(pool([0.7, 0.7])) == pytest.approx(0.49 / 0.58)
    assert round(float(pool([0.7, 0.7])), 3) == 0.845


@given(opinions)
def test_bayes_with_an_even_prior_is_the_independent_pool(said):
    assert float(bayes_pool(said)) == pytest.approx(float(independent_pool(said)))


@given(opinions, st.floats(0.05, 0.95))
def test_bayes_multiplies_likelihood_ratios(said, prior):
    odds = prior / (1.0 - prior)
    ratio = odds * math.prod((p / (1.0 - p)) / odds for p in said)
    assert float(bayes_pool(said, prior)) == pytest.approx(ratio / (1.0 + ratio))


@given(st.integers(1, 4), st.floats(0.05, 0.95))
def test_sensors_that_repeat_the_prior_leave_it(count, prior):
    assert float(bayes_pool([prior] * count, prior)) == pytest.approx(prior)


def test_weights_tell_whom_to_trust():
    assert float(linear_pool([0.9, 0.1], [3.0, 1.0])) == pytest.approx(0.7)
    odds = 9.0**0.75 * 9.0**-0.25
    assert float(logarithmic_pool([0.9, 0.1], [0.75, 0.25])) == pytest.approx(odds / (1.0 + odds))
    assert float(logarithmic_pool([0.9, 0.1], [3.0, 1.0])) == pytest.approx(odds / (1.0 + odds))
    assert float(linear_pool([0.9, 0.1], [1.0, 0.0])) == pytest.approx(0.9)


@every
@given(arrays(np.float64, (3, 2, 4), elements=st.one_of(sure, st.just(math.nan))))
def test_cells_are_pooled_one_by_one(pool, maps):
    pooled = pool(maps)
    for index in np.ndindex(2, 4):
        column = maps[(slice(None), *index)]
        if np.isnan(column).all():
            assert math.isnan(pooled[index])
        else:
            assert pooled[index] == pytest.approx(float(pool(np.where(np.isnan(column), 0.5, column))))


@every
def test_certainty_against_certainty_is_even(pool):
    assert float(pool([1.0, 0.0])) == pytest.approx(0.5)


@averaging
@pytest.mark.parametrize("weights", [[1.0], [1.0, -1.0], [0.0, 0.0], [1.0, math.nan]])
def test_weights_that_do_not_fit_are_refused(pool, weights):
    with pytest.raises(GridError, match=r"^weights .* for 2 maps$") as caught:
        pool([0.5, 0.6], weights)
    assert caught.value.hint == "give one per map, not negative, not all 0"


@pytest.mark.parametrize("prior", [0.0, 1.0, math.nan])
def test_a_prior_that_is_sure_is_refused(prior):
    with pytest.raises(GridError, match="prior of the Bayes pool") as caught:
        bayes_pool([0.5], prior)
    assert caught.value.hint == "it must be between 0 and 1"
