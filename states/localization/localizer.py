"""Where the base is, from everything that it senses: one estimate, how sure it is, and a status.

Scans are matched to the walls from where wheels, gyroscope and trackers predict the base; matches
and tracker poses correct a Kalman filter at their own instants. While matches are bad, particles
look for the base all over the map, and take over where they find it. A base that stands, its pose
settled, is left alone but for one scan per second.
"""

from __future__ import annotations

import math
from collections import Counter
from functools import cached_property, partial
from typing import Literal

import numpy as np

from hw.geometry import Pose2, Twist2, wrap
from hw.samples import ImuReading, Odometry, PoseSigma, Scan, TrackerPose, is_finite
from hw.sensing import Sensing
from hw.tracking import Tracking
from states.localization.drift import Drift, DriftWatch
from states.localization.fusion import Fusion, covariance_of, inverse
from states.localization.gyro import Gyro
from states.localization.localizer_values import LocalizerValues
from states.localization.odometry_watch import OdometryWatch
from states.localization.scan_tracker import Match, match
from states.localization.scans import Cloud, cloud_of, span_ns
from states.localization.search import Search
from states.localization.tracker_feed import TrackerFeed
from states.localization.trail import Trail
from states.maps.distance import Array
from states.maps.field import Field

LocalizerMode = Literal["starting", "tracking", "doubtful", "lost"]
LocalizerStatus = Literal[LocalizerMode, "resting", "odometry wrong", "odometry missing"]

MISSING = 0.3
"""Wheels that are silent for longer than scans are missing, s."""
BLIND_NS = 1_000_000_000
"""Without a fair match for so long no word of a search helps any more."""
TURNED = 0.05
"""A base that the gyroscope feels turning faster is not at rest, whatever its wheels say, rad/s."""
CARRIED_NS = 1_000_000_000
"""Longer than this no pose is moved on by the wheels alone."""
MOMENT_NS = 50_000_000
"""Over so long a velocity is told."""
UNSEEN_NS = 1_000_000_000
"""Where no scans have come for so long, trackers alone have to do."""
STOOD = 0.3
"""Wheels that have not moved for so long stand, s."""
MOVED = (0.05, math.radians(0.8))
"""A frame of tracking that has moved by more, m and rad, is told; less may be a border's bias."""
COMPARED = 0.2
"""So often trackers are compared with the estimate, s."""
ALIKE = 0.3
"""For so long errors of matches on a scanned map stay alike, s: the map is off by half a cell."""
SMOOTH = 0.05
"""By so much each scan counts in the share of beams on walls."""
LEAP = 3.0
"""A match that is off its prediction by more standard deviations has to repeat itself."""
CERTAIN = 0.8
"""But not if such a share of its beams is on walls."""
FAR_BETTER = 0.25
"""After several bad matches one from farther around is taken that fits better by such a share."""
BETTER = 0.1
"""A place elsewhere is believed if its share of beams on walls is higher by so much."""
AROUND = PoseSigma(0.3, 0.2)
"""How far around the predicted pose is looked when the match there is not healthy."""
SAME_M, SAME_RAD = 0.03, 0.01
"""A base at rest that is seen farther off has been moved."""


UNKNOWN = PoseSigma(math.inf, math.inf)
"""Of a base that is lost."""


