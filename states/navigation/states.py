"""States that drive the base."""

from __future__ import annotations

import math
from collections.abc import Generator, Mapping
from typing import TYPE_CHECKING, Literal

from engine import NEVER_NS, Action, Context, Run, Yielded
from engine.files import Duration
from hw import OLD_S, DriveMode, Pose2, Twist2, UserPose, wrap
from hw.scene import Disc
from states.environment import (
    BASE_ADMITTED,
    BASE_MODE,
    BASE_POSE,
    BASE_POSE_SIGMA,
    BASE_REFUSAL,
    ENVIRONMENT,
    SignalReader,
    environment_of,
    extrapolated_state,
    planner_key,
)
from states.subsystems import SUBSYSTEMS, Subsystem, SubsystemName

if TYPE_CHECKING:
    from states.navigation.local import LocalPlanner
    from states.navigation.planner_interfaces import GlobalPlanner

PLANNERS: Mapping[str, float | None] = {planner_key(name): OLD_S for name in SUBSYSTEMS}
"""`reads` of a state that uses planners, with the greatest age of their scans, s."""
DRIVES: Mapping[str, float | None] = {
    ENVIRONMENT: None, BASE_REFUSAL: None, BASE_ADMITTED: None, BASE_POSE_SIGMA: OLD_S,
    **extrapolated_state.READS,
}  # fmt: skip
"""`reads` of a state that drives with a local planner, see `command_of`."""
Clearance = Literal["own", "chase", "haptic", "escape"]
"""Whose distances from walls and user a drive keeps: those of its own subsystem, or of another."""
NO_PATH_S = 1.0
"""A missing path counts after this time, s: estimated poses jump, people walk."""
NARROW = 0.03
"""A place so much nearer to a wall than a subsystem's inflation, m, is too narrow to start from."""
SLOW = 0.1
"""Speed below which the robot counts as standing, m/s."""

FIRST_POSE_S = 2.0
"""How long a drive waits for the first pose of the base, s.

An estimate with a given start has it after one turn of each scanner and one match, 0.1 to 0.2 s; a
robot that then has to search needs more, and where it stands is not known: `lost`.
"""


class DriveTo(Action):
    """Drive to a goal on the fastest path around walls and user, with a subsystem's values.

    The path is replanned in every tick, with the obstacles scanned so far and a prediction of the
    walking user. For `haptic` the safety chain gets the goal, from which a touch will be served.
    `clearance` names another subsystem whose `inflation` and, where there is no room for more,
    `user_radius` are kept instead; Escape's are from a place nearer to walls than the inflation.
    `no_path`: for 1 s the goal has not been free or reachable; `stuck`: no progress for
    `patience`; `lost`: the pose of base or user is, or a scanner has fallen silent; a first pose
    is waited for (`FIRST_POSE_S`). With the `mode`
    differential the robot drives only along its heading (R2), until the drive ends.
    """

    outcomes = ("arrived", "no_path", "stuck", "lost")
    reads = {BASE_MODE: None, **DRIVES, **PLANNERS}
    commands = ("base",)

    def __init__(
        self,
        subsystem: SubsystemName = "chase",
        patience: Duration = 3.0,
        mode: DriveMode = "omni",
        clearance: Clearance = "own",
    ) -> None:
        self.subsystem: SubsystemName = subsystem
        self.clearance: Clearance = clearance
        self.patience = patience
        self.mode: DriveMode = mode

    def run(self, ctx: Context, goal: Pose2) -> Run:
        from states.navigation.planners import driver_of

        environment = environment_of(ctx)
        keeping = yield from self._keeping(ctx)
        planner = planner_of(ctx, keeping)
        if planner is None:
            return "lost"
        driver = driver_of(environment, self.subsystem, planner, keeping, self.mode)
        driver.go_to(goal)
        progress = GoalProgress(self.patience)
        base, touches = ctx.part("base"), self.subsystem == "haptic"
        own, kept = (environment.navigation.named(name) for name in (self.subsystem, keeping))
        before = ctx.value(BASE_MODE)
        if self.mode != before:
            base.use(self.mode)
        if touches:
            base.grant(goal)
        try:
            while (now := extrapolated_state.around(ctx)) is not None and planner is not None:
                driver.planner = planner
                disc = self._disc(own, kept, planner, now, goal)
                command = command_of(ctx, driver, now, disc, environment.period)
                if driver.status == "arrived":
                    return "arrived"
                left = math.inf if driver.path is None else driver.path.length
                failure = progress.failure(ctx, left, goal.yaw - now.pose.yaw)
                if failure is not None:
                    return failure
                base.drive(command, self.subsystem, left)
                yield ctx.value(BASE_REFUSAL)
                planner = planner_of(ctx, keeping)
        finally:
            base.release(self.subsystem)
            if before not in (self.mode, None):
                base.use(before)
            if touches:
                base.grant(None)
        return "lost"

    def _keeping(self, ctx: Context) -> Generator[Yielded, None, SubsystemName]:
        """The subsystem whose distances from walls and user are kept, once the pose is known."""
        yield from first_pose(ctx)
        if self.clearance != "own":
            return self.clearance
        planner, here = planner_of(ctx, self.subsystem), ctx.value(BASE_POSE)
        if planner is None or here is None:
            return self.subsystem
        inflation = environment_of(ctx).navigation.named(self.subsystem).inflation
        is_narrow = planner.clearance((here.x, here.y)) < inflation - NARROW
        return "escape" if is_narrow else self.subsystem

    def _disc(
        self,
        own: Subsystem,
        kept: Subsystem,
        planner: GlobalPlanner,
        now: extrapolated_state.RobotAndUser,
        goal: Pose2,
    ) -> Disc | None:
        """The disc around the user to keep out of: the wide one if there is a path around it."""
        if kept is own or now.user is None:
            return user_disc(now.user, own)
        wide = wide_disc(now.user, own, kept, goal)
        path = planner.plan((now.pose.x, now.pose.y), (goal.x, goal.y), wide)
        return user_disc(now.user, kept) if path is None else wide


