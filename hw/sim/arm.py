"""The arm in the reduced simulation: straight joint lines with trapezoid speed, and timed courses.

Where the arm is follows from the time alone, so an arm at rest costs nothing and the time step
does not matter.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from hw.robot import ArmModel, MotionLimits
from hw.samples import ArmState, Joints, Sample, TimedJoints

_NOWHERE = 1e-12
"""A move shorter than this, rad, is none."""
START_TOLERANCE = 0.01
"""How far from the arm a course may begin, rad."""


@dataclass(frozen=True, slots=True)
class JointLine:
    """A move along a straight joint line from rest to rest; the share of the way goes 0 to 1.

    `rate` is the highest change of the share per s, `slope` its change per s2, `stretch` the
    factor by which the whole move is slowed down.
    """

    start: Joints
    way: Joints
    rate: float
    slope: float
    stretch: float = 1.0

    @classmethod
    def fastest(
        cls, model: ArmModel, acceleration: float, start: Joints, goal: Joints, duration: float
    ) -> JointLine:
        """The move in the shortest time within the limits, or in duration s if that is longer."""
        way = tuple(b - a for a, b in zip(start, goal, strict=True))
        longest = max(abs(d) for d in way)
        if longest < _NOWHERE:
            return cls(start, way, math.inf, math.inf)
        speeds = zip(model.max_speed, way, strict=True)
        slope = acceleration / longest
        # a line too short to reach its speed limit has a triangle for a profile
        rate = min(min(v / abs(d) for v, d in speeds if d), math.sqrt(slope))
        line = cls(start, way, rate, slope)
        return cls(start, way, rate, slope, max(1.0, duration / line.duration))

    @property
    def duration(self) -> float:
        """Time of the whole move, s."""
        return (
            0.0
            if self.rate == math.inf
            else self.stretch * (1.0 / self.rate + self.rate / self.slope)
        )

    def at(self, t: float) -> tuple[float, float]:
        """Share of the way and its change per s, t s after the start."""
        if t >= self.duration:
            return 1.0, 0.0
        t, ramp = max(0.0, t / self.stretch), self.rate / self.slope
        left = 1.0 / self.rate + ramp - t
        if t < ramp:
            return 0.5 * self.slope * t * t, self.slope * t / self.stretch
        if left < ramp:
            return 1.0 - 0.5 * self.slope * left * left, self.slope * left / self.stretch
        return self.rate * (t - 0.5 * ramp), self.rate / self.stretch

    def joints(self, share: float) -> Joints:
        """The angles at a share of the way."""
        return tuple(a + share * d for a, d in zip(self.start, self.way, strict=True))

    def slope_at(self, _share: float) -> Joints:
        """Change of the angles with the share."""
        return self.way


@dataclass(frozen=True, slots=True)
class JointCourse:
    """Joint angles at rising times from 0 on, straight in between; its share is that time, s."""

    times: tuple[float, ...]
    points: tuple[Joints, ...]

    @classmethod
    def of(cls, points: Sequence[TimedJoints]) -> JointCourse:
        """The course through checked points."""
        return cls(tuple(time for time, _ in points), tuple(joints for _, joints in points))

    @property
    def duration(self) -> float:
        """Time of the last point, s."""
        return self.times[-1]

    def at(self, t: float) -> tuple[float, float]:
        """Share of the way and its change per s, t s after the start."""
        return (self.duration, 0.0) if t >= self.duration else (max(0.0, t), 1.0)

    def joints(self, share: float) -> Joints:
        """The angles at a share of the way."""
        if share >= self.duration:
            return self.points[-1]
        k = self._piece(share)
        rest = share - self.times[k]
        return tuple(
            a + rest * v for a, v in zip(self.points[k], self.slope_at(share), strict=True)
        )

    def slope_at(self, share: float) -> Joints:
        """Change of the angles with the share, rad/s."""
        k = self._piece(share)
        span = self.times[k + 1] - self.times[k]
        return tuple(
            (b - a) / span for a, b in zip(self.points[k], self.points[k + 1], strict=True)
        )

    def _piece(self, share: float) -> int:
        return min(bisect_right(self.times, share), len(self.times) - 1) - 1


class SimArm:
    """An arm that moves within its limits; a stop brakes along the line, within 0.2 s (R45)."""

    signals: tuple[str, ...] = ("arm.joints",)

    def __init__(self, model: ArmModel, limits: MotionLimits, joints: Joints | None = None) -> None:
        start = model.parked if joints is None else joints
        model.check(start)
        self._model = model
        self._acceleration = limits.arm_acceleration
        self._still = (0.0,) * len(start)
        self.state = ArmState(start, self._still)
        self.braked = False
        self._line: JointLine | JointCourse | None = None
        self._since = 0
        self._brake: tuple[float, float, float] | None = None
        self._next: tuple[Joints, float] | None = None
        self._now = 0
        self._reported = -1

    def move_to(self, joints: Joints, duration_s: float | None = None) -> None:
        """Go to these angles; see `Arm`."""
        self._model.check(joints)
        duration = 0.0 if duration_s is None else duration_s
        if not 0.0 <= duration < math.inf:
            raise ValueError(
                f"arm: a duration of {duration_s} s; it must be finite and not below 0"
            )
        if self.braked:
            return
        self._next = (joints, duration)
        if self._line is None:
            self._begin(self._now)
        elif self._brake is None:
            self._start_braking()

    def follow(self, points: Sequence[TimedJoints]) -> None:
        """Be at these angles at these times; see `Arm`."""
        self._model.check_course(points)
        if self._line is not None:
            self.stop()
        elif not self.braked and begins_at(points, self.state.joints) and len(points) > 1:
            self._line, self._since = JointCourse.of(points), self._now

    def stop(self) -> None:
        """Brake to standstill; see `Arm`."""
        self._next = None
        if self._line is not None and self._brake is None:
            self._start_braking()

    def samples(self, now_ns: int) -> list[Sample]:
        """The joints of this instant."""
        if self._reported == now_ns:
            return []
        self._reported = now_ns
        return [Sample("arm.joints", now_ns, self.state)]

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        if self.braked and (self._next is not None or self._brake is None):
            self.stop()
        self._now = until_ns
        line = self._line
        while line is not None:
            share, rate, left = self._progress(line, (until_ns - self._since) * 1e-9)
            joints = line.joints(share)
            if left > 0.0:
                velocities = tuple(rate * d for d in line.slope_at(share))
                self.state = ArmState(joints, velocities, moving=True)
                return
            self.state = ArmState(joints, self._still)
            self._line = self._brake = None
            self._begin(until_ns + round(left * 1e9))
            line = self._line

    def _progress(self, line: JointLine | JointCourse, t: float) -> tuple[float, float, float]:
        """Share, its rate, and time left (negative: since when it is over), t s after `_since`."""
        if self._brake is None:
            share, rate = line.at(t)
            return share, rate, line.duration - t
        share, rate, slope = self._brake
        over = rate / slope
        braking = min(t, over)
        share += rate * braking - 0.5 * slope * braking * braking
        return share, rate - slope * braking, over - t

    def _start_braking(self) -> None:
        line = self._line
        assert line is not None
        share, rate = line.at((self._now - self._since) * 1e-9)
        longest = max(_NOWHERE, *(abs(d) for d in line.slope_at(share)))
        self._brake = (share, rate, self._model.stop_deceleration / longest)
        self._since = self._now

    def _begin(self, since_ns: int) -> None:
        if self._next is None:
            return
        joints, duration = self._next
        self._next = None
        line = JointLine.fastest(
            self._model, self._acceleration, self.state.joints, joints, duration
        )
        if line.duration > 0.0:
            self._line, self._since = line, since_ns


def begins_at(points: Sequence[TimedJoints], joints: Joints) -> bool:
    """Does a course begin where the arm stands?"""
    return all(abs(a - b) <= START_TOLERANCE for a, b in zip(points[0][1], joints, strict=True))
