"""Touch requests that arise from walking up to a touchable surface of the virtual world.

A touch is requested when the person is within NEAR of a touchable surface and faces it (R74). The
DEEP is where the view ray meets the surface, at touching height; the prop's x axis is along the
view. The request stays until the person turns away, walks away, or looks at another spot. The first
two have hysteresis, so that a person who sways at the limit requests once.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from hw.geometry import Pose2, Pose3
from hw.people.walking.person import Person
from hw.samples import UserPose
from hw.scene import Point, Surface

NEAR, AWAY = 1.5, 1.8
"""Distances from a surface at which a touch is requested, and beyond which it is given up, m."""
FACING, TURNED_AWAY = math.radians(45.0), math.radians(60.0)
"""The same two limits for the angle between the view and the surface's normal, rad."""
SAME_SPOT = 0.4
"""Distance by which the spot in view may move before it counts as another one, m."""
STEADY_NS = 300_000_000
"""Time for which a spot must be looked at, ns; a glance in passing requests nothing."""


@dataclass(frozen=True, slots=True)
class _Spot:
    surface: Surface
    place: Point


class Interaction:
    """Adds requests for touchable surfaces to a given person.

    The given person's own requests take precedence. With `requests` the person has finished once
    that many touches were requested and are over.
    """

    def __init__(
        self, person: Person, surfaces: Iterable[Surface], requests: int | None = None
    ) -> None:
        self._person = person
        self._surfaces = tuple(surfaces)
        self._left = requests
        self._own: Pose3 | None = None
        self._held: _Spot | None = None
        self._looked_at: _Spot | None = None
        self._since = 0
        self._copy()

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Advance to now_ns; see `Person`. Without tracking no request begins or ends."""
        self._person.step(now_ns, robot, informed)
        sample = self._person.measured
        if sample is not None and isinstance(sample.value, UserPose):
            body = sample.value.body
            self._perceive(now_ns, Pose2(body.x, body.y, sample.value.head_yaw))
        self._copy()

    def _copy(self) -> None:
        person = self._person
        self.body, self.speed, self.measured = person.body, person.speed, person.measured
        self.request = person.request or self._own
        self.finished = person.finished or (self._left == 0 and self._own is None)

    def _perceive(self, now_ns: int, view: Pose2) -> None:
        if self._held is not None:
            self._hold(self._held, view)
        else:
            self._look(now_ns, view)

    def _hold(self, spot: _Spot, view: Pose2) -> None:
        place = _met(spot.surface, view, AWAY, TURNED_AWAY)
        if place is None or math.dist(place, spot.place) > SAME_SPOT:
            self._own = self._held = self._looked_at = None

    def _look(self, now_ns: int, view: Pose2) -> None:
        spot = self._nearest(view)
        before = self._looked_at
        if spot is None or before is None or not _is_same(before, spot):
            self._looked_at, self._since = spot, now_ns
        elif now_ns - self._since >= STEADY_NS and self._left != 0:
            x, y = spot.place
            self._held = spot
            self._own = Pose3.from_yaw(x, y, spot.surface.touching_height, view.yaw)
            self._left = None if self._left is None else self._left - 1

    def _nearest(self, view: Pose2) -> _Spot | None:
        met = ((surface, _met(surface, view, NEAR, FACING)) for surface in self._surfaces)
        spots = [_Spot(surface, place) for surface, place in met if place is not None]
        here = (view.x, view.y)
        return min(spots, key=lambda spot: math.dist(here, spot.place), default=None)


def _met(surface: Surface, view: Pose2, near: float, facing: float) -> Point | None:
    if surface.distance(view.x, view.y) > near or surface.angle_from(view) > facing:
        return None
    return surface.seen_from(view)


def _is_same(a: _Spot, b: _Spot) -> bool:
    return a.surface is b.surface and math.dist(a.place, b.place) <= SAME_SPOT
