"""The pose carried on from its last correction by the wheels' displacement, however long ago.

A step (dx, dy, dyaw) of the base in its own frame takes pose p to p' and its covariance P to

    P' = F P F^T + R Q R^T,   F = (1 0 -(y' - y); 0 1 x' - x; 0 0 1)

with the rotation R by the yaw and slip Q, a variance per metre and per radian of the step. Steps
are those between wheel samples, so that a way out and back counts twice, and an error of the yaw
moves all that follows. How much these wheels slip on this floor is learnt from the matches.

Over a gap between wheel samples the way is longer than the step: the base goes on at the pace
before, over a length L and an angle A, and the yaw slips by a variance r of that. An error of the
yaw moves the end aside by it times what is then left to the end: by r l^2 / 3 in all on a straight
way of length l, by r L^2 / 12 on a way out and back. So r (L^2 - l^2) / 12 is added in both
directions, since the way itself is unknown.

Wheels also have an error of scale s, the same at every step: a worn or soft tyre. Along a corridor
that shows no progress it adds up with the way, not with its root. The lever l = dp/ds is carried
on as the pose is, l' = F l + (dx dy 0)^T, and a match of information I leaves (1 + P I)^-1 l of it.
It adds s^2 l l^T to the covariance, as far as that is more than the slip of so long a way.
"""

from __future__ import annotations

import math

import numpy as np

from hw import Pose2, compiled
from states.localization.filter import ProcessNoise
from states.localization.wheels.steps import Planar, composed, place_of, step
from states.maps import Array

USUAL, WORST = 4.0, 100.0
"""Slip before anything is known, and at most, in multiples of the floor's variance."""
WEIGHT = 0.1
"""Weight of each match in the mean slip."""
SURPRISE = 25.0
"""Largest squared error of a prediction that counts, in multiples of its variance."""
GAP = 1.0
"""Wheel samples farther apart than this leave a gap, s."""
PACE_OVER = 30.0
"""Time over which the usual pace is averaged, s."""
SCALE = 0.05
"""Standard deviation of the wheels' scale, as a share."""
UNSEEN = (0.3, 0.3)
"""Standard deviation of the motion during a reset of the odometry, m and rad."""
NOTHING = np.zeros((3, 3))
NOTHING.flags.writeable = False
_ONES = np.eye(3)


