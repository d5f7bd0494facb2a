"""Real parts through a connection: opened as needed, guarded, stopped together, closed whatever."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from cobodeck.loop.clocks import RealTime
from cobodeck.loop.loop import Loop
from cobodeck.loop.operators import ConsoleOperator
from cobodeck.loop.sample_router import Inlet, WrongSample
from cobodeck.loop.wiring import Wired
from cobodeck.real.connected import Connected, Stops, connect
from cobodeck.real.health import fault_of
from cobodeck.real.open_connection import finds_itself, is_needed, nothing
from cobodeck.setup.setup import Uses
from cobodeck.terminal.console import Problem
from engine.chart.load import load_text
from engine.clock import TickGrid
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import Action, Context, Run as Steps
from hw.connection.connection import Connection, RunInfo, ServedPart
from hw.geometry import STILL, Pose2, Twist2
from hw.ipc.processes import Child
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.motion.reckoner import Reckoner
from hw.safety.cycle_record import LATCHES, RUNS_ON
from hw.safety.guarded import HEARD, GuardedBase
from hw.safety.limits import SafetyLimits
from hw.safety.stop_line import StopLatch
from hw.samples import Sample
from tests.waiting import until

BODY = load_robot("rbkairos_ur10")
LIMITS = SafetyLimits.of(BODY, MotionLimits())
EVERYTHING = Uses(frozenset(("base", "arm", "lamp")), frozenset(("base.pose",)))
AHEAD = Twist2(0.3, 0.0, 0.0)
OPENED: dict[str, Any] = {}


class Driver:
    """Notes what it is told; raises in the methods that the test names."""

    signals: tuple[str, ...] = ()

    def __init__(self, now: Callable[[], int], raises: str = "") -> None:
        self.calls: list[str] = []
        self.raises = set(raises.split())
        self.now = now
        OPENED[type(self).__name__] = self
        self._note("open")

    def _note(self, name: str) -> None:
        self.calls.append(name)
        if name in self.raises:
            raise OSError(f"{name}: cable out")

    def stop(self) -> None:
        self._note("stop")

    def close(self) -> None:
        self._note("close")

    def samples(self, now_ns: int) -> list[Sample]:
        self._note("samples")
        return []


class Base(Driver):
    """Wheels that stand at the origin."""

    signals = ("base.pose", "base.twist")
    mode = "omni"

    def __init__(self, now: Callable[[], int], raises: str = "") -> None:
        self.driven: deque[Twist2] = deque(maxlen=1000)
        self.wake: Callable[[], None] | None = None
        self.pose: Any = Pose2(0.0, 0.0)
        self.twist: Any = STILL
        super().__init__(now, raises)

    def drive(self, command: Twist2) -> None:
        self._note("drive")
        self.driven.append(command)

    def stop(self) -> None:
        self.driven.append(STILL)
        super().stop()

    def use(self, mode: str) -> None:
        """It goes in all directions."""

    def samples(self, now_ns: int) -> list[Sample]:
        super().samples(now_ns)
        return [Sample("base.pose", now_ns, self.pose), Sample("base.twist", now_ns, self.twist)]


class Wheels(Base):
    """Wheels that count their way from somewhere."""

    signals = ("base.odometry", "base.twist")


class Arm(Driver):
    """An arm that says nothing."""

    def follow(self, points: Any) -> int:
        """It stays where it is."""
        return 1

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:
        """It does not move."""


class Lamp(Driver):
    """A lamp."""

    signals = ("lamp.lit",)


class Line(Driver):
    """A stop line with a driver of its own."""

    signals = ("stop.engaged",)

    def __init__(self, now: Callable[[], int], raises: str = "") -> None:
        super().__init__(now, raises)
        self.latch = StopLatch(lambda: True)

    def pull(self, reason: str) -> None:
        self._note("pull")
        self.latch.pull(reason)

    def reset(self) -> bool:
        return self.latch.reset()

    def samples(self, now_ns: int) -> list[Sample]:
        return self.latch.samples(now_ns)


def connection(**drivers: tuple[type[Driver], str]) -> Connection:
    parts = {
        name: ServedPart(__name__, driver.__name__, {"raises": raises}, f"c.yaml:{n}:3")
        for n, (name, (driver, raises)) in enumerate(drivers.items(), 4)
    }
    return Connection("c", "", "rbkairos_ur10", parts)


@pytest.fixture(autouse=True)
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Any]]:
    import sys

    monkeypatch.setitem(sys.modules, __name__, sys.modules.get(__name__) or _this_module())
    OPENED.clear()
    yield OPENED
    for thread in threading.enumerate():
        assert thread.name != "chain", "a chain goes on after its test"


def _this_module() -> Any:
    from types import SimpleNamespace

    return SimpleNamespace(**globals())


def connected(
    uses: Uses = EVERYTHING,
    tell: Callable[[str], None] = nothing,
    **drivers: tuple[type[Driver], str],
) -> Connected:
    begin = time.monotonic_ns()
    now = lambda: time.monotonic_ns() - begin  # noqa: E731
    tracking = Tracking.of(BODY.sensing)
    opening = RunInfo(now, BODY, MotionLimits(), LIMITS, tracking, tell=tell)
    return connect(connection(**drivers), opening, uses)


def hear(plant: Connected) -> None:
    """Let the guard hear where the base is, as a loop's inlet would."""
    guard = plant.guard
    assert guard is not None
    now = guard.base.now()
    for sample in guard.samples(now):
        guard.hear(sample, now)


