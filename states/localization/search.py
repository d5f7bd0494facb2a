"""Search for the base on the whole map, or around a place: particles propose, matches decide.

The likeliest particles of a first scan, well apart from each other, become hypotheses. Each is
refined by scan matching at every further scan and scored by the log-likelihoods of the latest
scans; those that fall behind are dropped. Particles alone converge to wrong places where rooms look
alike: one 10 cm off the truth fits worse than one at the optimum of a wrong place. Refined, both
can be compared.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hw.compiled import compiled
from hw.geometry import Pose2, wrap
from hw.samples import PoseSigma
from states.localization.amcl import Amcl, AmclValues
from states.localization.fusion import covariance_of, inverse
from states.localization.particles import wrapped
from states.localization.scan_tracker import Match, TrackerValues, match
from states.maps.distance import Array
from states.maps.field import Field, Table, distance_at, is_floor

PER_SQUARE_METRE, MOST = 150, 100_000
"""Particles of a search on the whole floor, per m2 and at most."""
SEEDS = 100
"""Number of hypotheses at the start."""
APART = (0.3, 0.25)
"""Least distance between hypotheses at the start, m and rad."""
ONE = (0.1, 0.05)
"""Hypotheses that come closer than this, m and rad, are merged."""
BEHIND_WALL = 3.0
"""Penalty of a beam that ends behind a wall, over one on something unmapped (log-likelihood)."""
WORSE, KEPT = 60.0, 30
"""Largest log-likelihood behind the best, and largest number, of hypotheses that are kept."""
ALIKE = 0.1
"""Independent beams per beam of a scan: errors of neighbours correlate."""
KEEP = 0.9
"""Decay of earlier scores per scan: scans from one place repeat the same evidence."""
SURE = 0.99
"""Probability from which the best hypothesis is accepted."""
FEWEST, MORE, PLAIN = 4, 60, 0.6
"""Least number of scans before an answer, so that both scanners contribute; `MORE` where less than
a share `PLAIN` of beams is on walls, so that moving obstacles have time to change."""
PATIENCE = 25
"""Scans in a row that fit no hypothesis, after which the search restarts on the whole floor."""
CARRIED = 8.0
"""Log-odds that the base has not been carried elsewhere."""
_NEAR, _CLOSE = covariance_of(PoseSigma(0.3, 0.2)), covariance_of(PoseSigma(0.05, 0.03))


@dataclass(slots=True)
class _Hypothesis:
    match: Match
    expected: float
    fits: float = 0.0

    @property
    def log(self) -> float:
        return self.expected + self.fits


class Search:
    """A search on the whole floor, or `about` a pose; give it every scan.

    `guess` is the best hypothesis while it is probable enough and most beams are on walls, even if
    too few scans have been seen for an answer; else None.
    """

    def __init__(
        self, field: Field, particles: AmclValues, matching: TrackerValues, seed: int
    ) -> None:
        self._field, self._matching = field, matching
        self._amcl = Amcl(field, particles, seed)
        self._also: Pose2 | None = None
        self._prior: Array | None = None
        self._hypotheses: list[_Hypothesis] = []
        self._odom_from_base: Pose2 | None = None
        self._scans = self._unfit = 0
        self.guess: Match | None = None
        self._begun = False

    def about(self, map_from_base: Pose2, covariance: Array) -> None:
        """Search near a pose, with covariance (3, 3) in the map."""
        self._amcl.start(map_from_base, covariance)
        self._begin(map_from_base)
        self._prior = inverse(covariance)

    def anywhere(self, also: Pose2 | None = None) -> None:
        """Search the whole floor; `also` is a further hypothesis, the pose so far."""
        area = len(self._field.free) * self._field.table.cell**2
        wanted = round(PER_SQUARE_METRE * area)
        self._amcl.start_anywhere(min(max(wanted, self._amcl.values.max_particles), MOST))
        self._begin(also)

    def update(self, odom_from_base: Pose2, points: Array) -> Match | None:
        """Take a scan, points (n, 2) in the base frame, m; the match once the base is found."""
        if not self._begun:
            self.anywhere()
        self._scans += 1
        if not self._hypotheses:
            self._seed(points)
        moved = (self._odom_from_base or odom_from_base).inverse() @ odom_from_base
        self._odom_from_base = odom_from_base
        self._also = None if self._also is None else self._also @ moved
        about = _NEAR if self._scans < FEWEST else _CLOSE
        for one in self._hypotheses:
            predicted = one.match.map_from_base @ moved
            one.match = match(self._field, points, predicted, about, self._matching)
            one.fits = KEEP * one.fits + self._fit(points, one.match.map_from_base)
        self._hypotheses = _kept(self._hypotheses)
        best = self._hypotheses[0]
        weight = 1.0 / sum(math.exp(one.log - best.log) for one in self._hypotheses)
        fair = best.match.is_fair(self._matching)
        self._unfit = 0 if fair else self._unfit + 1
        if self._unfit >= PATIENCE:
            self.anywhere(self._also)
        sure = fair and weight >= SURE
        plain = best.match.share >= PLAIN
        self.guess = best.match if sure and plain else None
        return best.match if sure and self._scans >= (FEWEST if plain else MORE) else None

    def _begin(self, also: Pose2 | None) -> None:
        self._also, self._prior, self._hypotheses = also, None, []
        self._odom_from_base, self._scans, self._unfit, self._begun = None, 0, 0, True
        self.guess = None

    def _seed(self, points: Array) -> None:
        particles = self._amcl.particles
        order = np.argsort(-self._amcl.fits(points), kind="stable")
        chosen = _apart(particles[order], SEEDS, *APART)
        poses = [Pose2(*map(float, row)) for row in chosen]
        if self._also is not None:
            poses.append(self._also)
        none = np.zeros((3, 3))
        for pose in poses:
            start = Match(pose, none, 0.0, 0, 0.0, 0)
            self._hypotheses.append(_Hypothesis(start, self._expected(pose)))

    def _expected(self, pose: Pose2) -> float:
        """Log prior of a pose."""
        also = self._also
        if also is None:
            return 0.0
        if self._prior is None:
            return 0.0 if _same(pose, also) else -CARRIED
        off = np.array([pose.x - also.x, pose.y - also.y, wrap(pose.yaw - also.yaw)])
        return -0.5 * float(off @ self._prior @ off)

    def _fit(self, points: Array, map_from_base: Pose2) -> float:
        values, corner = self._amcl.values, self._field.map_from_corner
        pose = corner.inverse() @ map_from_base
        sigma = math.hypot(values.sigma_hit, self._field.sigma)
        floor = values.z_rand / values.laser_max_range
        table = self._field.table
        log: float = _fit(points, (pose.x, pose.y, pose.yaw), table, sigma, values.z_hit, floor)
        return ALIKE * log


def _kept(hypotheses: list[_Hypothesis]) -> list[_Hypothesis]:
    """Hypotheses, best first, without those far behind it or merged into a better one."""
    ordered = sorted(hypotheses, key=lambda one: -one.log)
    kept: list[_Hypothesis] = []
    for one in ordered:
        if one.log < ordered[0].log - WORSE or len(kept) == KEPT:
            break
        if not any(_same(one.match.map_from_base, other.match.map_from_base) for other in kept):
            kept.append(one)
    return kept


def _same(one: Pose2, other: Pose2) -> bool:
    return one.distance_to(other) < ONE[0] and abs(wrap(one.yaw - other.yaw)) < ONE[1]


@compiled
def _fit(
    points: Array,
    pose: tuple[float, float, float],
    table: Table,
    sigma: float,
    hit: float,
    floor: float,
) -> float:
    """Sum of ln(hit exp(-d^2 / 2 sigma^2) + floor), with a penalty for beams behind walls."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    total = 0.0
    for i in range(len(points)):
        x = pose[0] + c * points[i, 0] - s * points[i, 1]
        y = pose[1] + s * points[i, 0] + c * points[i, 1]
        d = distance_at(x, y, table)[0]
        total += math.log(hit * math.exp(-0.5 * (d / sigma) ** 2) + floor)
        if d > 3.0 * sigma and not is_floor(x, y, table):
            total -= BEHIND_WALL
    return total


@compiled
def _apart(particles: Array, count: int, metres: float, radians: float) -> Array:
    """At most `count` of the particles (n, 3), in order, each apart from those chosen before."""
    chosen = np.empty((count, 3))
    found = 0
    for i in range(len(particles)):
        near = False
        for k in range(found):
            dx, dy = particles[i, 0] - chosen[k, 0], particles[i, 1] - chosen[k, 1]
            turn = wrapped(particles[i, 2] - chosen[k, 2])
            if dx * dx + dy * dy < metres * metres and abs(turn) < radians:
                near = True
                break
        if not near:
            chosen[found] = particles[i]
            found += 1
            if found == count:
                break
    return chosen[:found].copy()
