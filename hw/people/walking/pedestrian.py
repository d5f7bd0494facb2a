"""A person who walks straight, turns on the spot, and avoids a robot that was shown to them."""

from __future__ import annotations

import math
import random
from collections.abc import Generator, Iterator

from hw.geometry import Pose2, wrap
from hw.people.walking.leaving import Leaving
from hw.people.walking.manner import ATTENTIVE, Manner
from hw.people.walking.person import Actor
from hw.people.walking.script import WalkStep
from hw.samples import USER_RADIUS
from hw.scene import Point, Room, distance_to_segment

NEARLY, ROOM, MORE_ROOM = 1.27, 1.5, 2.5
"""A person who is shown the robot closer than NEARLY steps back to ROOM; if it is shown again at
the same place, to MORE_ROOM, because it cannot free itself. Distances between centres, m."""
BACKWARDS = 0.5
"""Speed of stepping back, m/s."""
MEMORY_NS = 10_000_000_000
"""Time after that pause for which they keep away from where the robot was, ns."""
SAME_PLACE = 0.5
"""A robot shown again within this distance of its last place causes no new pause, m."""
KEEP = 1.27
"""Least distance of a path from the place where the robot was shown, m."""
ATTEMPTS, REST_NS = 3, 4_000_000_000
"""Attempts to reach a place, and the rest (ns) where there is no path, before they give up."""

_NEAR = 1e-6
_ASIDE = tuple(math.radians(angle) for angle in (0, 40, -40, 80, -80))
_ROUND = tuple((radius, step * math.pi / 12.0) for radius in (1.6, 2.5, 3.5) for step in range(24))


