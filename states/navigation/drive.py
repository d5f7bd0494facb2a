"""A drive of the base under way: a command per tick towards a goal, and whether that gets nearer.

All states that drive the base do so with it, also those that choose their goal anew in every tick.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, Protocol

from engine.files import Duration, Speed
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
from states.navigation.beside_user import comes_in, user_disc, way_in, wide_disc
from states.subsystems import SUBSYSTEMS, SubsystemName

if TYPE_CHECKING:
    from states.navigation.planner_interfaces import Driver, GlobalPlanner

PLANNERS: Mapping[str, float | None] = {planner_key(name): OLD_S for name in SUBSYSTEMS}
"""`reads` of a state that uses planners, with the greatest age of their scans, s."""
DRIVES: Mapping[str, float | None] = {
    ENVIRONMENT: None, BASE_MODE: None, BASE_REFUSAL: None, BASE_ADMITTED: None,
    BASE_POSE_SIGMA: OLD_S,
    **extrapolated_state.READS,
}  # fmt: skip
"""`reads` of a state that drives, see `BaseDrive`; besides those of its planner."""
Clearance = Literal["own", "chase", "haptic", "escape"]
"""Whose distances from walls and user a drive keeps: those of its own subsystem, or of another."""
NO_PATH_S = 1.0
"""A missing path counts after this time, s: estimated poses jump, people walk."""
NARROW = 0.03
"""A place so much nearer to a wall than a subsystem's inflation, m, is too narrow to start from."""


class DriveContext(SignalReader, Protocol):
    """The part of a state's context that a drive uses."""

    @property
    def now(self) -> int:
        """Chart time, ns."""
        ...

    def after(self, seconds: float) -> int:
        """The chart time `seconds` from now, ns."""
        ...

    def part(self, name: str) -> Any:
        """A part of the robot."""
        ...


