"""What a state waits for with `On` covers all that it has looked at before it waits."""

from __future__ import annotations

import inspect
from typing import Any

import pytest

from behaviors.inform import UserReady
from cobodeck.project.state_catalogue import catalogue
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from cobodeck.testing.testing import ChartTester
from engine.run import life
from engine.run.context import LeafContext
from engine.signals.board import Board
from engine.signals.signal_kinds import Derived, Measured, declare
from engine.state import Context, Monitor, On, Run, Stamped
from hw.geometry import Pose2, Twist2
from hw.samples import UserPose
from tests.engine.conftest import Bench


class Watched(LeafContext):
    """Notes what is read in a step, and what is not covered when the state waits after it."""

    waited: set[str]
    forgotten: dict[str, set[str]]

    def __init__(self, node: Any, board: Any, *others: Any) -> None:
        super().__init__(node, board, *others)
        self.board, self.read, self.tick = board, set[str](), -1

    def _note(self, signal: str) -> None:
        if self.tick != self.board.ticks:
            self.tick = self.board.ticks
            self.read.clear()
        self.read.add(signal)

    def value(self, signal: str) -> Any:
        self._note(signal)
        return super().value(signal)

    def sample(self, signal: str) -> Stamped | None:
        self._note(signal)
        return super().sample(signal)

    def age(self, signal: str) -> float:
        self._note(signal)
        return super().age(signal)

    def events(self, signal: str) -> tuple[Stamped, ...]:
        self._note(signal)
        return super().events(signal)

    def bits(self, names: tuple[str, ...]) -> int:
        """Called when a state waits."""
        covered = super().bits(names)
        name = self.node.interface.name
        self.waited.add(name)
        if self.tick == self.board.ticks:
            constant = self.board.bits(
                name for name, signal in self.board.declared.items()
                if getattr(signal, "constant", False) and name in self.board.slots
            )  # fmt: skip
            for signal in self.read:
                if self.board.bits([signal]) & ~covered & ~constant:
                    self.forgotten.setdefault(name, set()).add(signal)
        return covered


@pytest.fixture
def watched(monkeypatch: pytest.MonkeyPatch) -> type[Watched]:
    monkeypatch.setattr(Watched, "waited", set(), raising=False)
    monkeypatch.setattr(Watched, "forgotten", {}, raising=False)
    monkeypatch.setattr(life, "LeafContext", Watched)
    return Watched


def shipped() -> dict[str, Any]:
    """The state classes that wait with `On`, by name; some do so through functions."""
    found = catalogue().interfaces
    waiting = {name for name, i in found.items() if "On(" in inspect.getsource(i.make)}
    elsewhere = {"ParkArm", "ReachDeep", "Above", "Silent"}
    return {name: found[name] for name in waiting | elsewhere}


NEEDED = {
    "Above": "{signal: user.distance, limit: 9 m}",
    "Changed": "{signal: base.pose}",
    "InEscapeZone": "{ahead: 2.5 m, half_view: 36 deg, around: 1.5 m, moving: 0.2 m/s}",
    "Silent": "{signal: base.pose, time: 1 s}",
    "WaitFor": "{signal: base.pose}",
    "WaitForForce": "{limit: 5 N}",
}
"""The parameters that a state needs, by name."""


def test_shipped_states_wait_for_all_that_they_look_at(
    watched: type[Watched], sim: ChartTester
) -> None:
    for scene, user, requests in (("study", None, 1), ("lab_a", "cornering", 2)):
        loop = stage(open_setup("cobodeck", scene), Options(user=user, requests=requests))
        loop.leave_out = False
        loop.go(90 * 10**9)
    for name, interface in shipped().items():  # those that wait only while something is unknown
        if name in watched.waited:
            continue
        kind = "watch" if interface.monitor else "do"
        ways = ", ".join(f"{outcome}: .x" for outcome in interface.outcomes)
        deep = "deep: deep" if "deep" in interface.inputs else ""
        sim.start(
            "chart: c\noutcomes: [x]\ninputs: {deep: Pose3}\n"
            f"states:\n  a: {{{kind}: {name}, with: {NEEDED.get(name, '{}')}, in: {{{deep}}}, "
            f"next: {{{ways}}}}}\n",
            real=["a"],
            inputs={"deep": {"x": 0, "y": 0, "z": 0}},
        )
        sim.tick(2)
    assert watched.forgotten == {}
    assert watched.waited >= set(shipped()) - {"UserReady"}  # it has a test of its own


def test_who_waits_until_the_user_is_ready_waits_for_what_keeps_the_robot_from_going_on(
    watched: type[Watched],
) -> None:
    setup = open_setup("cobodeck", "study")
    board = Board(setup.signals)
    board.put("environment", setup.environment, 0)
    board.put("settings", setup.profile.settings, 0)
    node = "{watch: UserReady, with: {least: 0 s}, next: {restarted: .x}}"
    text = f"chart: c\noutcomes: [x]\nstates:\n  a: {node}\n"
    bench = Bench(text, states=(UserReady,), scripted=False, board=board)
    for tick in range(10):  # willing, but the stop line is pulled
        user = Pose2(1.0, 1.0 + 0.001 * tick)
        board.put("vr.restart", True, bench.now)
        board.put("stop.engaged", "button", bench.now)
        board.put("user.pose", UserPose(user, 0.0), bench.now)
        board.put("base.pose", Pose2(7.0, 7.0), bench.now)
        board.put("base.twist", Twist2(0.0), bench.now)
        bench.tick()
    leaf: Any = bench.run.nodes["a"]
    assert {"vr.restart", "base.pose", "user.velocity", "stop.engaged"} <= leaf.context.read
    assert watched.forgotten == {}


class Careless(Monitor):
    """Looks at two signals and waits for one."""

    outcomes = ("seen",)
    reads = {"a": None, "b": None, "both": None}

    def run(self, ctx: Context) -> Run:
        while not ctx.value("both"):
            yield On("a")
        return "seen"


def test_who_forgets_one_is_found(watched: type[Watched]) -> None:
    signals = [Measured("a"), Measured("b"), Derived("both", ("a", "b"), lambda a, b: a and b)]
    text = "chart: c\noutcomes: [x]\nstates:\n  a: {watch: Careless, next: {seen: .x}}\n"
    Bench(text, states=(Careless,), scripted=False, board=Board(declare(signals))).tick()
    assert watched.forgotten == {"Careless": {"both"}}