def driving(plant: Connected) -> None:
    guard = plant.guard
    assert guard is not None
    guard.drive(AHEAD)
    hear(plant)
    guard.tick(guard.base.now())
    until(lambda: AHEAD in guard.base.driven)


# -- what is opened ------------------------------------------------------------------------------


def test_only_what_the_chart_uses_is_opened() -> None:
    plant = connected(
        Uses(frozenset(("base",)), frozenset()),
        base=(Base, ""),
        lamp=(Lamp, "open"),
        stop_line=(Line, ""),
    )
    plant.close()

    assert set(OPENED) == {"Base", "Line"}


def test_a_guard_goes_by_nothing_for_which_no_part_would_be_opened() -> None:
    plant = connected(base=(Base, ""), arm=(Arm, ""))
    plant.close()
    watched = GuardedBase(OPENED["Base"], LIMITS, BODY.parked)
    heard = set(watched.hears)
    watched.chain.locate_by(Reckoner(Tracking()))

    assert heard | set(watched.hears) == HEARD


def test_who_gives_what_the_guard_hears_is_opened_with_the_base() -> None:
    class Trackers(Driver):
        signals = ("user.pose",)

    alone = Uses(frozenset(("lamp",)), frozenset())

    assert is_needed("trackers", Trackers, Uses(frozenset(("base",)), frozenset()))
    assert not is_needed("trackers", Trackers, alone)


def test_wheels_that_do_not_know_where_they_are_are_located() -> None:
    knowing, counting = connected(base=(Base, "")), connected(base=(Wheels, ""))
    knowing.close()
    counting.close()

    assert not knowing.guard.chain.reckons
    assert counting.guard.chain.reckons
    assert not finds_itself(connection(base=(Base, "")))
    assert finds_itself(connection(base=(Wheels, "")))


def test_wheels_without_a_room_to_be_located_in_are_driven_all_the_same() -> None:
    plant = connected(base=(Wheels, ""))
    try:
        assert plant.guard is not None
        run = run_of(plant)
        plant.guard.drive(AHEAD)
        Wired(run, run.board, Inlet(run.board), plant.guard).pass_on(0)
        assert plant.guard.selected.twist == AHEAD
    finally:
        plant.close()


def test_what_a_chart_can_do_without_is_opened_too_where_it_is_there() -> None:
    class Scanner(Driver):
        signals = ("base.scan",)

    welcome = Uses(frozenset(), frozenset(), frozenset(("base.scan",)))

    assert is_needed("lidar", Scanner, welcome)
    assert not is_needed("lidar", Scanner, Uses(frozenset(), frozenset()))


def test_a_part_that_cannot_be_opened_is_told_with_its_place_and_the_others_are_closed() -> None:
    with pytest.raises(Problem) as failure:
        connected(base=(Base, ""), lamp=(Lamp, "open"))

    assert str(failure.value).startswith("c.yaml:5:3: part 'lamp' by ")
    assert str(failure.value).endswith("OSError: open: cable out")
    assert OPENED["Base"].calls[-1] == "close"


