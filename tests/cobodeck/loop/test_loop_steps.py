"""What the loop does between two readings of its clock, in virtual time alone."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import pytest

from cobodeck.loop.clocks import Virtual
from cobodeck.loop.loop import LATE_NS, Loop
from cobodeck.loop.plant import Nothing
from cobodeck.loop.sample_router import Inlet
from cobodeck.loop.stopwatch import Stopwatch
from cobodeck.loop.ticked import Ticked
from cobodeck.loop.wiring import Wired
from engine.chart.load import load_text
from engine.clock import TickGrid
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, Monitor, On, Run as Steps
from hw.samples import Sample
from tests.cobodeck.loop.test_loop import Stepped

MS = 10**6
GRID = TickGrid(100)
CHART = """
chart: c
outcomes: [done, late]
any:
  seen: {watch: Loud, next: {loud: .done}}
  wait: {do: Wait, timeout: 995 ms, next: {done: .done, timeout: .late}}
"""


class Loud(Monitor):
    """`loud` once the number is above 9."""

    outcomes = ("loud",)
    reads = {"number": None}

    def run(self, ctx: Context) -> Steps:
        while (ctx.value("number") or 0.0) <= 9.0:
            yield On("number")
        return "loud"


class Plant(Nothing):
    """Notes what it is asked to do; `happens` are the instants at which something happens."""

    def __init__(self, happens: tuple[int, ...] = (), **parts: Any) -> None:
        super().__init__(parts)
        self.happens, self.to, self.closed = happens, [-1], 0

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """Each is told once."""
        broken, self.broken = self.broken, []
        return broken

    @failures.setter
    def failures(self, broken: list[tuple[str, Exception]]) -> None:
        self.broken = broken

    def advance(self, to_ns: int) -> None:
        self.to.append(to_ns)

    def quiet_until(self) -> int:
        return next((at for at in self.happens if at > self.to[-1]), 1 << 62)

    def close(self) -> None:
        self.closed += 1


class Taps:
    """Notes what it is told."""

    def __init__(self) -> None:
        self.ticks: list[Ticked] = []
        self.failures: list[str] = []

    def failed(self, part: str, error: BaseException) -> None:
        self.failures.append(f"{part}: {error}")

    def tick(self, ticked: Ticked) -> None:
        self.ticks.append(ticked)


class Source:
    """A part that delivers a number at given instants."""

    signals = ("number",)

    def __init__(self, *numbers: tuple[int, float]) -> None:
        self.numbers = [*numbers]

    def samples(self, now_ns: int) -> list[Sample]:
        due = [number for number in self.numbers if number[0] <= now_ns]
        self.numbers = self.numbers[len(due) :]
        return [Sample("number", at, value) for at, value in due]


class Steady:
    """A loop over `CHART`; `each` is called in each step of the action, which else sleeps."""

    def __init__(
        self,
        clock: Any,
        each: Callable[[Steady], None] | None = None,
        source: Source | None = None,
        plant: Plant | None = None,
    ) -> None:
        steady = self

        class Wait(Action):
            """Is stepped in each tick, or sleeps."""

            outcomes = ("done",)

            def run(self, ctx: Context) -> Steps:
                try:
                    while True:
                        steady.steps.append(ctx.now)
                        if each is None:
                            yield On("number")
                        else:
                            each(steady)
                            yield None
                finally:
                    steady.cleaned += 1

            reads = {"number": None}

        self.steps: list[int] = []
        self.cleaned = 0
        self.stamps: list[int] = []
        self.told: list[str] = []
        self.clock, self.taps, self.plant = clock, Taps(), plant or Plant()
        library = load_text(CHART)
        board = Board(declare([Measured("number", float)]))
        known = {cls.__name__: interface(cls) for cls in (Loud, Wait)}
        self.run = ChartRun(Machine(library["c"], library, known), board)
        inlet = Inlet(board, {"source": source or Source()})
        wired = Wired(self.run, board, inlet, show=self.stamps.append)
        self.loop = Loop(
            self.plant,
            wired,
            GRID,
            clock=clock,
            taps=[self.taps],
            tell=lambda error: self.told.append(f"{error.path}: {error.text}"),
        )

    @property
    def ticked(self) -> list[tuple[Any, ...]]:
        return [tuple(ticked) for ticked in self.taps.ticks]


def passing(times: dict[int, int]) -> Callable[[Steady], None]:
    """Lets so many ns pass in these steps, by number."""

    def each(steady: Steady) -> None:
        steady.clock.now += times.get(len(steady.steps), 0)

    return each


def test_each_tick_is_told_with_its_number_what_was_missed_and_how_late_it_was() -> None:
    steady = Steady(
        Stepped(), passing({1: 10 * MS + LATE_NS, 2: 36 * MS, 3: 10 * MS + LATE_NS + 1})
    )
    steady.loop.go(60 * MS)

    late = 11 * MS + 36 * MS  # 17 ms behind the instant before it
    assert steady.ticked == [
        (0, 0, "grid", 0, 0),
        (10 * MS, 1, "grid", 0, LATE_NS),
        (late, 4, "grid", 2, late - 20 * MS),
        (late + 11 * MS + 1, 5, "grid", 0, late + 11 * MS + 1 - 50 * MS),
        (60 * MS, 6, "grid", 0, 0),
        (60 * MS, 7, "end", 0, 0),
    ]
    assert (steady.loop.ticks, steady.loop.missed) == (7, 2)


def test_the_plant_is_moved_by_the_grid_and_commands_apply_no_later_than_it_is() -> None:
    for paced in (False, True):
        plant = Plant()
        plant.paced = paced
        steady = Steady(Stepped(), passing({1: 37 * MS}), plant=plant)
        steady.loop.go(50 * MS)

        assert plant.to == [-1, 0, 30 * MS, 40 * MS, 50 * MS]
        assert steady.stamps == [0, 37 * MS if paced else 30 * MS, 40 * MS, 50 * MS]


def test_a_timeout_off_the_grid_adds_its_tick_at_its_instant() -> None:
    steady = Steady(Stepped())
    steady.clock.woken = [123 * MS]
    steady.loop.go(2000 * MS)

    assert steady.run.outcome == "late"
    assert steady.loop.now_ns == 995 * MS
    assert (steady.loop.added, steady.loop.ticks) == (1, 100)
    kinds = [ticked.kind for ticked in steady.taps.ticks]
    assert (kinds.count("grid"), kinds.count("taken")) == (100, 1)
    assert steady.ticked[-2:] == [(995 * MS, 100, "added", 0, 0), (995 * MS, 100, "end", 0, 0)]


def test_a_sample_off_the_grid_adds_a_tick_if_it_is_waited_for() -> None:
    steady = Steady(Stepped(), source=Source((13 * MS, 1.0), (27 * MS, 10.0)))
    steady.clock.woken = [13 * MS, 27 * MS, 37 * MS]
    steady.loop.go(2000 * MS)

    assert steady.run.outcome == "done"
    assert steady.ticked == [
        (0, 0, "grid", 0, 0),
        (10 * MS, 1, "grid", 0, 0),
        (13 * MS, 2, "added", 0, 0),
        (20 * MS, 2, "grid", 0, 0),
        (27 * MS, 3, "added", 0, 0),
        (27 * MS, 3, "end", 0, 0),
    ]
    assert steady.stamps == [0, 0 + 10 * MS, 10 * MS, 20 * MS, 20 * MS]


@pytest.mark.parametrize("clock", [Virtual, Stepped])
def test_a_number_on_the_grid_is_taken_in_its_tick(clock: Any) -> None:
    steady = Steady(clock(), source=Source((20 * MS, 10.0)), plant=Plant((20 * MS,)))
    steady.loop.go(2000 * MS)

    assert steady.run.outcome == "done"
    assert steady.loop.now_ns == 20 * MS


def test_ticks_are_left_out_up_to_what_happens_next_in_plant_or_chart() -> None:
    plant = Plant((204 * MS, 206 * MS, 500 * MS))
    steady = Steady(Virtual(), plant=plant)
    steady.loop.go(700 * MS)

    # the tick in which the plant has moved past an event, and the end
    assert plant.to == [-1, 0, 210 * MS, 500 * MS, 700 * MS]
    assert steady.loop.now_ns == 700 * MS
    assert steady.loop.ticks == 71
    assert steady.loop.left_out == 71 - len(
        {t.at_ns for t in steady.taps.ticks if t.kind == "grid"}
    )
    assert steady.run.outcome is None
    steady = Steady(Virtual(), plant=Plant())
    steady.loop.go(2000 * MS)
    assert (steady.run.outcome, steady.loop.now_ns) == ("late", 1000 * MS)


def test_in_virtual_time_no_tick_is_left_out_if_that_is_not_wanted() -> None:
    steady = Steady(Virtual())
    steady.loop.leave_out = False
    steady.loop.go(50 * MS)

    assert (steady.loop.ticks, steady.loop.left_out) == (6, 0)
    assert steady.plant.to == [-1, *(GRID.instant(n) for n in range(6))]


@pytest.mark.parametrize("clock", [Virtual, Stepped])
def test_who_ends_a_run_early_finds_it_cleaned_up_and_the_plant_closed_once(clock: Any) -> None:
    steady = Steady(clock(), lambda _: None)
    assert steady.loop.go(30 * MS) == 30 * MS

    assert (steady.cleaned, steady.plant.closed) == (1, 1)
    assert not steady.loop.busy
    assert steady.run.tick(40 * MS) is None
    assert len(steady.steps) == 4


def test_a_stop_wakes_the_clock_and_takes_effect_once_in_the_next_tick() -> None:
    class Clock(Stepped):
        wakes = 0

        def wake(self) -> None:
            self.wakes += 1

    class Woken:
        wake: Any = None

    part = Woken()
    steady = Steady(Clock(), lambda s: s.loop.stop() if len(s.steps) == 2 else None)
    steady.plant.parts = {"part": part}
    steady.loop.go(2000 * MS)

    assert (steady.run.outcome, steady.loop.now_ns, steady.cleaned) == ("stopped", 20 * MS, 1)
    assert steady.clock.wakes == 1
    part.wake()
    assert steady.clock.wakes == 2


def test_a_control_c_between_two_ticks_stops_the_run_in_the_next_one() -> None:
    class Clock(Stepped):
        waits_left = 3

        def wait(self, until_ns: int) -> int:
            self.waits_left -= 1
            if self.waits_left == 0:
                raise KeyboardInterrupt
            return super().wait(until_ns)

    steady = Steady(Clock(), lambda _: None)
    steady.loop.go(2000 * MS)

    assert (steady.run.outcome, steady.loop.now_ns) == ("stopped", 20 * MS)
    assert (steady.cleaned, steady.plant.closed) == (1, 1)


def test_a_part_that_fails_is_told_once_and_stops_the_robot() -> None:
    class Line:
        def __init__(self) -> None:
            self.pulled: list[str] = []

        def pull(self, reason: str) -> None:
            self.pulled.append(reason)

    line = Line()
    steady = Steady(
        Stepped(),
        lambda s: s.plant.broken.append(("base", OSError("gone"))) if len(s.steps) == 2 else None,
    )
    steady.plant.parts = {"stop_line": line}
    steady.loop.go(50 * MS)

    assert line.pulled == ["part base: OSError"]
    assert steady.taps.failures == ["base: gone"]
    assert steady.told == ["part base: gone"]
    assert [error.time for error in steady.run.errors] == [10 * MS]


def test_the_spans_of_a_tick_add_up_and_none_is_lost() -> None:
    steady = Steady(Virtual(), lambda _: None)
    steady.loop.stopwatch = watch = Stopwatch()
    steady.loop.go(100 * MS)

    assert all(spent > 0 for spent in watch.spent_ns)


def test_in_virtual_time_no_clock_is_read_unless_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    def read() -> int:
        raise AssertionError("a clock was read")

    monkeypatch.setattr(time, "perf_counter_ns", read)
    steady = Steady(Virtual(), lambda _: None)
    steady.loop.go(100 * MS)

    assert steady.loop.stopwatch is None
