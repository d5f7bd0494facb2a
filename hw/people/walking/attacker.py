"""Random people who try to be touched by the robot, each kind in a way of their own.

They know where the robot is and how it moves, ignore the sign, and go until they touch it. They
walk beside walls rather than into them, turn at once, and then do the same again.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

from hw.geometry import Pose2, wrap
from hw.people.walking.person import Touch
from hw.people.walking.wanderer import HOLDS_S, Wanderer
from hw.samples import USER_RADIUS
from hw.scene import Point

ATTACKS_S, RESTS_S = (5.0, 15.0), (0.5, 2.0)
"""How long an attack lasts at most, and how long they stay where they touched the robot, s."""
TOUCHES = 0.9
"""They go no nearer to the robot's centre, m: they touch its longer side."""
LEAD_S, FRONT = 1.5, 1.0
"""They look ahead so far, s, to where the robot will be, and cut so far ahead of its centre, m."""
ROUND, ROUND_RAD, CLOSER = 2.0, 0.6, 0.1
"""Distance at which they begin to go around, m, the angle of a step, and how they close in, m/s."""
BEHIND, FOLLOWS_S = 1.4, (2.0, 8.0)
"""How far behind the robot's centre they follow, m, and for how long, s."""
LURKS_S, NEAR = (10.0, 20.0), 2.5
"""How long they wait at a wall, s, and how near the robot has to come, m."""
SERVES, GRABS_S = 2.0, (0.0, 5.0)
"""Nearer than this, m, the robot is about to reach; how long they then wait, s."""
_MOVES = 0.1
_ASIDE = tuple(math.radians(angle) for angle in (0, 30, -30, 60, -60, 90, -90))

Target = Callable[[float], Point]
"""Where they go, in the map, m, so many seconds after the attack began."""


class Attacker(Wanderer):
    """Does what the errand of their manner says, and asks for touches in between."""

    _drift: Point = (0.0, 0.0)  # velocity of the robot in the map, m/s

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Go on to now_ns; see `Person`."""
        span_s, before = (now_ns - self._now) * 1e-9, self._robot
        if span_s > 0.0:
            self._drift = (robot.x - before.x) / span_s, (robot.y - before.y) / span_s
        super().step(now_ns, robot, informed)

    def _errand(self) -> Callable[[], Iterator[bool]]:
        attacks = {
            "cut": self._cut,
            "circle": self._circle,
            "shadow": self._shadow,
            "lurk": self._lurk,
            "back": self._back,
        }
        return attacks.get(self.manner.errand, self._go_somewhere)

    def _cut(self) -> Iterator[bool]:
        yield from self._attack(lambda _: self._met_at(FRONT))

    def _back(self) -> Iterator[bool]:
        yield from self._attack(lambda _: self._met_at(0.0), backwards=True)

    def _circle(self) -> Iterator[bool]:
        turn = self._chance.choice((-ROUND_RAD, ROUND_RAD))

        def around(gone_s: float) -> Point:
            radius = max(TOUCHES, ROUND - CLOSER * gone_s)
            return self._beside(self._robot.x - self._x, self._robot.y - self._y, -radius, turn)

        yield from self._attack(around)

    def _shadow(self) -> Iterator[bool]:
        follows_s = self._chance.uniform(*FOLLOWS_S)

        def behind(gone_s: float) -> Point:
            if gone_s > follows_s:
                return self._met_at(0.0)
            if math.hypot(*self._drift) > _MOVES:
                return self._beside(*self._drift, -BEHIND)
            return self._beside(self._robot.x - self._x, self._robot.y - self._y, -BEHIND)

        yield from self._attack(behind)

    def _lurk(self) -> Iterator[bool]:
        yield from self._go_to_wall()
        yield from self._wait_for_it(NEAR, LURKS_S)
        yield from self._attack(lambda _: self._met_at(0.0))

    def _request(self) -> Iterator[bool]:
        if self.manner.errand != "grab":
            yield from super()._request()
            return
        self.request = Touch().deep(Pose2(self._x, self._y, self._yaw))
        yield from self._wait_for_it(SERVES, HOLDS_S)
        yield from self._stand(self._span(GRABS_S))
        yield from self._attack(lambda _: self._met_at(0.0))
        self.request = None

    def _met_at(self, ahead: float) -> Point:
        """Where the robot will be once they get there, or so far ahead of that, m."""
        (vx, vy), robot = self._drift, self._robot
        speed = math.hypot(vx, vy)
        needed = self._distance() / self.manner.speeds[1]
        span = min(LEAD_S, needed) + (ahead / speed if speed > _MOVES else 0.0)
        return robot.x + span * vx, robot.y + span * vy

    def _beside(self, dx: float, dy: float, away: float, turn: float = 0.0) -> Point:
        """The place so far from the robot, m, in a direction turned by so much, rad."""
        yaw = math.atan2(dy, dx) + turn
        return self._robot.x + away * math.cos(yaw), self._robot.y + away * math.sin(yaw)

    def _distance(self) -> float:
        return math.hypot(self._robot.x - self._x, self._robot.y - self._y)

    def _wait_for_it(self, near: float, spans_s: tuple[float, float]) -> Iterator[bool]:
        """Wait until the robot is as near as this, m, and in sight, or a time is over."""
        left = self._span(spans_s)
        while left > 0 and not (self._distance() < near and self._is_in_sight()):
            left -= self._budget
            self._budget = 0
            yield True

    def _is_in_sight(self) -> bool:
        return self._room.sees(self._x, self._y, self._robot.x, self._robot.y)

    def _attack(self, target: Target, *, backwards: bool = False) -> Iterator[bool]:
        """Make for a place that moves until they touch the robot; else walk somewhere."""
        here = self._x, self._y
        if self._is_in_sight():
            yield from self._make_for(target, backwards)
        if (self._x, self._y) == here:
            yield from self._go_somewhere()
        elif self._distance() <= TOUCHES:
            yield from self._stand(self._span(RESTS_S))

    def _make_for(self, target: Target, backwards: bool) -> Iterator[bool]:
        speed, whole = self._chance.uniform(*self.manner.speeds), self._span(ATTACKS_S)
        left = whole
        while left > 0 and self._distance() > TOUCHES:
            span = min(left, self._budget)
            if not self._step_to(target((whole - left) * 1e-9), speed, span * 1e-9, backwards):
                return
            left -= span
            self._budget -= span
            if left > 0:
                yield True

    def _step_to(self, goal: Point, speed: float, span_s: float, backwards: bool) -> bool:
        """Walk towards a place, or along the wall in between; False if a wall is all around."""
        dx, dy = goal[0] - self._x, goal[1] - self._y
        pace = min(speed * span_s, math.hypot(dx, dy))
        if pace <= 0.0:
            return True
        towards = math.atan2(dy, dx)
        for aside in _ASIDE:
            x = self._x + pace * math.cos(towards + aside)
            y = self._y + pace * math.sin(towards + aside)
            if self._room.clearance(x, y) >= USER_RADIUS:
                self._yaw = wrap(towards + aside + math.pi * backwards)
                self._x, self._y, self._tempo = x, y, speed
                return True
        return False
