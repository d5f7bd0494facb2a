"""Fakes share a world: what it knows comes to the evaluator, and an operator without a terminal."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest

from cobodeck.evaluate.localization import LocalizationWatch
from cobodeck.evaluate.metrics import Evaluator
from cobodeck.loop.clocks import RealTime
from cobodeck.loop.operators import ConsoleOperator
from cobodeck.loop.sample_router import Inlet
from cobodeck.real.connected import Connected
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.terminal.console import Problem
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from hw.connection.connection import Connection, RunInfo, ServedPart
from hw.geometry import STILL, Pose2, Pose3
from hw.samples import ArmState, Odometry, Sample, TrackerPose, UserPose
from hw.sim.sensors.devices import ScriptedOperator
from hw.truth import Truth

OPENED: dict[str, Any] = {}


class FakeWorld:
    """Knows the truth, finishes and fails as the test wants."""

    def __init__(self, opening: RunInfo, now: Any) -> None:
        OPENED["world"] = self
        self.play = opening.play
        start = Pose2(0.0, 0.0) if self.play is None else self.play.scene.robot_start
        self.truth: Truth | None = Truth(base=start, body=Pose2(5.0, 5.0), contacts=())
        self.truth_ns, self.finished = 0, False
        self.failures: list[Exception] = []
        self.advanced = self.pushed = 0

    def advance(self) -> None:
        self.advanced += 1

    def push_off(self) -> None:
        self.pushed += 1


class Parts:
    """All that the chart needs of a robot, standing still."""

    signals: tuple[str, ...] = ()

    def __init__(self, now: Any) -> None:
        self.now = now

    def stop(self) -> None:
        """It stands."""

    def samples(self, now_ns: int) -> list[Sample]:
        return [Sample(name, now_ns, VALUES[name]) for name in self.signals if name in VALUES]


class Base(Parts):
    """Wheels."""

    signals = ("base.odometry", "base.twist")
    mode = "omnidirectional"

    def drive(self, command: Any) -> None:
        """It stands."""

    def use(self, mode: str) -> None:
        """As it is."""


class Arm(Parts):
    """An arm."""

    signals = ("arm.joints",)

    def follow(self, points: Any) -> int:
        """It stands."""
        return 0

    def pace(self, share: float) -> None:
        """As it is."""


class Trackers(Parts):
    """Of the person."""

    signals = ("user.pose",)


class Vr(Parts):
    """The VR side."""

    signals = ("vr.haptic_request", "vr.release", "vr.restart")

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Nobody looks."""


class Bumper(Parts):
    """Foam."""

    signals = ("bumper.hit",)


SETUP = open_setup("cobodeck", "lab_a")
VALUES = {
    "base.odometry": Odometry(Pose2(0.0, 0.0), STILL),
    "base.twist": STILL,
    "arm.joints": ArmState(SETUP.body.parked, (0.0,) * 6),
    "user.pose": UserPose(Pose2(5.0, 5.0), 0.0),
}
DRIVERS = {"base": Base, "arm": Arm, "trackers": Trackers, "vr": Vr, "bumper": Bumper}


