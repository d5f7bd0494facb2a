"""A person who walks about at random, and requests touches wherever they are.

All random numbers come from streams of the person's own: the same seed gives the same walk whatever
the robot does, unless it is shown to them; then they may walk around it or give up a goal. Pursuers
and curious people, who walk up to the robot, depend on where it is, too.
Requests are like those of the evaluation (R131, R132), with other durations but the same 5 s pause
afterwards.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator

from engine.files import mistake
from hw.geometry import Pose2, wrap
from hw.people.walking.manner import ATTENTIVE, Manner
from hw.people.walking.pedestrian import Pedestrian
from hw.people.walking.person import Touch
from hw.people.walking.script import WalkStep
from hw.samples import USER_RADIUS
from hw.scene import Point, Room

NAME = "random"
ABOUT = "Walks at random, by --seed: places, headings, speeds, pauses and requests; attentive."

PAUSES_S = (0.0, 5.0)
"""Range of the pauses between two walks, s."""
WALKS = (1, 3)
"""Range of the number of walks between two requests."""
HOLDS_S = (20.0, 30.0)
"""Range of the duration of a request, s."""
TURN_RATE = 3.0
"""Rate of turning on the spot, rad/s."""
PURSUITS_S, INTO = (5.0, 15.0), 0.6
"""Duration of an approach to the robot, s, and the distance from its centre at which it ends, m: a
pursuer walks into a robot that stays."""
VISITS_S, VISIT = 8.0, (1.2, 2.5)
"""Longest walk of a curious person up to the robot, s, and where it ends, m from its centre."""
LOOKS, LOOKS_S = (2, 5), (0.3, 2.0)
"""How often a curious person turns at a place, and for how long they then look, s."""
GLANCES_S, GLANCE, HEAD_RATE = (0.4, 2.5), 1.2, 3.0
"""How long they hold their head, s; greatest turn of it, rad; and how fast it turns, rad/s."""
_GOALS, _DETOURS, _PLACES = 10, 100, 1000


class Wanderer(Pedestrian):
    """Walks from one random place to the next, USER_RADIUS or more from walls.

    Where there is no straight path, one random place in between is tried as a detour. Ends after
    `requests` and the pause after the last; None: never.

    Raises:
        FileError: the start is closer than USER_RADIUS to a wall, so that no path leads away.
    """

    def __init__(
        self,
        room: Room,
        start: Pose2,
        seed: int,
        requests: int | None = None,
        manner: Manner = ATTENTIVE,
    ) -> None:
        if room.clearance(start.x, start.y) < USER_RADIUS:
            raise mistake(
                NAME,
                f"the start ({start.x:g}, {start.y:g}) is not {USER_RADIUS:g} m away from walls; "
                "give user.start in the scene",
            )
        # a named stream: no other source with the same seed draws the same numbers
        self._chance = random.Random(f"{NAME} user {seed}")
        self._glances = random.Random(f"{NAME} glances {seed}")
        self._glance, self._glance_until = 0.0, 0
        self._left = requests
        super().__init__(room, start, TURN_RATE, manner, seed)

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Go on to now_ns; see `Person`."""
        if self.manner.errand == "look":
            self._turn_head(now_ns, (now_ns - self._now) * 1e-9)
        super().step(now_ns, robot, informed)

    @property
    def still_until_ns(self) -> int:
        """As of any `Actor`; a curious person is never still, because they turn their head."""
        return self._now if self.manner.errand == "look" else super().still_until_ns

    def _turn_head(self, now_ns: int, span_s: float) -> None:
        if now_ns >= self._glance_until:
            self._glance = self._glances.uniform(-GLANCE, GLANCE)
            self._glance_until = now_ns + round(self._glances.uniform(*GLANCES_S) * 1e9)
        most = HEAD_RATE * span_s
        self._head_turn += min(max(self._glance - self._head_turn, -most), most)

    def _errand(self) -> Callable[[], Iterator[bool]]:
        """What they do between requests."""
        errands = {"pursue": self._pursue, "look": self._explore}
        return errands.get(self.manner.errand, self._go_somewhere)

    def _request(self) -> Iterator[bool]:
        yield from self._ask(Touch(0, self._span(HOLDS_S)))

    def _run(self) -> Iterator[bool]:
        errand = self._errand()
        while self._left is None or self._left > 0:
            for _ in range(self._chance.randint(*WALKS)):
                yield from errand()
                if not self.manner.hurries:
                    yield from self._stand(self._span(PAUSES_S))
            yield from self._request()
            self._left = None if self._left is None else self._left - 1

    def _pursue(self) -> Iterator[bool]:
        """Approach the robot; if a wall is in between or they are stuck, walk somewhere else."""
        here = self._x, self._y
        if self._room.sees(*here, self._robot.x, self._robot.y):
            speed, span = self._chance.uniform(*self.manner.speeds), self._span(PURSUITS_S)
            yield from self._approach(speed, INTO, span, ends=False)
        if (self._x, self._y) == here:
            yield from self._go_somewhere()

    def _explore(self) -> Iterator[bool]:
        """Walk up to the robot, to a wall, or somewhere, and look about on the way and there."""
        kind = self._chance.random()
        if kind < 0.25 and self._room.sees(self._x, self._y, self._robot.x, self._robot.y):
            stop_at = self._chance.uniform(*VISIT)
            yield from self._approach(
                self._chance.uniform(*self.manner.speeds), stop_at, round(VISITS_S * 1e9)
            )
        else:
            yield from self._go_half_way()
            yield from self._look_about()
            yield from (self._go_to_wall() if kind < 0.7 else self._go_somewhere())
        yield from self._look_about()

    def _look_about(self) -> Iterator[bool]:
        for _ in range(self._chance.randint(*LOOKS)):
            yield from self._turn(wrap(self._yaw + self._chance.uniform(-math.pi, math.pi)))
            yield from self._stand(self._span(LOOKS_S))

    def _go_half_way(self) -> Iterator[bool]:
        x, y = self._way()[0]
        x, y = 0.5 * (self._x + x), 0.5 * (self._y + y)
        yield from self._walk(WalkStep(x, y, None, self._chance.uniform(*self.manner.speeds)))

    def _go_to_wall(self) -> Iterator[bool]:
        """Walk up to a wall and face it."""
        here = self._x, self._y
        places = [place for _ in range(_GOALS) if self._is_clear(here, place := self._place())]
        x, y = min(places, key=lambda place: self._room.clearance(*place), default=here)
        yaw, speed = self._towards_wall(x, y), self._chance.uniform(*self.manner.speeds)
        yield from self._walk(WalkStep(x, y, yaw, speed))

    def _towards_wall(self, x: float, y: float) -> float:
        """The direction in which a wall is nearest, rad."""
        yaws = (step * math.pi / 8.0 for step in range(-7, 9))
        there = {yaw: (x + 0.2 * math.cos(yaw), y + 0.2 * math.sin(yaw)) for yaw in yaws}
        return min(there, key=lambda yaw: self._room.clearance(*there[yaw]))

    def _go_somewhere(self) -> Iterator[bool]:
        speed = self._chance.uniform(*self.manner.speeds)
        yaw = self._chance.uniform(-math.pi, math.pi)
        *between, (x, y) = self._way()
        for place in between:
            yield from self._walk(WalkStep(*place, None, speed))
        yield from self._walk(WalkStep(x, y, yaw, speed))

    def _way(self) -> tuple[Point, ...]:
        """A path to a random place, via at most one other; the present place if none is found."""
        here = (self._x, self._y)
        for _ in range(_GOALS):
            goal = self._place()
            if self._is_clear(here, goal):
                return (goal,)
            for _ in range(_DETOURS):
                other = self._place()
                if self._is_clear(here, other) and self._is_clear(other, goal):
                    return other, goal
        return (here,)

    def _place(self) -> Point:
        x_low, y_low, x_high, y_high = self._room.bounds
        for _ in range(_PLACES):
            place = self._chance.uniform(x_low, x_high), self._chance.uniform(y_low, y_high)
            if self._room.clearance(*place) >= USER_RADIUS:
                return place
        return self._x, self._y

    def _is_clear(self, start: Point, end: Point) -> bool:
        return self._room.way_clearance(*start, *end) >= USER_RADIUS

    def _span(self, seconds: tuple[float, float]) -> int:
        return round(self._chance.uniform(*seconds) * 1e9)
