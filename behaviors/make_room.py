"""Making room: the robot keeps its distance from a user who walks towards it (R91)."""

from __future__ import annotations

from collections.abc import Mapping

from behaviors.person import turns_at_it
from behaviors.situation import CHANGES, READS, TURN_ROOM, WAYS, Situation, situation
from engine import NEVER_NS, Action, Context, Monitor, On, Run, Until
from engine.files import Duration, Length, Speed
from states.environment import BASE_REFUSAL, USER_STANDS_SINCE
from states.signals import PREDICTORS

THINK_S = 0.2
"""Interval at which the place to drive to is chosen again, s."""
TURNING = 0.4
"""A standing user who turns faster than this, rad/s, may set off."""
WATCHED = 4.5
"""… and then crowds a robot nearer than this, m. Clearing the path of a user at 1.5 m/s by 1.27 m
takes 1.27 + 1.5 (1.6 + 0.15 + 0.3) = 4.3 m: the drive, the reaction, and the delay of the velocity
estimate. The remaining distance is gained while the user turns."""
SETTLED_NS = 1_000_000_000
"""After standing this long a turn is read as the start of a walk; otherwise only within
TURN_ROOM."""
SLACK = 0.2
"""Hysteresis: the robot makes room until the user is farther away than `room` by this, m."""
WATCHES: Mapping[str, float | None] = {**READS, USER_STANDS_SINCE: None}
"""`reads` of a state that calls `watched_from`."""


def watched_from(ctx: Context) -> float:
    """How near to the robot, m, a standing user crowds it by turning towards it."""
    since = ctx.value(USER_STANDS_SINCE)
    settled = since is not None and ctx.now - since >= SETTLED_NS
    return WATCHED if settled else TURN_ROOM


def is_crowded(
    now: Situation, room: float, ahead: float, walking: float, watched: float = WATCHED
) -> bool:
    """True if the user walks and is nearer than `room`, m, or likely will be in `ahead` seconds.

    Walking means faster than `walking`, m/s; or they stand, and turn towards the robot, nearer
    than `watched`, m. Distances are to where it would come to rest.
    """
    speed, rate, body = now.velocity.speed, now.velocity.wz, now.user.body
    if speed <= walking and abs(rate) <= TURNING:
        return False
    rest = now.rest
    distance = rest.distance_to(body)
    if speed <= walking:
        contact = now.settings.escape.contact
        turns = distance < watched
        return turns and turns_at_it(body.bearing_to(rest), distance, rate, contact)
    spare = distance - room
    if spare < 0.0:
        return True
    likely = [PREDICTORS[name] for name in now.settings.user.likely]
    return any(
        rest.distance_to(predictor.at(body, now.velocity, ahead, rest)) < room
        for predictor in likely
        if predictor.reach(speed, ahead) > spare
    )


class UserCrowds(Monitor):
    """`crowded` when the user walks and is nearer than `room`, or will be in `ahead` seconds.

    While the user walks the robot stays 3 to 4 m away (R91). A turn on the spot towards the robot,
    as before a walk, counts as crowding. With a `room` of 0 m it never ends.
    """

    outcomes = ("crowded",)
    reads = WATCHES

    def __init__(self, room: Length = 0.0, ahead: Duration = 1.0, walking: Speed = 0.3) -> None:
        self.room, self.ahead, self.walking = room, ahead, walking

    def run(self, ctx: Context) -> Run:
        if self.room <= 0.0:
            yield Until(NEVER_NS)
        news = On(*CHANGES)
        while True:
            now = situation(ctx)
            watched = watched_from(ctx)
            if now is not None and is_crowded(now, self.room, self.ahead, self.walking, watched):
                return "crowded"
            yield news


class MakeRoom(Action):
    """Keep out of a walking user's way until they have stopped or are far enough away.

    Of places all around it the robot drives to the one that keeps the predicted distance to the
    user between `room` and `far` best (R91).
    """

    outcomes = ("clear", "lost")
    reads = {**WAYS, **WATCHES, BASE_REFUSAL: None}
    commands = ("base",)

    def __init__(
        self,
        room: Length = 3.0,
        far: Length = 4.0,
        ahead: Duration = 1.0,
        walking: Speed = 0.2,
    ) -> None:
        self.room, self.far, self.ahead, self.walking = room, far, ahead, walking

    def run(self, ctx: Context) -> Run:
        from behaviors.dodge import place_with_room
        from behaviors.straight_drive import command_towards

        base, band = ctx.part("base"), (self.room, self.far)
        again, found = 0, None
        try:
            while (now := situation(ctx, "chase", "escape")) is not None:
                watched = watched_from(ctx)
                if not is_crowded(now, self.room + SLACK, self.ahead, self.walking, watched):
                    return "clear"
                if found is None or ctx.now >= again:
                    again = ctx.after(THINK_S)
                    found = place_with_room(now, band, None if found is None else found[0])
                goal, keeps = found
                command = command_towards(now, goal, "chase", keeps)
                base.drive(now.slowed(command, "chase"), "chase")
                yield ctx.value(BASE_REFUSAL)
        finally:
            base.release("chase")
        return "lost"
