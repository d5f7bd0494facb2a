"""Making room: the robot keeps its distance from a user who walks towards it (R91)."""

from __future__ import annotations

from behaviors.situation import CHANGES, READS, WAYS, Situation, situation
from engine.files.units import Duration, Length, Speed
from engine.state import NEVER_NS, Action, Context, Monitor, On, Run, Until
from states.keys import BASE_REFUSAL
from states.signals.prediction import PREDICTORS

THINK_S = 0.2
"""How often a place is chosen anew while making room, s."""
SLACK = 0.2
"""Room is made until the user is farther than asked for by this, m."""


def is_crowded(now: Situation, room: float, ahead: float, walking: float) -> bool:
    """Does the user walk and, now or `ahead` seconds later, come nearer than `room`?

    The robot counts as where it would come to rest.
    """
    speed = now.velocity.speed
    if speed <= walking:
        return False
    rest, body = now.rest, now.user.body
    spare = rest.distance_to(body) - room
    if spare < 0.0:
        return True
    likely = [PREDICTORS[name] for name in now.settings.user.likely]
    return any(
        rest.distance_to(predictor.at(body, now.velocity, ahead, rest)) < room
        for predictor in likely
        if predictor.reach(speed, ahead) > spare
    )


class UserCrowds(Monitor):
    """`crowded` when the user walks and is, or will be in a moment, nearer than `room`; 0 m: never.

    While the user walks the robot stays 3 to 4 m away (R91).
    """

    outcomes = ("crowded",)
    reads = READS

    def __init__(self, room: Length = 0.0, ahead: Duration = 1.0, walking: Speed = 0.3) -> None:
        self.room, self.ahead, self.walking = room, ahead, walking

    def run(self, ctx: Context) -> Run:
        if self.room <= 0.0:
            yield Until(NEVER_NS)
        while True:
            now = situation(ctx)
            if now is not None and is_crowded(now, self.room, self.ahead, self.walking):
                return "crowded"
            yield On(*CHANGES)


class MakeRoom(Action):
    """Keep out of a walking user's way, until they have stopped or are far enough.

    Of places all around the robot it goes for the one from which the predicted walk stays between
    `room` and `far` best (R91).
    """

    outcomes = ("clear", "lost")
    reads = {**WAYS, BASE_REFUSAL: None}
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
        from behaviors.rollout import towards

        base, band = ctx.part("base"), (self.room, self.far)
        again, goal = 0, None
        try:
            while (now := situation(ctx, "chase", "escape")) is not None:
                if not is_crowded(now, self.room + SLACK, self.ahead, self.walking):
                    return "clear"
                if goal is None or ctx.now >= again:
                    again = ctx.after(THINK_S)
                    goal = place_with_room(now, band, goal)
                base.drive(now.slowed(towards(now, goal, "chase"), "chase"), "chase")
                yield ctx.value(BASE_REFUSAL)
        finally:
            base.release("chase")
        return "lost"
