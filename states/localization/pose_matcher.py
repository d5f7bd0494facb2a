"""Scan matching for the localizer: near a prediction, wider where that fails, and at rest."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from hw.geometry import Pose2, wrap
from hw.samples import PoseSigma
from states.localization.fusion import covariance_of
from states.localization.localizer_values import LocalizerValues
from states.localization.match_health import MatchHealth
from states.localization.scan_tracker import Match, match
from states.localization.scans import Cloud
from states.maps.distance import Array
from states.maps.field import Field

LEAP = 3.0
"""A match this many standard deviations from its prediction must be repeated to be believed."""
CERTAIN = 0.8
"""Share of beams on walls from which a match is believed at once, wherever it lies."""
AROUND = PoseSigma(0.3, 0.2)
"""Spread of the wider search around the predicted pose."""
SAME_M, SAME_RAD = 0.03, 0.01
"""A base at rest that is seen farther away than this has been moved, m and rad."""


class PoseMatcher:
    """Matches scans to the walls of one map, and counts them in `counts["matched"]`.

    `floor` (3, 3) is the covariance that no averaging removes: that of the parameters and, on a
    scanned map, half a cell and the yaw error that this allows.
    """

    def __init__(self, field: Field, values: LocalizerValues, counts: Counter[str]) -> None:
        self._field, self._values, self._counts = field, values, counts
        least, half = values.floor_sigma, field.sigma
        self.floor = covariance_of(
            PoseSigma(math.hypot(least.position, half), math.hypot(least.yaw, 0.2 * half))
        )

    def follow(
        self, cloud: Cloud, predicted: Pose2, covariance: Array, health: MatchHealth
    ) -> Match:
        """The match near a predicted pose or, if that is poor, a clearly better one farther off."""
        # four times the covariance (twice the sigma): the filter will weigh the prediction once
        # more when it takes the match, so it should count little here
        found = self._near(cloud, predicted, 4.0 * covariance)
        matching = self._values.matching
        if found.is_fair(matching):
            return found
        around = self._near(cloud, predicted, covariance_of(AROUND))
        clear = around.share >= health.least_share_of_wider(found)
        return around if clear and around.is_healthy(matching) else found

    def at_rest(self, cloud: Cloud, pose: Pose2, covariance: Array) -> tuple[Match, bool]:
        """The best match of a base at rest, and whether that base is still where it was."""
        found = self._near(cloud, pose, covariance)
        if found.is_healthy(self._values.matching) and is_same(pose, found.map_from_base):
            return found, True
        around = self._near(cloud, pose, covariance_of(AROUND))
        return (around if around.share > found.share else found), False

    def _near(self, cloud: Cloud, predicted: Pose2, covariance: Array) -> Match:
        self._counts["matched"] += 1
        whole = covariance + self.floor
        return match(self._field, cloud.points, predicted, whole, self._values.matching)


def leaps(found: Match, predicted: Pose2, covariance: Array) -> bool:
    """True if a match is too far from its prediction to be believed without being repeated."""
    if found.share >= CERTAIN:
        return False
    pose = found.map_from_base
    place = LEAP * math.sqrt(max(0.0, 0.5 * (covariance[0, 0] + covariance[1, 1]))) + SAME_M
    turn = LEAP * math.sqrt(max(0.0, covariance[2, 2])) + SAME_RAD
    near = pose.distance_to(predicted) < place
    return not (near and abs(wrap(pose.yaw - predicted.yaw)) < turn)


def is_same(one: Pose2, other: Pose2) -> bool:
    """True if two poses differ by no more than a base at rest appears to move."""
    return one.distance_to(other) < SAME_M and abs(wrap(one.yaw - other.yaw)) < SAME_RAD


def is_sure(covariance: Array, wanted: PoseSigma) -> bool:
    """True if no standard deviation of a pose is above the wanted one."""
    return bool((np.diag(covariance) <= np.diag(covariance_of(wanted))).all())
