"""The real drivers beside their fakes, as a rig of the conformance suite; see `test_parts.py`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import pytest

from cobodeck.loop.clocks import RealTime
from cobodeck.real.connected import Connected, connect
from cobodeck.setup.setup import Uses
from hw.connection.connection import HostedScene, RunInfo, ServedPart, load_connection
from hw.geometry import Pose2, Pose3, Twist2
from hw.model.robot import MotionLimits, RobotModel
from hw.model.sensor_errors import SensorErrors
from hw.model.tracking import Tracking
from hw.safety.limits import SafetyLimits
from hw.samples import Sample, UserPose
from hw.scene.scene import Scene
from hw.sim.sensors.devices import ScriptedOperator

EVERYTHING = Uses(
    frozenset(("base", "arm", "wrench", "vr", "bumper", "lidar")),
    frozenset(("rover.tracker", "base.scan", "bumper.hit")),
)
FIRST = {
    "base.odometry",
    "arm.joints",
    "wrench.reading",
    "vr.haptic_request",
    "base.scan",
    "stop.engaged",
}
"""All drivers are heard once these are."""
LEVELS = {"vr.haptic_request", "stop.engaged", "base.mode"}
BUSY = 3
"""If more steps of the world than this are late by 50 ms, drivers rightly see silence."""
PATIENCE = 300
"""So many ticks until they are."""


def heard(parts: Mapping[str, Any], now_ns: int) -> list[Sample]:
    """The samples that all parts have now; those of their own kind, and the base hears them."""
    found = []
    for part in parts.values():
        for sample in part.samples(now_ns):
            assert sample.name in part.signals
            assert sample.stamp_ns <= now_ns
            found.append(sample)
            parts["base"].hear(sample, now_ns)
    return found


class _Person:
    """The live person of the hosted world."""

    def __init__(self, rig: FakesRig) -> None:
        self._rig = rig

    def push(self, stamp_ns: int, pose: UserPose) -> None:
        self._rig.hosted.place(pose)

    def ask(self, deep: Pose3) -> None:
        self._rig.hosted.ask(deep)

    def let_go(self) -> None:
        self._rig.hosted.ask(None)


class _World:
    """What is true in it."""

    def __init__(self, rig: FakesRig) -> None:
        self._rig = rig

    @property
    def now_ns(self) -> int:
        return self._rig.now_ns

    @property
    def collisions(self) -> Any:
        return self._rig.hosted.truth


class FakesRig:
    """All parts of the connection `fakes` but the trackers of the person, in real time.

    And the force of its arm. `base.pose` is the truth: no driver gives it.
    """

    near = 0.02
    """How exact what is measured is, m, rad and their rates."""
    lag, by_hand = 3, 120
    """Ticks until a command has got through, and until somebody has closed the line of the foam."""

    def __init__(
        self, robot: RobotModel, scene: Scene, motion: MotionLimits, safety: SafetyLimits
    ) -> None:
        self._clock = RealTime()
        play = HostedScene(scene, "live", replace(SensorErrors(), slip=None))
        tracking = Tracking.of(robot.sensing)
        self.told: list[str] = []
        opening = RunInfo(self._clock.now, robot, motion, safety, tracking, play, self.told.append)
        connection = load_connection("fakes")
        parts = {name: one for name, one in connection.parts.items() if name != "trackers"}
        parts["wrench"] = ServedPart("hw.drivers", "UrWrench", {"host": "loopback"}, "the rig")
        self.plant: Connected = connect(replace(connection, parts=parts), opening, EVERYTHING)
        self.hosted: Any = self.plant.world
        operator = ScriptedOperator(self.plant.parts["stop_line"], by_hand=self.hosted.push_off)
        self.parts = {**self.plant.parts, "operator": operator}
        self.plant.attendant = operator
        self.person, self.world = _Person(self), _World(self)
        self.got: list[Sample] = []
        self.n = self.now_ns = 0
        self._begin()

    def ticks(self, count: int, each: Any = None) -> None:
        end = self.n + count  # of the grid: those that were missed count, too
        while self.n < end:
            if self.hosted.late > BUSY:
                pytest.skip("this machine is too busy for processes in real time")
            self._take()
            if each is not None:
                each()
            self.parts["base"].tick(self.now_ns)
            show = getattr(self.parts["vr"], "show", None)
            if show is not None:
                show(self.now_ns)

    def place(self, x: float, y: float, yaw: float = 0.0) -> None:
        self.person.push(0, UserPose(Pose2(x, y, yaw), yaw))

    def values(self, name: str) -> list[Any]:
        return [sample.value for sample in self.got if sample.name == name]

    def drive(self, twist: Twist2, ticks: int) -> None:
        self.parts["base"].drive(twist)
        self.ticks(ticks, lambda: self.parts["base"].drive(twist))

    def close(self) -> None:
        self.plant.close()

    def _begin(self) -> None:
        for part in self.parts.values():  # of what is from before the run only levels count
            self.got += [one for one in part.samples(0) if one.name in LEVELS]
        for _ in range(PATIENCE):
            self.ticks(1)
            if {sample.name for sample in self.got} >= FIRST:
                return
        raise AssertionError(FIRST - {sample.name for sample in self.got})

    def _take(self) -> None:
        self.now_ns = now = self._clock.wait(self.n * 10**9 // 30)
        self.n = max(self.n + 1, now * 30 // 10**9)
        self.plant.advance(now)
        self.got += heard(self.parts, now)
        self.got.append(Sample("base.pose", now, self.hosted.truth.base))