class Pedestrian(Actor):
    """Walks in straight lines; turns at turn_rate, rad/s.

    Walking and turning start and stop instantly, as for the paper's simulated cylinder. A person
    who was shown the robot steps back if they nearly touch it, walks away if they stand before it,
    pauses, and does not walk through the place where it stood: they walk around it, wait, or give
    up the goal. Leaving ends their request.
    """

    def __init__(
        self,
        room: Room,
        start: Pose2,
        turn_rate: float,
        manner: Manner = ATTENTIVE,
        seed: int = 0,
    ) -> None:
        self._room, self._turn_rate = room, turn_rate
        self._courtesy = random.Random(f"courtesy {seed}")
        self._leaving = Leaving(room, manner.leaves_s, turn_rate, self._courtesy)
        self._met: Point | None = None
        self._resumes = self._forgets = self._pause = 0
        self._sees_it = self._surprised = self._backs_off = False
        super().__init__(start, manner, seed)

    def _halts(self, elapsed: int) -> bool:
        """True while they see the robot or pause; makes room for it meanwhile."""
        if self._informed:
            self._notice((self._shown_at.x, self._shown_at.y))
            if self._rate == 0.0:
                self._make_room(elapsed * 1e-9)
        else:
            if self._sees_it:
                self._leaving.end()
            if self._now >= self._forgets:
                self._met = None
        self._sees_it = self._informed
        return self._informed or self._now < self._resumes

    def _notice(self, robot: Point) -> None:
        """Note where the robot is shown; if it is shown where it last was, they do not pause."""
        if not self._sees_it:
            known = self._met is not None and math.dist(self._met, robot) < SAME_PLACE
            self._surprised = not known
            self._pause = round(self._courtesy.uniform(*self.manner.pause_s) * 1e9)
            self._leaving.begin(self._now)
        if self._surprised:
            self._resumes = self._now + self._pause
        self._met, self._forgets = robot, self._now + self._pause + MEMORY_NS

    def _make_room(self, span: float) -> None:
        """Walk away from the shown robot, or step back, for `span` in s, if need be."""
        assert self._met is not None
        here = Pose2(self._x, self._y, self._yaw)
        there, self._aside = self._leaving.step(here, self._met, self._now, span)
        self._x, self._y, self._yaw = there.x, there.y, there.yaw
        if self._leaving.under_way:
            self._let_go()
        elif self._step_back(span):
            self._aside = BACKWARDS

    def _step_back(self, span: float) -> bool:
        """Step back from the shown robot, or aside at a wall; False if no need or no room."""
        assert self._met is not None
        dx, dy = self._x - self._met[0], self._y - self._met[1]
        distance = math.hypot(dx, dy)
        limit = MORE_ROOM if not self._surprised else ROOM if self._backs_off else NEARLY
        self._backs_off = distance < limit
        if not self._backs_off:
            return False
        free = min(USER_RADIUS, self._room.clearance(self._x, self._y))
        for aside in _ASIDE:
            direction = math.atan2(dy, dx) + aside
            x = self._x + BACKWARDS * span * math.cos(direction)
            y = self._y + BACKWARDS * span * math.sin(direction)
            if self._room.clearance(x, y) >= free:
                self._x, self._y = x, y
                return True
        return False

    def _turn(self, yaw: float) -> Iterator[bool]:
        left = wrap(yaw - self._yaw)
        rate = math.copysign(self._turn_rate, left)
        while abs(left) > abs(rate) * self._budget * 1e-9:
            part = rate * self._budget * 1e-9
            self._yaw = wrap(self._yaw + part)
            left -= part
            self._budget = 0
            yield True
        self._budget -= round(left / rate * 1e9)
        self._yaw = yaw

    def _walk(self, step: WalkStep) -> Iterator[bool]:
        goal = step.x, step.y
        for _ in range(ATTEMPTS):
            if (yield from self._walk_to(goal, step.speed)):
                if step.yaw is not None:
                    yield from self._turn(step.yaw)
                return

    def _walk_to(self, goal: Point, speed: float) -> Generator[bool, None, bool]:
        """Walk straight to a place, or around the shown robot; True on arrival."""
        way = self._way_to(goal)
        if way is None:
            yield from self._stand(REST_NS)
            return False
        for place in way:
            if not (yield from self._leg(place, speed)):
                return False
        return True

    def _leg(self, place: Point, speed: float) -> Generator[bool, None, bool]:
        """Turn and walk straight; False if the robot was shown meanwhile, or stands in the path."""
        x, y = self._x, self._y
        dx, dy = place[0] - x, place[1] - y
        length = math.hypot(dx, dy)
        if length <= _NEAR:
            return True
        yield from self._turn(math.atan2(dy, dx))
        if (self._x, self._y) != (x, y) or self._is_barred((x, y), place):
            return False
        span, gone = round(length / speed * 1e9), 0
        while span - gone > self._budget:
            gone += self._budget
            self._budget = 0
            share = gone / span
            self._x, self._y = x + share * dx, y + share * dy
            self._tempo = speed
            yield True
            if self._rate == 0.0:
                while self._rate == 0.0:
                    self._budget = 0
                    yield True
                return False
        self._budget -= span - gone
        self._x, self._y = place
        return True

    def _approach(
        self, speed: float, stop_at: float, span_ns: int, *, ends: bool = True
    ) -> Iterator[bool]:
        """Approach the robot, wherever it goes, at `speed`, m/s.

        Ends `stop_at` m before its centre, after `span_ns`, and before a wall. If it `ends`, also
        once they have stopped because it was shown to them, or the sign is over.
        """
        left, shown = span_ns, False
        if ends and self._informed:
            return
        while not (shown and (self._rate == 0.0 or not self._informed)):
            shown = ends and self._informed
            dx, dy = self._robot.x - self._x, self._robot.y - self._y
            distance = math.hypot(dx, dy)
            span = min(left, self._budget)
            pace = min(speed * span * 1e-9, distance - stop_at)
            if distance <= stop_at or (pace <= 0.0 and (span > 0 or left == 0)):
                return
            if pace > 0.0:
                self._yaw = math.atan2(dy, dx)
                x, y = self._x + pace * math.cos(self._yaw), self._y + pace * math.sin(self._yaw)
                if self._room.clearance(x, y) < USER_RADIUS:
                    return
                self._x, self._y, self._tempo = x, y, speed
            left -= span
            self._budget -= span
            if left == 0:
                return
            yield True

    def _way_to(self, goal: Point) -> tuple[Point, ...] | None:
        """The direct path, or one with a detour by one place; None if both are blocked.

        The robot may stand in the direct path, or a wall, because they have made room.
        """
        here = self._x, self._y
        if self._room.sees(*here, *goal) and not self._is_barred(here, goal):
            return (goal,)
        places = [
            (x + radius * math.cos(angle), y + radius * math.sin(angle))
            for x, y in dict.fromkeys((self._met or here, here))
            for radius, angle in _ROUND
        ]
        places.sort(key=lambda place: math.dist(here, place) + math.dist(place, goal))
        for place in places:
            if self._is_open(here, place) and self._is_open(place, goal):
                return place, goal
        return None

    def _is_open(self, start: Point, end: Point) -> bool:
        """True if a straight path keeps clear of the walls and of the shown robot."""
        if self._is_barred(start, end):
            return False
        free = min(USER_RADIUS, *(self._room.clearance(*place) for place in (start, end)))
        return free > 0.0 and self._room.way_clearance(*start, *end) >= free

    def _is_barred(self, start: Point, end: Point) -> bool:
        """True if a path comes too close to the shown robot, and closer than its start is."""
        if self._met is None:
            return False
        nearest = distance_to_segment(*self._met, (*start, *end))
        return nearest < min(KEEP, math.dist(start, self._met) - 0.01)
