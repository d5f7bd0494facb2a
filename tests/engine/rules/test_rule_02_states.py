"""Rule 2 of engine/README.md: a state is one generator."""

from __future__ import annotations

from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Measured, declare
from engine.state import Action, Context, Monitor, On, Run


def test_rule_2_until_and_on_say_when_to_be_stepped_next(bench):
    steps = []

    class Listen(Monitor):
        """Notes when it is stepped."""

        outcomes = ("seen",)
        reads = {"twice": None}

        def run(self, ctx: Context) -> Run:
            while True:
                steps.append((ctx.now, ctx.value("twice")))
                yield On("twice", until=ctx.after(0.5))

    signals = declare([Measured("one"), Derived("twice", ("one",), lambda v: 2 * v)])
    board = Board(signals)
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Listen, next: {seen: .x}}\n"
    b = bench(text, states=(Listen,), scripted=False, board=board)
    b.tick(3)
    board.put("one", 4, b.now)
    b.tick(8)
    assert steps == [(0, None), (3 * 10**8, 8), (8 * 10**8, 8)]


def test_rule_2_a_run_without_yield_is_an_instant_state(bench):
    class Decide(Action):
        """Decides at once."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            return "done"

    text = """
chart: c
outcomes: [x]
states:
  a: {do: Decide, next: {done: b}}
  b: {do: Decide, next: {done: .x}}
"""
    b = bench(text, states=(Decide,), scripted=False)
    b.tick()
    assert b.run.outcome == "x"


def test_rule_2_each_entry_has_a_fresh_instance(bench):
    made = []

    class Once(Action):
        """Remembers its instances."""

        outcomes = ("done",)

        def run(self, ctx: Context) -> Run:
            made.append(self)
            yield
            return "done"

    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Once, next: {done: a}}\n"
    b = bench(text, states=(Once,), scripted=False)
    b.tick(6)
    assert len(made) == len(set(map(id, made))) == 6
