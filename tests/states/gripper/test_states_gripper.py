"""States of gripper and sensor, on the simulated ones."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from engine.chart import load_text
from engine.check.all_checks import check
from engine.interfaces import interface
from engine.machine.machine import Machine
from engine.run.chart_run import ChartRun
from engine.signals.board import Board
from engine.signals.signal_kinds import Measured, declare
from engine.state import NEVER_NS
from hw.model.prop import GripperModel
from hw.samples import GripperState, WrenchReading
from hw.sim.hand.tool import SimGripper
from hw.sim.mock import MockGripper
from states.gripper.states import CloseGripper, OpenGripper, WaitForForce

HZ = 30
MODEL = GripperModel(opening=0.085, speed=0.15)
CUP = 0.06


class Fingers:
    """A gripper, stepped with the state that moves it."""

    def __init__(self, context: Any, state: Any, kind: type[SimGripper] = SimGripper) -> None:
        self.gripper = kind(MODEL)
        self.ctx = context({}, {"gripper": self.gripper})
        self.run, self.tick = state.run(self.ctx), 0
        self.notes: list[str] = []
        self.told: Callable[[GripperState], GripperState | None] = lambda state: state

    def until_end(self, seconds: float = 10.0) -> str | None:
        for _ in range(round(seconds * HZ)):
            self.ctx.now, self.tick = self.tick * 10**9 // HZ, self.tick + 1
            self.gripper.advance(self.ctx.now)
            told = self.told(self.gripper.state)
            if told is not None:
                self.ctx.values["gripper.state"] = told
                self.ctx.stamps["gripper.state"] = self.ctx.now
            try:
                note = next(self.run)
            except StopIteration as end:
                return str(end.value)
            if isinstance(note, str):
                self.notes.append(note)
        return None


@pytest.mark.requirement(150)
@pytest.mark.parametrize("kind", [SimGripper, MockGripper])
@pytest.mark.parametrize(
    ("between", "opening", "outcome", "at"),
    [(CUP, 0.0, "holding", CUP), (None, 0.0, "empty", 0.0), (CUP, 0.07, "empty", 0.07)],
)
def test_closing_fingers_tell_whether_they_have_got_something(
    context: Any, kind: Any, between: float | None, opening: float, outcome: str, at: float
) -> None:
    fingers = Fingers(context, CloseGripper(opening), kind)
    fingers.gripper.between = between

    assert fingers.until_end() == outcome
    assert fingers.gripper.state.opening == pytest.approx(at)


@pytest.mark.requirement(150)
@pytest.mark.parametrize("kind", [SimGripper, MockGripper])
@pytest.mark.parametrize(("opening", "at"), [(None, 0.085), (0.07, 0.07)])
def test_fingers_open_as_wide_as_they_go_or_as_they_are_told(
    context: Any, kind: Any, opening: float | None, at: float
) -> None:
    fingers = Fingers(context, OpenGripper(opening), kind)
    fingers.gripper.between = CUP
    fingers.gripper.state = GripperState(CUP, holding=True)

    assert fingers.until_end() == "opened"
    assert fingers.gripper.state == GripperState(pytest.approx(at))


@pytest.mark.parametrize("state", [OpenGripper(0.1), CloseGripper(0.1)])
def test_an_opening_that_the_fingers_do_not_have_is_an_error(context: Any, state: Any) -> None:
    with pytest.raises(ValueError, match=r"an opening of 0\.1 m; 0 to 0\.085 is free"):
        Fingers(context, state).until_end()


def test_fingers_that_are_there_already_take_a_tick(context: Any) -> None:
    fingers = Fingers(context, OpenGripper())

    assert fingers.until_end() == "opened"
    assert fingers.tick == 2


def test_fingers_that_cannot_open_so_far_as_they_hold_something_say_so(context: Any) -> None:
    fingers = Fingers(context, OpenGripper(0.02))
    fingers.gripper.between = CUP

    assert fingers.until_end() == "failed"
    assert fingers.notes == ["the fingers still hold something"]


@pytest.mark.parametrize("state", [OpenGripper(0.0), CloseGripper()])
def test_fingers_that_never_rest_fail_after_the_patience(context: Any, state: Any) -> None:
    fingers = Fingers(context, state)
    fingers.told = lambda state: replace(state, moving=True)

    assert fingers.until_end() == "failed"
    assert fingers.notes == ["the fingers have not come to rest within 3 s"]
    assert fingers.tick == 3 * HZ + 2


def test_a_gripper_that_says_nothing_fails_after_the_patience(context: Any) -> None:
    fingers = Fingers(context, CloseGripper(patience=1.0))
    fingers.told = lambda _: None

    assert fingers.until_end() == "failed"
    assert fingers.tick == HZ + 2


@pytest.mark.requirement(48)
@pytest.mark.parametrize("state", [OpenGripper(0.0), CloseGripper()])
def test_a_pulled_stop_line_fails_either(context: Any, state: Any) -> None:
    fingers = Fingers(context, state)
    fingers.until_end(0.2)
    fingers.ctx.values["stop.engaged"] = "button"

    assert fingers.until_end() == "failed"


def test_whatever_ends_it_stops_the_fingers(context: Any) -> None:
    fingers = Fingers(context, CloseGripper())
    fingers.until_end(0.2)

    fingers.run.close()
    fingers.gripper.advance(10**9)

    assert 0.0 < fingers.gripper.state.opening < 0.085
    assert not fingers.gripper.state.moving


BOTH = """
chart: both
outcomes: [done]
all:
  left: {do: OpenGripper, with: {part: left_gripper, signal: left.state}}
  right: {do: CloseGripper, with: {part: right_gripper, signal: right.state}}
