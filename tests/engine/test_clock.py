"""Whole nanoseconds: the grid of ticks, and every duration that somebody gives in seconds."""

from __future__ import annotations

from fractions import Fraction
from typing import ClassVar

import pytest
from hypothesis import example, given, strategies as st

from engine.clock import TickGrid
from engine.machine.machine import to_ns
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, Monitor, On, Run
from tests.engine.conftest import Bench

S = 10**9
RATES = st.integers(1, 1000)
UNEVEN = [ms for ms in range(1, 3000) if int(ms / 1e3 * 1e9) != ms * 10**6]
"""Milliseconds that are one nanosecond short if they are cut off instead of rounded."""


@given(st.integers(0, 10**12), RATES)
@example(30 * 86_400 * 365, 30)
@example(9_007_199_255, 7)
def test_rule_1_an_instant_is_exact_for_thousands_of_years(number: int, hz: int):
    exact = Fraction(number * S, hz)
    instant = TickGrid(hz).instant(number)
    assert type(instant) is int
    assert instant <= exact < instant + 1


@given(st.integers(0, 10**18), RATES)
@example(0, 30)
@example(33_333_333, 30)
@example(10**18, 7)
def test_rule_1_the_ticks_next_to_an_instant_are_on_its_two_sides(at: int, hz: int):
    grid = TickGrid(hz)
    last, first = grid.last(at), grid.first(at)
    assert grid.instant(last) <= at < grid.instant(last + 1)
    assert at <= grid.instant(first)
    assert first == 0 or grid.instant(first - 1) < at


class Short(Action):
    """Tells when it will end."""

    outcomes = ("done",)
    reads: ClassVar = {"voice": 0.0}
    found: ClassVar[list[int]] = []

    def run(self, ctx: Context) -> Run:
        self.found += [ctx.after(ms / 1e3) - ctx.now for ms in UNEVEN]
        yield
        return "done"


def test_rule_1_what_a_state_plans_is_rounded():
    bench = Bench(
        "chart: c\noutcomes: [x]\nstates:\n  a: {do: Short, next: {done: .x}}\n",
        states=(Short,),
        scripted=False,
        board=Board(declare([Measured("voice")])),
    )
    Short.found.clear()
    bench.tick()
    assert Short.found == [ms * 10**6 for ms in UNEVEN] != []


def test_rule_1_what_a_chart_or_a_wait_says_is_rounded():
    assert [to_ns(ms / 1e3) for ms in UNEVEN] == [ms * 10**6 for ms in UNEVEN]
    assert [On("voice", older=ms / 1e3).older for ms in UNEVEN] == [ms * 10**6 for ms in UNEVEN]


class Aged(Monitor):
    """Ends once the voice is too old."""

    outcomes = ("old",)
    reads: ClassVar = {"voice": 0.0}

    def run(self, ctx: Context) -> Run:
        while ctx.value("voice") is not None:
            yield
        return "old"


@pytest.mark.parametrize("ms", UNEVEN[:3])
def test_rule_1_the_greatest_age_of_a_value_is_rounded(ms: int):
    class Exact(Aged):
        """Accepts an age that is not to be cut off."""

        reads: ClassVar = {"voice": ms / 1e3}

    board = Board(declare([Measured("voice")]))
    bench = Bench(
        "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Exact, next: {old: .x}}\n",
        states=(Exact,),
        scripted=False,
        board=board,
    )
    board.put("voice", 1.0, 0)
    assert bench.run.tick(0) is None
    assert bench.run.tick(ms * 10**6) is None
    assert bench.run.tick(ms * 10**6 + 1) == "x"
