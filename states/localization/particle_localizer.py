"""The paper's localization, chosen by name: AMCL alone, reset by the trackers (4.2.2).

Particles follow wheels and scans; between two updates the wheels move the estimate on. Trackers
reset the particles once a second, and up to ten times a second while the base turns (R30).
`Localizer` is the default because it measured better: it matches scans, and particles only search.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Literal

import numpy as np

from hw import Odometry, Pose2, PoseSigma, Scan, TrackerPose, is_finite
from hw.model import Sensing, Tracking
from states.localization.filter import UNKNOWN, covariance_of, sigma_of
from states.localization.matching import Amcl, AmclValues, LocalizerValues, cloud_of, span_ns
from states.localization.wheels import MISSING_NS, TrackerFeed, Trail
from states.maps import Array, Field

ParticleStatus = Literal["starting", "tracking", "odometry missing"]


class ParticleLocalizer:
    """Estimates map_from_base by particles alone; see the module. `counts` is as in `Localizer`."""

    drift = None
    """Trackers and scanners are not compared here."""

    def __init__(
        self,
        field: Field,
        sensing: Sensing,
        tracking: Tracking,
        start: Pose2 | None = None,
        seed: int = 0,
        values: AmclValues | None = None,
    ) -> None:
        self._sensing, self._values = sensing, LocalizerValues()
        self._amcl = Amcl(field, values, seed)
        self._trail, self._feed = Trail(), TrackerFeed(tracking)
        self._spread(start, covariance_of(self._values.start_sigma))
        self._from_odom: Pose2 | None = None
        self._pose: Pose2 | None = None
        self._sigma = UNKNOWN
        self._scan_ns = 0
        self._counts: Counter[str] = Counter()

    @property
    def pose(self) -> Pose2 | None:
        """map_from_base at `stamp_ns`; None before the first scan or tracker pose."""
        return self._pose

    @property
    def sigma(self) -> PoseSigma:
        """Standard deviations of the heaviest cluster."""
        return self._sigma

    @property
    def stamp_ns(self) -> int | None:
        """Stamp of the newest wheel sample."""
        return self._trail.stamp_ns

    @property
    def status(self) -> ParticleStatus:
        """What the estimate is based on."""
        heard = self._trail.stamp_ns
        if heard is None or self._scan_ns - heard > MISSING_NS:
            return "odometry missing"
        return "starting" if self._pose is None else "tracking"

    @property
    def counts(self) -> Mapping[str, int]:
        """Scans matched and skipped, tracker poses taken."""
        return self._counts

    def update(self, name: str, stamp_ns: int, value: object) -> None:
        """Take one sample; one with NaN or infinite numbers is ignored."""
        if is_finite(value):
            self.take(stamp_ns, value)

    def take(self, stamp_ns: int, value: object) -> None:
        """Take one sample that is finite."""
        if isinstance(value, Odometry):
            if self._trail.add_odometry(stamp_ns, value.pose):
                self._move_on()
        elif isinstance(value, Scan):
            self._take_scan(stamp_ns, value)
        elif isinstance(value, TrackerPose):
            self._take_tracker(stamp_ns, value)

    def _move_on(self) -> None:
        odom_from_base = self._trail.pose
        if self._from_odom is None or odom_from_base is None:
            return
        pose = self._from_odom @ odom_from_base
        if self._pose is None or pose != self._pose:
            self._pose = pose

    def _take_scan(self, stamp_ns: int, scan: Scan) -> None:
        self._scan_ns = max(self._scan_ns, stamp_ns)
        motion = self._trail.velocity(stamp_ns, stamp_ns + span_ns(scan))
        cloud = cloud_of(scan, stamp_ns, self._sensing, self._amcl.values.laser_max_beams, motion)
        odom_from_base = self._trail.at(cloud.stamp_ns)
        if odom_from_base is None:
            return
        taken = self._amcl.update(odom_from_base, cloud.points)
        self._counts["matched" if taken else "skipped"] += 1
        if taken:
            self._believe(odom_from_base)

    def _take_tracker(self, stamp_ns: int, seen: TrackerPose) -> None:
        values = self._values
        period = values.tracker_period(self._trail.last_velocity())
        pose, odom_from_base = (
            self._feed.add_tracker_pose(stamp_ns, seen, period),
            self._trail.at(stamp_ns),
        )
        if pose is None or odom_from_base is None:
            return
        self._counts["trackers"] += 1
        self._spread(pose, covariance_of(values.vive_sigma))
        self._amcl.update(odom_from_base, np.empty((0, 2)), force=True)
        self._believe(odom_from_base)

    def _spread(self, pose: Pose2 | None, covariance: Array) -> None:
        if pose is None:
            self._amcl.start_anywhere()
        else:
            self._amcl.start(pose, covariance)

    def _believe(self, odom_from_base: Pose2) -> None:
        found = self._amcl.estimate()
        self._from_odom = found.map_from_base @ odom_from_base.inverse()
        self._sigma = sigma_of(found.covariance)
        self._move_on()
