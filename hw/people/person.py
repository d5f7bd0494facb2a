"""A person as the simulation needs one: scripted, replayed or live, behind one interface (R24).

Source of the numbers: R23 (a cylinder of 1 m diameter), R13 (position is the tailbone).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from hw.geometry import Pose2, Pose3, wrap
from hw.samples import Sample, UserPose

RADIUS = 0.5
"""Radius of the cylinder that stands for a person, m (R23)."""

STOPPING_S = 0.5
"""Time in which a person who is shown the robot comes to a stop, s."""


class Person(Protocol):
    """Where a person truly is, and what tracking sees of it.

    The attributes hold for the instant of the last `step`. A person knows nothing of charts; the
    only things that reach them are the robot's place and whether it is shown to them.
    """

    body: Pose2
    """True pose of the body in the map, during drop-outs of tracking too."""
    speed: float
    """True speed over the floor, m/s."""
    request: Pose3 | None
    """The DEEP in the map while the person asks for a touch, else None (a level)."""
    measured: Sample | None
    """The newest `user.pose` since the step before; None: tracking has nothing new."""
    finished: bool
    """Has the script or recording come to its end?"""

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Go on to now_ns; informed: the robot and the stop sign are shown (R115)."""
        ...


@dataclass(frozen=True, slots=True)
class Touch:
    """How a person asks for a touch (R131, R132): ns, and m ahead of the body and above the floor.

    They stand for `stand_ns`, ask for `hold_ns`, let go, and stay for `wait_ns`.
    """

    stand_ns: int = 10_000_000_000
    hold_ns: int = 30_000_000_000
    wait_ns: int = 5_000_000_000
    ahead: float = 0.85
    height: float = 1.5

    def deep(self, body: Pose2) -> Pose3:
        """Where the prop has to be: ahead of the body, its x axis along the view, in the map."""
        x, y = body.transform(self.ahead, 0.0)
        return Pose3.from_yaw(x, y, self.height, body.yaw)


class Actor:
    """A person whose doings are one routine in their own time.

    Own time runs with the world's, except that it slows down to a stand while the robot is shown
    to the person, and up again after. The routine is a generator: it uses up `_budget` (ns of own
    time) and yields when nothing is left, so that no time is lost between one doing and the next.
    """

    def __init__(self, start: Pose2) -> None:
        self.body = start
        self.speed = 0.0
        self.request: Pose3 | None = None
        self.measured: Sample | None = None
        self.finished = False
        self._x, self._y, self._yaw = start.x, start.y, start.yaw
        self._head_turn = 0.0
        self._tempo = 0.0
        self._rate = 1.0
        self._now = 0
        self._budget = 0
        self._robot = start
        self._informed = False
        self._blind_until = 0
        self._seen = UserPose(start, start.yaw)
        self._routine = self._run()

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Go on to now_ns; see `Person`."""
        elapsed, self._now = now_ns - self._now, now_ns
        self._robot, self._informed = robot, informed
        self._budget = self._own_time(elapsed, informed)
        self._tempo = 0.0
        self.finished = next(self._routine, None) is None
        self.speed = self._tempo * self._rate
        body = self.body
        if body.x != self._x or body.y != self._y or body.yaw != self._yaw:
            self.body = Pose2(self._x, self._y, self._yaw)
        self.measured = self._measure(now_ns)

    def _own_time(self, elapsed: int, informed: bool) -> int:
        if self._rate == 1.0 and not informed:
            return elapsed
        before = self._rate
        change = elapsed * 1e-9 / STOPPING_S
        self._rate = max(0.0, before - change) if informed else min(1.0, before + change)
        return round(0.5 * (before + self._rate) * elapsed)

    def _measure(self, now_ns: int) -> Sample | None:
        if now_ns < self._blind_until:
            return None
        return Sample("user.pose", now_ns, self._seen_at(self.body, self._head_yaw()))

    def _seen_at(self, body: Pose2, head_yaw: float) -> UserPose:
        """What tracking says of this pose: the same object for as long as nothing has changed."""
        seen = self._seen
        if (seen.body is not body and seen.body != body) or seen.head_yaw != head_yaw:
            self._seen = UserPose(body, head_yaw)
        return self._seen

    def _head_yaw(self) -> float:
        turn = self._head_turn
        return self.body.yaw if turn == 0.0 else wrap(self.body.yaw + turn)

    def _run(self) -> Iterator[bool]:
        """The whole routine; yields True whenever the budget is used up."""
        raise NotImplementedError

    def _stand(self, span_ns: int) -> Iterator[bool]:
        while span_ns > self._budget:
            span_ns -= self._budget
            yield True
        self._budget -= span_ns

    def _ask(self, touch: Touch) -> Iterator[bool]:
        yield from self._stand(touch.stand_ns)
        self.request = touch.deep(Pose2(self._x, self._y, self._yaw))
        yield from self._stand(touch.hold_ns)
        self.request = None
        yield from self._stand(touch.wait_ns)