def test_a_person_who_is_not_tracked_is_not_watched() -> None:
    plant = connected(base=(Base, ""))
    plant.close()

    assert not plant.person_watched


# -- the chain -----------------------------------------------------------------------------------


def test_the_wheels_are_driven_from_cycle_to_cycle_and_stand_when_it_is_closed() -> None:
    plant = connected(base=(Base, ""))
    driving(plant)
    plant.close()

    base = OPENED["Base"]
    assert base.driven[-1] == STILL
    assert base.calls[-1] == "close"


def test_without_ticks_the_wheels_are_told_to_stand() -> None:
    plant = connected(base=(Base, ""))
    driving(plant)
    base = OPENED["Base"]
    until(lambda: base.driven[-1] == STILL)
    plant.close()

    assert plant.guard is not None
    assert any("command is old" in r.reasons for r in plant.guard.chain.cycles.reader().read_new())


@pytest.mark.parametrize("raises", ["drive", "drive stop"])
def test_a_driver_that_raises_in_a_cycle_stops_the_robot_and_is_told_once(raises: str) -> None:
    plant = connected(base=(Base, raises), arm=(Arm, ""))
    assert plant.guard is not None
    plant.guard.drive(AHEAD, "escape")  # the arm has not said that it is folded
    hear(plant)
    plant.guard.tick(plant.guard.base.now())
    until(lambda: "stop" in OPENED["Arm"].calls)
    cycles = plant.guard.chain.cycles.written
    until(lambda: plant.guard is not None and plant.guard.chain.cycles.written > cycles + 2)
    plant.close()
    told = plant.failures

    assert [name for name, _ in told][:1] == ["base"]
    assert "cable out" in str(told[0][1])
    assert len(told) <= 3  # in the cycles once for each text, and once more at the end


# -- stopping ------------------------------------------------------------------------------------


@pytest.mark.parametrize("own", [True, False])
def test_a_stop_stops_every_part_at_once_whoever_serves_the_line(own: bool) -> None:
    parts = {"arm": (Arm, ""), "base": (Base, ""), "lamp": (Lamp, "stop")}
    if own:
        parts["stop_line"] = (Line, "")
    plant = connected(**parts)  # type: ignore[arg-type]
    plant.parts["stop_line"].pull("console")
    plant.close()

    assert "stop" in OPENED["Arm"].calls
    assert "stop" in OPENED["Lamp"].calls  # whose raising keeps nobody from anything
    if own:
        assert OPENED["Line"].calls.count("pull") == 1


def test_a_reset_takes_the_latch_of_the_guard_away_with_a_line_of_its_own_too() -> None:
    plant = connected(base=(Base, ""), stop_line=(Line, ""))
    guard, line = plant.guard, plant.parts["stop_line"]
    assert guard is not None
    guard.chain.rule.state["latched"] = LATCHES.index(RUNS_ON)
    until(lambda: "pull" in OPENED["Line"].calls)
    reset = line.reset()
    plant.close()

    assert reset
    assert guard.chain.rule.latched is None
    assert OPENED["Line"].latch.reason is None
    assert OPENED["Line"].calls.count("pull") == 1


def test_a_cause_that_holds_keeps_the_line_pulled() -> None:
    class HeldChain:
        def pull(self, reason: str) -> None:
            """Its wheels are here: the stop line is heard in this process."""

        def reset(self, now_ns: int) -> bool:
            return False

    class Held:
        chain = HeldChain()

    told: list[str] = []
    stops = Stops(StopLatch(lambda: True), {}, lambda: 0, told.append)
    stops.guard = Held()  # type: ignore[assignment]
    stops.pull("bumper")

    assert not stops.reset()
    assert [s.value for s in stops.samples(0)] == ["bumper"]
    stops.pull("drive 2: has no heartbeat")
    assert told == ["stopped until the reset: bumper", "not reset: bumper"]


class Scanner(Driver):
    """A scanner that may be out of order."""

    signals = ("base.scan",)
    fault: Any = None


def with_scanner() -> tuple[Connected, list[str]]:
    uses = Uses(frozenset(("base",)), frozenset(("base.scan",)))
    told: list[str] = []
    return connected(uses, told.append, base=(Base, ""), scanner=(Scanner, "")), told


