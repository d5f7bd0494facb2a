"""The pose of the base from all its sensors: one estimate, its uncertainty, and a status.

Scans are matched to the walls, starting from where wheels, gyroscope and trackers predict the base.
Matches and tracker poses then correct a Kalman filter, each at its own stamp. While matches are bad
(`match_health.py`), the whole map is searched, and the pose jumps to where they find the base.
While the base stands and its pose has settled, nothing is computed but one match every `check` s.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Literal

import numpy as np

from hw import ImuReading, Odometry, Pose2, PoseSigma, Scan, TrackerPose, Twist2, is_finite, wrap
from hw.model import Sensing, Tracking
from states.localization.filter import (
    GYRO_NOISE,
    SLIPPING,
    UNKNOWN,
    Fusion,
    covariance_of,
    inverse,
    sigma_of,
)
from states.localization.matching import (
    AROUND,
    LEAP,
    WORSE,
    Cloud,
    LocalizerMode,
    LocalizerValues,
    Match,
    MatchHealth,
    PoseMatcher,
    Prediction,
    Search,
    cloud_of,
    is_near,
    is_same,
    is_sure,
    leaps,
    span_ns,
)
from states.localization.wheels import STOOD, Drift, TrackerComparison, TrackerFeed, WheelMotion
from states.maps import Array, Field

LocalizerStatus = Literal[
    LocalizerMode, "ambiguous", "resting", "odometry wrong", "odometry missing"
]


DOUBT = covariance_of(PoseSigma(0.5, 0.3))
"""Added to the covariance while the scans do not support the pose."""
_ONES = np.eye(3)


class Localizer:
    """Estimates map_from_base from `base.odometry`, `base.imu`, `base.scan` and `rover.tracker`.

    `start` is the given start pose, known to `start_sigma`; without it the whole floor is searched.
    Samples are taken in the order of arrival. `pose` is map_from_base at `stamp_ns`, the stamp of
    the newest wheel sample or scan: the same object while the base rests, None while unknown.
    `counts` has the number of matches, of scans skipped at rest, of tracker poses used and of poses
    found by a search.
    """

    def __init__(
        self,
        field_: Field,
        sensing: Sensing,
        tracking: Tracking,
        start: Pose2 | None = None,
        seed: int = 0,
        values: LocalizerValues | None = None,
    ) -> None:
        self._sensing = sensing
        self._values = values or LocalizerValues()
        self._fusion = Fusion(gyro=sensing.imu is not None, rough_map=field_.sigma > 0.0)
        self._wheels = WheelMotion(SLIPPING if sensing.imu is None else GYRO_NOISE)
        self._feed, self._comparison = TrackerFeed(tracking), TrackerComparison(tracking)
        self._start = start
        self.counts: Counter[str] = Counter()
        self._matcher = PoseMatcher(field_, self._values, self.counts)
        self._health = MatchHealth(self._values)
        self._search = Search(field_, self._values.particles, self._values.matching)
        self.pose: Pose2 | None = None
        self.stamp_ns: int | None = None
        self._known: tuple[Pose2, Array] | None = None
        self._sigma: PoseSigma | None = None
        self._heard = self._resting = False
        self._held: tuple[int, Scan] | None = None
        self._check_ns = self._stood = 0

    @property
    def covariance(self) -> Array:
        """Covariance (3, 3) of x, y in the map, m2, and yaw, rad2; infinite if unknown."""
        if self.pose is None:
            return np.diag([math.inf] * 3)
        return self._spread()

    def _spread(self) -> Array:
        """The covariance; there has to be a pose."""
        assert self._known is not None
        known: Array = self._known[1] + self._matcher.floor + self._wheels.by_scale
        return known + DOUBT if self._health.mode == "doubtful" else known

    @property
    def sigma(self) -> PoseSigma:
        """Standard deviations of the pose; the same object while nothing has changed."""
        if self.pose is None:
            return UNKNOWN
        self._sigma = self._sigma or sigma_of(self._spread())
        return self._sigma

    @property
    def drift(self) -> Drift | None:
        """How trackers and scanners differ; None while a re-acquired tracker may explain it."""
        return self._comparison.drift

    @property
    def clock_offset(self) -> float | None:
        """How late the wheels' stamps are against the scans', s; None until turns have shown it."""
        return self._wheels.clock.sure

    @property
    def status(self) -> LocalizerStatus:
        """What the pose is based on; anything but `tracking` and `resting` needs attention."""
        if self._health.mode != "tracking":
            return "ambiguous" if self._is_ambiguous else self._health.mode
        if self._wheels.missing:
            return "odometry missing"
        if self._wheels.watch.wrong:
            return "odometry wrong"
        return "resting" if self._resting else "tracking"

    @property
    def _is_ambiguous(self) -> bool:
        """True while several places are about as likely, and none is accepted."""
        return self._health.mode in ("starting", "lost") and self._search.ambiguous

    def update(self, name: str, stamp_ns: int, value: object) -> None:
        """Take one sample; one with NaN or infinite numbers is ignored."""
        if is_finite(value):
            self.take(stamp_ns, value)

    def take(self, stamp_ns: int, value: object) -> None:
        """Take one sample that is finite; what is not heard of is missed from the first one on."""
        if not self._heard:
            self._heard, self._health.fair_ns, self._wheels.scan_ns = True, stamp_ns, stamp_ns
        match value:
            case Odometry():
                self._take_odometry(stamp_ns, value.pose)
            case Scan():
                self._take_scan(stamp_ns, value)
            case ImuReading():
                self._wheels.gyro.add_reading(stamp_ns, value.rates[2], self._wheels.standing)
                return  # it says nothing until the wheels do
            case TrackerPose():
                self._take_tracker(stamp_ns, value)
        mode = self._health.mode
        unknown = mode == "lost" or (mode == "starting" and self._is_ambiguous)
        self.pose = None if self._known is None or unknown else self._known[0]

    # wheels

    def _take_odometry(self, stamp_ns: int, odom_from_base: Pose2) -> None:
        wheels, before = self._wheels, self._wheels.trail.stamp_ns
        if not wheels.add_odometry(stamp_ns, odom_from_base):
            return
        if self._start is not None:
            self._begin_at_start(stamp_ns, self._start)
        if self._resting:
            if wheels.still:
                self.stamp_ns = stamp_ns
                return
            self._end_rest(before or stamp_ns)
        if self._fusion.begun and not wheels.watch.wrong:
            middle = stamp_ns if before is None else (before + stamp_ns) // 2
            velocity, standing = wheels.trail.last_velocity(), wheels.standing
            self._fusion.wheels(middle, velocity, standing=standing, rate=wheels.rate)
        if self._health.mode != "tracking":
            self._search.advance()
        self._move_on(stamp_ns)
        held, self._held = self._held, None
        if held is not None:
            self._take_scan(*held)

    def _begin_at_start(self, stamp_ns: int, start: Pose2) -> None:
        self._start = None
        spread = covariance_of(self._values.start_sigma)
        self._begin(stamp_ns, start, spread, None)
        self._search.about(start, spread)

    def _move_on(self, stamp_ns: int) -> None:
        """Move the published pose on to the newest stamp."""
        before = self.stamp_ns
        newest = stamp_ns if before is None or stamp_ns > before else before
        if self._fusion.begun:
            self._known, self._sigma = self._fusion.at(newest), None
        self.stamp_ns = newest

    # scans

    def _take_scan(self, stamp_ns: int, scan: Scan) -> None:
        if self._start is not None:
            self._begin_at_start(stamp_ns, self._start)
        self._wheels.saw_scan(stamp_ns)
        if self._wheels.awaited and not self._resting:
            self._held = stamp_ns, scan
            return
        if self._resting and stamp_ns < self._check_ns:
            self.counts["skipped"] += 1
            return
        motion = self._wheels.velocity(stamp_ns, stamp_ns + span_ns(scan))
        motion = motion or self._fusion.velocity
        cloud = cloud_of(scan, stamp_ns, self._sensing, self._values.matching.beams, motion)
        if self._resting and self._still_rests(cloud):
            self._check_ns = stamp_ns + round(self._values.check * 1e9)
            return
        if self._health.mode in ("tracking", "doubtful"):
            self._follow(cloud)
        if self._health.mode != "tracking":
            self._search_by(cloud, scan.sensor)
        if self._fusion.begun and not self._resting:
            self._move_on(cloud.stamp_ns)

    def _follow(self, cloud: Cloud) -> None:
        """Match a scan near the predicted pose, and correct the filter by the match."""
        stamp_ns, health = cloud.stamp_ns, self._health
        predictions = self._predictions(stamp_ns)
        if not predictions:
            return
        unsure = health.is_blind(stamp_ns) and not is_sure(predictions[0][1], AROUND)
        unsure |= self._wheels.watch.contradicted
        found = self._matcher.follow(cloud, predictions, health, unsure=unsure)
        pose, fair = found.map_from_base, found.is_fair(self._values.matching)
        healthy = fair and found.is_healthy(self._values.matching)
        if healthy:
            self._weigh(found, *predictions[0])
        if fair:
            # predictions without wheels are poor: a match far from one is no reason for doubt
            gated = self._wheels.believed and leaps(found, *predictions[0])
            self._fusion.scan(stamp_ns, pose, found.information, gated=gated)
            self._anchor(stamp_ns, found.information)
        supported = health.mode != "doubtful" or self._search.supports(pose)
        if health.add_match(stamp_ns, found, supported=supported, unsure=unsure):
            here = self._fusion.at(stamp_ns)
            # a base that drives is not carried away: elsewhere it needs more evidence
            given = not self._wheels.standing
            self._search.anywhere(None if here is None else here[0], given=given)
        if healthy:
            self._wheels.compare(stamp_ns, pose)
            self._settle(stamp_ns)

    def _weigh(self, found: Match, predicted: Pose2, covariance: Array) -> None:
        """Let a match tell by how much its prediction was off."""
        pose = found.map_from_base
        off = (pose.x - predicted.x, pose.y - predicted.y, wrap(pose.yaw - predicted.yaw))
        own = inverse(found.information + _ONES) + self._matcher.floor
        self._wheels.weigh(np.array(off), covariance + own)

    def _predictions(self, stamp_ns: int) -> list[Prediction]:
        """Where the base may be: by the wheels since the last correction, and by the filter.

        The filter integrates velocities, which is wrong where wheel samples are rare or uneven;
        where it departs from the wheels' displacement by more than that may be wrong, it restarts
        there. Wheels that contradict the scans are one hypothesis of two.
        """
        known, carried = self._fusion.at(stamp_ns), self._wheels.carried_on(stamp_ns)
        if carried is None:
            return [] if known is None else [known]
        if known is None or (self._wheels.believed and not is_near(known[0], *carried, 1.0)):
            self._begin(stamp_ns, *carried, self._wheels.velocity_at(stamp_ns))
            return [carried]
        return [carried] if self._wheels.believed else [known, carried]

    def _begin(
        self, stamp_ns: int, pose: Pose2, covariance: Array, velocity: Twist2 | None
    ) -> None:
        self._fusion.begin(stamp_ns, pose, covariance, velocity)
        self._wheels.corrected(stamp_ns, pose, covariance)

    def _anchor(self, stamp_ns: int, information: Array) -> None:
        """Let the wheels carry the corrected pose on."""
        known = self._fusion.at(stamp_ns)
        if known is not None:
            self._wheels.corrected(stamp_ns, *known, information)

    # rest

    def _settle(self, stamp_ns: int) -> None:
        """Begin to rest once the base stands and its pose is certain."""
        if (
            self._wheels.trail.standing < STOOD
            or self.status != "tracking"
            or self.stamp_ns is None
        ):
            self._stood = 0
            return
        self._stood += 1
        known = self._fusion.at(self.stamp_ns)
        assert known is not None  # it has just been corrected
        if self._stood >= self._values.rest_scans or is_sure(known[1], self._values.rest_sigma):
            self._resting, self._known, self._sigma = True, known, None
            self._check_ns = stamp_ns + round(self._values.check * 1e9)

    def _still_rests(self, cloud: Cloud) -> bool:
        """Check by one scan that the base was not moved at rest; if it was, end the rest."""
        assert self._known is not None  # a base rests at a known pose only
        found, is_there = self._matcher.at_rest(cloud, *self._known)
        if is_there:
            return True
        if found.is_healthy(self._values.matching):
            self._wheels.watch.moved_at_rest(cloud.stamp_ns)
            self._known = found.map_from_base, inverse(found.information + _ONES)
        self._end_rest(cloud.stamp_ns)
        return False

    def _end_rest(self, stamp_ns: int) -> None:
        """Restart the filter from the pose of the rest."""
        assert self._known is not None  # a base rests at a known pose only
        self._resting, self._stood = False, 0
        self._begin(stamp_ns, *self._known, self._wheels.velocity_at(stamp_ns))

    # search

    def _search_by(self, cloud: Cloud, sensor: str) -> None:
        """Give a scan to the search; where it finds the base, go on from there."""
        stamp_ns, mode = cloud.stamp_ns, self._health.mode
        odom = self._wheels.trail.at(stamp_ns) or Pose2(0.0, 0.0)
        found = self._search.update(odom, cloud.points, sensor)
        guess = self._search.guess
        velocity = self._wheels.velocity_at(stamp_ns)
        if found is None:
            best = self._search.best if self._search.ambiguous else None
            if mode == "doubtful" and best is not None and self._health.is_elsewhere(best):
                self._health.given_up()
            if guess is not None and mode == "starting":
                unsure = covariance_of(self._values.start_sigma)
                self._begin(stamp_ns, guess.map_from_base, unsure, velocity)
            return
        here = self._fusion.at(stamp_ns) if mode == "doubtful" else None
        stays = here is not None and is_same(here[0], found.map_from_base)
        moves = not self._wheels.standing
        if mode == "doubtful" and not (stays or moves or self._health.is_elsewhere(found)):
            return
        strays = mode in ("doubtful", "lost") and not stays
        if strays and self._may_have_stayed(cloud, found):
            return
        self.counts["found"] += 1
        if stays:
            self._health.confirmed(stamp_ns)
            return
        self._health.relocated(stamp_ns, found)
        covariance = inverse(found.information + _ONES)
        self._begin(stamp_ns, found.map_from_base, covariance, velocity)
        self._wheels.relocated()

    def _may_have_stayed(self, cloud: Cloud, found: Match) -> bool:
        """True if the base may as well be where the wheels have led; what was found is only alike.

        Off the map nothing fits. Where a match there is as good, the search begins anew with it.
        """
        carried = self._wheels.carried_on(cloud.stamp_ns)
        if carried is None or is_near(found.map_from_base, *carried, 2.0 * LEAP):
            return False
        if self._matcher.is_off(cloud, carried[0]):
            return True
        beside = self._matcher.beside(cloud, carried)
        as_good = beside.share >= found.share - WORSE and beside.is_healthy(self._values.matching)
        if as_good:
            self._search.anywhere(beside.map_from_base, given=True)
        return as_good

    # trackers

    def _take_tracker(self, stamp_ns: int, seen: TrackerPose) -> None:
        self._compare_trackers(stamp_ns, seen)
        values, health = self._values, self._health
        period = values.tracker_period(self._wheels.trail.last_velocity())
        pose = self._feed.add_tracker_pose(stamp_ns, seen, period)
        if pose is None or self._resting:
            return
        self.counts["trackers"] += 1
        covariance = covariance_of(values.vive_sigma)
        if not self._fusion.begun or health.mode == "lost":
            self._begin(stamp_ns, pose, covariance, None)
            self._search.about(pose, 9.0 * covariance)
            health.placed(stamp_ns)
            return
        verdict = self._fusion.trackers(stamp_ns, pose, values.vive_sigma)
        if verdict.outcome in ("accepted", "reacquired"):
            self._anchor(max(stamp_ns, self._wheels.reckoned_ns), inverse(covariance))
        health.blind(stamp_ns - self._wheels.scan_ns)
        if verdict.outcome == "rejected" and health.mode != "tracking":
            self._search.about(pose, 9.0 * covariance)

    def _compare_trackers(self, stamp_ns: int, seen: TrackerPose) -> None:
        if self._comparison.is_due(stamp_ns, seen) and self._health.mode == "tracking":
            known = self._known if self._resting else self._fusion.at(stamp_ns)
            if known is not None:
                self._comparison.update(stamp_ns, known[0])
