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

    A person may have `still_until_ns`: before this instant nothing about them changes, and they are
    measured at each one as at this one, unless the sign is shown to them.
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
    no time is lost between two steps of the routine. While they stand it is not resumed: `_waits`
    is the own time left, ns.
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
        self._budget = self._waits = 0
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
        if informed or self._shown or self._changes:
            self._perceive(informed)
        self._tempo = self._aside = 0.0
        halts = self._halts(elapsed)
        budget = elapsed if self._rate == 1.0 and not halts else self._own_time(elapsed, halts)
        if budget < self._waits:
            self._waits -= budget
        else:
            self._budget = budget
            self.finished = next(self._routine, None) is None
        self.speed = self._aside or self._tempo * self._rate
        body = self.body
        if body.x != self._x or body.y != self._y or body.yaw != self._yaw:
            self.body = Pose2(self._x, self._y, self._yaw)
        self.measured = self._measure(now_ns)

    @property
    def still_until_ns(self) -> int:
        """Nothing about them changes before this instant unless the sign is shown, ns."""
        moves = self.speed or self._rate != 1.0
        return self._now if moves or self._shown or self._changes else self._now + self._waits

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
        before = self._rate
        change = elapsed * 1e-9 / STOPPING_S
        self._rate = max(0.0, before - change) if halts else min(1.0, before + change)
        return round(0.5 * (before + self._rate) * elapsed)

    def _measure(self, now_ns: int) -> Sample | None:
        if now_ns < self._blind_until:
            return None
        body, turn = self.body, self._head_turn
        head_yaw = body.yaw if turn == 0.0 else wrap(body.yaw + turn)
        return Sample("user.pose", now_ns, self._seen_at(body, head_yaw))

    def _seen_at(self, body: Pose2, head_yaw: float) -> UserPose:
        """The measured pose for a true one: the same object while nothing has changed."""
        seen = self._seen
        if (seen.body is not body and seen.body != body) or seen.head_yaw != head_yaw:
            self._seen = UserPose(body, head_yaw)
        return self._seen

    def _run(self) -> Iterator[bool]:
        """The whole routine; yields True whenever the budget is spent."""
        raise NotImplementedError

    def _stand(self, span_ns: int) -> Iterator[bool]:
        """Stand for this much of their own time; the routine is resumed once it is over."""
        if span_ns > self._budget:
            self._waits = span_ns - self._budget
            yield True
            span_ns, self._waits = self._waits, 0
        self._budget -= span_ns

    def _ask(self, touch: Touch) -> Iterator[bool]:
        yield from self._stand(touch.stand_ns)
        self.request = touch.deep(Pose2(self._x, self._y, self._yaw))
        yield from self._stand(touch.hold_ns)
        self.request = None
        yield from self._stand(0 if self.manner.hurries else touch.wait_ns)

    def _let_go(self) -> None:
        """End their request early, because they leave."""
        if self.request is not None:
            self.request, self._waits = None, 0
