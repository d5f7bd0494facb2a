"""Haptic: where to stand for a touch, and when it is over (paper 4.4.1)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

from behaviors.keys import HAPTIC_POSES
from behaviors.settings import HapticSettings, Settings
from behaviors.situation import CHANGES, WAYS, Situation, situation
from engine.state import Action, Context, Monitor, On, Run
from hw.geometry import Pose2, Pose3, wrap
from states.keys import HAPTIC_REQUEST, RELEASE, planner_key

if TYPE_CHECKING:
    from states.navigation.interfaces import GlobalPlanner


def all_poses(haptic: HapticSettings, deep: Pose3) -> Iterator[Pose2]:
    """All Haptic rover poses in order: a half circle in front of the DEEP (R75).

    Angle 0 is on the line from the user through the DEEP; the robot faces the DEEP (R76, R85).
    """
    for angle in haptic.angles:
        direction = deep.yaw + angle
        x = deep.x + haptic.radius * math.cos(direction)
        y = deep.y + haptic.radius * math.sin(direction)
        yield Pose2(x, y, wrap(direction + math.pi))


def poses(settings: Settings, planner: GlobalPlanner, deep: Pose3) -> tuple[Pose2, ...]:
    """The Haptic rover poses that are free by Haptic's planner, in order (R77)."""
    return tuple(p for p in all_poses(settings.haptic, deep) if planner.is_free((p.x, p.y)))


def reachable(now: Situation, free: tuple[Pose2, ...]) -> dict[Pose2, float]:
    """The poses that the robot can drive to, in order, each with the time of the drive, s."""
    planner, here = now.planners["haptic"], (now.pose.x, now.pose.y)
    found = {}
    for goal in free:
        place = (goal.x, goal.y)
        path = planner.plan(here, place, now.user_disc("haptic", place))
        if path is not None:
            found[goal] = drive_time(now, path.length, abs(wrap(goal.yaw - now.pose.yaw)))
    return found


def best_pose(now: Situation, times: dict[Pose2, float], deep: Pose3) -> Pose2 | None:
    """The first pose, or with `order` "time" the one with the prop at the DEEP soonest.

    None: with `order` "time", the DEEP is out of the arm's reach from all of them.
    """
    goals = tuple(times)
    if now.settings.haptic.order == "given":
        return goals[0] if goals else None
    drive = now.environment.navigation.haptic
    tolerance = (drive.tolerance, drive.yaw_tolerance)
    drives = tuple(times.values())
    best = now.environment.workspace.best(goals, drives, deep, now.user.body, tolerance)
    return None if best is None else goals[best]


def drive_time(now: Situation, length: float, turn: float) -> float:
    """Time of a drive of `length`, m, from rest to rest, while turning by `turn`, rad; s."""
    from states.navigation.speed import rest_to_rest

    limits, fastest = now.environment.limits, now.environment.navigation.haptic.max_speed
    drive = rest_to_rest(length, fastest, limits.base_acceleration)
    turning = rest_to_rest(turn, limits.base_yaw_rate, limits.base_yaw_acceleration)
    return float(max(drive, turning))


class Released(Monitor):
    """`released` when the user lets go, whatever the robot is doing for them (R61, R83)."""

    outcomes = ("released",)
    reads = {RELEASE: None, HAPTIC_REQUEST: None}

    def run(self, ctx: Context, since: int) -> Run:
        while not ctx.events(RELEASE) and self._is_asked(ctx, since):
            yield On(RELEASE, HAPTIC_REQUEST)
        return "released"

    def _is_asked(self, ctx: Context, since: int) -> bool:
        sample = ctx.sample(HAPTIC_REQUEST)
        return sample is not None and sample.value is not None and sample.stamp == since


class ChooseHapticPose(Action):
    """Choose a Haptic rover pose among those that are free and can be reached.

    By the profile's `order`: the first one given, or the one with the prop at the DEEP soonest,
    by the exact reach of the arm. `none`: the user stands too near to a wall, or blocks the only
    path. `out_of_reach`: the arm cannot reach the DEEP from any of them.
    """

    outcomes = ("chosen", "none", "out_of_reach")
    outputs = {"chosen": {"pose": Pose2}}
    reads = {**WAYS, HAPTIC_POSES: None}

    def run(self, ctx: Context, deep: Pose3) -> Run:
        while (now := situation(ctx, "haptic")) is None:
            yield On(planner_key("haptic"), *CHANGES)
        times = reachable(now, ctx.value(HAPTIC_POSES) or ())
        if not times:
            return "none"
        best = best_pose(now, times, deep)
        return "out_of_reach" if best is None else ("chosen", {"pose": best})
