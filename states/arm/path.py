"""Ways through joint space: straight lines with rounded corners, without time.

A path is a chain of pieces q(x) = p0 + p1 x + p2 x^2 with x from 0 to the piece's length. Lines run
at unit speed in joint space (the length is the Euclidean one, rad) and a rounded corner is the
parabola that leaves one line and meets the next with its direction, so that the slope dq/ds has no
jump except at corners left sharp.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from states.arm.collision import CollisionChecker
from states.arm.kernels import Array

_SHORTEST = 1e-12
_SMALLEST_CUT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Pieces (m, 3, 6) and their lengths (m,); m may be 0, then the path is the point `start`."""

    start: Array
    pieces: Array
    lengths: Array

    @classmethod
    def through(cls, points: ArrayLike, rounding: Sequence[float] = ()) -> JointPath:
        """Straight lines through points (k, 6), equal neighbours merged.

        rounding[i] is how far before and after the corner at point i + 1 its parabola begins and
        ends, rad, at most half of each line; 0 or left out: sharp.
        """
        corners = _distinct(np.asarray(points, dtype=np.float64))
        steps = np.diff(corners, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        cuts = np.zeros(len(corners))
        cuts[1 : 1 + len(rounding)] = rounding[: max(len(corners) - 2, 0)]
        cuts[cuts < _SMALLEST_CUT] = 0.0
        pieces: list[Array] = []
        sizes: list[float] = []
        for i, (step, length) in enumerate(zip(steps, lengths, strict=True)):
            along = step / length
            straight = length - cuts[i] - cuts[i + 1]
            if straight > _SHORTEST:
                pieces.append(np.array([corners[i] + cuts[i] * along, along, np.zeros(6)]))
                sizes.append(straight)
            if cuts[i + 1] > 0.0:
                after, cut = steps[i + 1] / lengths[i + 1], cuts[i + 1]
                bend = (after - along) / (4.0 * cut)
                pieces.append(np.array([corners[i + 1] - cut * along, along, bend]))
                sizes.append(2.0 * cut)
        return cls(corners[0].copy(), np.array(pieces).reshape(-1, 3, 6), np.array(sizes))

    @property
    def length(self) -> float:
        """Of all pieces, rad."""
        return float(self.lengths.sum())

    @property
    def goal(self) -> Array:
        """The last joints (6,)."""
        return np.asarray(self.at(np.array([self.length]))[0][0])

    @property
    def knots(self) -> Array:
        """Where pieces begin and the last one ends, (m + 1,)."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """Joints, slope and bend (n, 6) each at s (n,); outside [0, length] the ends count."""
        n = len(s)
        if not len(self.pieces):
            return np.repeat(self.start[None], n, axis=0), np.zeros((n, 6)), np.zeros((n, 6))
        knots = self.knots
        k = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(self.pieces) - 1)
        x = np.clip(s - knots[k], 0.0, self.lengths[k])[:, None]
        p = self.pieces[k]
        return p[:, 0] + x * (p[:, 1] + x * p[:, 2]), p[:, 1] + 2.0 * x * p[:, 2], 2.0 * p[:, 2]

    def sharp(self) -> Array:
        """Which of the inner knots are corners left sharp, (m - 1,) booleans."""
        if len(self.pieces) < 2:
            return np.zeros(0, dtype=np.bool_)
        before = self.pieces[:-1, 1] + 2.0 * self.lengths[:-1, None] * self.pieces[:-1, 2]
        return np.asarray(np.abs(before - self.pieces[1:, 1]).max(axis=1) > 1e-9)


def first_contact(checker: CollisionChecker, path: JointPath, since: float = 0.0) -> float | None:
    """Where a path, followed from `since` on, first comes too near to something; None: nowhere."""
    knot = 0.0
    for piece, length in zip(path.pieces, path.lengths, strict=True):
        begin = min(max(since - knot, 0.0), length)
        rest = np.array(
            [
                piece[0] + begin * (piece[1] + begin * piece[2]),
                piece[1] + 2.0 * begin * piece[2],
                piece[2],
            ]
        )
        if begin < length:
            free, _ = checker.sweep(rest, length - begin)
            if free < length - begin:
                return float(knot + begin + free)
        knot += length
    return None


def rounded(
    checker: CollisionChecker, points: Array, largest: float = 0.6, tries: int = 5
) -> tuple[JointPath, int]:
    """The path through points with corners as round as is free, and the joint sets examined.

    Each corner starts at `largest` rad (at most half of the shorter line beside it) and is halved
    until its parabola is free; after `tries` it stays sharp, and the arm stops there.
    """
    corners = _distinct(points)
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    cuts, checks = [], 0
    for i in range(1, len(corners) - 1):
        cut = min(largest, 0.5 * lengths[i - 1], 0.5 * lengths[i])
        for _ in range(tries):
            bend = JointPath.through(corners[i - 1 : i + 2], [cut])
            free, used = _bend_free(checker, bend)
            checks += used
            if free:
                break
            cut *= 0.5
        cuts.append(cut if free else 0.0)
    return JointPath.through(corners, cuts), checks


def _bend_free(checker: CollisionChecker, path: JointPath) -> tuple[bool, int]:
    k = int(np.argmax(np.abs(path.pieces[:, 2]).max(axis=1)))
    if not path.pieces[k, 2].any():  # straight on: nothing to round
        return True, 0
    length = float(path.lengths[k])
    free, checks = checker.sweep(path.pieces[k], length)
    return free >= length, checks


def _distinct(points: Array) -> Array:
    keep = np.ones(len(points), dtype=np.bool_)
    keep[1:] = np.linalg.norm(np.diff(points, axis=0), axis=1) > _SHORTEST
    return np.asarray(points[keep])
