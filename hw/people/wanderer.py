"""A person who walks about at random, and requests touches wherever they are.

All random numbers come from one stream of the person's own: the same seed gives the same walk
whatever the robot does, unless it is shown to them; then they may walk around it or give up a goal.
Requests are like those of the evaluation (R131, R132), with other durations but the same 5 s pause
afterwards.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator

from engine.files.finding import mistake
from hw.geometry import Pose2
from hw.people.manner import ATTENTIVE, Manner
from hw.people.pedestrian import Pedestrian
from hw.people.person import RADIUS, Touch
from hw.people.script import WalkStep
from hw.room import Point, Room

NAME = "random"
ABOUT = "Walks at random, by --seed: places, headings, speeds, pauses and requests."

SPEEDS = (0.5, 1.5)
"""Range of walking speeds, m/s."""
PAUSES_S = (0.0, 5.0)
"""Range of the pauses between two walks, s."""
WALKS = (1, 3)
"""Range of the number of walks between two requests."""
HOLDS_S = (20.0, 30.0)
"""Range of the duration of a request, s."""
TURN_RATE = 3.0
"""Rate of turning on the spot, rad/s."""
_GOALS, _DETOURS, _PLACES = 10, 100, 1000


class Wanderer(Pedestrian):
    """Walks from one random place to the next, RADIUS or more from walls.

    Where there is no straight path, one random place in between is tried as a detour. Ends after
    `requests` and the pause after the last; None: never.

    Raises:
        FileError: the start is closer than RADIUS to a wall, so that no path leads away.
    """

    def __init__(
        self,
        room: Room,
        start: Pose2,
        seed: int,
        requests: int | None = None,
        manner: Manner = ATTENTIVE,
    ) -> None:
        if room.clearance(start.x, start.y) < RADIUS:
            raise mistake(
                NAME,
                f"the start ({start.x:g}, {start.y:g}) is not {RADIUS:g} m away from walls; "
                "give user.start in the scene",
            )
        # a named stream: no other source with the same seed draws the same numbers
        self._chance = random.Random(f"{NAME} user {seed}")
        self._left = requests
        super().__init__(room, start, TURN_RATE, manner, seed)

    def _run(self) -> Iterator[bool]:
        while self._left is None or self._left > 0:
            for _ in range(self._chance.randint(*WALKS)):
                yield from self._go_somewhere()
                yield from self._stand(self._span(PAUSES_S))
            yield from self._ask(Touch(0, self._span(HOLDS_S)))
            self._left = None if self._left is None else self._left - 1

    def _go_somewhere(self) -> Iterator[bool]:
        speed = self._chance.uniform(*SPEEDS)
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
            if self._room.clearance(*place) >= RADIUS:
                return place
        return self._x, self._y

    def _is_clear(self, start: Point, end: Point) -> bool:
        return self._room.way_clearance(*start, *end) >= RADIUS

    def _span(self, seconds: tuple[float, float]) -> int:
        return round(self._chance.uniform(*seconds) * 1e9)