"""


def test_a_robot_with_two_grippers_moves_both_at_once() -> None:
    library = load_text(BOTH)
    states = {cls.__name__: interface(cls) for cls in (OpenGripper, CloseGripper)}
    signals = declare([
        Measured("left.state", GripperState),
        Measured("right.state", GripperState),
        Measured("stop.engaged", str),
    ])  # fmt: skip
    same = load_text(BOTH.replace("right_gripper", "left_gripper"))
    parts = {"left_gripper": SimGripper(MODEL), "right_gripper": SimGripper(MODEL)}
    board = Board(signals)
    run = ChartRun(Machine(library["both"], library, states), board, parts)

    found = check(library, states, signals=signals, parts=tuple(parts))
    assert {finding.code for finding in found} == {"S10"}, found  # errors end the chart
    assert "S08" in {finding.code for finding in check(same, states)}
    for tick in range(60):
        now = tick * 10**9 // HZ
        for name, gripper in parts.items():
            gripper.advance(now)
            board.put(f"{name.removesuffix('_gripper')}.state", gripper.state, now)
        run.tick(now)

    assert run.outcome == "done"
    ends = {r.subject: r.detail[0] for r in run.trace if r.kind == "outcome"}
    assert (ends["left"], ends["right"]) == ("opened", "empty")


def force(x: float = 0.0, y: float = 0.0, z: float = 0.0) -> WrenchReading:
    return WrenchReading((x, y, z), (0.0, 0.0, 0.0))


class Felt:
    """A monitor that is stepped as the engine would: on news, and at the instant it waits for."""

    def __init__(self, context: Any, state: WaitForForce) -> None:
        self.ctx = context({})
        self.run = state.run(self.ctx)

    def step(self, seconds: float, reading: WrenchReading | None) -> str | None:
        self.ctx.now = round(seconds * 1e9)
        self.ctx.values["wrench.reading"] = reading
        try:
            self.waits: Any = next(self.run)
        except StopIteration as end:
            return str(end.value)
        return None


@pytest.mark.requirement(150)
@pytest.mark.parametrize(
    ("along", "reading", "felt"),
    [
        ("any", force(3.0, 0.0, 4.1), True),
        ("any", force(3.0, 0.0, 3.9), False),
        ("z", force(9.0, 9.0, 4.9), False),
        ("z", force(0.0, 0.0, -5.1), True),
        ("x", force(5.1, 0.0, 0.0), True),
        ("y", force(5.1, 0.0, 0.0), False),
    ],
)
def test_a_force_is_felt_as_a_whole_or_along_an_axis(
    context: Any, along: Any, reading: WrenchReading, felt: bool
) -> None:
    monitor = Felt(context, WaitForForce(5.0, along))

    assert monitor.step(0.0, force()) is None
    assert monitor.step(0.1, reading) == ("felt" if felt else None)


def test_what_the_tool_weighs_at_entry_does_not_count_unless_asked(context: Any) -> None:
    relative, absolute = (
        Felt(context, WaitForForce(5.0, relative=relative)) for relative in (True, False)
    )

    assert relative.step(0.0, force(z=-12.0)) is None
    assert relative.step(0.1, force(z=-16.0)) is None
    assert relative.step(0.2, force(z=-17.5)) == "felt"
    assert absolute.step(0.0, force(z=-12.0)) == "felt"


def test_a_force_has_to_last_and_may_fall_a_little(context: Any) -> None:
    monitor = Felt(context, WaitForForce(5.0, for_=0.3, older=1.0))

    assert monitor.step(0.0, force()) is None
    assert monitor.waits.until == NEVER_NS
    assert monitor.step(0.1, force(x=5.2)) is None
    assert monitor.waits.until == round(0.4e9)
    assert monitor.step(0.2, force(x=4.4)) is None  # below 90 %
    assert monitor.waits.until == NEVER_NS
    assert monitor.step(0.3, force(x=5.2)) is None
    assert monitor.step(0.5, force(x=4.6)) is None
    assert monitor.step(0.6, force(x=4.6)) == "felt"


def test_a_silent_sensor_feels_nothing(context: Any) -> None:
    monitor = Felt(context, WaitForForce(5.0, for_=0.3))

    assert monitor.step(0.0, None) is None
    assert monitor.step(0.1, force()) is None
    assert monitor.step(0.2, force(x=math.inf)) is None
    assert monitor.waits.until == round(0.4e9) + 1  # then the reading is older than 0.2 s
    assert monitor.waits.older == round(0.2e9)
    assert monitor.step(0.4, None) is None
    assert monitor.step(0.6, force(x=6.0)) is None
    assert monitor.step(0.8, force(x=6.0)) is None
    assert monitor.waits.until == round(0.9e9)
    assert monitor.step(0.9, force(x=6.0)) == "felt"
