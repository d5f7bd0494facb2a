"""The arm of the reduced simulation: exactly where its trajectory says, linear between points.

The joint angles follow from the time alone, so an arm at rest costs nothing and the time step has
no influence.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace

from hw.model import ArmModel, check_pace
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
        times, joints = zip(*points, strict=True)
        return cls(times, joints)

    def at(self, share: float) -> tuple[Joints, Joints]:
        """Angles, rad, and velocities at a rate of 1, rad/s, at a share of the trajectory."""
        times, points = self.times, self.points
        k = min(bisect_right(times, share), len(times) - 1)
        start, span, rest = points[k - 1], times[k] - times[k - 1], share - times[k - 1]
        slope = tuple([(b - a) / span for a, b in zip(start, points[k], strict=True)])
        if share >= times[-1]:
            return points[-1], slope
        return tuple([a + rest * v for a, v in zip(start, slope, strict=True)]), slope


@dataclass(frozen=True, slots=True)
class PacedCourse:
    """Progress along a course from `since_ns` on, while its rate tends to `rate` at `slope` per s.

    `share` and `before` are the share, s, and the rate at that instant.
    """

    course: JointCourse
    since_ns: int
    share: float = 0.0
    before: float = 1.0
    rate: float = 1.0
    slope: float = 1.0

    def at(self, now_ns: int) -> tuple[float, float]:
        """Share and rate at an instant.

        While the rate goes from r to w by +-d per second the share grows by r t +- d t^2 / 2, until
        |w - r| / d, and by w t from then on.
        """
        t = (now_ns - self.since_ns) * 1e-9
        change = self.rate - self.before
        if change == 0.0:
            share, rate = self.share + self.rate * (now_ns - self.since_ns) * 1e-9, self.rate
        else:
            slope = math.copysign(self.slope, change)
            changing = min(t, abs(change) / self.slope)
            share = self.share + changing * (self.before + 0.5 * slope * changing)
            share += (t - changing) * self.rate
            rate = self.rate if t >= abs(change) / self.slope else self.before + slope * t
        end = self.course.times[-1]
        return (end, 0.0) if share >= end else (share, rate)

    def paced(self, now_ns: int, rate: float, deceleration: float) -> PacedCourse:
        """The same course, with this rate from now on; `deceleration` of its fastest joint."""
        share, before = self.at(now_ns)
        fastest = max(_NOWHERE, *map(abs, self.course.at(share)[1]))
        return PacedCourse(self.course, now_ns, share, before, rate, deceleration / fastest)


class SimArm:
    """An arm that follows its trajectory exactly; a stop brakes along it, within 0.2 s (R45).

    `still`: it stands, and nothing has been asked of it since the last step.
    """

    signals: tuple[str, ...] = ("arm.joints",)

    def __init__(self, model: ArmModel, joints: Joints) -> None:
        model.check(joints)
        self._model = model
        self._still = (0.0,) * len(joints)
        self.state = ArmState(joints, self._still)
        self.braked = False
        self.still = False
        self._course: PacedCourse | None = None
        self._now = 0
        self._reported = -1

    def follow(self, points: Sequence[TimedJoints]) -> int:
        """Follow a trajectory; see `Arm`."""
        self._model.check_course(points)
        self.still = False
        refused = refusal(self.state, points, self.braked)
        self.stop()
        number = self.state.course + 1
        self.state = replace(self.state, course=number, refused=refused)
        if refused is None and len(points) > 1:
            self._course = PacedCourse(JointCourse.of(points), self._now)
        return number

    def pace(self, share: float, separation: float | None = None, needed: float = 0.0) -> None:  # noqa: ARG002  why is for the record
        """Follow the present trajectory at this share of its speed; see `Arm`."""
        check_pace(share)
        course = self._course
        if course is not None and 0.0 < course.rate != share:
            self._course = course.paced(self._now, share, self._model.stop_deceleration)

    def stop(self) -> None:
        """Brake to standstill; see `Arm`."""
        course = self._course
        if course is not None and course.rate > 0.0:
            self._course = course.paced(self._now, 0.0, self._model.stop_deceleration)

    def samples(self, now_ns: int) -> list[Sample]:
        """The joints at this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        return [Sample("arm.joints", now_ns, self.state)]

    def advance(self, until_ns: int) -> None:
        """Advance to until_ns."""
        course = self._course
        if course is not None and self.braked and course.rate > 0.0:
            self.state = replace(self.state, refused=STOPPED)
            self.stop()
            course = self._course
        self._now, self.still = until_ns, course is None
        if course is None:
            return
        share, rate = course.at(until_ns)
        joints, slope = course.course.at(share)
        known, moving, velocities = self.state, rate > 0.0, self._still
        if moving:
            velocities = tuple([rate * v for v in slope])
        else:
            self._course = None
        self.state = ArmState(
            joints,
            velocities,
            moving,
            known.course,
            known.refused,
            known.mode,
            rate if moving else 1.0,
        )


def refusal(state: ArmState, points: Sequence[TimedJoints], braked: bool) -> str | None:
    """Why an arm refuses a trajectory now; None if it follows it."""
    if braked:
        return STOPPED
    if state.moving:
        return "the arm moves"
    begin = zip(points[0][1], state.joints, strict=True)
    away = max(abs(a - b) for a, b in begin)
    return None if away <= START_TOLERANCE else f"the arm stands {away:.3f} rad from its start"
