"""Where robot and user are, when all that is known of it is measured with noise and too late.

A way planned anew from each measured pose follows every error of it. What was sent is known
exactly, though, and a pose reckoned by it moves as smoothly as the plan does; measured poses only
pull it along, by a tenth of the difference a cycle at 30 Hz. Planning anew then gives the same plan
again. What is farther off than noise is, because the robot was pushed or found itself anew, counts
at once. m, s, rad; all in the map.
"""

from __future__ import annotations

import math

from hw.geometry import STILL, Pose2, Twist2, wrap
from hw.room import Point

MEMORY = 1.0 / 3.0
"""Measured poses are averaged over this time, s."""
BAND = 0.06
"""Farther from what is measured than this nothing is reckoned, m and rad."""
LEAK = 1.0
"""For so long ways and changes of velocity are summed up to be compared, s."""
FORGOTTEN = 4.0
"""Comparisons count for so long, s."""
DOUBT = 7e-4
"""Weight of the delay that was told against those comparisons, m2/s."""
LONGEST_DELAY = 0.3
"""A base that is later than this is no base to drive with, s."""


def share_of(error: float, count: int, dt: float) -> float:
    """How much of a difference, m or rad, the count-th measurement corrects, 0 to 1.

    The first ones are averaged; what goes beyond the band is corrected in one go.
    """
    share = min(1.0, max(dt / MEMORY, 1.0 / count))
    if error > BAND:
        share = max(share, 1.0 - BAND * (1.0 - share) / error)
    return share


class DelayEstimator:
    """How much later than they were sent the wheels have velocities, s; delay and lag alike.

    What is missing of the way that was sent is the delay times what the velocity has changed.
    """

    def __init__(self, told: float) -> None:
        self._told = told
        self.forget()

    def forget(self) -> None:
        """The base has not gone where it was sent: nothing of that is delay."""
        self.delay = self._told
        self._missing = self._changed = (0.0, 0.0)
        self._products = self._squares = 0.0

    def update(self, missing: Point, changed: Point, dt: float) -> None:
        """Take what this cycle's measured way lacks of the sent one, m, and the change, m/s."""
        kept = math.exp(-dt / LEAK)
        mx, my = self._missing = _sum(self._missing, missing, kept)
        cx, cy = self._changed = _sum(self._changed, changed, kept)
        kept = math.exp(-dt / FORGOTTEN)
        self._products = kept * self._products + dt * (mx * cx + my * cy)
        self._squares = kept * self._squares + dt * (cx * cx + cy * cy)
        found = (self._products + DOUBT * self._told) / (self._squares + DOUBT)
        self.delay = min(LONGEST_DELAY, max(0.0, found))


def _sum(old: Point, new: Point, kept: float) -> Point:
    return kept * old[0] + new[0], kept * old[1] + new[1]


class ReckonedPose:
    """The robot's pose by the velocities sent, once they act; `delay` told, s, is a first guess."""

    def __init__(self, delay: float) -> None:
        self._delay = DelayEstimator(delay)
        self._count = 0
        self._pose = self._measured = Pose2(0.0, 0.0)
        self._sent = STILL

    @property
    def delay(self) -> float:
        """How late the wheels are, as far as is known, s."""
        return self._delay.delay

    def update(
        self, measured: Pose2, twist: Twist2, sent: Twist2, dt: float, *, lost: bool = False
    ) -> Pose2:
        """The pose when what was sent acts.

        Args:
            measured: map_from_base.
            twist: measured velocity, in the map.
            sent: velocity that was to be had by now, in the map.
            dt: time since the last cycle, s.
            lost: the base did not go where it was sent; all begins anew with what it has.
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
            self._pose = moved(self._pose, middle, dt)
        self._measured = measured
        seen = moved(measured, twist, self.delay)
        pose, count = self._pose, self._count
        ex, ey, turn = seen.x - pose.x, seen.y - pose.y, wrap(seen.yaw - pose.yaw)
        share, turned = share_of(math.hypot(ex, ey), count, dt), share_of(abs(turn), count, dt)
        self._pose = Pose2(pose.x + share * ex, pose.y + share * ey, wrap(pose.yaw + turned * turn))
        return self._pose


class ReckonedPlace:
    """Somebody else's place, by their velocity and measured places."""

    def __init__(self) -> None:
        self._count = 0
        self._place = (0.0, 0.0)

    def update(self, measured: Point, velocity: Point, dt: float) -> Point:
        """The place now; `velocity` in m/s, `dt` since the last cycle, s."""
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


def moved(pose: Pose2, motion: Twist2, time: float) -> Pose2:
    """Where a velocity in the map leads within a time, s."""
    x, y = pose.x + time * motion.vx, pose.y + time * motion.vy
    return Pose2(x, y, wrap(pose.yaw + time * motion.wz))
