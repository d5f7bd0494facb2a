"""Motion measured by wheels and gyroscope, and whether it can be trusted."""

from __future__ import annotations

import numpy as np

from hw import Pose2, Twist2
from states.localization.filter import ProcessNoise
from states.localization.wheels.dead_reckoning import NOTHING, DeadReckoning
from states.localization.wheels.gyro import Gyro
from states.localization.wheels.odometry_watch import OdometryWatch
from states.localization.wheels.trail import Trail
from states.localization.wheels.wheel_clock import WheelClock
from states.maps import Array

MISSING_NS = 300_000_000
"""Wheels whose newest sample is this much older than the newest scan count as missing, ns."""
MISSED_SCANS = 3
"""Least number of scans without a wheel sample between them until wheels count as missing."""
MOMENT_NS = 50_000_000
"""Time over which the velocity at an instant is measured, ns."""
TURNING = 0.05
"""A base whose gyroscope reads more than this is not at rest, whatever its wheels say, rad/s."""
ALONE = 0.05
"""A standard deviation by the wheels' scale from which they drive alone, m."""
STOOD = 0.3
"""Wheels that have not moved for this long count as standing, s."""


class WheelMotion:
    """Odometry of the last seconds, checked against the motion that scans show."""

    def __init__(self, slip: ProcessNoise) -> None:
        self.trail, self.gyro, self.watch = Trail(), Gyro(), OdometryWatch()
        self.clock = WheelClock()
        self._reckoning = DeadReckoning(slip)
        self.reckoned_ns = 0
        self.scan_ns = self._unaccompanied = 0
        self.rate: float | None = None

    def add_odometry(self, stamp_ns: int, odom_from_base: Pose2) -> bool:
        """Take a wheel sample; False if it is not newer than the last.

        `rate` is then the mean rate of turn by the gyroscope since the sample before, rad/s.
        """
        before_ns, resets = self.trail.stamp_ns, self.trail.resets
        if not self.trail.add_odometry(stamp_ns, odom_from_base):
            return False
        self._unaccompanied = 0
        self.rate = self.gyro.pop_mean_rate(stamp_ns)
        unseen = before_ns is None or self.reckoned_ns - before_ns > MISSING_NS
        if unseen or self.trail.resets > resets:
            self._reckoning.restart(odom_from_base)
            self.watch.restart()
        elif stamp_ns > self.reckoned_ns and not self.still:
            elapsed = (stamp_ns - self.reckoned_ns) * 1e-9
            turn = None if self.rate is None else self.rate * elapsed
            self._reckoning.move(odom_from_base, elapsed, turn)
        self.reckoned_ns = stamp_ns if stamp_ns > self.reckoned_ns else self.reckoned_ns
        return True

    @property
    def missing(self) -> bool:
        """True if scans keep coming and the wheels have gone silent."""
        heard = self.trail.stamp_ns
        if heard is None:
            return True
        return self.scan_ns - heard > MISSING_NS and self._unaccompanied >= MISSED_SCANS

    @property
    def awaited(self) -> bool:
        """True if, after a gap in both, a scan has come before the wheels: they may follow yet."""
        heard = self.trail.stamp_ns
        return heard is not None and self.scan_ns - heard > MISSING_NS and not self.missing

    @property
    def believed(self) -> bool:
        """True unless the wheels are missing or contradict the scans."""
        return not (self.watch.wrong or self.missing)

    @property
    def standing(self) -> bool:
        """True if the wheels have not moved for a while."""
        return self.trail.standing > STOOD

    @property
    def still(self) -> bool:
        """True if the newest wheel sample has not moved and the gyroscope feels no turn."""
        return self.trail.standing > 0.0 and -TURNING < (self.rate or 0.0) < TURNING

    def saw_scan(self, stamp_ns: int) -> None:
        """Note the stamp of a scan, by which silence of the wheels is measured."""
        self.scan_ns = stamp_ns if stamp_ns > self.scan_ns else self.scan_ns
        self._unaccompanied += 1

    def velocity(self, first_ns: int, last_ns: int) -> Twist2 | None:
        """Mean velocity between two stamps, in the base frame; None unless trusted."""
        return self.trail.velocity(first_ns, last_ns) if self.believed else None

    def velocity_at(self, stamp_ns: int) -> Twist2 | None:
        """Velocity at a stamp, in the base frame; None unless trusted."""
        return self.velocity(stamp_ns - MOMENT_NS, stamp_ns)

    def compare(self, stamp_ns: int, map_from_base: Pose2) -> None:
        """Compare the wheels with a healthy match at this stamp.

        After a long way on wheels alone the step of a match is no motion.
        """
        self.clock.add_yaw(stamp_ns, map_from_base.yaw, self.trail)
        by_scale = self.by_scale
        if by_scale is not NOTHING and np.trace(by_scale) > ALONE**2:
            self.watch.restart()
        else:
            self.watch.add_match(stamp_ns, map_from_base, self.trail)

    def relocated(self) -> None:
        """Note that a search has found the base elsewhere: earlier matches are of no use."""
        self.watch.restart()
        self.clock.forget()

    # the pose by the wheels since its last correction

    def corrected(
        self,
        stamp_ns: int,
        map_from_base: Pose2,
        covariance: Array,
        information: Array | None = None,
    ) -> None:
        """Carry this pose on from now; see `DeadReckoning.correct`."""
        odom_from_base = self.trail.at(stamp_ns)
        if odom_from_base is not None:
            self._reckoning.correct(map_from_base, covariance, odom_from_base, information)
            self.reckoned_ns = stamp_ns

    def carried_on(self, stamp_ns: int) -> tuple[Pose2, Array] | None:
        """The corrected pose carried on to a stamp, and its covariance; None while unknown."""
        odom_from_base = None if self.missing else self.trail.at(stamp_ns)
        if odom_from_base is None:
            return None
        return self._reckoning.at(odom_from_base)

    @property
    def by_scale(self) -> Array:
        """Covariance (3, 3) that slip alone does not explain; see `DeadReckoning`."""
        return self._reckoning.by_scale

    def weigh(self, off: Array, covariance: Array) -> None:
        """Learn from a match how far the wheels' prediction may be off; see `DeadReckoning`."""
        self._reckoning.weigh(off, covariance)
