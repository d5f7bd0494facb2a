"""Objects that are not in the map, as a scene lists them: chairs, and people besides the user.

    objects:
      - {kind: chair, at: [3.0, 4.0], appears: 12 s}
      - {kind: person, at: [1.0, 1.0], walks: [[5.0, 1.0], [5.0, 4.0]], speed: 0.8 m/s, again: true}

Each is an upright cylinder, present from `appears` until `leaves`. It moves from `at` through the
places of `walks`; with `again` back and forth endlessly, otherwise it stays at the last one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Literal, NamedTuple

from engine.files import Duration, Length, Speed
from engine.files.declared import Fault, Range
from hw.geometry import total
from hw.places import PlanePoint
from hw.samples import USER_RADIUS

_SIZES = {"chair": (0.25, 0.9), "person": (USER_RADIUS, 1.8)}
"""Default radius and height, m."""
Time = Annotated[Duration, Range(0.0, 1e6)]


class Body(NamedTuple):
    """An upright cylinder; `at` gives its place at an instant (ns), None while absent."""

    radius: float
    height: float
    at: Callable[[int], PlanePoint | None]


@dataclass(frozen=True, slots=True)
class Thing:
    """A checked object of a scene; s, m, m/s."""

    kind: Literal["chair", "person"]
    """Gives the size, unless `radius` and `height` do."""
    at: PlanePoint
    """Where it stands, or starts from."""
    radius: Annotated[Length, Range(0.02, 2.0)] | None = None
    """Of the upright cylinder."""
    height: Annotated[Length, Range(0.1, 3.0)] | None = None
    """Of the upright cylinder."""
    appears: Time = 0.0
    """From then on it is there."""
    leaves: Time | None = None
    """From then on it is gone; without it, it stays."""
    walks: tuple[PlanePoint, ...] = ()
    """Places that it goes to, one after another."""
    speed: Annotated[Speed, Range(0.01, 5.0)] = 1.0
    """How fast it walks."""
    again: bool = False
    """Back and forth endlessly; else it stays at the last place."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.leaves is not None and self.leaves <= self.appears:
            yield "leaves", f"{self.leaves:g} s is not after appears, {self.appears:g} s"
        if self.again and not self.walks:
            yield "again", "there are no places to walk through; give them as 'walks'"
        for place, following in pairwise((self.at, *self.walks)):
            if place == following:
                yield "walks", f"({place[0]:g}, {place[1]:g}) is there twice in a row"

    @property
    def body(self) -> Body:
        """Its shape and its place over time."""
        radius, height = _SIZES[self.kind]
        return Body(self.radius or radius, self.height or height, self.place)

    def place(self, time_ns: int) -> PlanePoint | None:
        """Its place at an instant of the run; None while absent."""
        since = time_ns * 1e-9 - self.appears
        if since < 0.0 or (self.leaves is not None and time_ns * 1e-9 >= self.leaves):
            return None
        if not self.walks:
            return self.at
        way = since * self.speed
        places = (self.at, *self.walks)
        if self.again:
            length = total(math.dist(a, b) for a, b in pairwise(places))
            way %= 2.0 * length
            way = min(way, 2.0 * length - way)
        return _along(places, way)


def named(things: Sequence[Thing]) -> list[tuple[str, Thing]]:
    """The objects of a scene by name: `chair_1`, `person_2`, numbered in the order of its file."""
    return [(f"{thing.kind}_{n}", thing) for n, thing in enumerate(things, 1)]


def _along(places: tuple[PlanePoint, ...], way: float) -> PlanePoint:
    """The point of a polyline at this length, m; its end beyond."""
    for (x1, y1), (x2, y2) in pairwise(places):
        length = math.hypot(x2 - x1, y2 - y1)
        if way < length:
            share = way / length
            return x1 + share * (x2 - x1), y1 + share * (y2 - y1)
        way -= length
    return places[-1]
