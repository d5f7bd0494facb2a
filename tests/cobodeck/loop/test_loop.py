"""The one loop: instants, late and missed ticks, what blocks it, how it ends."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import pytest

from cobodeck.loop.clocks import RealTime
from cobodeck.loop.loop import LATE_NS, Loop
from cobodeck.loop.plant import Nothing
from cobodeck.loop.sample_router import Inlet
from cobodeck.loop.wiring import Wired
from cobodeck.record.format.value_codec import value
from cobodeck.record.read.reader import Record
from cobodeck.run.build_run import stage
from cobodeck.run.simulation import simulate
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.chart.load import load_text
from engine.clock import TickGrid
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, Monitor, On, Run as Steps
from hw.samples import Sample

ROOT = Path(__file__).resolve().parents[3]
MS = 10**6
GRID = TickGrid(100)


class Stepped:
    """A clock that a test moves on: `spend` lets time pass inside a tick."""

    waits: ClassVar[bool] = True

    def __init__(self) -> None:
        self.now = 0
        self.woken: list[int] = []

    def wait(self, until_ns: int) -> int:
        woken = [at for at in self.woken if at < until_ns]
        self.woken = [at for at in self.woken if at >= until_ns]
        self.now = max(self.now, min([until_ns, *woken]))
        return self.now

    def wake(self) -> None:
        """Woken by `woken`."""


CHART = """
chart: c
outcomes: [done, failed]
any:
  seen: {watch: Seen, next: {seen: .done}}
  work: {do: Work, next: {done: .done, error: .failed}}
"""


class Seen(Monitor):
    """`seen` once the number is above 9."""

    outcomes = ("seen",)
    reads = {"number": None}

    def run(self, ctx: Context) -> Steps:
        while (ctx.value("number") or 0.0) <= 9.0:
            yield On("number")
        return "seen"


class Rig:
    """A loop on a clock of the test's; `each` is called in every step of the action."""

    def __init__(self, each: Callable[[Any], None] | None = None, **given: Any) -> None:
        rig = self

        class Work(Action):
            """Does what the test says in each grid tick."""

            outcomes = ("done",)

            def run(self, ctx: Context) -> Steps:
                while True:
                    rig.steps.append(ctx.now)
                    if each is not None:
                        each(rig)
                    yield None

        self.steps: list[int] = []
        self.clock = Stepped()
        library = load_text(CHART)
        known = {cls.__name__: interface(cls) for cls in (Seen, Work)}
        self.board = Board(declare([Measured("number", float)]))
        self.run = ChartRun(Machine(library["c"], library, known), self.board)
        wired = Wired(self.run, self.board, Inlet(self.board, given.pop("sources", {})))
        self.loop = Loop(Nothing(), wired, GRID, clock=self.clock, **given)

    @property
    def overruns(self) -> int:
        assert self.loop.stopwatch is not None
        return self.loop.stopwatch.overruns


def test_ticks_are_at_the_instants_of_the_grid() -> None:
    rig = Rig()
    rig.loop.go(50 * MS)

    assert rig.steps == [GRID.instant(n) for n in range(6)]
    assert (rig.loop.ticks, rig.loop.missed, rig.overruns) == (6, 0, 0)


