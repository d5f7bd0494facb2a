"""The arm of the reduced simulation: exactly where its trajectory says, linear between points.

The joint angles follow from the time alone, so an arm at rest costs nothing and the time step has
no influence.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hw.robot import ArmModel
from hw.samples import ArmState, Joints, Sample, TimedJoints

_NOWHERE = 1e-12
"""Least speed of the fastest joint that braking is computed from, rad/s: no division by 0."""
STOPPED = "the stop line is pulled"
START_TOLERANCE = 0.01
"""Largest distance of the arm from the first point of a trajectory, rad."""


@dataclass(frozen=True, slots=True)
class JointCourse:
    """Joint angles at times rising from 0, linear in between; a `share` is a planned time, s."""

    times: tuple[float, ...]
    points: tuple[Joints, ...]

    @classmethod
    def of(cls, points: Sequence[TimedJoints]) -> JointCourse:
        """The trajectory through checked points."""
        return cls(tuple(time for time, _ in points), tuple(joints for _, joints in points))

    @property
    def duration(self) -> float:
        """Time of the last point, s."""
        return self.times[-1]

    def at(self, t: float) -> tuple[float, float]:
        """The share reached t s after the start, and its rate: 1, and 0 at the end."""
        return (self.duration, 0.0) if t >= self.duration else (max(0.0, t), 1.0)

    def joints(self, share: float) -> Joints:
        """The angles at a share of the trajectory, rad."""
        if share >= self.duration:
            return self.points[-1]
        k = self._piece(share)
        rest = share - self.times[k]
        return tuple(
            a + rest * v for a, v in zip(self.points[k], self.slope_at(share), strict=True)
        )

    def slope_at(self, share: float) -> Joints:
        """Joint velocities at a rate of 1, rad/s."""
        k = self._piece(share)
        span = self.times[k + 1] - self.times[k]
        return tuple(
            (b - a) / span for a, b in zip(self.points[k], self.points[k + 1], strict=True)
        )

    def _piece(self, share: float) -> int:
        return min(bisect_right(self.times, share), len(self.times) - 1) - 1


class SimArm:
    """An arm that follows its trajectory exactly; a stop brakes along it, within 0.2 s (R45)."""

    signals: tuple[str, ...] = ("arm.joints",)

    def __init__(self, model: ArmModel, joints: Joints | None = None) -> None:
        start = model.parked if joints is None else joints
        model.check(start)
        self._model = model
        self._still = (0.0,) * len(start)
        self.state = ArmState(start, self._still)
        self.braked = False
        self._course: JointCourse | None = None
        self._since = 0
        self._brake: tuple[float, float, float] | None = None
        self._now = 0
        self._reported = -1

    def follow(self, points: Sequence[TimedJoints]) -> int:
        """Follow a trajectory; see `Arm`."""
        self._model.check_course(points)
        refused = refusal(self.state, points, self.braked)
        self.stop()
        number = self.state.course + 1
        self.state = replace(self.state, course=number, refused=refused)
        if refused is None and len(points) > 1:
            self._course, self._since = JointCourse.of(points), self._now
        return number

    def stop(self) -> None:
        """Brake to standstill; see `Arm`."""
        course = self._course
        if course is None or self._brake is not None:
            return
        share, rate = course.at((self._now - self._since) * 1e-9)
        longest = max(_NOWHERE, *(abs(d) for d in course.slope_at(share)))
        self._brake = (share, rate, self._model.stop_deceleration / longest)
        self._since = self._now

    def samples(self, now_ns: int) -> list[Sample]:
        """The joints at this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        return [Sample("arm.joints", now_ns, self.state)]

    def advance(self, until_ns: int) -> None:
        """Advance to until_ns."""
        course = self._course
        if course is not None and self.braked and self._brake is None:
            self.state = replace(self.state, refused=STOPPED)
            self.stop()
        self._now = until_ns
        if course is None:
            return
        share, rate, left = self._progress(course, (until_ns - self._since) * 1e-9)
        moving = left > 0.0
        velocities = self._still
        if moving:
            velocities = tuple(rate * d for d in course.slope_at(share))
        else:
            self._course = self._brake = None
        number, refused = self.state.course, self.state.refused
        self.state = ArmState(course.joints(share), velocities, moving, number, refused)

    def _progress(self, course: JointCourse, t: float) -> tuple[float, float, float]:
        """Share, its rate, and the time left, s, at t s after `_since`.

        While braking with the slope d the rate falls from r as r - d t, so the share grows by
        r t - d t^2 / 2 until r / d.
        """
        if self._brake is None:
            share, rate = course.at(t)
            return share, rate, course.duration - t
        share, rate, slope = self._brake
        over = rate / slope
        braking = min(t, over)
        share += rate * braking - 0.5 * slope * braking * braking
        return share, rate - slope * braking, over - t


def refusal(state: ArmState, points: Sequence[TimedJoints], braked: bool) -> str | None:
    """Why an arm refuses a trajectory now; None if it follows it."""
    if braked:
        return STOPPED
    if state.moving:
        return "the arm moves"
    begin = zip(points[0][1], state.joints, strict=True)
    away = max(abs(a - b) for a, b in begin)
    return None if away <= START_TOLERANCE else f"the arm stands {away:.3f} rad from its start"
