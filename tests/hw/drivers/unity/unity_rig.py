"""A VR link in its own process, its parts, and a VR application beside it, for tests."""

from __future__ import annotations

import select
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from hw.connection.connection import RunInfo
from hw.drivers.unity.unity_link import Unity, UnityRoverTrackers, UnityTrackers, UnityVr
from hw.fakes.unity.vr_application import FRAME_NS, Application
from hw.fakes.unity.vr_plays import Alone
from hw.geometry import Pose2, Pose3
from hw.model.robot import MotionLimits, load_robot
from hw.model.tracking import Tracking
from hw.safety.limits import SafetyLimits
from hw.samples import Sample, UserPose
from tests.hw.drivers.rigs import own_address

ROBOT = load_robot("rbkairos_ur10")
DEEP = Pose3.from_yaw(4.65, 5.0, 1.5, 3.0)
MAP_FROM_VIVE = Pose3.from_yaw(3.0, -1.0, 0.0, 0.8)
PATIENCE_S = 10.0


def an_opening(now: Callable[[], int]) -> RunInfo:
    """What a driver is told of a run in a tracking frame that is not the map's."""
    tracking = Tracking(MAP_FROM_VIVE, Tracking.of(ROBOT.sensing).mounts)
    limits = MotionLimits(base_acceleration=1.0)
    return RunInfo(now, ROBOT, limits, SafetyLimits.of(ROBOT, limits), tracking)


class Standing:
    """Somebody who stands there, and asks for a touch when told to."""

    def __init__(self, body: Pose2) -> None:
        self.body, self.speed, self.finished = body, 0.0, False
        self.request: Pose3 | None = None
        self.measured: Sample | None = None

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        self.measured = Sample("user.pose", now_ns, UserPose(self.body, self.body.yaw))


class Rig:
    """See the module; `samples` has all that the parts have given, `wakes` how often they woke."""

    def __init__(self, **arguments: Any) -> None:
        begun_ns = time.monotonic_ns()
        self.now: Callable[[], int] = lambda: time.monotonic_ns() - begun_ns
        self.begun_ns = begun_ns
        self.remarks: list[str] = []
        self.opening = replace(an_opening(self.now), tell=self.remarks.append)
        arguments.setdefault("host", own_address())
        self.link = Unity(0, self.now, self.opening, **arguments)
        self.link.wait()
        self.trackers = UnityTrackers(self.link)
        self.rover = UnityRoverTrackers(self.link)
        self.vr = UnityVr(self.link, self.now)
        self.person = Standing(Pose2(5.5, 5.0, 3.0))
        self.wakes = 0
        self.vr.wake = self._woken
        self.samples: list[Sample] = []
        self.applications: list[Application] = []

    def application(self, person: Standing | None = None, **arguments: Any) -> Application:
        """A VR application with somebody in it."""
        play = Alone(self.person if person is None else person)
        made = Application(*self.link.address, play, map_from_vive=MAP_FROM_VIVE, **arguments)
        self.applications.append(made)
        return made

    def until(self, true: Callable[[], object], each: Callable[[], None] | None = None) -> bool:
        """Let all go on, frame by frame, until something is true; False: it never was."""
        end_ns = time.monotonic_ns() + int(PATIENCE_S * 1e9)
        while time.monotonic_ns() < end_ns:
            due_ns = time.monotonic_ns() + FRAME_NS
            for application in self.applications:
                application.step(time.monotonic_ns())
            if each is not None:
                each()
            for part in (self.trackers, self.rover, self.vr):
                self.samples += part.samples(self.now())
            if true():
                return True
            select.select([], [], [], max(0, due_ns - time.monotonic_ns()) * 1e-9)
        return False

    def values(self, name: str) -> list[Any]:
        return [sample.value for sample in self.samples if sample.name == name]

    def newest(self, name: str) -> Any:
        values = self.values(name)
        return values[-1] if values else None

    def close(self) -> None:
        for application in self.applications:
            application.client.close()
        self.link.close()

    def _woken(self) -> None:
        self.wakes += 1
