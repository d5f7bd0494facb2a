"""S06 and S07 against trying out all combinations."""

from __future__ import annotations

from itertools import product

import pytest
from hypothesis import given, settings, strategies as st

from engine.check.when import TooLarge, uncovered
from tests.repeats import examples

NAMES = "abcd"
OUTCOMES = ("x", "y", "z")
domains_of_children = st.dictionaries(
    st.sampled_from(NAMES),
    st.lists(st.sampled_from(OUTCOMES), min_size=1, unique=True),
    min_size=1,
)


def rules_over(domains: dict[str, list[str]]) -> st.SearchStrategy[list[dict[str, str]]]:
    item = st.dictionaries(
        st.sampled_from(sorted(domains)), st.sampled_from(OUTCOMES), min_size=1, max_size=3
    )
    return st.lists(item, max_size=12)


def matched(combination: dict[str, str], rules: list[dict[str, str]]) -> bool:
    return any(rule.items() <= combination.items() for rule in rules)


@given(st.data(), domains_of_children)
@settings(deadline=None, max_examples=examples(500))
def test_a_combination_is_found_exactly_if_there_is_one(
    data: st.DataObject, domains: dict[str, list[str]]
) -> None:
    rules = data.draw(rules_over(domains))
    all_of_them = [dict(zip(domains, c, strict=True)) for c in product(*domains.values())]
    missed = [c for c in all_of_them if not matched(c, rules)]
    found = uncovered(domains, rules)
    assert (found in missed) if missed else (found is None)


def test_a_hundred_children_are_no_hundred_dimensions() -> None:
    domains = {f"n{i}": ["done", "failed"] for i in range(100)}
    every = dict.fromkeys(domains, "done")
    one_failed = [{name: "failed"} for name in domains]
    assert uncovered(domains, [every, *one_failed]) is None
    assert uncovered(domains, [every, *one_failed[1:]]) == {**every, "n0": "failed"}


def test_what_would_take_too_long_is_said_so() -> None:
    # pigeons in holes: each rule is "two pigeons in one hole"; no short proof by splitting exists
    holes = [f"h{i}" for i in range(9)]
    pigeons = {f"p{i}": holes for i in range(10)}
    names = list(pigeons)
    rules = [
        {first: hole, second: hole}
        for i, first in enumerate(names)
        for second in names[i + 1 :]
        for hole in holes
    ]
    with pytest.raises(TooLarge):
        uncovered(pigeons, rules)
