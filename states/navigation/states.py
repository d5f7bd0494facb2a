"""States that drive the base."""

from __future__ import annotations

import math
from collections.abc import Generator
from typing import TYPE_CHECKING, Annotated, Any

from engine import Action, Context, Key, Run, Yielded
from engine.files import Duration, Length, Speed
from engine.files.declared import ABOVE_0, FROM_0
from hw import DriveMode, Pose2
from states.environment import (
    BASE_POSE,
    BASE_REFUSAL,
    USER_POSE,
    USER_VELOCITY,
    environment_of,
    extrapolated_state,
)
from states.navigation.beside_user import place_near
from states.navigation.drive import DRIVES, PLANNERS, BaseDrive, Clearance
from states.subsystems import SubsystemName

if TYPE_CHECKING:
    from states.navigation.planner_interfaces import GlobalPlanner

FIRST_POSE_S = 2.0
"""How long a drive waits for the first pose of the base, s.

An estimate with a given start has it after one turn of each scanner and one match, 0.1 to 0.2 s; a
robot that then has to search needs more, and where it stands is not known: `lost`.
"""


class _Drives(Action):
    """Drives the base with a subsystem's values.

    Args:
        subsystem: whose values of the profile's `navigation` to drive with.
        patience: how long to go without progress before it is `stuck`.
        mode: how to drive the wheels until the drive ends: `differential` drives along the heading
            only (R2); by default the first of the `modes` in the robot's file.
        clearance: whose distances from walls and user to keep: `own`, those of `subsystem`, or
            another one's.
        speed: nowhere faster than this; by default as fast as the limits allow.

    Outcomes:
        arrived: the robot stands at the goal, within the tolerance of the subsystem.
        no_path: for 1 s the goal has not been free or reachable.
        stuck: there was no progress for `patience`.
        lost: the pose of base or user is lost, or a scanner has fallen silent.
    """

    outcomes = ("arrived", "no_path", "stuck", "lost")
    reads = {**DRIVES, **PLANNERS}
    optional = (USER_POSE, USER_VELOCITY)
    commands = ("base",)

    def __init__(
        self,
        subsystem: SubsystemName = "chase",
        patience: Annotated[Duration, ABOVE_0] = 3.0,
        mode: DriveMode | None = None,
        clearance: Clearance = "own",
        speed: Annotated[Speed, ABOVE_0] | None = None,
    ) -> None:
        self.subsystem: SubsystemName = subsystem
        self.clearance: Clearance = clearance
        self.patience = patience
        self.mode: DriveMode | None = mode
        self.speed = speed

    def _drive(self, ctx: Context) -> BaseDrive:
        keeping = self.clearance, self.mode, self.patience, self.speed
        return BaseDrive(ctx, self.subsystem, *keeping)


class DriveTo(_Drives):
    """Drive to a goal on the fastest path around walls and user, with a subsystem's values.

    `{do: DriveTo, in: {goal: {x: 2 m, y: 1 m, yaw: 90 deg}}, timeout: 20 s, next: …}`.
    The path is replanned in every tick, with the obstacles scanned so far and a prediction of the
    walking user. For `haptic` the safety chain gets the goal, from which a touch will be served.
    `clearance` names another subsystem whose `inflation` and, where there is no room for more,
    `user_radius` are kept instead; a drive that starts nearer to a wall than its own inflation,
    by more than 3 cm, keeps Escape's.
    A first pose is waited for, up to 2 s.

    Args:
        goal: where to drive, map_from_base.
    """

    def run(self, ctx: Context, goal: Pose2) -> Run:
        yield from first_pose(ctx)
        with self._drive(ctx) as drive:
            if drive.is_lost:
                return "lost"
            while (ended := drive.towards(goal)) is None:
                yield ctx.value(BASE_REFUSAL)
            return ended


