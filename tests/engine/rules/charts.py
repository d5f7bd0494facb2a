"""Charts that tests of several rules run, and a state that listens."""

from __future__ import annotations

from engine.machine.node import Substitute
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, On, Run

TWO_GUARDS = """
chart: c
outcomes: [x, y]
any:
  first: {watch: See, next: {seen: .x, lost: .y}}
  second: {watch: See, next: {seen: .y, lost: .x}}
  work: {do: Do, next: {done: .x, failed: .y, other: .y}}
"""


SEQUENCE = """
chart: c
outcomes: [x]
states:
  a: {do: Do, next: {done: b, failed: .x, other: a}}
  b: {do: Do, next: {done: a, failed: .x, other: .x}}
"""


NESTED = """
chart: c
outcomes: [x]
states:
  chase:
    any:
      danger: {watch: See, next: {seen: .away, lost: .away}}
      inner:
        any:
          near: {watch: See, next: {seen: .again, lost: .x}}
          drive: {do: Drive, next: {done: .again, failed: .x, other: .x}}
        next: {again: .again, x: .x}
    next: {away: escape, again: chase}
  escape:
    any:
      clear: {watch: See, next: {seen: .safe, lost: .x}}
      flee: {do: Drive, next: {done: .safe, failed: .x, other: .x}}
    next: {safe: chase}
"""


DATA = """
chart: c
outcomes: [x]
outputs: {x: {goal: number}}
data: {goal: {type: number, initial: 0}}
states:
  give: {do: Give, out: {value: goal}, next: {done: use, failed: use, other: give}}
  use: {do: Use, in: {value: goal}, next: {done: .x, failed: give, other: .x}}
"""


class Listen(Action):
    """Notes what it hears."""

    outcomes = ("done",)
    reads = {"voice": None}
    heard: list = []

    def run(self, ctx: Context) -> Run:
        while True:
            self.heard.append((ctx.now, ctx.value("voice")))
            yield On("voice")


def listening(bench, **given):
    """A chart of which `listen` waits for samples; the tick after it has begun to."""
    Listen.heard.clear()
    board = Board(declare([Measured("voice"), Measured("other")]))
    text = """
chart: c
outcomes: [x]
any:
  work: {do: Give, autonomy: {failed: high}, next: {done: .x, failed: .x, other: .x}}
  listen: {do: Listen, next: {done: .x}}
"""
    b = bench(text, states=(Listen,), board=board, **given)
    b.run.put_in("listen", Substitute(Listen, {}))
    b.tick()
    return b
