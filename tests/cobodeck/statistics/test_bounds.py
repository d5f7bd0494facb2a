"""Bounds of proportions and means."""

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from cobodeck.statistics import bounded_share, mean_bounds, proportion_bounds
from tests.repeats import examples


def test_no_failure_in_51_escapes_bounds_the_share_below_5_7_percent():
    """One-sided 95 % is two-sided 90 %; three in a hundred are the rule of three."""
    low, high = proportion_bounds(0, 51, confidence=0.90)
    assert low == 0.0
    assert high == pytest.approx(1.0 - 0.05 ** (1 / 51), rel=1e-12)
    assert round(100 * high, 1) == 5.7


@settings(max_examples=examples(50))
@given(st.integers(1, 60).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))))
def test_at_each_bound_what_was_seen_is_just_as_unlikely_as_allowed(seen):
    hits, number = seen
    low, high = proportion_bounds(hits, number)

    def at_most(most, share):
        ways = (
            math.comb(number, k) * share**k * (1 - share) ** (number - k) for k in range(most + 1)
        )
        return sum(ways)

    assert 0.0 <= low <= hits / number <= high <= 1.0
    if hits < number:
        assert at_most(hits, high) == pytest.approx(0.025, rel=1e-6)
    if hits > 0:
        assert 1.0 - at_most(hits - 1, low) == pytest.approx(0.025, rel=1e-6)


@pytest.mark.parametrize("wrong", [(0, 0), (3, 2), (-1, 2)])
def test_impossible_counts_are_refused(wrong):
    with pytest.raises(ValueError, match="needs 0 <= hits <= number"):
        proportion_bounds(*wrong)


def test_bounds_of_a_mean_are_those_of_the_normal_distribution_where_it_holds():
    values = np.random.default_rng(1).normal(5.0, 2.0, 400)
    low, high = mean_bounds(values)
    half = 1.96 * values.std(ddof=1) / 20.0
    assert low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert high == pytest.approx(values.mean() + half, abs=0.1 * half)
    assert mean_bounds(values) == (low, high)


def test_a_single_value_is_its_own_bound_and_none_has_no_mean():
    assert mean_bounds([3.0]) == (3.0, 3.0)
    with pytest.raises(ValueError, match="no values"):
        mean_bounds([])


def test_a_share_has_the_bounds_of_its_proportion():
    low, high = proportion_bounds(3, 40)
    assert bounded_share(3, 40) == {"share": 0.075, "low": low, "high": high}
    assert bounded_share(50, 40) == {
        "share": 1.25,
        "low": proportion_bounds(40, 40)[0],
        "high": 1.0,
    }
    assert bounded_share(None, 40) is bounded_share(3, None) is bounded_share(0, 0) is None