class DriveThrough(_Drives):
    """Drive through all goals in turn, as `DriveTo` does, and stop only at the last one.

    `{do: DriveThrough, in: {goals: [{x: 2 m, y: 1 m}, {x: 4 m, y: 1 m}]}, next: …}`.
    The next goal counts once the robot is within `passing` of the present one, whatever its yaw.
    Without goals it has `arrived`.

    Args:
        passing: a goal on the way counts as passed within this distance, whatever the yaw.
        goals: where to drive, map_from_base each, in this order.

    Outcomes:
        arrived: the robot stands at the last goal, or there were no goals.
    """

    def __init__(
        self,
        subsystem: SubsystemName = "chase",
        passing: Annotated[Length, ABOVE_0] = 0.5,
        patience: Annotated[Duration, ABOVE_0] = 3.0,
        mode: DriveMode | None = None,
        clearance: Clearance = "own",
        speed: Annotated[Speed, ABOVE_0] | None = None,
    ) -> None:
        super().__init__(subsystem, patience, mode, clearance, speed)
        self.passing = passing

    def run(self, ctx: Context, goals: tuple[Pose2, ...]) -> Run:
        if not goals:
            return "arrived"
        yield from first_pose(ctx)
        with self._drive(ctx) as drive:
            if drive.is_lost:
                return "lost"
            for goal in goals[:-1]:
                while (ended := drive.towards(goal, self.passing)) is None:
                    yield ctx.value(BASE_REFUSAL)
                if ended != "arrived":
                    return ended
                yield ctx.value(BASE_REFUSAL)
            while (ended := drive.towards(goals[-1])) is None:
                yield ctx.value(BASE_REFUSAL)
            return ended


class Follow(Action):
    """Drive after the user, facing them, to stay within `distance`, until something else ends it.

    It rests within `distance`, which is at least Chase's `user_radius` plus its `tolerance`, and
    sets off again once they are farther away by `slack`. First poses are waited for, up to 2 s.

    Args:
        distance: how near to stay.
        slack: how much farther away they may be before it sets off again.
        mode: how to drive the wheels, as for `DriveTo`.

    Outcomes:
        no_path: for 1 s no path has led to them.
        lost: the pose of base or user is lost, or a scanner has fallen silent.
    """

    outcomes = ("no_path", "lost")
    reads = {**DRIVES, **PLANNERS}
    commands = ("base",)

    def __init__(
        self,
        distance: Annotated[Length, FROM_0] = 2.0,
        slack: Annotated[Length, FROM_0] = 0.3,
        mode: DriveMode | None = None,
    ) -> None:
        self.distance, self.slack = distance, slack
        self.mode: DriveMode | None = mode

    def run(self, ctx: Context) -> Run:
        yield from first_pose(ctx)
        yield from first_pose(ctx, USER_POSE)
        chase = environment_of(ctx).navigation.chase
        near, rests = max(self.distance, chase.user_radius + chase.tolerance), False
        with BaseDrive(ctx, "chase", "own", self.mode) as drive:
            while (now := extrapolated_state.around(ctx)) is not None and now.user is not None:
                away = now.pose.distance_to(now.user.body)
                rests = away <= near + (self.slack if rests else chase.tolerance)
                if rests:
                    drive.rest()
                else:
                    ended = drive.towards(_beside(now.user.body, now.pose, near, drive.planner))
                    if ended not in (None, "arrived"):
                        return ended
                yield ctx.value(BASE_REFUSAL)
        return "lost"


def _beside(user: Pose2, here: Pose2, near: float, planner: GlobalPlanner | None) -> Pose2:
    """The first place within `near`, m, of the user on the path to them, facing them.

    Without a path it is their own place, to which no drive finds one either.
    """
    at = (user.x, user.y)
    place = None if planner is None else place_near(planner, (here.x, here.y), at, near)
    x, y = place or at
    return Pose2(x, y, math.atan2(user.y - y, user.x - x))


def first_pose(ctx: Context, signal: Key[Any] = BASE_POSE) -> Generator[Yielded, None, None]:
    """Wait up to FIRST_POSE_S while a pose, by default of the base, has never been known."""
    until = ctx.after(FIRST_POSE_S)
    while ctx.now < until and ctx.age(signal) == math.inf:
        yield f"waits for the first {signal}"
