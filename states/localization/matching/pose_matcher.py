"""Scan matching for the localizer: near a prediction, wider where that fails, and at rest."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hw import Pose2, PoseSigma
from states.localization.filter import covariance_of
from states.localization.matching.beyond import is_leaving
from states.localization.matching.correlative import Window, correlated, score_of
from states.localization.matching.localizer_values import LocalizerValues
from states.localization.matching.match_health import MatchHealth
from states.localization.matching.scan_tracker import Match, match
from states.localization.matching.scans import Cloud
from states.maps import Array, Field

LEAP = 3.0
"""A match this many standard deviations from its prediction must be repeated to be accepted."""
CERTAIN = 0.8
"""Share of beams on walls from which a match is accepted at once, wherever it lies."""
AROUND = PoseSigma(0.3, 0.2)
"""Spread of the wider search around the predicted pose; a prediction that is worse is unsure."""
OUTSIDE = 1.0
"""A base this far from all floor of the map is not where it seems, m."""
BESIDE = 0.3
"""A base that wheels lead this far from all floor has left the map, m."""
SAME_M, SAME_RAD = 0.03, 0.01
"""A base at rest that is seen farther away than this has been moved, m and rad."""
Prediction = tuple[Pose2, Array]
"""A predicted map_from_base, and its covariance (3, 3)."""
_BOX = covariance_of(PoseSigma(0.1, 0.05))


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
        self,
        cloud: Cloud,
        predictions: Sequence[Prediction],
        health: MatchHealth,
        *,
        unsure: bool,
    ) -> Match:
        """The best match near some prediction; if that is poor, the likeliest one around them.

        Also around an `unsure` prediction: a match near it may be the wrong one of several.
        """
        # four times the covariance (twice the sigma): the filter will weigh the prediction once
        # more when it takes the match, so it should count little here
        near = [self._near(cloud, pose, 4.0 * covariance) for pose, covariance in predictions]
        best = max(near, key=_share)
        poor = not best.is_fair(self._values.matching) or health.is_worse(best)
        if poor or unsure:
            around = [self._around(cloud, one, best, health) for one in predictions]
            best = max(around, key=_share)
        return best if self.is_on_the_floor(best.map_from_base) else replace(best, share=0.0)

    def is_on_the_floor(self, map_from_base: Pose2, within: float = OUTSIDE) -> bool:
        """True if some floor of the map is within so many m of a pose, or the floor is unknown."""
        table, pose = self._field.table, self._field.map_from_corner.inverse() @ map_from_base
        column, row, around = (round(n / table.cell) for n in (pose.x, pose.y, within))
        some = table.floor[
            max(0, row - around) : row + around, max(0, column - around) : column + around
        ]
        return len(table.floor) == 0 or bool(some.any())

    def beside(self, cloud: Cloud, prediction: Prediction) -> Match:
        """The best match in a window about a prediction."""
        pose, covariance = prediction
        starts = correlated(self._field, cloud.points, self._window(pose, covariance))
        found = [self._near(cloud, start, _BOX) for start in (pose, *starts)]
        return max(found, key=_share)

    def _window(self, pose: Pose2, covariance: Array) -> Window:
        """Three standard deviations about a prediction, twice over, and at least `AROUND`."""
        whole = 4.0 * covariance + self.floor
        metres = 3.0 * math.sqrt(max(whole[0, 0], whole[1, 1]))
        radians = 3.0 * math.sqrt(whole[2, 2])
        least = 3.0 * AROUND.position, 3.0 * AROUND.yaw
        return Window(pose, whole, max(metres, least[0]), max(radians, least[1]))

    def is_off(self, cloud: Cloud, map_from_base: Pose2) -> bool:
        """True if a pose is off the map, or a scan shows that the map ends there."""
        fits = self._values.matching.inlier_distance + self._field.sigma
        return not self.is_on_the_floor(map_from_base, BESIDE) or is_leaving(
            self._field, cloud.points, map_from_base, fits
        )

    def _around(
        self, cloud: Cloud, prediction: Prediction, near: Match, health: MatchHealth
    ) -> Match:
        """The likeliest match in a window about a prediction; `near` if none is clearly better."""
        window = self._window(*prediction)
        best, score = near, score_of(self._field, cloud.points, window, near.map_from_base)
        for start in correlated(self._field, cloud.points, window):
            found = self._near(cloud, start, _BOX)
            its = score_of(self._field, cloud.points, window, found.map_from_base)
            if its > score and self._is_clear(found, near, prediction, health):
                best, score = found, its
        return best

    def _is_clear(
        self, found: Match, near: Match, prediction: Prediction, health: MatchHealth
    ) -> bool:
        """True unless a match lies where no slip leads while the near one will do."""
        matching = self._values.matching
        if not found.is_healthy(matching):
            return False
        if is_near(found.map_from_base, prediction[0], prediction[1], 2.0 * LEAP):
            return True
        return not near.is_healthy(matching) and found.share >= health.least_share_of_wider(near)

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
    """True if a match is too far from its prediction to be accepted without being repeated."""
    sigmas = 2.0 * LEAP if found.share >= CERTAIN else LEAP
    return not is_near(found.map_from_base, predicted, covariance, sigmas)


def is_near(pose: Pose2, predicted: Pose2, covariance: Array, sigmas: float) -> bool:
    """True if a pose is within so many standard deviations of a prediction."""
    place = sigmas * math.sqrt(max(0.0, 0.5 * (covariance[0, 0] + covariance[1, 1]))) + SAME_M
    turn = sigmas * math.sqrt(max(0.0, covariance[2, 2])) + SAME_RAD
    return pose.is_near(predicted, place, turn)


def is_same(one: Pose2, other: Pose2) -> bool:
    """True if two poses differ by no more than a base at rest appears to move."""
    return one.is_near(other, SAME_M, SAME_RAD)


def is_sure(covariance: Array, wanted: PoseSigma) -> bool:
    """True if no standard deviation of a pose is above the wanted one."""
    return bool((np.diag(covariance) <= np.diag(covariance_of(wanted))).all())


def _share(match_: Match) -> float:
    return match_.share
