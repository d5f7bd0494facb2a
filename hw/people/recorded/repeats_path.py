"""A person who replays a recording, and leaves a robot that is shown to them."""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

from hw.geometry import Pose2
from hw.people.walking import Actor, Leaving, Manner, turned, walked
from hw.scene import Room

TURN_RATE, PACE = 3.0, 1.0
"""How fast they turn to leave and to return, rad/s, and walk back, m/s."""

_NEAR = 1e-6


class Replayed(Actor):
    """Interrupts a recording while the robot is shown, and goes on with it after.

    A person before the shown robot walks away from it, which ends their request. Once
    it is hidden they pause, walk back if they have left, and the recording goes on from there.
    """

    def __init__(self, start: Pose2, room: Room, manner: Manner, seed: int) -> None:
        self._chance = random.Random(f"courtesy {seed}")
        self._leaving = Leaving(room, manner.leaves_s, TURN_RATE, self._chance)
        self._way_back: list[Pose2] = []
        self._sees_it = False
        self._resumes = 0
        super().__init__(start, manner, seed)

    @property
    def still_until_ns(self) -> int:
        """Now: how they are measured depends on the rows and gaps of the recording."""
        return self._now

    def _halts(self, elapsed: int) -> bool:
        """True while they see the robot or pause; leaves it meanwhile."""
        if self._informed:
            if not self._sees_it:
                self._leaving.begin(self._now)
            if self._rate == 0.0:
                self._leave(elapsed * 1e-9)
        elif self._sees_it:
            self._leaving.end()
            pause = self._chance.uniform(*self.manner.pause_s)
            self._resumes = self._now + round(pause * 1e9)
        self._sees_it = self._informed
        return self._informed or self._now < self._resumes

    def _leave(self, span_s: float) -> None:
        here, leaving = Pose2(self._x, self._y, self._yaw), self._leaving.under_way
        robot = self._shown_at.x, self._shown_at.y
        there, self._aside = self._leaving.step(here, robot, self._now, span_s)
        if self._leaving.under_way:
            self._let_go()
            if not leaving:
                self._way_back.append(here)
        self._x, self._y, self._yaw = there.x, there.y, there.yaw

    def _return(self) -> Iterator[bool]:
        """Walk back, if they have left, and turn as they stood."""
        while self._way_back:
            here, goal = Pose2(self._x, self._y, self._yaw), self._way_back[-1]
            span_s, self._budget = self._budget * 1e-9, 0
            if math.dist((here.x, here.y), (goal.x, goal.y)) > _NEAR:
                here, self._tempo = walked(here, (goal.x, goal.y), PACE, TURN_RATE, span_s)
            elif here.yaw != goal.yaw:
                here = turned(here, goal.yaw, TURN_RATE, span_s)
            else:
                here = self._way_back.pop()
            self._x, self._y, self._yaw = here.x, here.y, here.yaw
            yield True
