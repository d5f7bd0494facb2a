"""A drive of the base under way: a command per tick towards a goal, and whether that gets nearer.

The states of `states.py` drive with it; those of behaviours that choose a goal or a disc anew in
every tick use its parts, `command_of`, `planner_of` and the discs.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Literal, Protocol

from engine.files import Duration, Speed
from hw import OLD_S, DriveMode, Pose2, Twist2, UserPose, wrap
from hw.scene import Disc, Point
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

    A context manager: whatever ends it, the base is released and gets its mode back. `clearance`,
    `mode`, `patience` and `speed` are those of `DriveTo`; the pose of the base is known.
    """

    def __init__(
        self,
        ctx: DriveContext,
        subsystem: SubsystemName,
        clearance: Clearance,
        mode: DriveMode,
        patience: Duration = 3.0,
        speed: Speed | None = None,
    ) -> None:
        self._ctx, self._base, self._environment = ctx, ctx.part("base"), environment_of(ctx)
        self._subsystem, self._mode, self._before = subsystem, mode, ctx.value(BASE_MODE)
        self._keeping = _keeping(ctx, subsystem, clearance)
        self._planner = planner_key(self._keeping)
        named = self._environment.navigation.named
        self._own, self._kept = named(subsystem), named(self._keeping)
        self._speed = math.inf if speed is None else speed
        self._driver: LocalPlanner | None = None
        self._goal: Pose2 | None = None
        self._progress = GoalProgress(patience)

    def __enter__(self) -> BaseDrive:
        if self._mode != self._before:
            self._base.use(self._mode)
        return self

    def __exit__(self, *_: object) -> None:
        self._base.release(self._subsystem)
        if self._before not in (self._mode, None):
            self._base.use(self._before)
        if self._subsystem == "haptic":
            self._base.grant(None)

    @property
    def is_lost(self) -> bool:
        """Whether poses or scans are missing, so that it cannot even begin."""
        return extrapolated_state.around(self._ctx) is None or self.planner is None

    @property
    def planner(self) -> GlobalPlanner | None:
        """The planner with the distances that are kept; None if its scans are too old."""
        return self._ctx.value(self._planner)

    def towards(self, goal: Pose2, passing: float = 0.0) -> str | None:
        """Send this tick's command; None while the goal is ahead, else the outcome of the drive.

        `arrived`: it stands at the goal, or, with `passing`, is within that distance of it, m;
        the others are those of `DriveTo`.
        """
        ctx = self._ctx
        now, planner = extrapolated_state.around(ctx), ctx.value(self._planner)
        if now is None or planner is None:
            return "lost"
        driver = self._driver
        if driver is None or goal is not self._goal:
            driver = self._set_out_for(goal, planner)
        driver.planner = planner
        if self._kept is self._own or now.user is None:
            disc = user_disc(now.user, self._own)
        else:
            disc = self._disc_between(planner, now, now.user, goal)
        command = command_of(ctx, driver, now, disc, self._environment.period)
        left = math.inf if driver.path is None else driver.path.length
        self._base.drive(command, self._subsystem, left)
        if driver.status == "arrived" or (passing and now.pose.distance_to(goal) <= passing):
            return "arrived"
        return self._progress.failure(ctx, left, goal.yaw - now.pose.yaw)

    def rest(self) -> None:
        """Drive no farther, and let the base stand, until there is a goal again."""
        self._base.release(self._subsystem)
        if self._driver is not None:
            self._driver.release()
        self._goal = None

    def _set_out_for(self, goal: Pose2, planner: GlobalPlanner) -> LocalPlanner:
        """The local planner, made when it is first needed, with this goal."""
        if self._driver is None:
            from states.navigation.planners import driver_of

            named = self._subsystem, planner, self._keeping, self._mode
            self._driver = driver_of(self._environment, *named, self._speed)
        self._driver.planner = planner
        self._goal = goal
        self._driver.go_to(goal)
        self._progress.begin_anew()
        if self._subsystem == "haptic":
            self._base.grant(goal)
        return self._driver

    def _disc_between(
        self,
        planner: GlobalPlanner,
        now: extrapolated_state.RobotAndUser,
        user: UserPose,
        goal: Pose2,
    ) -> Disc | None:
        """The disc around the user to keep out of: the wide one if there is a path around it."""
        wide = wide_disc(user, self._own, self._kept, goal)
        path = planner.plan((now.pose.x, now.pose.y), (goal.x, goal.y), wide)
        return user_disc(user, self._kept) if path is None else wide


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


def place_near(planner: GlobalPlanner, here: Point, user: Point, near: float) -> Point | None:
    """The first place within `near`, m, of a user on the path to them; None without a path."""
    end = user if planner.is_free(user) else planner.nearest_free(user)
    path = None if end is None else planner.plan(here, end)
    return None if path is None else place_at(path.points, user, near)


def place_at(path: Sequence[Point], user: Point, near: float) -> Point:
    """The first point of a path within `near`, m, of the user; without one, the path's end.

    With d the segment and f from the user to its start, |f + share d| = near is a quadratic in
    `share`; the smaller root is where the path enters the circle.
    """
    for start, end in itertools.pairwise(path):
        if math.dist(end, user) > near:
            continue
        dx, dy = end[0] - start[0], end[1] - start[1]
        fx, fy = start[0] - user[0], start[1] - user[1]
        square, along = dx * dx + dy * dy, fx * dx + fy * dy
        outside = fx * fx + fy * fy - near * near
        root = math.sqrt(max(0.0, along * along - square * outside))
        share = min(1.0, max(0.0, (-along - root) / square)) if square > 0.0 else 0.0
        return start[0] + share * dx, start[1] + share * dy
    return path[-1]
