"""A room, a robot and the shipped profiles for tests of behaviours."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest

from behaviors.profile.profile import Profile, load_profile
from behaviors.situation.present_situation import Situation
from engine.state import Stamped
from hw.geometry import Pose2, Twist2
from hw.model.robot import RobotModel, load_robot
from hw.samples import UserPose
from hw.scene.room import Room
from states.environment.environment import Environment

HALL = Room(outer=((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)))


@pytest.fixture(scope="session")
def robot() -> RobotModel:
    return load_robot("rbkairos_ur10")


@pytest.fixture(scope="session", params=["paper", "tuned"])
def profile(request: pytest.FixtureRequest) -> Profile:
    return load_profile(request.param)


@pytest.fixture(scope="session")
def paper() -> Profile:
    return load_profile("paper")


@pytest.fixture(scope="session")
def tuned() -> Profile:
    return load_profile("tuned")


@pytest.fixture(scope="session")
def environment_of(robot: RobotModel) -> Callable[..., Environment]:
    def make(profile: Profile, room: Room = HALL) -> Environment:
        return profile.environment(room, robot)

    return make


@pytest.fixture(scope="session")
def situation_of(environment_of: Callable[..., Environment]) -> Callable[..., Situation]:
    def make(
        profile: Profile,
        pose: Pose2,
        user: UserPose,
        velocity: Twist2 | None = None,
        twist: Twist2 | None = None,
        room: Room = HALL,
    ) -> Situation:
        environment = environment_of(profile, room)
        planners = environment.static_planners
        still = Twist2(0.0)
        moving, walking = twist or still, velocity or still
        return Situation(environment, profile.settings, pose, moving, user, walking, planners)

    return make


class FakeContext:
    """What a state sees, from plain dicts; `events` are handed out once."""

    def __init__(self, values: dict[str, Any], parts: dict[str, Any] | None = None) -> None:
        self.values, self.parts = values, parts or {}
        self.stamps: dict[str, int] = {}
        self.pending: dict[str, list[Stamped]] = {}
        self.ages: dict[str, float] = {}
        self.now = 0

    def after(self, seconds: float) -> int:
        return self.now + round(seconds * 1e9)

    def value(self, signal: str) -> Any:
        if signal.endswith(".planner") and signal not in self.values:
            return self.values["environment"].static_planners[signal.removesuffix(".planner")]
        return self.values.get(signal)

    def sample(self, signal: str) -> Stamped | None:
        if signal not in self.values:
            return None
        return Stamped(self.values[signal], self.stamps.get(signal, 0))

    def age(self, signal: str) -> float:
        return self.ages.get(signal, 0.0) if self.values.get(signal) is not None else math.inf

    def events(self, signal: str) -> tuple[Stamped, ...]:
        return tuple(self.pending.pop(signal, ()))

    def part(self, name: str) -> Any:
        return self.parts[name]


class Base:
    """A base that keeps its newest command, which has to come from one `source`."""

    def __init__(self, source: str) -> None:
        self.command: Twist2 | None = None
        self.source = source

    def drive(self, command: Twist2, source: str) -> None:
        assert source == self.source
        self.command = command

    def release(self, source: str) -> None:
        assert source == self.source
        self.command = None


class Vr:
    """What was shown, in order: with the sign, without it, hidden."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def inform(self, show: bool, sign: bool = True) -> None:
        self.told.append(("shown" if sign else "robot") if show else "hidden")


@pytest.fixture
def context() -> type[FakeContext]:
    return FakeContext
