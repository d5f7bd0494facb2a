"""How a person walks away from the robot that is shown to them."""

from __future__ import annotations

import math
import random

from hw.geometry import Pose2, wrap
from hw.samples import USER_RADIUS
from hw.scene import Point, Room

BEFORE, ENOUGH, CLOSE = 2.5, 3.0, 1.27
"""A person nearer than BEFORE to the shown robot walks away to ENOUGH, on the way no nearer than
CLOSE, or than they were; between centres, m."""
PACES = (0.8, 1.2)
"""Range of the speed of walking away, m/s."""

_ASIDE = tuple(math.radians(side * angle) for angle in range(0, 106, 15) for side in (1, -1))
_STRIDE, _LONGEST, _WORTH = 0.1, 4.0, 0.2


class Leaving:
    """Walks a person away from the shown robot after a while, or aside where a wall is.

    They go straight, stop about 3 m away or where there is no more room, and wait there. `waits_s`
    is the range of the time before they set off, drawn each time; None: they never do.
    """

    def __init__(
        self,
        room: Room,
        waits_s: tuple[float, float] | None,
        turn_rate: float,
        chance: random.Random,
    ) -> None:
        self._room, self._waits_s, self._turn_rate = room, waits_s, turn_rate
        self._chance = chance
        self._due_ns: int | None = None
        self._goal: Point | None = None
        self._pace = 0.0

    @property
    def under_way(self) -> bool:
        """True while they walk away."""
        return self._goal is not None

    def begin(self, now_ns: int) -> None:
        """The robot has come into view: they may leave after a while."""
        self._goal, self._due_ns = None, self._drawn(now_ns)

    def end(self) -> None:
        """The robot is hidden: they stop where they are."""
        self._goal = self._due_ns = None

    def step(self, here: Pose2, robot: Point, now_ns: int, span_s: float) -> tuple[Pose2, float]:
        """Where a person who stands or leaves is after `span_s`, and their speed in m/s."""
        if self._goal is None:
            self._decide(here, robot, now_ns)
        if self._goal is None:
            return here, 0.0
        left = math.dist((here.x, here.y), self._goal)
        if left < 1e-6 or math.dist((here.x, here.y), robot) >= ENOUGH:
            self._goal = None
            return here, 0.0
        return self._walk(here, robot, self._goal, span_s)

    def _decide(self, here: Pose2, robot: Point, now_ns: int) -> None:
        if math.dist((here.x, here.y), robot) >= BEFORE:
            self._due_ns = None
        elif self._due_ns is None:
            self._due_ns = self._drawn(now_ns)
        elif now_ns >= self._due_ns:
            self._due_ns = None
            self._goal = self._way_out((here.x, here.y), robot)
            self._pace = self._chance.uniform(*PACES)

    def _drawn(self, now_ns: int) -> int | None:
        if self._waits_s is None:
            return None
        return now_ns + round(self._chance.uniform(*self._waits_s) * 1e9)

    def _walk(self, here: Pose2, robot: Point, goal: Point, span_s: float) -> tuple[Pose2, float]:
        """Turn towards the goal, then walk; stop if that would bring them nearer to the robot."""
        there, speed = walked(here, goal, self._pace, self._turn_rate, span_s)
        if _nears((here.x, here.y), (there.x, there.y), robot):
            self._goal = None
            return here, 0.0
        return there, speed

    def _way_out(self, here: Point, robot: Point) -> Point | None:
        """The end of the straight way that leads farthest away; None if none is worth while."""
        away = math.atan2(here[1] - robot[1], here[0] - robot[0])
        best, most = None, math.dist(here, robot) + _WORTH
        for aside in _ASIDE:
            end = self._end_of(here, away + aside, robot)
            gap = math.dist(end, robot)
            if gap >= ENOUGH:
                return end
            if gap > most:
                best, most = end, gap
        return best

    def _end_of(self, here: Point, direction: float, robot: Point) -> Point:
        """Where a straight way ends: ENOUGH away from the robot, or before a wall."""
        free = min(USER_RADIUS, self._room.clearance(*here))
        end, steps = here, 0
        while math.dist(end, robot) < ENOUGH and steps * _STRIDE < _LONGEST:
            steps += 1
            x = here[0] + steps * _STRIDE * math.cos(direction)
            y = here[1] + steps * _STRIDE * math.sin(direction)
            if self._room.clearance(x, y) < free or _nears(here, (x, y), robot):
                return end
            end = x, y
        return end


def turned(here: Pose2, yaw: float, rate: float, span_s: float) -> Pose2:
    """A person who turns on the spot to a yaw, at `rate` in rad/s, after `span_s` of it."""
    turn, most = wrap(yaw - here.yaw), rate * span_s
    if abs(turn) > most:
        yaw = wrap(here.yaw + math.copysign(most, turn))
    return Pose2(here.x, here.y, yaw)


def walked(
    here: Pose2, goal: Point, pace: float, rate: float, span_s: float
) -> tuple[Pose2, float]:
    """A person who turns to a goal elsewhere, then walks there, after `span_s`; their speed, m/s.

    They walk at `pace`, m/s, and turn at `rate`, rad/s.
    """
    yaw = math.atan2(goal[1] - here.y, goal[0] - here.x)
    if abs(wrap(yaw - here.yaw)) > rate * span_s:
        return turned(here, yaw, rate, span_s), 0.0
    share = min(1.0, pace * span_s / math.dist((here.x, here.y), goal))
    there = Pose2(here.x + share * (goal[0] - here.x), here.y + share * (goal[1] - here.y), yaw)
    return there, pace


def _nears(here: Point, there: Point, robot: Point) -> bool:
    """True if a place is too near to the robot, and nearer than the place before it."""
    return math.dist(there, robot) < min(CLOSE, math.dist(here, robot))
