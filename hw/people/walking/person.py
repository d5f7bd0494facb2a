"""The interface of a simulated person (R24), and the base class of those with a routine.

Source of the figures: R23 (a cylinder of 1 m diameter), R13 (the position is the tailbone).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

from hw.geometry import Pose2, Pose3, wrap
from hw.people.walking.manner import ATTENTIVE, Manner
from hw.samples import Sample, UserPose

STOPPING_S = 0.5
"""Time in which a person who perceives the stop sign comes to a stop, s."""


class Person(Protocol):
    """A person's true pose, and what tracking sees of it.

    The attributes hold for the instant of the last `step`. A person perceives only the robot's pose
    and whether it is shown.
    """

    body: Pose2
    """True pose of the body in the map, also during drop-outs of tracking."""
    speed: float
    """True speed over the floor, m/s."""
    request: Pose3 | None
    """The DEEP in the map while the person requests a touch, else None (a level)."""
    measured: Sample | None
    """The newest `user.pose` since the step before; None if there is no new one."""
    finished: bool
    """True at the end of the script or recording."""

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Advance to now_ns; `informed`: the robot and the stop sign are shown (R115)."""
        ...


@dataclass(frozen=True, slots=True)
class Touch:
    """How a person requests a touch (R131, R132): times in ns, and the DEEP in m.

    They stand for `stand_ns`, request for `hold_ns`, let go, and stay for `wait_ns`, unless they
    are in a hurry. The DEEP is `ahead` of the body and `height` above the floor.
    """

    stand_ns: int = 10_000_000_000
    hold_ns: int = 30_000_000_000
    wait_ns: int = 5_000_000_000
    ahead: float = 0.85
    height: float = 1.5

    def deep(self, body: Pose2) -> Pose3:
        """The prop's target pose in the map: ahead of the body, its x axis along the view."""
        x, y = body.transform(self.ahead, 0.0)
        return Pose3.from_yaw(x, y, self.height, body.yaw)


class Actor:
    """A simulated person driven by one generator, on a clock that stops while the robot is shown.

    They perceive the sign, and its end, late by their reaction, which their manner and seed give
    (`reaction_s`, s; None: they ignore it). The person's own time runs with the world's, but slows
    to a standstill within STOPPING_S while they perceive that the robot is shown, and speeds up
    again after. The routine uses up `_budget` (ns of own time) and yields when it is spent, so that
    no time is lost between two steps of the routine.
    """

    def __init__(self, start: Pose2, manner: Manner = ATTENTIVE, seed: int = 0) -> None:
        self.manner, self.reaction_s = manner, manner.reaction(seed)
        self.body = start
        self.speed = 0.0
        self.request: Pose3 | None = None
        self.measured: Sample | None = None
        self.finished = False
        self._x, self._y, self._yaw = start.x, start.y, start.yaw
        self._head_turn = 0.0
        self._tempo = self._aside = 0.0
        self._rate = 1.0
        self._now = 0
        self._budget = 0
        self._robot = self._shown_at = start
        self._changes: deque[tuple[int, bool]] = deque()  # of the sign, when perceived, ns
        self._shown = self._informed = False
        self._blind_until = 0
        self._seen = UserPose(start, start.yaw)
        self._routine = self._run()

    def step(self, now_ns: int, robot: Pose2, informed: bool) -> None:
        """Advance to now_ns; see `Person`."""
        elapsed, self._now = now_ns - self._now, now_ns
        self._robot = robot
        self._perceive(informed)
        self._tempo = self._aside = 0.0
        self._budget = self._own_time(elapsed, self._halts(elapsed))
        self.finished = next(self._routine, None) is None
        self.speed = self._aside or self._tempo * self._rate
        body = self.body
        if body.x != self._x or body.y != self._y or body.yaw != self._yaw:
            self.body = Pose2(self._x, self._y, self._yaw)
        self.measured = self._measure(now_ns)

    def _perceive(self, shown: bool) -> None:
        """Update what the person perceives, delayed by their reaction time."""
        if self.reaction_s is None:
            return
        if shown:
            self._shown_at = self._robot
        if shown != self._shown:
            self._shown = shown
            self._changes.append((self._now + round(self.reaction_s * 1e9), shown))
        while self._changes and self._changes[0][0] <= self._now:
            _, self._informed = self._changes.popleft()

    def _halts(self, elapsed: int) -> bool:  # noqa: ARG002
        """True while they interrupt their routine for the robot; elapsed is in ns.

        A subclass that steps aside sets `_aside` to its speed, m/s.
        """
        return self._informed

    def _own_time(self, elapsed: int, halts: bool) -> int:
        if self._rate == 1.0 and not halts:
            return elapsed
        before = self._rate
        change = elapsed * 1e-9 / STOPPING_S
        self._rate = max(0.0, before - change) if halts else min(1.0, before + change)
        return round(0.5 * (before + self._rate) * elapsed)

    def _measure(self, now_ns: int) -> Sample | None:
        if now_ns < self._blind_until:
            return None
        return Sample("user.pose", now_ns, self._seen_at(self.body, self._head_yaw()))

    def _seen_at(self, body: Pose2, head_yaw: float) -> UserPose:
        """The measured pose for a true one: the same object while nothing has changed."""
        seen = self._seen
        if (seen.body is not body and seen.body != body) or seen.head_yaw != head_yaw:
            self._seen = UserPose(body, head_yaw)
        return self._seen

    def _head_yaw(self) -> float:
        turn = self._head_turn
        return self.body.yaw if turn == 0.0 else wrap(self.body.yaw + turn)

    def _run(self) -> Iterator[bool]:
        """The whole routine; yields True whenever the budget is spent."""
        raise NotImplementedError

    def _stand(self, span_ns: int) -> Iterator[bool]:
        while span_ns > self._budget:
            span_ns -= self._budget
            yield True
        self._budget -= span_ns

    def _ask(self, touch: Touch) -> Iterator[bool]:
        yield from self._stand(touch.stand_ns)
        self.request = touch.deep(Pose2(self._x, self._y, self._yaw))
        yield from self._hold(touch.hold_ns)
        self.request = None
        yield from self._stand(0 if self.manner.hurries else touch.wait_ns)

    def _hold(self, span_ns: int) -> Iterator[bool]:
        """Request for this time, or until they let go because they leave."""
        while self.request is not None and span_ns > self._budget:
            span_ns -= self._budget
            yield True
        if self.request is not None:
            self._budget -= span_ns
