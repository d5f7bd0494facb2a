"""The motion of a person, estimated from tracked poses that are noisy and sometimes missing."""

from __future__ import annotations

from typing import Protocol

from hw import Twist2, UserPose

WALKS, STANDS = 0.2, 0.1
"""Hysteresis against noise of the pose, m/s: a person walks from the first speed on, and stands
below the second."""


class StampedPlace(Protocol):
    """A value with its stamp, ns."""

    @property
    def value(self) -> object: ...

    @property
    def stamp(self) -> int: ...


class VelocityEstimator:
    """Estimates the velocity of the body in the map, m/s, and its turn rate, rad/s, as a `Twist2`.

    None while unknown, see `hw.motion.velocity_estimator.Motion`. A gap that the window spans is
    bridged: once there is a fresh pose again, their mean velocity over the gap is known, and a
    robot on its way out need not stop. The translation of a standing person is 0.
    """

    def __init__(self, window: float) -> None:
        from hw.motion import Motion

        self._motion = Motion(window, gone=window)
        self.memory_s = window
        self._walks = False
        self._velocity: Twist2 | None = None

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one `UserPose`."""
        pose = sample.value
        assert isinstance(pose, UserPose)
        self._motion.add_pose(sample.stamp, pose.body.x, pose.body.y, pose.body.yaw)
        self._velocity = found = self._motion.velocity
        if found is None:
            return
        self._walks = found.speed >= (STANDS if self._walks else WALKS)
        if not self._walks and found.speed > 0.0:
            self._velocity = Twist2(0.0, 0.0, found.wz)

    def leap(self, span_ns: int) -> None:
        """Pass over repeats of the last pose; see `Motion`."""
        self._motion.leap(span_ns)

    def value(self) -> Twist2 | None:
        """The present estimate."""
        return self._velocity


class StillnessEstimator:
    """Estimates since when a person is slower than both limits, ns; None while moving (R89)."""

    idempotent = True
    memory_s = 0.0

    def __init__(self, speed: float, turn: float) -> None:
        self._speed, self._turn = speed, turn
        self._since: int | None = None

    def update(self, _signal: str, sample: StampedPlace) -> None:
        """Take one velocity."""
        velocity = sample.value
        assert isinstance(velocity, Twist2)
        if velocity.speed >= self._speed or abs(velocity.wz) >= self._turn:
            self._since = None
        elif self._since is None:
            self._since = sample.stamp

    def leap(self, span_ns: int) -> None:
        """Do nothing: since when they stand does not depend on repeats."""

    def value(self) -> int | None:
        """The stamp of the first velocity below the limits."""
        return self._since