def first_pose(ctx: Context) -> Generator[Yielded, None, None]:
    """Wait up to FIRST_POSE_S while the pose of the base has never been known."""
    until = ctx.after(FIRST_POSE_S)
    while ctx.now < until and ctx.age(BASE_POSE) == math.inf:
        yield "waits for the first pose of the base"


def command_of(
    ctx: SignalReader,
    driver: LocalPlanner,
    now: extrapolated_state.RobotAndUser,
    user: Disc | None,
    period: float,
) -> Twist2:
    """A local planner's command (base frame) for the present poses and their uncertainty.

    `period` is the time between ticks, s.
    """
    sigma = ctx.value(BASE_POSE_SIGMA)
    held = ctx.value(BASE_REFUSAL) is not None
    return driver.command(
        now.pose,
        now.twist,
        user,
        period,
        now.walking,
        sigma=0.0 if sigma is None else sigma.position,
        admitted=now.twist if held else ctx.value(BASE_ADMITTED),
        share=now.share,
    )


def planner_of(ctx: SignalReader, name: SubsystemName) -> GlobalPlanner | None:
    """The planner of a subsystem with scanned obstacles; None if the scans are too old."""
    return ctx.value(planner_key(name))


class GoalProgress:
    """Watches whether a drive makes progress.

    Progress is a path shorter by STEP, m, with the turn left in rad added; a path longer by LONGER
    is a detour around a user who has moved, and starts the watch again.
    """

    STEP = 0.05
    LONGER = 0.3

    def __init__(self, patience: Duration) -> None:
        self._patience = patience
        self._least = math.inf
        self._until, self._give_up = 0, NEVER_NS

    def failure(self, ctx: Context, length: float, turn: float) -> str | None:
        """`no_path` once the length of the path, m, has been infinite for NO_PATH_S.

        `stuck` once path and turn, rad, have not become less for the whole patience.
        """
        if length == math.inf:
            self._give_up = min(self._give_up, ctx.after(NO_PATH_S))
            return "no_path" if ctx.now >= self._give_up else None
        self._give_up, left = NEVER_NS, length + abs(wrap(turn))
        nearer = left < self._least - self.STEP
        detour = left > self._least + self.LONGER
        if nearer or detour:
            self._least, self._until = left, ctx.after(self._patience)
        return None if ctx.now <= self._until else "stuck"


def is_there(pose: Pose2, twist: Twist2, goal: Pose2, subsystem: Subsystem) -> bool:
    """True within the tolerance of the goal's position, and standing."""
    return pose.distance_to(goal) <= subsystem.tolerance and twist.speed < SLOW


def user_disc(user: UserPose | None, subsystem: Subsystem) -> Disc | None:
    """The disc around the user that the robot's centre keeps out of."""
    if user is None:
        return None
    return Disc(user.body.x, user.body.y, subsystem.user_radius)


def wide_disc(user: UserPose, own: Subsystem, least: Subsystem, goal: Pose2) -> Disc:
    """The disc of a drive that may come nearer to the user than its own subsystem does.

    As wide as that of its `own`, but not over the goal, and never smaller than that of the `least`:
    past a user the safety chain admits a drive no nearer than its goal.
    """
    away = user.body.distance_to(goal)
    radius = max(least.user_radius, min(own.user_radius, away))
    return Disc(user.body.x, user.body.y, radius)
