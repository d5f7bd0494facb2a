"""A room, a robot and the shipped profiles for tests of behaviours."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from behaviors.escape import danger
from behaviors.profile.profile import Profile, load_profile
from behaviors.profile.settings import Settings
from behaviors.situation.present_situation import Situation
from cobodeck.testing.testing import ChartTester
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


class Base:
    """A base that keeps its newest command, which has to come from one `source`."""

    def __init__(self, source: str) -> None:
        self.command: Twist2 | None = None
        self.source = source

    def use(self, mode: str) -> None:
        assert mode == "omni"

    def drive(self, command: Twist2, source: str, left: float = math.inf) -> None:
        assert source == self.source
        self.command = command

    def release(self, source: str) -> None:
        assert source == self.source
        self.command = None


class Vr:
    """What was shown, in order: with the sign, without it, hidden."""

    def __init__(self) -> None:
        self.told: list[str] = []

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        self.told.append(("shown" if sign else "robot") if show else "hidden")


def is_required(environment: Environment, chosen: Settings, *seen: Any) -> bool:
    """With Escape's planner of a room in which nothing was scanned."""
    return danger.is_required(environment, chosen, environment.static_planners["escape"], *seen)


def is_safe(environment: Environment, chosen: Settings, *seen: Any) -> bool:
    return danger.is_safe(environment, chosen, environment.static_planners["escape"], *seen)


def behaviour(sim: ChartTester) -> str:
    return sim.active[0].partition("/")[0]


def written(folder: Path, text: str, name: str = "mine.yaml") -> Path:
    file = folder / name
    file.parent.mkdir(exist_ok=True)
    file.write_text(text)
    return file
