"""Reckoned poses by plain rules over value objects: what the compiled ones are compared with."""

from __future__ import annotations

import math

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.scene import Point
from states.navigation.local.reckoning import (
    BAND,
    DOUBT,
    FORGOTTEN,
    LEAK,
    LONGEST_DELAY,
    MEMORY,
)


def share_of(error: float, count: int, dt: float) -> float:
    """Gain with which the count-th measurement corrects a difference, m or rad, 0 to 1.

    The first measurements are averaged. A larger error is brought down to what an error of BAND
    would leave: (1 - gain) error = (1 - share) BAND.
    """
    share = min(1.0, max(dt / MEMORY, 1.0 / count))
    if error > BAND:
        share = max(share, 1.0 - BAND * (1.0 - share) / error)
    return share


class DelayEstimator:
    """Estimates how late the wheels follow what was sent, s, dead time and lag together.

    Over any interval the distance driven falls short of the distance sent by the delay times the
    change of velocity: missing = delay * changed. The delay is the least-squares solution over
    exponentially forgotten sums, sum(missing . changed) / sum(changed . changed), regularised
    towards the `prior` delay.
    """

    def __init__(self, prior: float) -> None:
        self._prior = prior
        self.forget()

    def forget(self) -> None:
        """Start again from the prior delay: the missing distance had another cause."""
        self.delay = self._prior
        self._missing = self._changed = (0.0, 0.0)
        self._products = self._squares = 0.0

    def update(self, missing: Point, changed: Point, dt: float) -> None:
        """Add a cycle of dt s: its missing distance, m, and its change of velocity, m/s."""
        kept = math.exp(-dt / LEAK)
        mx, my = self._missing = _sum(self._missing, missing, kept)
        cx, cy = self._changed = _sum(self._changed, changed, kept)
        kept = math.exp(-dt / FORGOTTEN)
        self._products = kept * self._products + dt * (mx * cx + my * cy)
        self._squares = kept * self._squares + dt * (cx * cx + cy * cy)
        found = (self._products + DOUBT * self._prior) / (self._squares + DOUBT)
        self.delay = min(LONGEST_DELAY, max(0.0, found))


def _sum(old: Point, new: Point, kept: float) -> Point:
    return kept * old[0] + new[0], kept * old[1] + new[1]


class ReckonedPose:
    """The robot's pose, integrated from the velocities sent; `delay`, s, is a first guess."""

    def __init__(self, delay: float) -> None:
        self._delay = DelayEstimator(delay)
        self._count = 0
        self._pose = self._measured = Pose2(0.0, 0.0)
        self._sent = STILL

    @property
    def delay(self) -> float:
        """The estimated delay of the wheels, s."""
        return self._delay.delay

    def update(
        self, measured: Pose2, twist: Twist2, sent: Twist2, dt: float, *, lost: bool = False
    ) -> Pose2:
        """The pose at the instant from which the velocity sent now acts.

        Args:
            measured: map_from_base.
            twist: measured velocity, in the map.
            sent: velocity that the base should have by now, in the map.
            dt: time since the last cycle, s.
            lost: the base did not follow; start again from the measured pose.
        """
        if lost:
            self._delay.forget()
            self._count = 0
        before, self._sent = self._sent, sent
        self._count += 1
        if self._count > 1:
            middle = _mean(before, sent)
            gone = measured.x - self._measured.x, measured.y - self._measured.y
            missing = dt * middle.vx - gone[0], dt * middle.vy - gone[1]
            self._delay.update(missing, (sent.vx - before.vx, sent.vy - before.vy), dt)
            self._pose = self._pose.moved(middle, dt)
        self._measured = measured
        seen = measured.moved(twist, self.delay)
        pose, count = self._pose, self._count
        ex, ey, turn = seen.x - pose.x, seen.y - pose.y, wrap(seen.yaw - pose.yaw)
        share, turned = share_of(math.hypot(ex, ey), count, dt), share_of(abs(turn), count, dt)
        self._pose = Pose2(pose.x + share * ex, pose.y + share * ey, wrap(pose.yaw + turned * turn))
        return self._pose


class ReckonedPlace:
    """The user's position, integrated from their velocity and corrected by measured positions."""

    def __init__(self) -> None:
        self._count = 0
        self._place = (0.0, 0.0)

    def update(self, measured: Point, velocity: Point, dt: float) -> Point:
        """The position now; `velocity` in m/s, `dt` since the last cycle, s."""
        self._count += 1
        x, y = self._place
        if self._count > 1:
            x, y = x + dt * velocity[0], y + dt * velocity[1]
        ex, ey = measured[0] - x, measured[1] - y
        share = share_of(math.hypot(ex, ey), self._count, dt)
        self._place = (x + share * ex, y + share * ey)
        return self._place


def _mean(a: Twist2, b: Twist2) -> Twist2:
    return Twist2(0.5 * (a.vx + b.vx), 0.5 * (a.vy + b.vy), 0.5 * (a.wz + b.wz))
