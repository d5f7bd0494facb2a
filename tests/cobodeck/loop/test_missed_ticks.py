"""Ticks that are missed change no value: samples keep the interval in which they came."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from cobodeck.loop.loop import Loop
from cobodeck.loop.plant import Nothing
from cobodeck.loop.sample_router import Inlet
from cobodeck.loop.wiring import Wired
from engine.chart.load import load_text
from engine.clock import TickGrid
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Estimated, Measured, declare
from engine.state import Action, Context, Run as Steps
from hw.samples import Sample

MS = 10**6
CHART = "chart: c\noutcomes: [x]\nstates:\n  look: {do: Look, next: {done: .x}}\n"


class Look(Action):
    """Asks for the order at 70 ms."""

    outcomes = ("done",)
    reads = {"order": None}

    def run(self, ctx: Context) -> Steps:
        while ctx.now < 70 * MS:
            yield None
        ctx.value("order")
        return "done"


class Order:
    """What has come, in the order in which it was taken."""

    def __init__(self) -> None:
        self.taken: tuple[str, ...] = ()

    def update(self, signal: str, sample: Any) -> None:
        self.taken += (sample.value,)

    def value(self) -> tuple[str, ...]:
        return self.taken


class Post:
    """Delivers `first` at 3 ms, and at 60 ms `second`, which was measured earlier."""

    signals = ("letter",)

    def __init__(self) -> None:
        self.letters = [(3 * MS, "first", 3 * MS), (60 * MS, "second", 2 * MS)]

    def samples(self, now_ns: int) -> list[Sample]:
        found = [letter for letter in self.letters if letter[0] <= now_ns]
        self.letters = self.letters[len(found) :]
        return [Sample("letter", stamp, value) for _, value, stamp in found]


class Stalling:
    """Is woken at 3 ms, and then comes late: at 60 ms, if it stalls."""

    waits: ClassVar[bool] = True

    def __init__(self, stalls: bool) -> None:
        self.now, self.stalls = 0, stalls

    def wait(self, until_ns: int) -> int:
        if self.now == 0 and until_ns > 0:
            self.now = 3 * MS
        elif self.now == 3 * MS and self.stalls:
            self.now = 60 * MS
        else:
            self.now = until_ns
        return self.now

    def wake(self) -> None:
        """It wakes by itself."""


@pytest.mark.parametrize("stalls", [False, True])
def test_samples_are_taken_in_the_order_of_the_intervals_in_which_they_came(stalls: bool) -> None:
    library = load_text(CHART)
    board = Board(declare([Measured("letter"), Estimated("order", ("letter",), Order)]))
    run = ChartRun(Machine(library["c"], library, {"Look": interface(Look)}), board)
    wired = Wired(run, board, Inlet(board, {"post": Post()}))
    loop = Loop(Nothing(), wired, TickGrid(100), clock=Stalling(stalls))

    loop.go(100 * MS)

    assert loop.missed == (5 if stalls else 0)
    order = board.slots["order"].newest
    assert order is not None
    assert order.value == ("first", "second")
    assert board.interval == loop.ticks
