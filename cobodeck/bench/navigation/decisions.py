"""Benchmark of decisions: from a user sample to a chosen pose, for Escape to the first command.

The states themselves are timed in random situations of a room: computing the poses or cells of
their space, choosing among them, and in Escape the first command (R40, R105, R109). They have no
knob and no error: a row tells the mean, another the 95th percentile.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from behaviors import haptic
from behaviors.chase import chase_states as chase
from behaviors.escape import escape_candidates, escape_poses, escape_states as escape, paper_escape
from behaviors.person import band, drives, lines, margin, touch, waiting
from behaviors.profile import Profile, load_profile, profile_names
from behaviors.situation import Situation
from cobodeck.bench.harness import ROUNDS, BenchRow, Work, timed_each, times
from engine import Action
from hw import USER_RADIUS, Pose2, Pose3, Twist2, UserPose, compile_examples
from hw.model import load_robot
from hw.scene import load_scene
from states.environment import Environment
from states.navigation.exact import visibility

NAME, SCENE = "navigation", "lab_a"
SITUATIONS, SEED = 200, 5
WALK = 1.0
"""Speed at which the users of the situations walk up to the robot, m/s."""
NEAR, FAR = 1.3, 2.5
"""Range of these users' distances from the robot, m."""
GOAL_UNITS = 0.1
"""The most that 95 % of Escape's decisions may take: 5 ms where a unit takes 50 ms."""


class _Parts:
    """A base and a virtual world that ignore every command."""

    def drive(self, command: Twist2, source: str = "", left: float = 0.0) -> None:
        """Ignore it."""

    def release(self, source: str = "") -> None:
        """Ignore it."""

    def inform(self, show: bool, sign: bool = True, least: float = 0.0) -> None:
        """Ignore it."""


@dataclass(frozen=True, slots=True)
class _Moment:
    """A stand-in for the context of a state at one instant."""

    values: Mapping[str, Any]

    def value(self, name: str) -> Any:
        return self.values[name]

    def age(self, name: str) -> float:  # noqa: ARG002  every value is fresh
        return 0.0

    def part(self, name: str) -> Any:  # noqa: ARG002  stands for all parts
        return _Parts()


def rows(rounds: int = ROUNDS, count: int = SITUATIONS) -> Iterator[BenchRow]:
    """Mean and 95 % quantile of one decision of each behaviour, by profile."""
    compile_examples((band, drives, lines, margin, touch, waiting, visibility))
    scene = load_scene(SCENE)
    robot = load_robot(scene.robot)
    for profile in map(load_profile, profile_names()):
        environment = profile.environment(scene.room, robot)
        found = situations(environment, profile.settings, count)
        for behaviour, decide in decisions(environment, profile).items():
            works = [Work(times(partial(decide, now))) for now in found]
            row = BenchRow(NAME, f"{behaviour} decision", profile.name, reference="has no error")
            mean, late = timed_each(row, works, rounds)
            yield mean
            yield replace(late, goal=GOAL_UNITS if behaviour == "escape" else None)


def decisions(environment: Environment, profile: Profile) -> dict[str, Callable[[Situation], Any]]:
    """For each behaviour, the work between a sample and its decision, by the profile's policy."""
    settings, planners = profile.settings, environment.static_planners
    rules, paper = settings.escape, profile.policy == "paper"
    cell = chase.ChooseChaseCell() if paper else chase.ChooseChasePose()
    pose = haptic.ChooseFirstHapticPose() if paper else haptic.ChooseHapticPose()

    def for_chase(now: Situation) -> Any:
        return _step(cell, now, {})

    def for_haptic(now: Situation) -> Any:
        x, y = now.user.body.transform(settings.haptic.deep_ahead, 0.0)
        deep = Pose3.from_yaw(x, y, settings.haptic.deep_height, now.user.body.yaw)
        return _step(pose, now, {}, deep=deep)

    def for_escape(now: Situation) -> Any:
        free = escape_poses.poses(settings, planners["escape"], now.user, now.pose)
        if profile.policy == "paper":
            return _step(paper_escape.DriveToFirst(), now, {"escape.poses": free})
        found = escape_candidates.candidates(now, free, environment.outline())
        seen = {"escape.poses": free, "escape.candidates": found}
        state = escape.DriveToBest(rules.earlier_by, rules.wider_by)
        return _step(state, now, seen)

    return {"chase": for_chase, "haptic": for_haptic, "escape": for_escape}


def _step(state: Action, now: Situation, more: Mapping[str, Any], **inputs: Any) -> Any:
    """The first step of a state; its outcome if that step ends it."""
    values = {
        "environment": now.environment, "settings": now.settings, "base.pose": now.pose,
        "base.twist": now.twist, "user.pose": now.user, "user.velocity": now.velocity,
        "arm.joints": None, "base.mode": "omni", **more,
        **{f"{name}.planner": planner for name, planner in now.planners.items()},
    }  # fmt: skip
    run = state.run(_Moment(values), **inputs)  # type: ignore[arg-type]
    try:
        next(run)
    except StopIteration as end:
        return end.value
    run.close()
    return None


def situations(environment: Environment, settings: Any, count: int) -> list[Situation]:
    """Seeded situations: robots at free places, and users who walk up to them."""
    rng = np.random.default_rng(SEED)
    low, high = np.min(environment.room.outer, axis=0), np.max(environment.room.outer, axis=0)
    planners = environment.static_planners
    found: list[Situation] = []
    while len(found) < count:
        x, y = (float(value) for value in rng.uniform(low, high))
        yaw, bearing = (float(value) for value in rng.uniform(-math.pi, math.pi, 2))
        away = float(rng.uniform(NEAR, FAR))
        body = Pose2(x + away * math.cos(bearing), y + away * math.sin(bearing), 0.0)
        if not (planners["chase"].is_free((x, y)) and environment.room.is_free(body.x, body.y)):
            continue
        if environment.room.clearance(body.x, body.y) < USER_RADIUS:
            continue
        towards = math.atan2(y - body.y, x - body.x)
        user = UserPose(Pose2(body.x, body.y, towards), towards)
        velocity = Twist2(WALK * math.cos(towards), WALK * math.sin(towards))
        pose = Pose2(x, y, yaw)
        found.append(Situation(environment, settings, pose, Twist2(0.0), user, velocity, planners))
    return found
