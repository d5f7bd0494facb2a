"""A state written for FlexBE, ported: `on_enter`, `execute` and `on_exit` on top of `run`."""

from __future__ import annotations

from typing import ClassVar

import pytest

from engine.files.units import Duration
from engine.flexbe import EventState, UserData
from engine.interfaces import interface
from engine.machine.node import Substitute
from tests.engine.conftest import Bench


class ExampleState(EventState):
    """Waits for `target_time`, then tells when it was entered and how often it looked."""

    outcomes = ("done", "failed")
    inputs = {"limit": float}
    outputs = {"done": {"looks": int}}
    exits: ClassVar[list[str]] = []

    def __init__(self, target_time: Duration) -> None:
        self.target_time = target_time

    def on_enter(self, userdata: UserData) -> None:
        if userdata.limit < 0:
            raise ValueError("no limit")
        self.until = self.ctx.after(self.target_time)
        userdata.looks = 0

    def execute(self, userdata: UserData) -> str | None:
        userdata.looks += 1
        if userdata.looks > userdata.limit:
            return "failed"
        return "done" if self.ctx.now >= self.until else None

    def on_exit(self, userdata: UserData) -> None:
        self.exits.append(f"after {userdata.looks}")


TEXT = """
chart: c
outcomes: [ok, bad]
outputs: {ok: {looks: integer}}
parameters: {wait: {type: duration, default: 300 ms}}
data: {limit: {type: number, initial: LIMIT}, looks: {type: integer, initial: 0}}
any:
  work:
    do: ExampleState
    with: {target_time: $wait}
    in: {limit: limit}
    out: {looks: looks}
    next: {done: .ok, failed: .bad}
  stop: {watch: See, next: {seen: .bad, lost: .bad}}
"""


@pytest.fixture(autouse=True)
def forget():
    ExampleState.exits.clear()


def ported(limit: int) -> Bench:
    text = TEXT.replace("LIMIT", str(limit))
    return Bench(text, states=(ExampleState,), scripted=False)


def test_its_interface_is_read_like_any_other():
    found = interface(ExampleState)
    assert found.outcomes == ("done", "failed")
    assert set(found.inputs) == {"limit"}
    assert str(found.parameters["target_time"].type) == "duration"


def test_it_runs_and_hands_over_its_outputs():
    b = ported(limit=99)
    b.run.put_in("stop", Substitute(Never, {}))
    b.tick(4)
    assert b.run.outcome == "ok"
    assert b.run.results == {"looks": 4}
    assert ExampleState.exits == ["after 4"]


def test_on_exit_is_called_once_when_a_guard_ends_it():
    b = ported(limit=99)
    b.tick(2)
    assert b.run.outcome == "bad"
    assert ExampleState.exits == ["after 1"]


def test_on_exit_is_not_called_when_on_enter_failed():
    b = ported(limit=-1)
    b.tick()
    assert b.run.outcome == "error"
    assert ExampleState.exits == []


class Never:
    """Stands in for a monitor that never ends."""

    def run(self, ctx):
        while True:
            yield


class Plain(EventState):
    """Has neither inputs nor outputs."""

    outcomes = ("done",)

    def execute(self, userdata: UserData) -> str | None:
        return "done"


def test_a_state_without_inputs_needs_none():
    assert interface(Plain).inputs == {}
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {do: Plain, next: {done: .x}}\n"
    bench = Bench(text, states=(Plain,), scripted=False)
    bench.tick()
    assert bench.run.outcome == "x"