class Localizer:
    """Estimates map_from_base from `base.odometry`, `base.imu`, `base.scan` and `rover.tracker`.

    `start` is where the base is told to be, to `start_sigma`; without it the whole floor is
    searched. Samples are taken in the order in which they come. `counts` says how many scans were
    matched and skipped, how many tracker poses taken, searches begun, places found. `drift` says
    how trackers and scanners differ for longer than a tracker that was lost explains.
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
        self._field, self._sensing, self._seed = field_, sensing, seed
        self._values = values or LocalizerValues()
        self._fusion = Fusion(sensing.imu is not None, ALIKE if field_.sigma > 0.0 else 0.0)
        self._trail, self._gyro, self._watch = Trail(), Gyro(), OdometryWatch()
        self._feed, self._compared = TrackerFeed(tracking), TrackerFeed(tracking)
        self._drifts = DriftWatch(*MOVED)
        self.drift: Drift | None = None
        self._start = start
        self._mode: LocalizerMode = "starting"
        self._stamp_ns: int | None = None
        self._known: tuple[Pose2, Array] | None = None
        self._sigma: PoseSigma | None = None
        self._resting = False
        self._check_ns = self._scan_ns = self._fair_ns = 0
        self._bad = self._stood = self._elsewhere = 0
        self._sure_ns, self._share = -1, 1.0
        # what no averaging removes: on a scanned map half a cell, and what that turns by
        least, half = self._values.floor_sigma, field_.sigma
        self._floor = covariance_of(
            PoseSigma(math.hypot(least.position, half), math.hypot(least.yaw, 0.2 * half))
        )
        self.counts: Counter[str] = Counter()

    @property
    def pose(self) -> Pose2 | None:
        """map_from_base at `stamp_ns`, the same object while the base is at rest; None: lost."""
        return None if self._mode == "lost" or self._known is None else self._known[0]

    @property
    def stamp_ns(self) -> int | None:
        """The instant of the pose: that of the newest word from the wheels, or scan."""
        return self._stamp_ns

    @property
    def covariance(self) -> Array:
        """Of the pose (3, 3): x, y in the map, m2, and yaw, rad2; infinite without a pose."""
        if self.pose is None:
            return np.diag([math.inf] * 3)
        assert self._known is not None  # there is a pose
        return self._known[1] + self._floor

    @property
    def sigma(self) -> PoseSigma:
        """How sure the pose is; the same object while nothing is new."""
        if self.pose is None:
            return UNKNOWN
        if self._sigma is None:
            (xx, xy, _), (_, yy, _), (_, _, yaw) = self.covariance.tolist()
            worst = 0.5 * (xx + yy) + math.hypot(0.5 * (xx - yy), xy)
            self._sigma = PoseSigma(math.sqrt(worst), math.sqrt(yaw))
        return self._sigma

    @property
    def status(self) -> LocalizerStatus:
        """What the estimate rests on; whatever is not `tracking` or `resting` wants attention."""
        if self._mode != "tracking":
            return self._mode
        if self._are_silent:
            return "odometry missing"
        if self._watch.wrong:
            return "odometry wrong"
        return "resting" if self._resting else "tracking"

    @property
    def map_from_odom(self) -> Pose2 | None:
        """Where the frame that the wheels count in lies in the map; None while that is unknown."""
        pose, odom_from_base = self.pose, self._trail.pose
        if pose is None or odom_from_base is None:
            return None
        return pose @ odom_from_base.inverse()

    def update(self, name: str, stamp_ns: int, value: object) -> None:
        """Take one sample; what is not finite is left out."""
        if not is_finite(value):
            return
        if isinstance(value, Odometry):
            self._take_odometry(stamp_ns, value.pose)
        elif isinstance(value, Scan):
            self._take_scan(stamp_ns, value)
        elif isinstance(value, ImuReading):
            self._gyro.put(stamp_ns, value.rates[2], self._trail.standing > STOOD)
        elif isinstance(value, TrackerPose):
            self._take_tracker(stamp_ns, value)

    # wheels

    def _take_odometry(self, stamp_ns: int, odom_from_base: Pose2) -> None:
        before = self._trail.stamp_ns
        if not self._trail.put(stamp_ns, odom_from_base):
            return
        rate = self._gyro.take(stamp_ns)
        if self._start is not None:
            self._begin_at_start(stamp_ns, self._start)
        if self._resting:
            if self._trail.standing > 0.0 and abs(rate or 0.0) < TURNED:
                self._stamp_ns = stamp_ns
                return
            self._get_up(before or stamp_ns)
        if self._fusion.begun and not self._watch.wrong:
            middle = stamp_ns if before is None else (before + stamp_ns) // 2
            self._fusion.wheels(
                middle,
                self._trail.last_velocity(),
                standing=self._trail.standing > STOOD,
                rate=rate,
            )
        self._move_on(stamp_ns)

    def _begin_at_start(self, stamp_ns: int, start: Pose2) -> None:
        self._start = None
        covariance = covariance_of(self._values.start_sigma)
        self._fusion.begin(stamp_ns, start, covariance, None)
        self._search.about(start, covariance)

    def _move_on(self, stamp_ns: int) -> None:
        """Tell the pose at the newest instant."""
        newest = stamp_ns if self._stamp_ns is None else max(stamp_ns, self._stamp_ns)
        if self._fusion.begun:
            self._known, self._sigma = self._fusion.at(newest), None
        self._stamp_ns = newest

    # scans

    def _take_scan(self, stamp_ns: int, scan: Scan) -> None:
        if self._start is not None:
            self._begin_at_start(stamp_ns, self._start)
        self._scan_ns = max(self._scan_ns, stamp_ns)
        if self._resting and stamp_ns < self._check_ns:
            self.counts["skipped"] += 1
            return
        motion = self._moving(stamp_ns, stamp_ns + span_ns(scan)) or self._fusion.velocity
        cloud = cloud_of(scan, stamp_ns, self._sensing, self._values.matching.beams, motion)
        if self._resting and self._is_still_there(cloud):
            self._check_ns = stamp_ns + round(self._values.check * 1e9)
            return
        if self._mode in ("tracking", "doubtful"):
            self._follow(cloud)
        if self._mode != "tracking":
            self._look(cloud)
        if self._fusion.begun and not self._resting:
            self._move_on(cloud.stamp_ns)

    def _moving(self, first_ns: int, last_ns: int) -> Twist2 | None:
        """The velocity between two stamps by the wheels, if these can be believed."""
        if self._watch.wrong or self._are_silent:
            return None
        return self._trail.velocity(first_ns, last_ns)

    @property
    def _are_silent(self) -> bool:
        heard = self._trail.stamp_ns
        return heard is None or self._scan_ns - heard > MISSING * 1e9

    def _follow(self, cloud: Cloud) -> None:
        known = self._fusion.at(cloud.stamp_ns)
        if known is None:
            return
        predicted = self._carried_on(cloud.stamp_ns) or known[0]
        # more than it may be off by, for the filter adds what is known to the match once more
        found = self._match(cloud, predicted, 4.0 * known[1])
        values = self._values
        if not found.is_fair(values.matching):
            around = self._match(cloud, predicted, covariance_of(AROUND))
            least = found.share + FAR_BETTER if self._bad >= values.patience else values.plain
            takes = around.share >= least and around.is_healthy(values.matching)
            found = around if takes else found
        self._share += SMOOTH * (found.share - self._share)
        if found.is_fair(values.matching):
            pose, information = found.map_from_base, found.information
            believed = self._watch.wrong or self._are_silent or found.share >= CERTAIN
            leaps = not believed and not _is_near(pose, predicted, known[1])
            self._fusion.scan(cloud.stamp_ns, pose, information, gated=leaps)
            self._fair_ns = cloud.stamp_ns
        healthy = found.is_healthy(values.matching)
        self._bad = 0 if healthy else self._bad + 1
        self._change_mode(cloud.stamp_ns)
        if healthy:
            self._compare_wheels(cloud.stamp_ns, found.map_from_base)
            self._settle(cloud.stamp_ns)

    def _carried_on(self, stamp_ns: int) -> Pose2 | None:
        """The pose of the last fair match, moved on by the very way of the wheels.

        The filter knows ways as velocities: between words that come seldom or unevenly it is off.
        """
        if self._moving(self._fair_ns, stamp_ns) is None or stamp_ns - self._fair_ns > CARRIED_NS:
            return None
        then = self._fusion.at(self._fair_ns)
        before, now = self._trail.at(self._fair_ns), self._trail.at(stamp_ns)
        if then is None or before is None or now is None:
            return None
        return then[0] @ (before.inverse() @ now)

    def _match(self, cloud: Cloud, predicted: Pose2, covariance: Array) -> Match:
        self.counts["matched"] += 1
        return match(
            self._field, cloud.points, predicted, covariance + self._floor, self._values.matching
        )

    def _change_mode(self, stamp_ns: int) -> None:
        values = self._values
        good = self._share >= values.plain and self._bad == 0
        odd = self._share < values.plain or self._bad >= values.patience
        blind = stamp_ns - self._fair_ns > BLIND_NS
        if self._mode == "tracking" and (blind or (odd and stamp_ns > self._sure_ns)):
            self._mode = "doubtful"
            self._elsewhere = 0
            here = self._fusion.at(stamp_ns)
            self._search.anywhere(None if here is None else here[0])
        elif self._mode == "doubtful" and good:
            self._mode = "tracking"
        elif self._mode == "doubtful" and stamp_ns - self._fair_ns > values.lost_after * 1e9:
            self._mode = "lost"

    def _compare_wheels(self, stamp_ns: int, map_from_base: Pose2) -> None:
        odom_from_base = self._trail.at(stamp_ns)
        if odom_from_base is not None:
            self._watch.see(stamp_ns, map_from_base, odom_from_base)

    # standing

    def _settle(self, stamp_ns: int) -> None:
        """Leave a standing base alone once its pose is sure."""
        if self._trail.standing < STOOD or self.status != "tracking" or self._stamp_ns is None:
            self._stood = 0
            return
        self._stood += 1
        known = self._fusion.at(self._stamp_ns)
        assert known is not None  # it has just been corrected
        wanted = covariance_of(self._values.rest_sigma)
        if self._stood >= self._values.rest_scans or (np.diag(known[1]) <= np.diag(wanted)).all():
            self._resting, self._known, self._sigma = True, known, None
            self._check_ns = stamp_ns + round(self._values.check * 1e9)

    def _is_still_there(self, cloud: Cloud) -> bool:
        assert self._known is not None  # it rests on that
        pose, covariance = self._known
        values = self._values.matching
        found = self._match(cloud, pose, covariance)
        if found.is_healthy(values) and _same(pose, found.map_from_base):
            return True
        around = self._match(cloud, pose, covariance_of(AROUND))
        found = around if around.share > found.share else found
        if found.is_healthy(values):
            self._watch.moved_at_rest(cloud.stamp_ns)
            self._known = found.map_from_base, inverse(found.information + np.eye(3))
        self._get_up(cloud.stamp_ns)
        return False

    def _get_up(self, stamp_ns: int) -> None:
        assert self._known is not None  # it rested on that
        pose, covariance = self._known
        self._resting, self._stood = False, 0
        self._fusion.begin(stamp_ns, pose, covariance, self._moving(stamp_ns - MOMENT_NS, stamp_ns))

    # particles

    def _look(self, cloud: Cloud) -> None:
        """Search for the base; where it is found, go on from there."""
        odom_from_base = self._trail.at(cloud.stamp_ns) or Pose2(0.0, 0.0)
        found = self._search.update(odom_from_base, cloud.points)
        guess = self._search.guess
        velocity = self._moving(cloud.stamp_ns - MOMENT_NS, cloud.stamp_ns)
        if found is None and guess is not None and self._mode == "starting":
            unsure = covariance_of(self._values.start_sigma)
            self._fusion.begin(cloud.stamp_ns, guess.map_from_base, unsure, velocity)
        if found is None:
            return
        doubtful = self._mode == "doubtful"
        here = self._fusion.at(cloud.stamp_ns) if doubtful else None
        stays = here is not None and _same(here[0], found.map_from_base)
        if doubtful and not stays and not self._is_elsewhere(found):
            return
        self.counts["found"] += 1
        self._sure_ns = cloud.stamp_ns + round(self._values.sure_for * 1e9)
        self._mode, self._bad = "tracking", 0
        if stays:
            return
        covariance = inverse(found.information + np.eye(3))
        self._fusion.begin(cloud.stamp_ns, found.map_from_base, covariance, velocity)
        self._fair_ns, self._share = cloud.stamp_ns, found.share
        self._watch.restart()

    def _is_elsewhere(self, found: Match) -> bool:
        """Was a place that fits better than the predicted one found scan after scan?"""
        better = found.share >= self._share + BETTER
        self._elsewhere = self._elsewhere + 1 if better else 0
        return self._elsewhere >= self._values.elsewhere

    @cached_property
    def _search(self) -> Search:
        return Search(self._field, self._values.particles, self._values.matching, self._seed)

    # trackers

    def _take_tracker(self, stamp_ns: int, seen: TrackerPose) -> None:
        self._watch_drift(stamp_ns, seen)
        values = self._values
        turns = abs(self._trail.last_velocity().wz) > values.turning
        period = values.vive_period_turning if turns else values.vive_period
        pose = self._feed.put(stamp_ns, seen, period)
        if pose is None or self._resting:
            return
        self.counts["trackers"] += 1
        covariance = covariance_of(values.vive_sigma)
        if not self._fusion.begun or self._mode == "lost":
            self._fusion.begin(stamp_ns, pose, covariance, None)
            self._search.about(pose, 9.0 * covariance)
            self._mode = "doubtful" if self._mode == "lost" else self._mode
            self._fair_ns = stamp_ns
            return
        verdict = self._fusion.trackers(stamp_ns, pose, values.vive_sigma)
        if self._mode == "starting" and stamp_ns - self._scan_ns > UNSEEN_NS:
            self._mode = "tracking"
        if verdict.outcome == "rejected" and self._mode != "tracking":
            self._search.about(pose, 9.0 * covariance)

    def _watch_drift(self, stamp_ns: int, seen: TrackerPose) -> None:
        pose = self._compared.put(stamp_ns, seen, COMPARED)
        if pose is None or self._mode != "tracking" or len(self._compared.each) < 2:
            return
        known = self._known if self._resting else self._fusion.at(stamp_ns)
        if known is not None:
            # one that was lost is off alone; a frame that has moved is moved for the best, too
            best = min(self._compared.each, key=partial(_apart, known[0]))
            self.drift = self._drifts.update(stamp_ns, best, known[0])


def _is_near(found: Pose2, predicted: Pose2, covariance: Array) -> bool:
    """Is a match within what the prediction may be off by, several times over?"""
    place = LEAP * math.sqrt(0.5 * (covariance[0, 0] + covariance[1, 1])) + SAME_M
    turn = LEAP * math.sqrt(covariance[2, 2]) + SAME_RAD
    near = found.distance_to(predicted) < place
    return near and abs(wrap(found.yaw - predicted.yaw)) < turn


def _apart(one: Pose2, other: Pose2) -> float:
    """In units of what is told."""
    return max(one.distance_to(other) / MOVED[0], abs(wrap(one.yaw - other.yaw)) / MOVED[1])


def _same(one: Pose2, other: Pose2) -> bool:
    return one.distance_to(other) < SAME_M and abs(wrap(one.yaw - other.yaw)) < SAME_RAD
