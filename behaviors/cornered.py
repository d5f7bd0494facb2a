"""Chase without a free place: what the robot does then, and how it leaves the user's zones."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

from behaviors.profile import EscapeSettings
from behaviors.refuge import KEEPS, SLOWLY, is_outside, refuge, way_out
from behaviors.situation import CHANGES, SETTINGS, WAYS, Situation, settings_of, situation
from behaviors.zones import in_zone
from engine import NEVER_NS, Action, Context, Monitor, On, Run, Until
from engine.files import Duration, Length, Speed
from hw import Pose2, UserPose
from hw.scene import Point
from states.environment import BASE_REFUSAL, USER_VELOCITY, extrapolated_state
from states.navigation import DRIVES, command_of, user_disc

NEAR, NEAR_S = 1.9, 1.0
"""A user nearer than NEAR, m, who sets off towards the robot at 1 m/s cannot be warned in time."""
LOOK_S = 1.0
"""Interval at which a robot without a way out looks for one again, s."""


class GiveUp(Monitor):
    """`failed` when Chase has had no free place for `after`; never if the profile `stays`.

    Having no free place is not a danger in itself; the Escape trigger still applies (R66, R101).
    """

    outcomes = ("failed",)
    reads = {SETTINGS: None}

    def __init__(self, after: Duration = 1.0) -> None:
        self.after = after

    def run(self, ctx: Context) -> Run:
        yield Until(NEVER_NS if settings_of(ctx).chase.stays else ctx.after(self.after))
        return "failed"


class Cornered(Monitor):
    """`cornered` when the robot has stood in a zone of a standing user for `patience`, no way out.

    After NEAR_S for a user nearer than NEAR: if they set off towards it, a sign would come too
    late. Not for a user to whom the robot was `shown` where they stand, within `moved`. A patience
    of 0 s: never.
    """

    outcomes = ("cornered",)
    reads = WAYS

    def __init__(self, patience: Duration = 0.0, moved: Length = 0.3) -> None:
        self.patience, self.moved = patience, moved

    def run(self, ctx: Context, shown: UserPose | None = None) -> Run:
        if self.patience <= 0.0:
            yield Until(NEVER_NS)
        due, news, escape = NEVER_NS, On(*CHANGES), settings_of(ctx).escape
        while True:
            now = situation(ctx, "escape") if self._is_close(ctx, escape, shown) else None
            if now is None:
                due = NEVER_NS
            elif due == NEVER_NS:
                soon = NEAR_S if now.distance < NEAR else self.patience
                due = ctx.after(min(soon, self.patience))
            elif ctx.now >= due:
                if way_out(now) is None:
                    return "cornered"
                due = ctx.after(LOOK_S)
            yield news if due == NEVER_NS else On(*CHANGES, until=due)

    def _is_close(self, ctx: Context, escape: EscapeSettings, shown: UserPose | None) -> bool:
        """True if the user stands, and the robot is in a zone of theirs, and not as `shown`."""
        velocity = ctx.value(USER_VELOCITY)
        if velocity is None or velocity.speed >= escape.moving:
            return False
        robot, person = extrapolated_state.robot(ctx), extrapolated_state.user(ctx)
        if robot is None or person is None:
            return False
        user = person[0]
        if shown is not None and shown.body.distance_to(user.body) <= self.moved:
            return False
        return in_zone(escape, user, robot[0], escape.hysteresis)


class Leave(Action):
    """Drive slowly out of the zones of a user to whom the robot has just been shown (R116).

    The robot stays visible on the way, without the stop sign. `away`: outside, not shown at all, or
    the user has gone farther than `moved` from where it was shown to them, or sets off, faster than
    `walking`. `blocked`: there is no way out.
    """

    outcomes = ("away", "blocked")
    reads = {**WAYS, **DRIVES}
    commands = ("base", "vr")

    def __init__(self, speed: Speed = SLOWLY, moved: Length = 0.3, walking: Speed = 0.3) -> None:
        self.speed, self.moved, self.walking = speed, moved, walking

    def run(self, ctx: Context, shown: UserPose | None = None) -> Run:
        now = situation(ctx, "escape")
        if shown is None or now is None or is_outside(now):
            return "away"
        if shown.body.distance_to(now.user.body) > self.moved:
            return "away"
        place = way_out(now)
        if place is None:
            return "blocked"
        vr = ctx.part("vr")
        vr.inform(True, sign=False)
        try:
            is_away = yield from _drive_to(ctx, now, place, self.speed, self._is_away, way_out)
        finally:
            vr.inform(False)
        return "away" if is_away else "blocked"

    def _is_away(self, now: Situation) -> bool:
        return is_outside(now) or now.velocity.speed > self.walking


class Withdraw(Action):
    """Drive slowly to the best place to wait outside the user's zones; stand if there is none.

    For a robot that has no place near the user (R101), by a profile in which it `stays`.
    """

    outcomes = ()
    reads = {**WAYS, **DRIVES}
    commands = ("base",)

    def __init__(self, speed: Speed = SLOWLY) -> None:
        self.speed = speed

    def run(self, ctx: Context) -> Run:
        if not settings_of(ctx).chase.stays:
            yield Until(NEVER_NS)
        while True:
            now = situation(ctx, "escape")
            place = None if now is None else refuge(now)
            if now is not None and place is not None:
                yield from _drive_to(ctx, now, place, self.speed)
            yield Until(ctx.after(LOOK_S))


def _drive_to(
    ctx: Context,
    begun: Situation,
    place: Point,
    speed: float,
    until: Callable[[Situation], bool] | None = None,
    better: Callable[[Situation], Point | None] | None = None,
) -> Generator[Any, None, bool]:
    """Drive to this place; with `until` true once that holds, false if it does not on the way.

    m in the map, at up to `speed`, m/s, without turning, with Escape's distance from walls. Each
    LOOK_S `better` is asked again: of two ways of the same length the robot may have taken the
    other one.
    """
    from states.navigation import driver_of

    base, navigation = ctx.part("base"), begun.environment.navigation
    driver = driver_of(begun.environment, "escape", begun.planners["escape"])
    driver.go_to(Pose2(*place, begun.pose.yaw))
    again = NEVER_NS if better is None else ctx.after(LOOK_S)
    try:
        while (now := situation(ctx, "escape")) is not None:
            if until is not None and until(now):
                return True
            driver.planner = now.planners["escape"]
            if better is not None and ctx.now >= again:
                again = ctx.after(LOOK_S)
                found = better(now)
                if found not in (None, place):
                    place = found
                    driver.go_to(Pose2(*place, begun.pose.yaw))
            disc, period = user_disc(now.user, navigation.named(KEEPS)), now.environment.period
            command = command_of(ctx, driver, now.around, disc, period)
            if driver.status == "arrived":
                return until is None
            if driver.path is None:
                return False
            share = speed / navigation.escape.max_speed
            base.drive(now.environment.slowed(command, share, "escape"), "chase")
            yield ctx.value(BASE_REFUSAL)
    finally:
        base.release("chase")
    return False