@pytest.fixture(autouse=True)
def opened(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setitem(sys.modules, "hw._of_this_test", sys.modules[__name__])
    OPENED.clear()
    yield
    OPENED.clear()


def connection(world: bool = True) -> Connection:
    def served(kind: type) -> ServedPart:
        return ServedPart("hw._of_this_test", kind.__name__, {}, "c.yaml:1:1")

    parts = {name: served(kind) for name, kind in DRIVERS.items()}
    peers = {"world": served(FakeWorld)} if world else {}
    return Connection("c", "", "rbkairos_ur10", parts, peers=peers)


def staged(options: Options) -> Any:
    return stage(SETUP, options, clock=RealTime())


def plant_of(loop: Any) -> Connected:
    plant = loop.plant
    assert isinstance(plant, Connected)
    return plant


def test_the_world_is_told_the_room_the_person_and_how_sensors_err() -> None:
    options = Options(user="study", requests=3, seed=7, connection=connection())
    plant = plant_of(staged(options))
    play = OPENED["world"].play
    plant.close()

    assert (play.scene, play.user, play.requests, play.seed) == (SETUP.scene, "study", 3, 7)
    assert play.sensing == SETUP.profile.plant.sensing
    assert play.sensors == SETUP.profile.plant.sensors(7)


def test_without_a_user_it_is_the_one_of_the_scene() -> None:
    plant_of(staged(Options(connection=connection()))).close()

    assert OPENED["world"].play.user == "demo"


def test_a_run_on_fakes_is_judged_by_the_truth_and_ends_with_its_person() -> None:
    loop = staged(Options(connection=connection()))
    world, plant = OPENED["world"], plant_of(loop)
    loop.tick()
    judges = [one for one in loop.observers if isinstance(one, Evaluator)]
    began = loop.finished
    world.finished = True
    over = loop.finished
    plant.close()

    assert world.advanced == 1
    assert [(one.measured, one.person) for one in judges] == [(False, True)]
    assert any(isinstance(one, LocalizationWatch) for one in loop.observers)
    assert judges[0].report()["contacts"] == 0
    assert (began, over) == (False, True)
    assert plant.truth is world.truth


def test_a_world_that_fails_is_told_once_and_stops_the_robot() -> None:
    loop = staged(Options(connection=connection()))
    world, plant = OPENED["world"], plant_of(loop)
    world.failures.append(OSError("silent"))
    loop.tick()
    loop.tick()
    plant.close()

    assert [error.path for error in loop.wired.run.errors] == ["part world"]
    assert plant.parts["stop_line"].reason == "part world: OSError"


def test_beside_fakes_without_a_terminal_a_script_looks_after_faults() -> None:
    loop = staged(Options(connection=connection()))
    world, plant = OPENED["world"], plant_of(loop)
    operator, line = plant.parts["operator"], plant.parts["stop_line"]
    assert isinstance(operator, ScriptedOperator)
    line.pull("bumper: person")
    plant.advance(1_000_000_000)
    held = line.reason
    plant.advance(2_000_000_001)
    samples = operator.samples(2_000_000_001)
    plant.close()

    assert held == "bumper: person"
    assert line.reason is None
    assert [sample.name for sample in samples] == ["operator.acknowledge"]
    assert world.pushed == 0


def test_an_operator_who_cannot_reset_for_long_pushes_the_robot_off(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    loop = staged(Options(connection=connection()))
    world, plant = OPENED["world"], plant_of(loop)
    line = plant.parts["stop_line"]
    monkeypatch.setattr(line, "reset", lambda: False)
    line.pull("bumper: person")
    for second in range(8):
        plant.advance(second * 1_000_000_000)
    plant.close()

    assert world.pushed == 3


def test_at_a_terminal_and_without_fakes_a_person_is_the_operator() -> None:
    terminal = open("/dev/null")  # noqa: PTH123, SIM115
    with terminal:
        loop = staged(Options(connection=connection(), console=terminal))
        plant_of(loop).close()
    other = staged(Options(connection=connection(world=False)))
    plant_of(other).close()

    assert isinstance(loop.plant.parts["operator"], ConsoleOperator)
    assert isinstance(other.plant.parts["operator"], ConsoleOperator)
    assert plant_of(other).truth is None
    assert not plant_of(other).finished


@pytest.mark.parametrize("asked", [{"user": "cornering"}, {"requests": 2}])
def test_nobody_can_be_asked_for_where_there_are_no_fakes(asked: dict[str, Any]) -> None:
    options = replace(Options(connection=connection(world=False)), **asked)
    with pytest.raises(Problem, match="has no fakes"):
        staged(options)


def test_an_estimate_is_compared_with_the_truth_of_its_own_instant_once_that_is_known() -> None:
    loop = staged(Options(connection=connection()))
    world, plant = OPENED["world"], plant_of(loop)
    (watch,) = [one for one in loop.observers if isinstance(one, LocalizationWatch)]
    for n in range(40):
        world.truth_ns = loop.grid.instant(n) - 12_000_000  # a bit behind the estimates
        loop.tick()
    plant.close()

    figures = watch.report()
    assert figures["rmse_m"] is not None
    assert figures["max_m"] < 0.05


def test_of_what_was_measured_before_the_run_the_newest_of_each_device_counts() -> None:
    class Source:
        signals = ("rover.tracker", "vr.release")

        def samples(self, now_ns: int) -> list[Sample]:
            def seen(name: str, x: float) -> Sample:
                return Sample("rover.tracker", now_ns, TrackerPose(name, Pose3(x, 0.0, 1.0)))

            return [seen("a", 1.0), seen("b", 1.0), seen("a", 2.0),
                    Sample("vr.release", now_ns, True), seen("b", 2.0)]  # fmt: skip

    known = [Measured("rover.tracker", TrackerPose), Measured("vr.release", bool)]
    inlet = Inlet(Board(declare(known)), {"all": Source()})
    taken: list[Sample] = []
    inlet.taps.append(lambda sample, now_ns, problem: taken.append(sample))
    inlet.begins = True
    inlet.poll(0)
    first, taken[:] = list(taken), []
    inlet.poll(33)

    assert [sample.value for sample in first if sample.name == "rover.tracker"] == [
        TrackerPose("a", Pose3(2.0, 0.0, 1.0)),
        TrackerPose("b", Pose3(2.0, 0.0, 1.0)),
    ]
    assert len(first) == 3
    assert len(taken) == 5


def test_a_run_on_parts_begins_so_and_a_simulation_does_not() -> None:
    loop = staged(Options(connection=connection()))
    plant_of(loop).close()

    assert loop.wired.inlet.begins
    assert not stage(SETUP, Options()).wired.inlet.begins
