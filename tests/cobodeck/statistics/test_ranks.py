"""Rank tests against books, statsmodels, enumeration, and the paper's own numbers."""

import itertools
import math
import random
from collections import Counter

import pytest
from hypothesis import assume, given, settings, strategies as st

from cobodeck.statistics import holm, jonckheere_terpstra, kruskal_wallis
from tests.repeats import examples

HOLLANDER_WOLFE = (
    (40, 35, 38, 43, 44, 41),
    (38, 40, 47, 44, 40, 42),
    (48, 40, 45, 43, 46, 44),
)
ALLELES = ((16, 8, 6), (27, 16, 15), (31, 29, 18, 42))
CHASE = tuple(range(1, 15))
"""The fourteen least of 42 sums."""
CORNER = tuple(14 + rank for rank in (1, *range(2, 21, 2), 23, 25, 27))
CENTER = tuple(rank for rank in range(15, 43) if rank not in CORNER)
"""Mixed: 115 of 196 pairs are slower in the center, 81 in the corner."""

groups = st.lists(
    st.lists(st.integers(0, 6).map(float), min_size=1, max_size=6), min_size=2, max_size=4
)


def test_values_of_the_books():
    found = jonckheere_terpstra(HOLLANDER_WOLFE)
    assert (found.j, found.mean) == (79, 54)
    assert found.variance == pytest.approx(150.2868, abs=5e-5)
    assert found.z == pytest.approx(2.0393, abs=5e-5)
    assert found.p == pytest.approx(0.02071, abs=5e-6)
    assert kruskal_wallis(HOLLANDER_WOLFE).h == pytest.approx(4.3615, abs=5e-5)
    found = jonckheere_terpstra(ALLELES)
    assert (found.j, found.mean) == (30.5, 16.5)
    assert found.variance == pytest.approx(27.0667, abs=5e-5)
    assert found.z == pytest.approx(2.69098, abs=5e-6)
    assert found.p == pytest.approx(0.003562, abs=5e-7)


def test_the_exact_probability_without_ties_is_that_of_the_tables():
    """79 or more of 108 pairs in three groups of six, dealt until there are 79."""
    chance, cards = random.Random(1), list(range(18))
    labels = [number for number in range(3) for _ in range(6)]
    while _pairs(cards, labels) != 2 * 79:
        chance.shuffle(cards)
    found = jonckheere_terpstra([cards[:6], cards[6:12], cards[12:]])
    assert found.p_exact == pytest.approx(0.023064, abs=5e-7)


@pytest.mark.requirement(138, 139)
def test_the_paper_s_own_statistics_come_out():
    """Chase wholly below, Corner and Center mixed: H = 27.62, r = 0.85, 0.85, 0.14, p = 0.22."""
    test = kruskal_wallis([CHASE, CORNER, CENTER])
    assert test.df == 2
    assert test.h == pytest.approx(27.6232, abs=5e-5)
    assert test.p < 0.001
    assert test.epsilon_squared == pytest.approx(0.657, abs=5e-4)
    pairs = {
        "corner": jonckheere_terpstra([CHASE, CORNER]),
        "center": jonckheere_terpstra([CHASE, CENTER]),
        "parked": jonckheere_terpstra([CORNER, CENTER]),
    }
    assert [pair.r for pair in pairs.values()] == pytest.approx([0.8510, 0.8510, 0.1476], abs=5e-5)
    assert pairs["corner"].z == pytest.approx(4.5029, abs=5e-5)
    assert pairs["corner"].p_exact == pytest.approx(1.0 / math.comb(28, 14), rel=1e-12)
    adjusted = holm({name: pair.p for name, pair in pairs.items()})
    assert adjusted["corner"] == adjusted["center"] == pytest.approx(1.0e-5, abs=5e-7)
    assert adjusted["parked"] == pytest.approx(0.2174, abs=5e-5)


@settings(max_examples=examples(60))
@given(groups)
def test_statsmodels_finds_the_same(found):
    assume(len({value for group in found for value in group}) > 1)
    oracle = pytest.importorskip("statsmodels.stats.nonparametric")
    theirs, ours = oracle.jonckheere_terpstra(found), jonckheere_terpstra(found)
    assert ours.j == theirs.statistic
    assert ours.p == pytest.approx(theirs.pvalue, rel=1e-9)


@settings(max_examples=examples(40))
@given(groups)
def test_the_exact_probability_is_that_of_all_ways_to_deal_the_values(found):
    values = [value for group in found for value in group]
    assume(len(set(values)) > 1 and len(values) <= 7)
    labels = [number for number, group in enumerate(found) for _ in group]
    seen = Counter(_pairs(values, order) for order in itertools.permutations(labels))
    least = _pairs(values, labels)
    share = sum(n for j, n in seen.items() if j >= least) / seen.total()
    assert jonckheere_terpstra(found).p_exact == pytest.approx(share, rel=1e-12)


def _pairs(values, labels):
    """Twice J by its definition: rising pairs of an earlier and a later group, ties half."""
    dealt = list(zip(labels, values, strict=True))
    return sum((y > x) + (y >= x) for first, x in dealt for later, y in dealt if first < later)


@settings(max_examples=examples(40))
@given(groups)
def test_reversed_groups_have_the_opposite_trend(found):
    assume(len({value for group in found for value in group}) > 1)
    there, back = jonckheere_terpstra(found), jonckheere_terpstra(found[::-1])
    assert there.z == pytest.approx(-back.z, abs=1e-12)
    assert there.r == pytest.approx(back.r)
    assert there.p + back.p == pytest.approx(1.0)


def test_too_many_ways_have_no_exact_probability():
    found = jonckheere_terpstra([list(range(80)), list(range(40, 120))])
    assert found.p_exact is None
    assert found.p < 0.001


@settings(max_examples=examples(60))
@given(st.lists(st.floats(0.0, 1.0) | st.sampled_from((0.01, 0.02, 0.03)), min_size=1, max_size=6))
def test_statsmodels_adjusts_as_holm_does(found):
    oracle = pytest.importorskip("statsmodels.stats.multitest")
    adjusted = holm({str(number): p for number, p in enumerate(found)})
    assert list(adjusted) == [str(number) for number in range(len(found))]
    _, theirs, *_ = oracle.multipletests(found, method="holm")
    assert list(adjusted.values()) == pytest.approx(theirs.tolist(), rel=1e-12)


def test_no_probabilities_need_no_adjustment():
    assert holm({}) == {}


@pytest.mark.parametrize("wrong", [[[1.0]], [[1.0], []], [[1.0], [1.0]], [[1.0], [math.nan]]])
def test_what_has_no_ranks_is_refused(wrong):
    for test in (kruskal_wallis, jonckheere_terpstra):
        with pytest.raises(ValueError, match=r"needs|all values are equal"):
            test(wrong)
