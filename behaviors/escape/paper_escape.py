"""The paper's Escape: the user's two zones, and the first free pose (4.4.3, R104-R113)."""

from __future__ import annotations

from collections.abc import Sequence

from behaviors.choice import cheapest
from behaviors.escape.escape_drive import AWAY, can_stop, drive_to_goals
from behaviors.escape.zones import in_zone
from behaviors.situation import CHANGES, ESCAPE_POSES, READS, WAYS, Situation, situation
from engine import NEVER_NS, Action, Context, Monitor, On, Run, Until
from engine.files import Angle, Length, Speed
from hw import Pose2
from states.navigation import user_disc


class InEscapeZone(Monitor):
    """`inside` while a user who moves has the robot in one of their two zones (R104).

    The robot's centre is nearer than `ahead`, no farther than `half_view` off the direction in
    which they look, or nearer than `around` in any direction. They move faster than `moving`; 0 m/s
    is the literal rule of the paper.

    Args:
        ahead: the radius of the zone ahead of the user.
        half_view: how far it reaches to either side of their view.
        around: the radius of the zone all around them.
        moving: a user faster than this moves.

    Outcomes:
        inside: a user who moves has the robot in one of the zones.
    """

    outcomes = ("inside",)
    reads = READS
    policy = "paper"

    def __init__(self, ahead: Length, half_view: Angle, around: Length, moving: Speed) -> None:
        self.ahead, self.half_view, self.around = ahead, half_view, around
        self.moving = moving

    def run(self, ctx: Context) -> Run:
        news = On(*CHANGES)
        while (now := situation(ctx)) is None or not self._is_inside(now):
            yield news
        return "inside"

    def _is_inside(self, now: Situation) -> bool:
        return now.velocity.speed >= self.moving and in_zone(self, now.user, now.pose)


class OutOfEscapeZone(Monitor):
    """`outside` once the robot is out of both zones, and can stop where it is (R112).

    The zones are those of `InEscapeZone`, wider by the `hysteresis`. With `must_reach`, as after a
    failure of Chase, not before an Escape pose has been `reached`.

    Args:
        ahead: the radius of the zone ahead of the user.
        half_view: how far it reaches to either side of their view.
        around: the radius of the zone all around them.
        hysteresis: how much wider the zones are than for `InEscapeZone`.
        must_reach: whether an Escape pose has to have been reached first.
        reached: the Escape pose that has been reached.

    Outcomes:
        outside: the robot is out of both zones, and can stop where it is.
    """

    outcomes = ("outside",)
    reads = WAYS
    policy = "paper"

    def __init__(
        self,
        ahead: Length,
        half_view: Angle,
        around: Length,
        hysteresis: Length,
        must_reach: bool = False,
    ) -> None:
        self.ahead, self.half_view, self.around = ahead, half_view, around
        self.hysteresis, self.must_reach = hysteresis, must_reach

    def run(self, ctx: Context, reached: Pose2 | None = None) -> Run:
        if self.must_reach and reached is None:
            yield Until(NEVER_NS)
        while (now := situation(ctx, "escape")) is None or not self._is_outside(now):
            yield None
        return "outside"

    def _is_outside(self, now: Situation) -> bool:
        return not in_zone(self, now.user, now.pose, self.hysteresis) and can_stop(now)


class DriveToFirst(Action):
    """Drive to the first free Escape pose that can be reached, in the order of the profile (R106).

    As fast as possible, without turning, the arm as it is (R109-R111). The pose is kept until the
    way to it closes. While the pose of robot or user or the user's velocity is unknown it brakes.

    Outcomes:
        reached: the robot stands at the pose.
        no_way: no free pose can be reached.

    Outputs:
        pose: the Escape pose, map_from_base.
    """

    outcomes = ("reached", "no_way")
    outputs = {"reached": {"pose": Pose2}}
    reads = AWAY
    commands = ("base",)
    sideways = True
    policy = "paper"

    def run(self, ctx: Context) -> Run:
        return (yield from drive_to_goals(ctx, _kept_or_first))


def _kept_or_first(ctx: Context, now: Situation, present: Pose2 | None) -> Pose2 | None:
    """The pose driven to so far, else the first in reach."""
    return present or first_in_reach(now, ctx.value(ESCAPE_POSES) or ())


def first_in_reach(now: Situation, free: Sequence[Pose2]) -> Pose2 | None:
    """The first of the poses to which the way past the user is free, in the map; None without."""
    planner, here = now.planners["escape"], (now.pose.x, now.pose.y)
    disc = user_disc(now.user, now.environment.navigation.escape)

    def order(i: int) -> int | None:
        return i if planner.allows(here, (free[i].x, free[i].y), disc) else None

    first = cheapest(range(len(free)), order)
    return None if first is None else free[first]
