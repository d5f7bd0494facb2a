"""Search for the base on the whole map, or around a place: a lattice proposes, matches decide.

A first scan is tried at every place of a lattice over the floor, in slices of bounded work. The
likeliest places, well apart from each other, become hypotheses. Each is refined by scan matching at
every further scan and scored by the log-likelihoods of the scans; those that fall behind are
dropped. Unrefined, a place 10 cm off the truth fits worse than one at the optimum of a wrong place.

Scans from one place repeat the same evidence: for each scanner only their mean counts, and it is
settled once the base has moved. The best hypothesis is the answer when all others are behind it by
`SURE`, and by `LIKE` more as long as the base has not moved: what is not on the map, and errors of
the map, favour one of two like places just as well as the truth does. Where the first scan was seen
off the map, the truth was not among the hypotheses; so an answer that is not clear is searched for
once more.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from hw import Pose2, PoseSigma, compiled, total, wrap
from states.localization.filter import covariance_of, inverse
from states.localization.matching.amcl import AmclValues
from states.localization.matching.correlative import ALIKE, CARRIED, Window, correlated
from states.localization.matching.proposals import Proposals
from states.localization.matching.scan_tracker import Match, TrackerValues, match
from states.maps import Array, Field, Table, distance_at, is_floor

REFINED = 20
"""Most hypotheses that are refined at once."""
GIVEN = (1.0, 0.5)
"""Distance up to which a place is where the base was said to be, m and rad."""
APART = 0.5
"""Distance from which a place is another one, m."""
ONE = (0.1, 0.05)
"""Hypotheses that come closer than this, m and rad, are merged."""
BEHIND_WALL = 3.0
"""Penalty of a beam that ends behind a wall, over one on something unmapped (log-likelihood)."""
WORSE, KEPT = 60.0, 30
"""Largest log-likelihood behind the best, and largest number, of hypotheses that are kept."""
MOVED = (0.1, 0.1)
"""A scan after so much motion is new evidence, m and rad."""
KEEP = 0.9
"""Decay of earlier evidence per place."""
SURE, LIKE = math.log(99.0), 8.0
"""Log-odds of the best hypothesis over the next one: needed, and in addition before any motion. 8
is what a tenth of 180 beams contributes."""
STEP = (0.3, 0.3)
"""After a longer way between two scans wheels may be farther off, m and rad."""
FEW, WINDOW = 2, (0.9, 0.6)
"""So many last hypotheses are sought in a window of these half sizes, m and rad."""
FEWEST, MORE, PLAIN = 4, 60, 0.6
"""Least number of scans before an answer, so that both scanners contribute; `MORE` where less than
a share `PLAIN` of beams is on walls, so that moving obstacles have time to change."""
CLEAR = 0.8
"""Share of beams on walls from which no motion is needed."""
PLACES, FAR = 5, (10, 20)
"""Places from which a place must have been confirmed if it is not clear; and if it is not where the
base was said to be, when clear and when not."""
PATIENCE = 25
"""Scans in a row that fit no hypothesis, after which the search begins anew."""
TRIES = 4
"""Searches about a given pose before one on the whole floor."""
_NEAR, _CLOSE = covariance_of(PoseSigma(0.3, 0.2)), covariance_of(PoseSigma(0.05, 0.03))


@dataclass(slots=True)
class _Hypothesis:
    match: Match
    expected: float
    fits: float = 0.0
    here: dict[str, float] = field(default_factory=dict)

    @property
    def log(self) -> float:
        return self.expected + self.fits + total(self.here.values())

    def add_fit(self, sensor: str, fit: float) -> None:
        """Take the fit of a scan; several from one place count as one."""
        before = self.here.get(sensor, fit)
        self.here[sensor] = 0.5 * (before + fit)

    def settle(self) -> None:
        """Add what was seen from a place that the base has left."""
        self.fits = KEEP * self.fits + total(self.here.values())
        self.here = {}


class _Seen(NamedTuple):
    """A scan, points (n, 2) in the base frame, and odometry at its instant."""

    odom_from_base: Pose2
    points: Array
    sensor: str


class Search:
    """A search on the whole floor, or `about` a pose; give it every scan.

    `best` is the likeliest hypothesis. `guess` is the best while it is ahead of all others and most
    beams are on walls, even if too few scans have been seen for an answer; else None. `ambiguous`
    is true while another place of the floor is about as likely.
    """

    def __init__(self, field_: Field, particles: AmclValues, matching: TrackerValues) -> None:
        self._field, self._values, self._matching = field_, particles, matching
        self.anywhere()

    def about(self, map_from_base: Pose2, covariance: Array) -> None:
        """Search near a pose, with covariance (3, 3) in the map."""
        self._given, self._tries = True, 0
        self._start(map_from_base, inverse(covariance))

    def anywhere(self, also: Pose2 | None = None, *, given: bool = False) -> None:
        """Search the whole floor; `also` is a further hypothesis, the pose so far.

        If that is `given`, places elsewhere need more evidence.
        """
        self._given, self._tries = given, TRIES
        self._start(also, None)

    def _start(self, also: Pose2 | None, prior: Array | None) -> None:
        self._also, self._prior = also, prior
        self._first: Pose2 | None = None
        self._seen: _Seen | None = None
        self._is_busy = self._more = False
        self._work: Iterator[None] = iter(())
        self._hypotheses: list[_Hypothesis] = []
        self._scans = self._unfit = self._places = 0
        self._place = Pose2(0.0, 0.0)
        self.best: Match | None = None
        self.guess: Match | None = None
        self.ambiguous = False

    def update(self, odom_from_base: Pose2, points: Array, sensor: str = "") -> Match | None:
        """Take a scan, points (n, 2) in the base frame, m; the match once the base is found.

        While there is work left on an earlier scan, this one only says where the base is now.
        """
        if not self._is_busy:
            before, self._seen = self._seen, _Seen(odom_from_base, points, sensor)
            self._is_busy, self._work = True, self._round(self._seen, before)
        self.advance()
        seen = self._seen
        found = None if self._is_busy else self._answer()
        if found is None or seen is None:
            return None
        since = seen.odom_from_base.inverse() @ odom_from_base
        return replace(found, map_from_base=found.map_from_base @ since)

    def advance(self) -> None:
        """Do one more slice of the work on a scan, if there is any left."""
        try:
            next(self._work)
        except StopIteration:
            self._is_busy = False

    def _answer(self) -> Match | None:
        self._scans += 1
        self.best = best = self._hypotheses[0].match
        ahead, fair = self._is_ahead(), best.is_fair(self._matching)
        self._unfit = 0 if fair else self._unfit + 1
        if self._unfit >= PATIENCE:
            self._restart()
            return None
        if self._more and self._prior is None and self._places >= PLACES:
            self._start(self._also, None)
            # there were more like places than hypotheses; there may be fewer here
            self.ambiguous = True
            return None
        sure, plain = fair and ahead, best.share >= PLAIN
        elsewhere = self._given and self._prior is None
        self.guess = best if sure and plain and not elsewhere else None
        unsure = fair and plain and not ahead and self._scans >= FEWEST
        self.ambiguous = unsure and self._prior is None
        if not (sure and self._is_enough(best)):
            return None
        if self._is_confirmed(best):
            return best
        self._again(best.map_from_base)
        return None

    def _is_confirmed(self, best: Match) -> bool:
        """True unless what was proposed long ago may have left out where the base is."""
        if self._prior is not None or best.share >= CLEAR:
            return True
        return any(
            one is not None and best.map_from_base.is_near(one, *GIVEN)
            for one in (self._also, self._first)
        )

    def _again(self, first: Pose2) -> None:
        """Search anew from here; the place that was found must be found once more."""
        self._start(self._also, None)
        self._first = first

    def _is_enough(self, best: Match) -> bool:
        """True once there is as much evidence as a place needs: more, the less is in its favour."""
        if self._scans < FEWEST:
            return False
        late = self._scans >= MORE
        if self._prior is not None:
            return best.share >= PLAIN or late or self._places >= PLACES
        also = self._also
        if self._given and not (also and best.map_from_base.is_near(also, *GIVEN)):
            return best.share >= PLAIN and self._places >= FAR[best.share < CLEAR]
        plain = best.share >= PLAIN and self._places >= PLACES
        return best.share >= CLEAR or plain or late

    def supports(self, map_from_base: Pose2) -> bool:
        """True unless places elsewhere are at least as likely as this one."""
        if self.ambiguous or self.best is None:
            return not self.ambiguous
        return self.best.map_from_base.distance_to(map_from_base) < APART

    def _restart(self) -> None:
        """Search anew: about the given pose some times more, then everywhere."""
        self._tries += 1
        self._start(self._also, self._prior if self._tries < TRIES else None)

    # the work on one scan, in slices

    def _round(self, seen: _Seen, before: _Seen | None) -> Iterator[None]:
        """Refine all hypotheses by one scan; the first scan proposes them."""
        far = self._scans < FEWEST
        if before is None or not self._hypotheses:
            yield from self._propose(seen)
        else:
            moved = before.odom_from_base.inverse() @ seen.odom_from_base
            far |= math.hypot(moved.x, moved.y) > STEP[0] or abs(moved.yaw) > STEP[1]
            self._carry(moved)
        since = self._place.inverse() @ seen.odom_from_base
        if math.hypot(since.x, since.y) > MOVED[0] or abs(since.yaw) > MOVED[1]:
            self._settle(seen.odom_from_base)
        about = _NEAR if far else _CLOSE
        for number, one in enumerate(self._hypotheses):
            if number and number % REFINED == 0:
                yield
            one.match = self._refined(one.match.map_from_base, seen.points, about)
            one.add_fit(seen.sensor, self._fit(seen.points, one.match.map_from_base))
        kept = _kept(self._hypotheses)
        self._more |= len(kept) == KEPT and kept[-1].log > kept[0].log - SURE - LIKE
        self._hypotheses = kept

    def _refined(self, predicted: Pose2, points: Array, about: Array) -> Match:
        """The match near a prediction; of the last hypotheses, in a window about it if need be."""
        found = match(self._field, points, predicted, about, self._matching)
        if len(self._hypotheses) > FEW or found.is_fair(self._matching):
            return found
        starts = correlated(self._field, points, Window(predicted, _NEAR, *WINDOW))
        others = [match(self._field, points, one, _CLOSE, self._matching) for one in starts]
        return max((found, *others), key=lambda one: one.share)

    def _propose(self, seen: _Seen) -> Iterator[None]:
        also, prior = self._also, self._prior
        about = None if also is None or prior is None else (also, inverse(prior))
        proposals = Proposals(self._field, seen.points, about)
        while proposals.advance():
            yield
        chosen = proposals.chosen()
        self._more = proposals.more
        poses = [*chosen, *(one for one in (also, self._first) if one is not None)]
        none = np.zeros((3, 3))
        self._hypotheses = [
            _Hypothesis(Match(pose, none, 0.0, 0, 0.0, 0), self._expected(pose)) for pose in poses
        ]
        self._place = seen.odom_from_base

    def _carry(self, moved: Pose2) -> None:
        """Move all hypotheses on by the wheels' displacement."""
        self._also = None if self._also is None else self._also @ moved
        self._first = None if self._first is None else self._first @ moved
        for one in self._hypotheses:
            one.match = replace(one.match, map_from_base=one.match.map_from_base @ moved)

    def _settle(self, odom_from_base: Pose2) -> None:
        """The base has moved: what was seen counts, what comes is new evidence."""
        self._place, self._places = odom_from_base, self._places + 1
        for one in self._hypotheses:
            one.settle()

    def _is_ahead(self) -> bool:
        """True if no other hypothesis is about as likely as the best."""
        if self._more and self._prior is None:
            return False
        best, others = self._hypotheses[0], self._hypotheses[1:]
        needed = SURE + LIKE / (1 + self._places)
        return not others or best.log - others[0].log >= needed

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
        values, corner = self._values, self._field.map_from_corner
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
    return one.is_near(other, *ONE)


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