class DeadReckoning:
    """The pose of the base by stamps of odometry: give it every sample and every correction."""

    def __init__(self, noise: ProcessNoise) -> None:
        metre, radian = noise.per_metre, noise.per_radian
        self._noise = (metre[0], metre[2], radian[0], radian[2])
        self._pose: Planar | None = None
        self._covariance, self._lever = np.zeros((3, 3)), np.zeros(3)
        self._odom_from_base = (0.0, 0.0, 0.0)
        self.slip = USUAL
        self._pace = (0.0, 0.0)

    def weigh(self, off: Array, covariance: Array) -> None:
        """Take by how much a match differs from its prediction, (3,), and the covariance of that.

        Differences of wheels and scans have many causes: slip, wear, stamps that lie. All show in
        the mean of off^T covariance^-1 off / 3, which is 1 if the variance by slip is right.
        """
        surprise = min(SURPRISE, float(off @ np.linalg.solve(covariance, off)) / 3.0)
        self.slip *= 1.0 + WEIGHT * (surprise - 1.0)
        self.slip = min(WORST, max(1.0, self.slip))

    def correct(
        self,
        map_from_base: Pose2,
        covariance: Array,
        odom_from_base: Pose2,
        information: Array | None = None,
    ) -> None:
        """Go on from this pose and its covariance (3, 3), where odometry has this pose.

        `information` (3, 3) is that of the match which has corrected it; None: the pose is new, and
        owes nothing to the wheels.
        """
        lever, odom = np.zeros(3), place_of(odom_from_base)
        if information is not None and self._pose is not None:
            _, before, lever = self._after(step(self._odom_from_base, odom))
            gain = (before + self._by_scale(lever)) @ information
            lever = np.asarray(np.linalg.solve(_ONES + gain, lever), np.float64)
        self._pose, self._lever = place_of(map_from_base), lever
        self._covariance = np.array(covariance)
        self._odom_from_base = odom

    @property
    def by_scale(self) -> Array:
        """Covariance (3, 3) by the error of the scale, as far as it is more than that by slip."""
        return self._by_scale(self._lever)

    def _by_scale(self, lever: Array) -> Array:
        length = math.hypot(lever[0], lever[1])
        if SCALE**2 * length <= self.slip * self._noise[0]:
            return NOTHING
        return (SCALE**2 - self.slip * self._noise[0] / length) * np.outer(lever, lever)

    def move(self, odom_from_base: Pose2, elapsed: float, turn: float | None) -> None:
        """Take an odometry pose, `elapsed` s after the last one.

        `turn` is the angle by the gyroscope since the last one, rad.
        """
        odom = place_of(odom_from_base)
        x, y, yaw = step(self._odom_from_base, odom)
        yaw = yaw if turn is None else turn
        unseen = self._unseen(math.hypot(x, y), abs(yaw), elapsed)
        if self._pose is not None:
            self._pose, self._covariance, self._lever = self._after((x, y, yaw), unseen)
        self._odom_from_base = odom

    def _unseen(self, length: float, angle: float, elapsed: float) -> tuple[float, float]:
        """Length, m, and angle, rad, beyond those of a step, over a gap; else note the pace."""
        speed, rate = self._pace
        if elapsed > GAP:
            return max(0.0, speed * elapsed - length), max(0.0, rate * elapsed - angle)
        keep = math.exp(-elapsed / PACE_OVER)
        new = (1.0 - keep) / max(elapsed, 1e-9)
        self._pace = keep * speed + new * length, keep * rate + new * angle
        return 0.0, 0.0

    def restart(self, odom_from_base: Pose2) -> None:
        """Take the first odometry pose after a reset: the motion since the last one is unknown."""
        self._odom_from_base = place_of(odom_from_base)
        self._covariance += np.diag([UNSEEN[0] ** 2, UNSEEN[0] ** 2, UNSEEN[1] ** 2])

    def at(self, odom_from_base: Pose2) -> tuple[Pose2, Array] | None:
        """map_from_base and its covariance at an odometry pose; None if never corrected."""
        if self._pose is None:
            return None
        moved = step(self._odom_from_base, place_of(odom_from_base))
        place, covariance, lever = self._after(moved)
        return Pose2(*place), covariance + self._by_scale(lever)

    def _after(
        self, moved: Planar, unseen: tuple[float, float] = (0.0, 0.0)
    ) -> tuple[Planar, Array, Array]:
        """Pose, covariance and lever after a step."""
        assert self._pose is not None
        covariance, lever = self._covariance.copy(), self._lever.copy()
        place = _carry(self._pose, moved, covariance, lever, unseen, self.slip, self._noise)
        return place, covariance, lever


@compiled
def _carry(
    before: Planar,
    moved: Planar,
    covariance: Array,
    lever: Array,
    unseen: tuple[float, float],
    slip: float,
    noise: tuple[float, float, float, float],
) -> Planar:
    """Carry covariance and lever on by a step, in place; Q is equal in all directions: no R.

    Returns the pose after the step.
    """
    after = composed(before, moved)
    p, dx, dy, turn = covariance, after[0] - before[0], after[1] - before[1], moved[2]
    straight = math.hypot(dx, dy)
    way = straight + unseen[0]
    length, angle = slip * way, slip * (abs(turn) + unseen[1])
    xt, yt, tt = p[0, 2], p[1, 2], p[2, 2]
    p[0, 0] += -2.0 * dy * xt + dy * dy * tt
    p[1, 1] += 2.0 * dx * yt + dx * dx * tt
    p[0, 1] += dx * xt - dy * yt - dx * dy * tt
    p[0, 2] -= dy * tt
    p[1, 2] += dx * tt
    place, yaw = noise[0] * length + noise[2] * angle, noise[1] * length + noise[3] * angle
    place += yaw * (way * way - straight * straight) / 12.0
    # the turn of the step itself is spread evenly along it
    p[0, 0] += place + yaw * dy * dy / 3.0
    p[1, 1] += place + yaw * dx * dx / 3.0
    p[0, 1] -= yaw * dx * dy / 3.0
    p[0, 2] -= 0.5 * yaw * dy
    p[1, 2] += 0.5 * yaw * dx
    p[2, 2] += yaw
    lever[0] += dx - dy * lever[2]
    lever[1] += dy + dx * lever[2]
    p[1, 0], p[2, 0], p[2, 1] = p[0, 1], p[0, 2], p[1, 2]
    return after