@pytest.mark.requirement(48, 51)
def test_what_is_out_of_order_stops_the_robot_is_named_and_stands_behind_a_refused_reset() -> None:
    plant, told = with_scanner()
    scanner, line = OPENED["Scanner"], plant.parts["stop_line"]
    plant.advance(0)
    assert line.reason is None
    scanner.fault = "front_laser: in standby"
    plant.advance(1)
    plant.advance(2)
    assert line.reason == "front_laser: in standby"
    assert scanner.calls.count("stop") == 1
    assert [line.reset() for _ in range(3)] == [False] * 3  # as a script asks; it is told once
    console = ConsoleOperator(line, told.append)
    console.say("reset")
    scanner.fault = None
    plant.advance(3)
    assert line.reset()
    assert line.why is None
    scanner.fault = "front_laser: silent"
    line.pull("bumper")
    plant.advance(4)
    scanner.fault = None
    assert line.reset()
    scanner.fault = "rear_laser: silent"
    line.pull(scanner.fault)  # as a part does that stops at once
    plant.advance(5)
    plant.close()

    assert told == [
        "stopped until the reset: front_laser: in standby", "not reset: front_laser: in standby",
        "not reset: front_laser: in standby",
        "stopped until the reset: bumper", "front_laser: silent",
        "stopped until the reset: rear_laser: silent",
    ]  # fmt: skip


@pytest.mark.requirement(48)
@pytest.mark.parametrize(
    ("number", "said"),
    [(signal.SIGKILL, "has ended (killed by signal 9, SIGKILL)"), (signal.SIGSTOP, "is halted")],
)
@pytest.mark.few(1)
def test_a_process_that_dies_or_hangs_stops_the_robot_and_is_named(number: int, said: str) -> None:
    plant, told = with_scanner()
    child = OPENED["Scanner"].child = Child("tests.hw.ipc.child", None, "the scanners' process")
    child.wait()
    plant.advance(0)
    os.kill(child.pid, number)
    os.waitid(os.P_PID, child.pid, os.WEXITED | os.WSTOPPED | os.WNOWAIT)
    plant.advance(1)
    refused = plant.parts["stop_line"].reset()
    plant.close()
    child.kill()

    assert not refused
    assert [line.partition(said)[0] for line in told] == [
        "stopped until the reset: the scanners' process ", "not reset: the scanners' process ",
    ]  # fmt: skip


def test_what_cannot_tell_how_it_is_is_told_of_itself() -> None:
    class Broken:
        @property
        def fault(self) -> str:
            raise OSError("cable out")

    assert fault_of(Broken()) == "Broken: OSError: cable out"
    assert fault_of(object()) is None


# -- closing -------------------------------------------------------------------------------------


def test_a_part_that_cannot_be_closed_does_not_keep_the_others_open() -> None:
    plant = connected(base=(Base, "stop"), lamp=(Lamp, "close"), arm=(Arm, ""))
    plant.close()

    assert OPENED["Base"].calls[-1] == "close"
    assert OPENED["Arm"].calls[-1] == "close"
    assert {name for name, _ in plant.failures} >= {"base", "lamp"}


# -- in the loop ---------------------------------------------------------------------------------

KINDS: dict[str, type] = {"base.pose": Pose2, "base.twist": Twist2}
CHART = """
chart: c
outcomes: [done, failed]
states:
  work: {do: Work, next: {done: .done, error: .failed}}
"""


class Work(Action):
    """Drives on, and notes that it was cleaned up before the lamp was closed."""

    outcomes = ("done",)
    commands = ("base", "lamp")

    def run(self, ctx: Context) -> Steps:
        base, lamp = ctx.part("base"), OPENED["Lamp"]
        try:
            while True:
                base.drive(AHEAD)
                yield None
        finally:
            lamp.calls.append("cleaned up")
            base.release()


def run_of(plant: Connected) -> ChartRun:
    library = load_text(CHART)
    machine = Machine(library["c"], library, {"Work": interface(Work)})
    names = ("base.pose", "base.twist", "base.mode", "base.refusal", "stop.engaged", "lamp.lit")
    board = Board(declare([Measured(name, KINDS.get(name, object)) for name in names]))
    return ChartRun(machine, board, plant.parts)


