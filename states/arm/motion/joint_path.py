"""Paths in joint space, without time: straight lines with rounded corners.

A path is a chain of pieces q(x) = p0 + p1 x + p2 x^2, x from 0 to the length of the piece. On lines
|dq/dx| = 1, so lengths are Euclidean, rad. A corner is rounded by the parabola that leaves one line
with its direction, `cut` before the corner, and meets the next with its own, `cut` behind it: over
its length of 2 cut the direction u changes linearly to v, so p2 = (v - u) / (4 cut). Thus dq/ds
jumps only at corners left sharp.

A smooth curve, such as a straight line of the tool, is given by joints and slopes at knots, over a
parameter of its own (`smooth`). Between two knots h apart with joints a, b and slopes u, v lie two
parabolas: the slope changes linearly from u to w = 2 (b - a) / h - (u + v) / 2 in the middle, and
from there to v, which gives the first p2 = (w - u) / h and the second (v - w) / h, and q(h) = b.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from states.arm.kinematics import Array, CollisionChecker

_SHORTEST = 1e-12
_SMALLEST_CUT = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """Pieces (m, 3, j) and their lengths (m,); with m = 0 the path is the point `start`."""

    start: Array
    pieces: Array
    lengths: Array

    @classmethod
    def through(cls, points: ArrayLike, rounding: Sequence[float] = ()) -> JointPath:
        """Straight lines through points (k, j); equal neighbours are merged.

        rounding[i] is how far before and behind the corner at point i + 1 its parabola begins and
        ends, rad, at most half of each line; 0 or missing leaves the corner sharp.
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
                pieces.append(np.array([corners[i] + cuts[i] * along, along, np.zeros(len(along))]))
                sizes.append(straight)
            if cuts[i + 1] > 0.0:
                after, cut = steps[i + 1] / lengths[i + 1], cuts[i + 1]
                bend = (after - along) / (4.0 * cut)
                pieces.append(np.array([corners[i + 1] - cut * along, along, bend]))
                sizes.append(2.0 * cut)
        return cls(
            corners[0].copy(), np.array(pieces).reshape(-1, 3, corners.shape[1]), np.array(sizes)
        )

    @classmethod
    def smooth(cls, joints: Array, slopes: Array, step: float) -> JointPath:
        """Parabolas through joints (k, j) with slopes (k, j), `step` of the parameter apart."""
        before, after = joints[:-1], joints[1:]
        u, v = slopes[:-1], slopes[1:]
        middle = 2.0 * (after - before) / step - 0.5 * (u + v)
        half = before + 0.25 * step * (u + middle)
        first = np.stack([before, u, (middle - u) / step], axis=1)
        second = np.stack([half, middle, (v - middle) / step], axis=1)
        pieces = np.stack([first, second], axis=1).reshape(-1, 3, joints.shape[1])
        return cls(joints[0].copy(), pieces, np.full(len(pieces), 0.5 * step))

    def reversed(self) -> JointPath:
        """The same path from its end to its start.

        With y = l - x a piece becomes q(l) - (p1 + 2 l p2) y + p2 y^2.
        """
        p, x = self.pieces[::-1], self.lengths[::-1, None]
        ends = p[:, 0] + x * (p[:, 1] + x * p[:, 2])
        turned = np.stack([ends, -(p[:, 1] + 2.0 * x * p[:, 2]), p[:, 2]], axis=1)
        return JointPath(ends[0].copy(), turned, self.lengths[::-1].copy())

    def first(self, count: int) -> JointPath:
        """The first pieces only."""
        return JointPath(self.start, self.pieces[:count], self.lengths[:count])

    def then(self, other: JointPath) -> JointPath:
        """This path, followed by another that begins at its goal."""
        return JointPath(
            self.start,
            np.concatenate([self.pieces, other.pieces]),
            np.concatenate([self.lengths, other.lengths]),
        )

    @property
    def length(self) -> float:
        """Length of all pieces, rad."""
        return float(self.lengths.sum())

    @property
    def goal(self) -> Array:
        """Joints (j,) at the end."""
        return np.asarray(self.at(np.array([self.length]))[0][0])

    @property
    def knots(self) -> Array:
        """Arc lengths at which pieces begin and the last one ends, (m + 1,)."""
        return np.concatenate([[0.0], np.cumsum(self.lengths)])

    def at(self, s: Array) -> tuple[Array, Array, Array]:
        """q, dq/ds (slope) and d2q/ds2 (bend), (n, j) each, at s (n,) clamped to the path."""
        n = len(s)
        if not len(self.pieces):
            still = np.zeros((n, len(self.start)))
            return np.repeat(self.start[None], n, axis=0), still, still.copy()
        knots = self.knots
        k = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(self.pieces) - 1)
        x = np.clip(s - knots[k], 0.0, self.lengths[k])[:, None]
        p = self.pieces[k]
        return p[:, 0] + x * (p[:, 1] + x * p[:, 2]), p[:, 1] + 2.0 * x * p[:, 2], 2.0 * p[:, 2]

    def sharp(self) -> Array:
        """True for inner knots at which the slope jumps, (m - 1,)."""
        if len(self.pieces) < 2:
            return np.zeros(0, dtype=np.bool_)
        before = self.pieces[:-1, 1] + 2.0 * self.lengths[:-1, None] * self.pieces[:-1, 2]
        return np.asarray(np.abs(before - self.pieces[1:, 1]).max(axis=1) > 1e-9)


def first_contact(
    checker: CollisionChecker, path: JointPath, since: float = 0.0, until: float = math.inf
) -> float | None:
    """Where between `since` and `until` a path first comes too close to something, if it does.

    All three are lengths along the path, in its own parameter.
    """
    knot = 0.0
    for piece, length in zip(path.pieces, path.lengths, strict=True):
        begin, end = min(max(since - knot, 0.0), length), min(max(until - knot, 0.0), length)
        rest = np.array(
            [
                piece[0] + begin * (piece[1] + begin * piece[2]),
                piece[1] + 2.0 * begin * piece[2],
                piece[2],
            ]
        )
        if begin < end:
            free, _ = checker.sweep(rest, end - begin)
            if free < end - begin:
                return float(knot + begin + free)
        knot += length
    return None


def rounded(
    checker: CollisionChecker, points: Array, largest: float = 0.6, tries: int = 5
) -> tuple[JointPath, int]:
    """The path through points with corners as round as is free, and the joint sets checked.

    The cut of each corner starts at `largest` rad (at most half of the shorter line beside it) and
    is halved until its parabola is free. After `tries` the corner stays sharp, and the arm stops
    there.
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
