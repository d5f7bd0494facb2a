"""Chase without a free place: what the robot does then, and how it leaves the user's zones."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Annotated, Any

from behaviors.profile import EscapeSettings
from behaviors.refuge import KEEPS, is_outside, refuge, way_out
from behaviors.situation import CHANGES, WAYS, Situation, settings_of, situation
from behaviors.zones import in_zone
from engine import NEVER_NS, Action, Context, Monitor, On, Run, Until
from engine.files import Duration, Length, Speed
from engine.files.declared import ABOVE_0
from hw import Pose2, UserPose
from hw.scene import Point
from states.environment import BASE_REFUSAL, USER_VELOCITY, extrapolated_state
from states.navigation import DRIVES, BaseDrive


class Cornered(Monitor):
    """`cornered` when the robot has stood in a zone of a standing user for `patience`, no way out.

    After `soon` for a user nearer than `near`: if they set off towards it, a sign would come too
    late. Not for a user to whom the robot was `shown` where they stand, within `moved`.
    """

    policy = "tuned"
    outcomes = ("cornered",)
    reads = WAYS

    def __init__(
        self,
        patience: Annotated[Duration, ABOVE_0] = 10.0,
        moved: Length = 0.3,
        near: Length = 1.9,
        soon: Duration = 1.0,
    ) -> None:
        self.patience, self.moved, self.near, self.soon = patience, moved, near, soon

    def run(self, ctx: Context, shown: UserPose | None = None) -> Run:
        due, news, escape = NEVER_NS, On(*CHANGES), settings_of(ctx).escape
        while True:
            now = situation(ctx, "escape") if self._is_close(ctx, escape, shown) else None
            if now is None:
                due = NEVER_NS
            elif due == NEVER_NS:
                soon = self.soon if now.distance < self.near else self.patience
                due = ctx.after(min(soon, self.patience))
            elif ctx.now >= due:
                if way_out(now) is None:
                    return "cornered"
                due = ctx.after(now.settings.chase.leave.look_again)
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
    `walking`. `blocked`: there is no way out. `speed`: by default the profile's.
    """

    policy = "tuned"
    outcomes = ("away", "blocked")
    reads = {**WAYS, **DRIVES}
    commands = ("base", "vr")

    def __init__(
        self,
        speed: Annotated[Speed, ABOVE_0] | None = None,
        moved: Length = 0.3,
        walking: Speed = 0.3,
    ) -> None:
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
            speed = self.speed or now.settings.chase.leave.speed
            is_away = yield from _drive_to(ctx, now, place, speed, self._is_away, way_out)
        finally:
            vr.inform(False)
        return "away" if is_away else "blocked"

    def _is_away(self, now: Situation) -> bool:
        return is_outside(now) or now.velocity.speed > self.walking


class Withdraw(Action):
    """Drive slowly to the best place to wait outside the user's zones; stand if there is none.

    For a robot that has no place near the user (R101). `speed`: by default the profile's.
    """

    policy = "tuned"
    outcomes = ()
    reads = {**WAYS, **DRIVES}
    commands = ("base",)

    def __init__(self, speed: Annotated[Speed, ABOVE_0] | None = None) -> None:
        self.speed = speed

    def run(self, ctx: Context) -> Run:
        leave = settings_of(ctx).chase.leave
        while True:
            now = situation(ctx, "escape")
            place = None if now is None else refuge(now)
            if now is not None and place is not None:
                yield from _drive_to(ctx, now, place, self.speed or leave.speed)
            yield Until(ctx.after(leave.look_again))


def _drive_to(
    ctx: Context,
    begun: Situation,
    place: Point,
    speed: float,
    until: Callable[[Situation], bool] | None = None,
    better: Callable[[Situation], Point | None] | None = None,
) -> Generator[Any, None, bool]:
    """Drive to this place; with `until` true once that holds, false if it does not on the way.

    m in the map, at up to `speed`, m/s, without turning, with Escape's distance from walls. From
    time to time `better` is asked again: of two ways of the same length the robot may have taken
    the other one.
    """
    goal = Pose2(*place, begun.pose.yaw)
    look_again = begun.settings.chase.leave.look_again
    again = NEVER_NS if better is None else ctx.after(look_again)
    drives = BaseDrive(ctx, "escape", "escape", speed=speed, apart=KEEPS, source="chase")
    with drives as drive:
        while (now := situation(ctx, "escape")) is not None:
            if until is not None and until(now):
                return True
            if better is not None and ctx.now >= again:
                again = ctx.after(look_again)
                found = better(now)
                if found not in (None, place):
                    place = found
                    goal = Pose2(*place, begun.pose.yaw)
            ended = drive.towards(goal, now=now.around)
            if ended is not None:
                return ended == "arrived" and until is None
            yield ctx.value(BASE_REFUSAL)
    return False
