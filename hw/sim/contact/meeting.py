"""Gap and contacts between the robot and one body, and between it and a scene's objects."""

from __future__ import annotations

import math
from collections.abc import Sequence

from hw.geometry import Pose2, wrap
from hw.model import Footprint
from hw.samples import USER_RADIUS
from hw.scene import Thing, named
from hw.sim.contact.contact import Sweep, first_touch, gap, swept_gap
from hw.sim.contact.nearby import Nearby
from hw.truth import BASE, Contact

_ROUNDING = 1e-9
"""Margin of bounds, m."""


class Meeting:
    """The robot's footprint and one body, watched from step to step.

    `least` is the least gap so far, m.
    """

    def __init__(self, footprint: Footprint, who: str, radius: float = USER_RADIUS) -> None:
        self.who, self.radius = who, radius
        self.least = math.inf
        self.touching = False
        self._footprint = footprint
        self._corner = footprint.half_diagonal

    def gap(self, robot: Pose2, body: Pose2) -> float:
        """The gap between them, m; at most 0 in contact."""
        return gap(self._footprint, robot, body.x, body.y, self.radius)

    def watch(
        self, robot: Sweep, body: Sweep, now_ns: int, span_s: float, granted: bool = False
    ) -> Contact | None:
        """Both have moved in the last span_s; the contact that began meanwhile, or None."""
        if self._is_far(robot, body):
            self.touching = False
            return None
        found = swept_gap(self._footprint, robot, body, self.radius)
        self.least = min(self.least, found)
        begun = found <= 0.0 and not self.touching
        self.touching = found <= 0.0 and self.gap(robot[1], body[1]) <= 0.0
        return self._contact(robot, body, now_ns, span_s, granted) if begun else None

    def _is_far(self, robot: Sweep, body: Sweep) -> bool:
        """True if they cannot have touched in this step, nor come as close as before.

        From the gap at the end at most as much is missing as both have moved: their paths, and
        what the corners have turned.
        """
        (a, b), (p, q) = robot, body
        corner = self._corner
        travel: float = ((b.x - a.x) ** 2 + (b.y - a.y) ** 2) ** 0.5
        travel += ((q.x - p.x) ** 2 + (q.y - p.y) ** 2) ** 0.5
        least = (self.least if self.least > 0.0 else 0.0) + travel + self.radius + _ROUNDING
        apart: float = ((q.x - b.x) ** 2 + (q.y - b.y) ** 2) ** 0.5
        if apart - corner > least:
            return True
        return self.gap(b, q) + self.radius - corner * abs(wrap(b.yaw - a.yaw)) > least

    def _contact(
        self, robot: Sweep, body: Sweep, now_ns: int, span_s: float, granted: bool
    ) -> Contact:
        touch = first_touch(self._footprint, robot, body, span_s, self.radius)
        return Contact(
            at_ns=now_ns - round((1.0 - touch.share) * span_s * 1e9),
            x=touch.x,
            y=touch.y,
            part=BASE,
            robot_closing=touch.robot_closing,
            person_closing=touch.person_closing,
            granted=granted,
            who=self.who,
        )


class Bystanders:
    """The objects of a scene: people, who can be touched, and things, which hold the robot."""

    def __init__(self, things: Sequence[Thing], footprint: Footprint) -> None:
        self.bodies = tuple(thing.body for thing in things)
        self._footprint, self._things = footprint, tuple(things)
        self._chairs = tuple(one for one in named(things) if one[1].kind != "person")
        self._people = tuple(
            (thing, Meeting(footprint, who, thing.body.radius))
            for who, thing in named(things)
            if thing.kind == "person"
        )

    def stand(self, now_ns: int) -> bool:
        """True if none of them moves, comes or goes from now on."""
        return all(
            not thing.walks and thing.leaves is None and thing.appears * 1e9 <= now_ns
            for thing in self._things
        )

    def people(self, now_ns: int) -> tuple[tuple[str, Pose2], ...]:
        """Poses of the people now, in the map, by name."""
        places = [(meeting.who, thing.place(now_ns)) for thing, meeting in self._people]
        return tuple((who, Pose2(*place)) for who, place in places if place is not None)

    def touching(self, now_ns: int) -> Pose2 | None:
        """The pose of a person who touches the robot; None if nobody does."""
        for thing, meeting in self._people:
            place = thing.place(now_ns)
            if meeting.touching and place is not None:
                return Pose2(*place)
        return None

    def watch(self, robot: Sweep, since_ns: int, now_ns: int) -> list[tuple[Contact, Pose2]]:
        """Contacts that began in this step, each with that person's pose now."""
        found = []
        for thing, meeting in self._people:
            place = thing.place(now_ns)
            if place is None:
                meeting.touching = False
                continue
            there = Pose2(*place)
            before = Pose2(*(thing.place(since_ns) or place))
            contact = meeting.watch(robot, (before, there), now_ns, (now_ns - since_ns) * 1e-9)
            if contact is not None:
                found.append((contact, there))
        return found

    def in_the_way(self, robot: Sweep, now_ns: int) -> Nearby | None:
        """The thing that the robot touches and moves further into; moving away is always free."""
        before, after = robot
        for what, thing in self._chairs:
            place = thing.place(now_ns)
            if place is None:
                continue
            radius = thing.body.radius
            left = gap(self._footprint, after, *place, radius)
            if left <= 0.0 and left < gap(self._footprint, before, *place, radius):
                return Nearby(left, what, *place)
        return None