class BaseDrive:
    """A drive of the base with a subsystem's values: `towards` a goal, once per tick.

    A context manager: whatever ends it, the base is released and gets its own mode back.
    `clearance`, `mode`, `patience` and `speed` are those of `DriveTo`; with a patience of None
    nobody watches whether it gets nearer. `apart` names a subsystem whose distance from the user
    is kept instead, `source` one with whose priority the base is commanded. `straight`: straight to
    the goal and without turning, as rollouts drive, instead of on a path. The pose of the base is
    known.
    """

    def __init__(  # noqa: PLR0913 - most are optional
        self,
        ctx: DriveContext,
        subsystem: SubsystemName,
        clearance: Clearance = "own",
        mode: DriveMode | None = None,
        patience: Duration | None = 3.0,
        speed: Speed | None = None,
        *,
        apart: SubsystemName | None = None,
        source: SubsystemName | None = None,
        straight: bool = False,
    ) -> None:
        self._ctx, self._base, self._environment = ctx, ctx.part("base"), environment_of(ctx)
        self._own_mode = self._environment.robot.base.own_mode
        self._mode: DriveMode = "omni" if straight else mode or self._own_mode
        self._subsystem, self._before = subsystem, ctx.value(BASE_MODE)
        self._source, self._straight = source or subsystem, straight
        self._own = self._environment.navigation.named(apart or subsystem)
        self._is_apart = apart is not None
        self.keep(_keeping(ctx, subsystem, clearance))
        self._speed = math.inf if speed is None else speed
        self._driver: Driver | None = None
        self._goal: Pose2 | None = None
        self._aim: Pose2 | None = None
        self._progress = None if patience is None else GoalProgress(patience)

    def __enter__(self) -> BaseDrive:
        if not self._mode == self._own_mode == self._before:
            self._base.use(self._mode)
        return self

    def __exit__(self, *_: object) -> None:
        self._base.release(self._source)
        if self._mode != self._own_mode:
            self._base.use(self._own_mode)
        if self._source == "haptic":
            self._base.grant(None)

    @property
    def is_lost(self) -> bool:
        """Whether poses or scans are missing, so that it cannot even begin."""
        return extrapolated_state.around(self._ctx) is None or self.planner is None

    @property
    def planner(self) -> GlobalPlanner | None:
        """The planner with the distances that are kept; None if its scans are too old."""
        return self._ctx.value(self._planner)

    def keep(self, name: SubsystemName) -> None:
        """Keep the distances from walls, and at least that from the user, of this subsystem."""
        self._keeping, self._planner = name, planner_key(name)
        self._kept = self._environment.navigation.named(name)
        self._goes_round = not (self._kept is self._own or self._is_apart or self._straight)

    def towards(
        self,
        goal: Pose2,
        passing: float = 0.0,
        now: extrapolated_state.RobotAndUser | None = None,
    ) -> str | None:
        """Send this tick's command; None while the goal is ahead, else the outcome of the drive.

        `arrived`: it stands at the goal, or, with `passing`, is within that distance of it, m;
        the others are those of `DriveTo`. `now`: robot and user, if the caller knows them already.
        """
        ctx = self._ctx
        now, planner = now or extrapolated_state.around(ctx), ctx.value(self._planner)
        if now is None or planner is None:
            return "lost"
        driver = self._driver
        if driver is None or goal is not self._goal:
            driver = self._set_out_for(goal, planner)
        driver.planner = planner
        aim, disc = goal, user_disc(now.user, self._own)
        if self._goes_round and now.user is not None:
            aim, disc = self._leg(planner, now, now.user, goal)
        if aim is not self._aim:
            driver.go_to(aim)
            self._aim = aim
        command = self._command(driver, now, disc)
        left = driver.left if aim is goal else driver.left + aim.distance_to(goal)
        self._base.drive(command, self._source, left)
        there = aim is goal and driver.status == "arrived"
        if there or (passing and now.pose.distance_to(goal) <= passing):
            return "arrived"
        if self._progress is None:
            return None
        return self._progress.failure(ctx, left, goal.yaw - now.pose.yaw)

    def rest(self) -> None:
        """Drive no farther, and let the base stand, until there is a goal again."""
        self._base.release(self._source)
        if self._driver is not None:
            self._driver.release()
        self._goal = self._aim = None

    def _set_out_for(self, goal: Pose2, planner: GlobalPlanner) -> Driver:
        """The local planner, made when it is first needed, with this goal."""
        if self._driver is None:
            self._driver = self._made(planner)
        self._driver.planner = planner
        self._goal = goal
        if self._progress is not None:
            self._progress.begin_anew()
        if self._source == "haptic":
            self._base.grant(goal)
        return self._driver

    def _made(self, planner: GlobalPlanner) -> Driver:
        from states.navigation.planners import driver_of, straight_driver_of

        environment, name = self._environment, self._subsystem
        if self._straight:
            return straight_driver_of(environment, name, planner, self._speed)
        return driver_of(environment, name, planner, self._keeping, self._mode, self._speed)

    def _command(
        self, driver: Driver, now: extrapolated_state.RobotAndUser, user: Disc | None
    ) -> Twist2:
        """The driver's command (base frame) for the present poses and their uncertainty."""
        ctx, period = self._ctx, self._environment.period
        if self._straight:
            return driver.command(now.pose, now.twist, user, period, share=now.share)
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

    def _leg(
        self,
        planner: GlobalPlanner,
        now: extrapolated_state.RobotAndUser,
        user: UserPose,
        goal: Pose2,
    ) -> tuple[Pose2, Disc]:
        """What to drive to now, the goal or the way in to it, and the disc to keep out of.

        To a goal near the user the drive goes round them as far away as its own subsystem does, and
        comes in from outside; where there is no such way, as near as it has to.
        """
        own, kept = self._own, self._kept
        disc, here = wide_disc(user, own, kept, goal), (now.pose.x, now.pose.y)
        if not comes_in(now.pose, user, goal):
            outside = way_in(user, goal, own.user_radius)
            round_it = Disc(user.body.x, user.body.y, own.user_radius)
            if planner.plan(here, (outside.x, outside.y), round_it) is not None:
                return outside, round_it
        if planner.plan(here, (goal.x, goal.y), disc) is None:
            disc = Disc(disc.x, disc.y, kept.user_radius)
        return goal, disc


def _keeping(ctx: SignalReader, subsystem: SubsystemName, clearance: Clearance) -> SubsystemName:
    """The subsystem whose distances from walls and user are kept."""
    if clearance != "own":
        return clearance
    planner, here = planner_of(ctx, subsystem), ctx.value(BASE_POSE)
    if planner is None or here is None:
        return subsystem
    inflation = environment_of(ctx).navigation.named(subsystem).inflation
    is_narrow = planner.clearance((here.x, here.y)) < inflation - NARROW
    return "escape" if is_narrow else subsystem


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
        self._until, self._give_up = 0, math.inf

    def begin_anew(self) -> None:
        """Watch the way to another goal; how long there has been no path at all still counts."""
        self._least = math.inf

    def failure(self, ctx: DriveContext, length: float, turn: float) -> str | None:
        """`no_path` once the length of the path, m, has been infinite for NO_PATH_S.

        `stuck` once path and turn, rad, have not become less for the whole patience.
        """
        if length == math.inf:
            self._give_up = min(self._give_up, ctx.after(NO_PATH_S))
            return "no_path" if ctx.now >= self._give_up else None
        self._give_up, left = math.inf, length + abs(wrap(turn))
        nearer = left < self._least - self.STEP
        detour = left > self._least + self.LONGER
        if nearer or detour:
            self._least, self._until = left, ctx.after(self._patience)
        return None if ctx.now <= self._until else "stuck"
