"""The stop sign stays for its time, in whatever order it is wanted and looked at."""

from __future__ import annotations

import pytest
from hypothesis import given, settings, strategies as st

from hw.sign import StopSign
from tests.repeats import examples

TICK = 33_333_333
SECOND = 10**9


def told(wanted: list[bool], tick: int = TICK, least: float = 2.0) -> list[bool]:
    """What is seen in each tick of a sign that is wanted or not."""
    sign, seen = StopSign(), []
    for n, want in enumerate(wanted):
        sign.want(want, least)
        seen.append(sign.shown(n * tick))
    return seen


def spans(flags: list[bool]) -> list[tuple[int, int]]:
    """First and last index of each stretch of True."""
    edges = [
        n
        for n in range(len(flags) + 1)
        if (n < len(flags) and flags[n]) != (n > 0 and flags[n - 1])
    ]
    return [(a, b - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]


@pytest.mark.requirement(114)
def test_a_sign_wanted_for_an_instant_is_shown_for_two_seconds_and_again_later() -> None:
    flash = [True] + [False] * 99
    seen = told(flash * 2)

    lengths = [(last - first) * TICK / SECOND for first, last in spans(seen)]
    assert lengths == [pytest.approx(2.0, abs=0.04)] * 2
    assert [first for first, _ in spans(seen)] == [0, 100]


@pytest.mark.requirement(114)
@given(
    stretches=st.lists(st.tuples(st.booleans(), st.integers(1, 150)), min_size=1, max_size=8),
    tick=st.integers(5_000_000, 100_000_000),
)
@settings(deadline=None, max_examples=examples(200))
def test_a_wanted_sign_is_shown_at_once_and_none_is_hidden_before_its_two_seconds(
    stretches: list[tuple[bool, int]], tick: int
) -> None:
    wanted = [want for want, count in stretches for _ in range(count)]

    seen = told(wanted, tick)

    assert all(there for want, there in zip(wanted, seen, strict=True) if want)
    for first, last in spans(seen):
        assert wanted[first]  # it never comes by itself
        begun = first * tick
        asked = max(n for n in range(first, last + 1) if wanted[n])
        over = max(begun + 2 * SECOND, asked * tick)
        if last + 1 < len(seen):
            assert over <= (last + 1) * tick < max(over, (asked + 1) * tick) + tick


@pytest.mark.requirement(18)
@given(st.lists(st.booleans(), min_size=1, max_size=50))
def test_a_sign_without_a_least_time_is_shown_while_it_is_wanted(wanted: list[bool]) -> None:
    assert told(wanted, least=0.0) == wanted


@pytest.mark.requirement(114)
@pytest.mark.parametrize("least", [0.0, 0.5])
def test_a_sign_that_is_still_to_be_seen_keeps_the_longer_of_its_times(least: float) -> None:
    sign = StopSign()
    sign.want(True, 2.0)
    assert sign.shown(0)
    sign.want(False)
    assert sign.shown(SECOND // 2)
    sign.want(True, least)
    assert sign.shown(SECOND)
    sign.want(False)

    assert sign.shown(2 * SECOND - 1)
    assert not sign.shown(2 * SECOND)
