"""Looks for the base all over the map, or about a place: particles, polished by matching.

Particles find the basin, the match its bottom. A place counts as found when scans in a row lead to
the same one, told by odometry, each with most of the particles' weight and a healthy match.
"""

from __future__ import annotations

import math

import numpy as np

from hw.geometry import Pose2, wrap
from states.localization.amcl import Amcl, AmclValues
from states.localization.scan_tracker import Match, TrackerValues, match
from states.maps.distance import Array
from states.maps.field import Field

PER_SQUARE_METRE = 150
"""Particles that a search all over the floor starts with, but not more than MOST."""
MOST = 100_000
CONFIRMED = 3
"""Scans in a row that must lead to one place."""
SAME_M, SAME_RAD = 0.15, 0.08
"""Places closer than this are one."""
SURE = 0.8
"""Weight that the heaviest cluster must have."""
PATIENCE = 40
"""Scans after which a search begins anew, all over the floor."""


class Search:
    """One search; tell it what is known of the place, then every scan."""

    def __init__(
        self, field: Field, particles: AmclValues, matching: TrackerValues, seed: int
    ) -> None:
        self._field, self._matching = field, matching
        self._amcl = Amcl(field, particles, seed)
        self._map_from_odom: Pose2 | None = None
        self._agreeing = self._scans = 0

    def about(self, map_from_base: Pose2, covariance: Array) -> None:
        """Look near a pose; covariance (3, 3) in the map."""
        self._amcl.start(map_from_base, covariance)
        self._begin()

    def anywhere(self) -> None:
        """Look all over the floor."""
        area = len(self._field.free) * self._field.table.cell**2
        wanted = round(PER_SQUARE_METRE * area)
        self._amcl.start_anywhere(min(max(wanted, self._amcl.values.max_particles), MOST))
        self._begin()

    def update(self, odom_from_base: Pose2, points: Array) -> Match | None:
        """Take a scan, points (n, 2) in the base frame; the match where the base was found."""
        self._scans += 1
        self._amcl.update(odom_from_base, points, force=True)
        guess = self._amcl.estimate()
        covariance = guess.covariance.copy()
        # an endless variance of yaw has no inverse
        covariance[2, 2] = min(covariance[2, 2], math.pi**2)
        covariance += np.diag([0.05**2, 0.05**2, 0.05**2])
        found = match(self._field, points, guess.map_from_base, covariance, self._matching)
        if guess.weight >= SURE and found.is_healthy(self._matching):
            self._compare(found.map_from_base @ odom_from_base.inverse(), odom_from_base)
        else:
            self._agreeing, self._map_from_odom = 0, None
        if self._agreeing >= CONFIRMED:
            return found
        if self._scans >= PATIENCE:
            self.anywhere()
        return None

    def _begin(self) -> None:
        self._map_from_odom, self._agreeing, self._scans = None, 0, 0

    def _compare(self, map_from_odom: Pose2, odom_from_base: Pose2) -> None:
        before, self._map_from_odom = self._map_from_odom, map_from_odom
        self._agreeing += 1
        if before is None:
            self._agreeing = 1
            return
        one, other = before @ odom_from_base, map_from_odom @ odom_from_base
        if one.distance_to(other) > SAME_M or abs(wrap(one.yaw - other.yaw)) > SAME_RAD:
            self._agreeing = 1
