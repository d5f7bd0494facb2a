"""A person who walks straight and turns on the spot, and minds a robot that they were shown."""

from __future__ import annotations

import math
from collections.abc import Generator, Iterator

from hw.geometry import Pose2, wrap
from hw.people.person import RADIUS, Actor
from hw.people.script import WalkStep
from hw.room import Point, Room, distance_to_segment

NEARLY, ROOM, MORE_ROOM = 1.27, 1.5, 2.5
"""Shown the robot nearer than NEARLY, m from centre to centre, a person steps back to ROOM; shown
it again where it was, to MORE_ROOM: it does not get away by itself."""
BACKWARDS = 0.5
"""… at this speed, m/s."""
MOMENT_NS = 3_000_000_000
"""So long after the robot is hidden again they find their way again before they go on."""
MEMORY_NS = 10_000_000_000
"""… and so long they walk nowhere near the place where it was."""
SAME_PLACE = 0.5
"""A robot shown again no farther from there, m, needs no other moment."""
KEEP = 1.27
"""How far ways stay from there, m from centre to way."""
ATTEMPTS, REST_NS = 3, 4_000_000_000
"""Tries to get somewhere, and the rest where there is no way, before they give it up."""

_NEAR = 1e-6
_ASIDE = tuple(math.radians(angle) for angle in (0, 40, -40, 80, -80))
_ROUND = tuple((radius, step * math.pi / 12.0) for radius in (1.6, 2.5, 3.5) for step in range(24))


class Pedestrian(Actor):
    """Walks in straight lines; turns at turn_rate, rad/s.

    Speed and turns set in and end at once, as those of the paper's simulated cylinder. Whoever was
    shown the robot steps back from it where they nearly touch it, takes a moment, and does not walk
    through the place where they saw it: they go round, or wait, or give up where they wanted to go.
    """

    def __init__(self, room: Room, start: Pose2, turn_rate: float) -> None:
        self._room, self._turn_rate = room, turn_rate
        self._shown: Point | None = None
        self._resumes = self._forgets = 0
        self._sees_it = self._surprised = self._backs_off = False
        super().__init__(start)

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Go on to now_ns; see `Person`."""
        steps_back = False
        if informed:
            self._notice(now_ns, (robot.x, robot.y))
            steps_back = self._rate == 0.0 and self._step_back((now_ns - self._now) * 1e-9)
        elif now_ns >= self._forgets:
            self._shown = None
        self._sees_it = informed
        super().step(now_ns, robot, informed or now_ns < self._resumes)
        if steps_back:
            self.speed = BACKWARDS

    def _notice(self, now_ns: int, robot: Point) -> None:
        """The robot is shown; one that still stands where it was before is no surprise."""
        if not self._sees_it:
            known = self._shown is not None and math.dist(self._shown, robot) < SAME_PLACE
            self._surprised = not known
        if self._surprised:
            self._resumes = now_ns + MOMENT_NS
        self._shown, self._forgets = robot, now_ns + MOMENT_NS + MEMORY_NS

    def _step_back(self, span: float) -> bool:
        """One step away from the robot that is shown, aside where a wall is; False: no need."""
        assert self._shown is not None
        dx, dy = self._x - self._shown[0], self._y - self._shown[1]
        distance = math.hypot(dx, dy)
        limit = MORE_ROOM if not self._surprised else ROOM if self._backs_off else NEARLY
        self._backs_off = distance < limit
        if not self._backs_off:
            return False
        free = min(RADIUS, self._room.clearance(self._x, self._y))
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
            if not self._room.sees(self._x, self._y, *goal):
                return  # led behind a wall by the robot, the person stays
            if (yield from self._go(goal, step.speed)):
                if step.yaw is not None:
                    yield from self._turn(step.yaw)
                return

    def _go(self, goal: Point, speed: float) -> Generator[bool, None, bool]:
        """Straight to a place, or round where the robot was shown; are they there?"""
        way = self._way_to(goal)
        if way is None:
            yield from self._stand(REST_NS)
            return False
        for place in way:
            if not (yield from self._leg(place, speed)):
                return False
        return True

    def _leg(self, place: Point, speed: float) -> Generator[bool, None, bool]:
        """Turn and walk straight; False if the robot was shown on the way, or it leads there."""
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

    def _way_to(self, goal: Point) -> tuple[Point, ...] | None:
        """Straight, or by one place round where the robot was shown; None: neither."""
        here = self._x, self._y
        if not self._is_barred(here, goal):
            return (goal,)
        assert self._shown is not None
        places = [
            (self._shown[0] + radius * math.cos(angle), self._shown[1] + radius * math.sin(angle))
            for radius, angle in _ROUND
        ]
        places.sort(key=lambda place: math.dist(here, place) + math.dist(place, goal))
        for place in places:
            if self._is_open(here, place) and self._is_open(place, goal):
                return place, goal
        return None

    def _is_open(self, start: Point, end: Point) -> bool:
        """Does a straight way keep off the walls and off the robot that was shown?"""
        if self._is_barred(start, end):
            return False
        free = min(RADIUS, *(self._room.clearance(*place) for place in (start, end)))
        return free > 0.0 and self._room.way_clearance(*start, *end) >= free

    def _is_barred(self, start: Point, end: Point) -> bool:
        """Would they come too near to where the robot was shown, and nearer than they are?"""
        if self._shown is None:
            return False
        nearest = distance_to_segment(*self._shown, (*start, *end))
        return nearest < min(KEEP, math.dist(start, self._shown) - 0.01)
