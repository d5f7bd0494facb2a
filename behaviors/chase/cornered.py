"""Chase without a free place: what the robot does then, and how it leaves the user's zones."""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Annotated, Any

from behaviors.chase.refuge import KEEPS, is_outside, refuge, way_out
from behaviors.escape import in_zone
from behaviors.profile import EscapeSettings, LeaveSettings, Settings
from behaviors.situation import CHANGES, WAYS, Situation, settings_of, situation
from engine import NEVER_NS, Action, Context, Monitor, On, Run, Until
from engine.files import Duration, Length, Speed
from engine.files.declared import ABOVE_0
from hw import Pose2, UserPose
from hw.scene import Point
from states.environment import BASE_REFUSAL, USER_VELOCITY, extrapolated_state
from states.navigation import DRIVES, BaseDrive


class Cornered(Monitor):
    """`cornered` when the robot has stood in a zone of a standing user for `patience`, no way out.

    After `near_for` for a user nearer than `near`: if they set off towards it, a sign would come
    too late. Not for a user to whom the robot was `shown` where they stand, within `moved`.

    Args:
        patience: how long it has to have stood there; by default the profile's.
        moved: a user who has gone farther than this since `shown` counts as not shown; by default
            the profile's.
        near: for a user nearer than this, `near_for` counts instead of `patience`; by default the
            profile's.
        near_for: how long for such a user; by default the profile's.
        shown: the pose of the user when the robot was last shown to them.

    Outcomes:
        cornered: the robot has stood there for that long, and there is no way out.
    """

    policy = "tuned"
    outcomes = ("cornered",)
    reads = WAYS

    def __init__(
        self,
        patience: Annotated[Duration, ABOVE_0] | None = None,
        moved: Length | None = None,
        near: Length | None = None,
        near_for: Duration | None = None,
    ) -> None:
        self.patience = patience
        self.values = _given(moved=moved, near=near, near_for=near_for)

    def run(self, ctx: Context, shown: UserPose | None = None) -> Run:
        due, news, settings = NEVER_NS, On(*CHANGES), settings_of(ctx)
        patience, leave = self.patience or settings.chase.cornered, self.values(settings)
        while True:
            is_close = self._is_close(ctx, settings.escape, shown, leave.moved)
            now = situation(ctx, "escape") if is_close else None
            if now is None:
                due = NEVER_NS
            elif due == NEVER_NS:
                soon = leave.near_for if now.distance < leave.near else patience
                due = ctx.after(min(soon, patience))
            elif ctx.now >= due:
                if way_out(now) is None:
                    return "cornered"
                due = ctx.after(leave.look_again)
            yield news if due == NEVER_NS else On(*CHANGES, until=due)

    def _is_close(
        self, ctx: Context, escape: EscapeSettings, shown: UserPose | None, moved: float
    ) -> bool:
        """True if the user stands, and the robot is in a zone of theirs, and not as `shown`."""
        velocity = ctx.value(USER_VELOCITY)
        if velocity is None or velocity.speed >= escape.moving:
            return False
        robot, person = extrapolated_state.robot(ctx), extrapolated_state.user(ctx)
        if robot is None or person is None:
            return False
        user = person[0]
        if shown is not None and shown.body.distance_to(user.body) <= moved:
            return False
        return in_zone(escape, user, robot[0], escape.hysteresis)


class Leave(Action):
    """Drive slowly out of the zones of a user to whom the robot has just been shown (R116).

    The robot stays visible on the way, without the stop sign.

    Args:
        speed: the fastest it drives; by default the profile's.
        moved: a user who has gone farther than this since `shown` is `away`; by default the
            profile's.
        walking: a user faster than this is `away`; by default the profile's.
        shown: the pose of the user when the robot was shown to them.

    Outcomes:
        away: the robot is outside, was not shown at all, or the user has gone farther than `moved`
            from where it was shown to them, or sets off, faster than `walking`.
        blocked: there is no way out, or the drive has ended on its way.
    """

    policy = "tuned"
    outcomes = ("away", "blocked")
    reads = {**WAYS, **DRIVES}
    commands = ("base", "vr")

    def __init__(
        self,
        speed: Annotated[Speed, ABOVE_0] | None = None,
        moved: Length | None = None,
        walking: Speed | None = None,
    ) -> None:
        self.values = _given(speed=speed, moved=moved, walking=walking)

    def run(self, ctx: Context, shown: UserPose | None = None) -> Run:
        now, leave = situation(ctx, "escape"), self.values(settings_of(ctx))
        if shown is None or now is None or is_outside(now):
            return "away"
        if shown.body.distance_to(now.user.body) > leave.moved:
            return "away"

        def is_away(now: Situation) -> bool:
            return is_outside(now) or now.velocity.speed > leave.walking

        place = way_out(now)
        if place is None:
            return "blocked"
        vr = ctx.part("vr")
        vr.inform(True, sign=False)
        try:
            left = yield from _drive_to(ctx, now, place, leave.speed, is_away, way_out)
        finally:
            vr.inform(False)
        return "away" if left else "blocked"


class Withdraw(Action):
    """Drive slowly to the best place to wait outside the user's zones; stand if there is none.

    For a robot that has no place near the user (R101).

    Args:
        speed: the fastest it drives; by default the profile's.
    """

    policy = "tuned"
    outcomes = ()
    reads = {**WAYS, **DRIVES}
    commands = ("base",)

    def __init__(self, speed: Annotated[Speed, ABOVE_0] | None = None) -> None:
        self.values = _given(speed=speed)

    def run(self, ctx: Context) -> Run:
        leave = self.values(settings_of(ctx))
        while True:
            now = situation(ctx, "escape")
            place = None if now is None else refuge(now)
            if now is not None and place is not None:
                yield from _drive_to(ctx, now, place, leave.speed)
            yield Until(ctx.after(leave.look_again))


def _given(**parameters: float | None) -> Callable[[Settings], LeaveSettings]:
    """The profile's values with those parameters of a node that are given."""
    own: dict[str, Any] = {name: v for name, v in parameters.items() if v is not None}
    return lambda settings: replace(settings.chase.leave, **own)


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