def looped(plant: Connected, seconds: float) -> Loop:
    run = run_of(plant)
    guard = plant.guard
    assert guard is not None
    inlet = Inlet(run.board, plant.parts, [(name, guard.hear) for name in guard.hears])
    told: list[Any] = []
    loop = Loop(
        plant, Wired(run, run.board, inlet, guard), TickGrid(30), clock=RealTime(), tell=told.append
    )
    loop.go(round(seconds * 1e9))
    return loop


def test_a_run_that_ends_by_its_time_cleans_up_before_devices_are_closed() -> None:
    loop = looped(connected(base=(Base, ""), lamp=(Lamp, "")), 0.2)

    calls = [call for call in OPENED["Lamp"].calls if call in ("cleaned up", "close")]
    assert calls == ["cleaned up", "close"]
    assert loop.wired.run.errors == []
    assert AHEAD in OPENED["Base"].driven
    assert OPENED["Base"].driven[-1] == STILL


def test_a_part_that_raises_while_it_is_sampled_is_told_and_stops_the_robot() -> None:
    loop = looped(connected(base=(Base, ""), lamp=(Lamp, "samples"), arm=(Arm, "")), 0.2)

    (error,) = loop.wired.run.errors
    assert (error.path, error.kind) == ("part lamp", "OSError")
    assert "stop" in OPENED["Arm"].calls
    assert OPENED["Lamp"].calls.count("samples") == 1


def test_garbage_from_a_driver_is_not_let_in_and_ends_what_moves() -> None:
    plant = connected(base=(Base, ""), lamp=(Lamp, ""))
    OPENED["Base"].pose = OPENED["Base"].twist = (0.0, 0.0, 0.0)  # a tuple is neither
    loop = looped(plant, 0.2)

    (error,) = loop.wired.run.errors
    assert (error.path, error.kind) == ("part base", "WrongSample")
    assert error.text == "sample 'base.pose': its value is a tuple; wanted: Pose2"
    assert error.file == __file__
    assert loop.wired.inlet.refused == {"base.pose": 1}
    assert AHEAD not in OPENED["Base"].driven
    assert plant.parts["stop_line"].reason == "part base: WrongSample"


def test_a_sample_that_its_part_announces_is_heard_and_recorded_though_no_chart_knows_it() -> None:
    class Bulb:
        signals = ("lamp.bulb",)

        def samples(self, now_ns: int) -> list[Sample]:
            return []

    inlet, heard = Inlet(Board(declare([])), {"lamp": Bulb()}), list[Sample]()
    inlet.listen("lamp.bulb", lambda sample, _: heard.append(sample))
    inlet.deliver(Sample("lamp.bulb", 0, "warm"), 0)

    assert [sample.value for sample in heard] == ["warm"]
    with pytest.raises(WrongSample, match=r"lamp\.blub.*no signal of this name is declared"):
        inlet.deliver(Sample("lamp.blub", 0, "warm"), 0)


def test_a_stamp_that_is_ahead_is_not_let_in() -> None:
    board = Board(declare([Measured("base.pose", Pose2)]))
    inlet = Inlet(board)
    inlet.deliver(Sample("base.pose", 3_000_000_000, Pose2(1.0, 0.0)), 0)
    for stamp in (float("nan"), None, "now"):
        with pytest.raises(WrongSample, match=r"'base\.pose': its stamp is .*; wanted: whole ns"):
            inlet.deliver(Sample("base.pose", stamp, Pose2(1.0, 0.0)), 0)  # type: ignore[arg-type]

    assert not board.inbox
    assert inlet.refused == {"base.pose": 4}
    inlet.deliver(Sample("base.pose", 20_000_000, Pose2(1.0, 0.0)), 0)
    assert len(board.inbox) == 1


def test_the_driver_of_the_base_can_wake_the_loop() -> None:
    plant = connected(base=(Base, ""), lamp=(Lamp, ""))
    looped(plant, 0.05)

    assert OPENED["Base"].wake is not None


def test_a_file_of_a_connection_names_drivers_by_module_and_class(tmp_path: Path) -> None:
    from hw.connection.connection import load_connection

    file = tmp_path / "c.yaml"
    file.write_text(
        "connection: c\nmodel: rbkairos_ur10\n"
        'parts:\n  base: {driver: "my.base:Base", address: 127.0.0.1, port: 5}\n'
    )
    served = load_connection(file).parts["base"]

    assert (served.module, served.driver) == ("my.base", "Base")
    assert served.arguments == {"address": "127.0.0.1", "port": 5}
