"""The chooser, against a search through all candidates."""

from __future__ import annotations

from hypothesis import given, strategies as st

from behaviors.choice import cheapest

COST = st.integers(0, 6)
CANDIDATES = st.lists(st.tuples(COST, st.none() | COST), max_size=12)


@given(CANDIDATES, st.none() | COST)
def test_it_finds_what_a_search_through_all_finds_and_the_first_of_equal_ones(candidates, below):
    bounds = [bound for bound, _ in candidates]
    totals = [None if more is None else bound + more for bound, more in candidates]
    found = cheapest(bounds, totals.__getitem__, below)
    reached = [t for t in totals if t is not None and (below is None or t < below)]
    if not reached:
        assert found is None
    else:
        assert totals[found] == min(reached)
        same = [i for i, t in enumerate(totals) if t == min(reached)]
        assert bounds[found] == min(bounds[i] for i in same)
        assert found == next(i for i in same if bounds[i] == bounds[found])


def test_only_candidates_that_may_still_be_the_best_are_asked():
    asked = []

    def total(i):
        asked.append(i)
        return None if i == 2 else 10 * i + 5

    assert cheapest([0, 10, -1, 3, 30], total) == 0
    assert asked == [2, 0, 3]


def test_after_so_many_tries_without_success_there_is_none():
    assert cheapest([0, 1, 2], lambda i: 9 if i == 2 else None, tries=2) is None
    assert cheapest([0, 1, 2], lambda i: 9 if i == 2 else None, tries=3) == 2
    assert cheapest([(0, 1), (0, 0)], lambda i: (0, 1 - i)) == 1