def test_a_tick_a_little_late_keeps_its_instant() -> None:
    rig = Rig(lambda r: setattr(r.clock, "now", r.clock.now + 10 * MS + LATE_NS // 2))
    rig.loop.go(50 * MS)

    assert rig.steps[1] == 10 * MS


def test_a_late_tick_takes_the_clocks_reading_and_missed_ones_are_not_made_up_for() -> None:
    def stall(rig: Any) -> None:
        if len(rig.steps) == 3:
            rig.clock.now += 55 * MS  # in the tick at 20 ms

    rig = Rig(stall)
    rig.loop.go(100 * MS)

    assert rig.steps == [0, 10 * MS, 20 * MS, 75 * MS, 80 * MS, 90 * MS, 100 * MS]
    assert rig.loop.missed == 4  # those at 30, 40, 50 and 60 ms; that at 70 was run late
    assert rig.loop.ticks == 11


def test_plants_move_on_by_the_grid_even_if_a_tick_is_late() -> None:
    moved: list[int] = []

    class Plant(Nothing):
        def advance(self, to_ns: int) -> None:
            moved.append(to_ns)

    rig = Rig(lambda r: setattr(r.clock, "now", r.clock.now + 15 * MS))
    rig.loop.plant = Plant()
    rig.loop.go(60 * MS)

    assert all(to == GRID.instant(GRID.last(to)) for to in moved)
    assert moved == sorted(set(moved))


def test_what_is_raised_is_told_as_it_happens() -> None:
    told: list[str] = []

    def fail(rig: Any) -> None:
        if len(rig.steps) == 2:
            raise OSError("no link")

    rig = Rig(fail, tell=lambda error: told.append(str(error)))
    rig.loop.go(100 * MS)

    assert rig.run.outcome == "failed"
    assert rig.run.ended_by == ("work", "error")
    assert len(told) == 1
    assert re.fullmatch(rf"{re.escape(__file__)}:\d+: OSError: no link", told[0])


def test_an_end_from_outside_ends_the_run_with_every_clean_up() -> None:
    rig = Rig(lambda r: r.loop.stop("Ada") if len(r.steps) == 3 else None)
    rig.loop.go(10**9)

    assert rig.run.outcome == "stopped"
    assert [command.by for _, command in rig.run.carried_out] == ["Ada"]
    assert rig.run.entered == {}
    assert len(rig.steps) == 3


# -- the command line, in a process of its own -------------------------------------------------

COBODECK = (sys.executable, "-m", "cobodeck")

STATES = """
import sys, time
from engine.state import Action

class Endless(Action):
    '''Never lets go.'''
    outcomes = ("done",)
    def run(self, ctx):
        print("running", flush=True)
        while True:
            pass
        yield

class Busy(Action):
    '''Goes on, and says when it is cleaned up.'''
    outcomes = ("done",)
    def run(self, ctx):
        print("running", flush=True)
        try:
            while True:
                yield
        finally:
            print("cleaned up", flush=True)

class Exits(Action):
    '''Tries to end the program.'''
    outcomes = ("done",)
    def run(self, ctx):
        yield
        sys.exit(0)

class Blocks(Action):
    '''Takes its time, once.'''
    outcomes = ("done",)
    def run(self, ctx):
        yield
        end = time.monotonic() + 0.5
        while time.monotonic() < end:
            pass
        yield
        return "done"
"""


@pytest.fixture
def project(tmp_path: Path) -> Path:
    (tmp_path / "pyproject.toml").write_text(
        '[project]\nname = "own"\n[project.entry-points."cobodeck.states"]\nown = "own_states"\n'
    )
    (tmp_path / "own_states.py").write_text(textwrap.dedent(STATES))
    for state in ("Endless", "Busy", "Exits", "Blocks"):
        (tmp_path / f"{state.lower()}.yaml").write_text(
            f"chart: {state.lower()}\noutcomes: [done, failed]\n"
            f"states:\n  a: {{do: {state}, next: {{done: .done, error: .failed}}}}\n"
        )
    return tmp_path


def begun(project: Path, *arguments: str) -> subprocess.Popen[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [*COBODECK, *arguments],
        cwd=project, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_a_run_in_order_with_figures_and_trace(project: Path, number: int) -> None:
    running = begun(project, "run", "busy.yaml", "--robot", "mock")
    assert running.stdout is not None
    assert running.stdout.readline() == "running\n"
    running.send_signal(number)
    out, err = running.communicate(timeout=60)

    assert running.returncode == 0, err
    assert out.startswith("cleaned up\n")
    assert re.search(r"outcome +stopped", out)
    assert list((project / "out").glob("*-busy-*.trace.jsonl"))


def test_a_second_control_c_breaks_off_a_state_that_never_ends_and_tells_where(
    project: Path,
) -> None:
    running = begun(project, "run", "endless.yaml", "--robot", "mock")
    assert running.stdout is not None
    assert running.stderr is not None
    assert running.stdout.readline() == "running\n"
    blocked = running.stderr.readline()
    assert re.search(r"blocked by a \(Endless\) at .*own_states\.py:\d+", blocked)
    running.send_signal(signal.SIGINT)
    running.send_signal(signal.SIGINT)
    while running.poll() is None:  # two signals may be seen as one
        try:
            running.wait(timeout=0.3)
        except subprocess.TimeoutExpired:
            running.send_signal(signal.SIGINT)
    out, err = running.communicate(timeout=60)

    assert running.returncode == 1
    assert re.search(r"own_states\.py:\d+: KeyboardInterrupt", err)
    assert re.search(r"outcome +failed: a ended with error", out)


def test_a_state_that_exits_fails_and_is_told(project: Path) -> None:
    running = begun(project, "simulate", "exits.yaml")
    out, err = running.communicate(timeout=120)

    assert running.returncode == 1
    assert re.search(r"own_states\.py:\d+: SystemExit: 0", err)
    assert re.search(r"errors +1, in a at 0\.03 s", out)


def test_a_state_that_blocks_in_real_time_is_named_and_its_missed_ticks_are_counted(
    project: Path,
) -> None:
    running = begun(project, "run", "blocks.yaml", "--robot", "mock")
    out, err = running.communicate(timeout=120)

    assert running.returncode == 0
    assert re.search(r"blocked by a \(Blocks\) at .*own_states\.py:\d+", err)
    found = re.search(r"(\d+) missed, (\d+) overruns", out)
    assert found is not None
    assert int(found[1]) >= 13
    assert int(found[2]) >= 1  # on a busy machine others take long, too


# -- on a simulated robot ------------------------------------------------------------------------


class Speeds:
    """Of the base, at each instant of the grid."""

    def __init__(self, world: Any) -> None:
        self.world, self.speeds = world, []

    def watch(self, now_ns: int) -> None:
        self.speeds.append(self.world.base.twist.speed)


def test_the_robot_hears_what_a_tick_decided_the_plants_latency_later() -> None:
    """A latency that is not simulated, or a profile's that does not reach the plant, shows here."""
    moved = {}
    for latency_ms in (0, 20):
        setup = open_setup("chase", "study")
        plant = replace(setup.profile.plant, latency=latency_ms / 1e3)
        loop = stage(replace(setup, profile=replace(setup.profile, plant=plant)), Options())
        seen = Speeds(loop.plant)
        loop.observers = (seen,)
        while not any(seen.speeds):
            loop.tick()
        # from the tick that decided to the next one, 33.3 ms, the base had that much less time
        moved[latency_ms] = seen.speeds[-1]

    assert moved[0] == pytest.approx(1.0 / 30.0, rel=0.01)  # 1 m/s2 for one period
    assert moved[20] == pytest.approx(1.0 / 30.0 - 0.02, rel=0.02)


def noted(stopped: list[str], name: str, stop: Callable[[], None]) -> None:
    stopped.append(name)
    stop()


def test_a_tick_that_breaks_leaves_no_part_moving() -> None:
    """Without the hold of a broken tick the base would drive on until its command is too old."""
    loop = stage(open_setup("chase", "study"), Options())
    while loop.plant.base.twist.speed < 0.5:
        loop.tick()
    stopped: list[str] = []
    for name, part in loop.wired.run.parts.items():
        part.stop = partial(noted, stopped, name, part.stop)

    loop.wired.run.queue = None  # type: ignore[assignment]  # a bug of the engine
    loop.leave_out = False
    with pytest.raises(AttributeError):
        loop.tick()

    assert {"base", "arm"} <= set(stopped)
    assert loop.wired.base is not None
    assert loop.wired.base.selected.source is None


def test_leaving_ticks_out_of_a_walk_changes_neither_trace_nor_figures() -> None:
    found = []
    for eager in (False, True):
        setup = open_setup("cobodeck", "study")
        result = simulate(setup, Options(requests=1, eager=eager, duration_s=70.0))
        found.append(result.figures)
    counts = {"wall_s", "realtime_factor", "cpu_us_per_tick", "signals", "overruns", "left_out"}
    both = [{k: v for k, v in figures.items() if k not in counts} for figures in found]

    assert both[0] == both[1]
    assert found[0]["left_out"] > 0.5 * found[0]["ticks"]
    assert found[1]["left_out"] == 0


def test_logic_alone_leaves_nearly_all_ticks_out() -> None:
    result = simulate(open_setup("cobodeck"), Options(tier=0, duration_s=2000.0))

    assert result.figures["left_out"] >= 0.97 * result.figures["ticks"]
    assert result.figures["transitions"] > 500


# -- real time -----------------------------------------------------------------------------------


def test_a_sample_that_is_waited_for_adds_a_tick_and_steps_only_who_waits() -> None:
    class Source:
        signals = ("number",)

        def samples(self, now_ns: int) -> list[Sample]:
            if not arrived or arrived[0] > now_ns:
                return []
            return [Sample("number", arrived.pop(0), 10.0)]

    arrived = [23 * MS]
    rig = Rig(sources={"source": Source()})
    rig.clock.woken = [23 * MS]
    rig.loop.go(50 * MS)

    assert rig.run.outcome == "done"
    assert rig.loop.now_ns == 23 * MS
    assert rig.steps == [0, 10 * MS, 20 * MS]
    assert rig.loop.added == 1


def test_a_wake_up_that_nobody_waits_for_adds_no_tick() -> None:
    rig = Rig()
    rig.clock.woken = [23 * MS, 27 * MS]
    rig.loop.go(50 * MS)

    assert rig.loop.added == 0
    assert rig.steps == [GRID.instant(n) for n in range(6)]


def test_real_time_sleeps_until_its_instant() -> None:
    clock = RealTime()

    assert clock.now() == 0
    assert clock.wait(20 * MS) >= 20 * MS
    assert clock.wait(10 * MS) >= 20 * MS  # over already


def test_real_time_can_be_woken_from_another_thread_and_from_a_signal() -> None:
    clock, hour = RealTime(), 3600 * 10**9
    threading.Timer(0.01, clock.wake).start()

    assert clock.wait(hour) < hour
    before = signal.signal(signal.SIGUSR1, lambda *_: clock.wake())
    threading.Timer(0.01, os.kill, (os.getpid(), signal.SIGUSR1)).start()
    assert clock.wait(hour) < hour
    signal.signal(signal.SIGUSR1, before)


def test_an_added_tick_that_takes_longer_than_a_period_is_an_overrun() -> None:
    class Source:
        signals = ("number",)

        def samples(self, now_ns: int) -> list[Sample]:
            return [Sample("number", now_ns, Slow(1.0))] if now_ns == 23 * MS else []

    class Slow(float):
        """A number that is compared slowly."""

        def __le__(self, other: object) -> bool:
            end = time.perf_counter_ns() + 2 * GRID.period_ns
            while time.perf_counter_ns() < end:
                pass
            return True

    rig = Rig(sources={"source": Source()})
    rig.clock.woken = [23 * MS]
    rig.loop.go(30 * MS)

    assert (rig.loop.added, rig.overruns) == (1, 1)


def test_the_operator_at_a_terminal_stops_resets_and_ends(project: Path) -> None:
    ours, theirs = pty.openpty()
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    running = subprocess.Popen(
        [*COBODECK, "run", "busy.yaml", "--robot", "mock", "--record", "x.mcap"],
        cwd=project, env=environment, text=True, stdin=theirs, stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )  # fmt: skip
    assert running.stdout is not None
    assert running.stdout.readline() == "running\n"
    os.write(ours, b"dance\nstop\nreset\nend\n")
    out, err = running.communicate(timeout=60)
    os.close(ours)

    assert running.returncode == 0
    assert "operator: ack (a fault), stop" in err
    assert "'dance' is not a command" in err
    assert "cobodeck: reset" in err
    assert re.search(r"outcome +stopped", out)
    told = [m for group in Record(project / "x.mcap").groups() for m in group.messages("operator")]
    commands = [(m["command"], value(m["arguments"]).get("text", ""), m["by"]) for m in told]
    assert commands == [
        ("Remark", "stop", "console"), ("Remark", "reset", "console"), ("End", "", "console")
    ]  # fmt: skip
