"""Making room: the robot keeps its distance from a user who walks towards it (R91)."""

from __future__ import annotations

from collections.abc import Mapping

from behaviors import person
from behaviors.situation import CHANGES, READS, WAYS, Situation, situation
from engine import NEVER_NS, Action, Context, Monitor, On, Run, Until
from engine.files import Duration, Length, Speed
from hw import Pose2
from states.environment import BASE_REFUSAL, USER_STANDS_SINCE
from states.navigation import DRIVES, BaseDrive
from states.signals import PREDICTORS

WATCHES: Mapping[str, float | None] = {**READS, USER_STANDS_SINCE: None}
"""`reads` of a state that asks whether the user has settled."""


def has_settled(ctx: Context, now: Situation) -> bool:
    """True if the user has stood for so long that a turn begins a walk."""
    since = ctx.value(USER_STANDS_SINCE)
    return since is not None and ctx.now - since >= now.settings.user.beside.settled * 1e9


def is_crowded(
    now: Situation,
    room: float,
    ahead: float,
    walking: float,
    settled: bool = True,
    again: bool = False,
) -> bool:
    """True if the user walks and is nearer than `room`, m, or likely will be in `ahead` seconds.

    Walking means faster than `walking`, m/s; or they stand, turn towards the robot, and a walk on
    such a line would leave it too little margin. One who has not `settled` turns on the way, mostly
    past it: then the turn counts within the profile's `turn`. Distances are to where the robot
    comes to rest. A robot that was crowded before is so `again` within a little more room.
    """
    speed, body, user = now.velocity.speed, now.user.body, now.settings.user
    if speed <= walking and abs(now.velocity.wz) <= user.walks.turning:
        return False
    rest = now.rest
    distance = rest.distance_to(body)
    if speed <= walking:
        near = person.watched_from(now) if settled else user.beside.turn
        return distance < near and person.turns_at_it(now)
    room += user.beside.slack if again else 0.0
    spare = distance - room
    if spare < 0.0:
        return True
    likely = [PREDICTORS[name] for name in user.likely]
    return any(
        rest.distance_to(predictor.at(body, now.velocity, ahead, rest)) < room
        for predictor in likely
        if predictor.reach(speed, ahead) > spare
    )


class UserCrowds(Monitor):
    """`crowded` when the user walks and is nearer than `room`, or will be in `ahead` seconds.

    While the user walks the robot stays 3 to 4 m away (R91). A turn on the spot towards the robot,
    as before a walk, counts as crowding. With a `room` of 0 m it never ends.

    Args:
        room: how near a walking user may come; 0 m: this never ends.
        ahead: how far ahead to predict the user.
        walking: a user faster than this walks.

    Outcomes:
        crowded: the user walks and is nearer than `room`, or will be, or turns towards the robot as
            before a walk.
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
            if now is not None and is_crowded(
                now, self.room, self.ahead, self.walking, has_settled(ctx, now)
            ):
                return "crowded"
            yield news


class MakeRoom(Action):
    """Keep out of a walking user's way until they have stopped or are far enough away.

    Of places all around it the robot drives to the one that keeps the predicted distance to the
    user between `room` and `far` best (R91).

    Args:
        room: the nearest that the user should be.
        far: the farthest that the user should be.
        ahead: how far ahead to predict the user.
        walking: a user faster than this walks.

    Outcomes:
        clear: the user has stopped, or is far enough away.
        lost: the pose of base or user is lost.
    """

    outcomes = ("clear", "lost")
    reads = {**WAYS, **DRIVES, **WATCHES}
    commands = ("base",)
    sideways = True

    def __init__(
        self,
        room: Length = 3.0,
        far: Length = 4.0,
        ahead: Duration = 1.0,
        walking: Speed = 0.2,
    ) -> None:
        self.room, self.far, self.ahead, self.walking = room, far, ahead, walking

    def run(self, ctx: Context) -> Run:
        from behaviors.chase.beside import place_with_room

        band, due = (self.room, self.far), 0
        goal: Pose2 | None = None
        with BaseDrive(ctx, "chase", "chase", patience=None, straight=True) as drive:
            while (now := situation(ctx, "chase", "escape")) is not None:
                if not self._is_crowded(now, has_settled(ctx, now)):
                    return "clear"
                if goal is None or ctx.now >= due:
                    due = ctx.after(now.settings.user.beside.again)
                    present = None if goal is None else (goal.x, goal.y)
                    place, keeps = place_with_room(now, band, present)
                    drive.keep(keeps)
                    goal = Pose2(*place)
                drive.towards(goal, now=now.around)
                yield ctx.value(BASE_REFUSAL)
        return "lost"

    def _is_crowded(self, now: Situation, settled: bool) -> bool:
        return is_crowded(now, self.room, self.ahead, self.walking, settled, again=True)
