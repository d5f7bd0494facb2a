"""Straight lines of the tool along its own axis: how the prop comes to a DEEP and leaves it.

The x axis of a DEEP points from the person into the surface, so the way in is a line along -x from
a *stand-off*, the DEEP moved by d along +x with its orientation kept, and the way out is the same
line backwards. A line is solved outwards from joints at the DEEP: at knots `STEP` apart the branch
next to that of the knot before is taken, dq/ds = J^-1 (x, 0) gives the slopes there, and parabolas
connect the knots (`JointPath.smooth`). A branch whose slope exceeds `STEEPEST` is nearly singular
and ends there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hw.model import MotionLimits
from states.arm.kinematics import (
    ALONG_STEPS,
    BRANCHES,
    EXACT,
    Array,
    Manipulator,
    descended,
    followed,
    forward,
    inverse,
    jacobian,
)
from states.arm.motion import JointPath, SlowZone, line_times

STEP = 0.01
"""Distance between two knots of a line, m."""

STEEPEST = 30.0
"""Largest dq/ds of a line, rad/m."""

TOUCH_SPEED = 0.25
"""Largest speed of the tool on a line and near the DEEP, m/s (ISO 10218-1: reduced speed)."""

NEAR = 0.115
"""Distance from the DEEP within which the tool keeps TOUCH_SPEED on its way to the stand-off, m."""

_TURN = 2.0 * np.pi
_DAMPING = 1e-12


@dataclass(frozen=True, slots=True, eq=False)
class ToolLine:
    """A line from joints at the DEEP outwards; `path` runs over metres of the tool.

    `knots` (n, 6) are `STEP` apart, the first at the DEEP; `steep` (n,) is the largest |dq/ds| of
    each joint from the DEEP up to that knot, (n, 6).
    """

    path: JointPath
    knots: Array
    steep: Array

    @property
    def length(self) -> float:
        """Length up to the last knot, m."""
        return (len(self.knots) - 1) * STEP

    def at(self, distance: float) -> Array:
        """Joints (6,) of the stand-off at this distance, m."""
        return np.asarray(self.knots[_count(distance)])

    def outwards(self, distance: float) -> JointPath:
        """The path from the DEEP to the stand-off."""
        return self.path.first(2 * _count(distance))


@dataclass(frozen=True, slots=True, eq=False)
class WayIn:
    """The line from the stand-off at `distance`, m, to the DEEP."""

    line: ToolLine
    distance: float

    def path(self) -> JointPath:
        """The path from the stand-off to the DEEP."""
        return self.line.outwards(self.distance).reversed()

    def duration(self, arm: Manipulator, limits: MotionLimits) -> float:
        """Time from rest to rest at TOUCH_SPEED at most, s; an estimate.

        Its acceleration limit is that of the steepest place all along.
        """
        n = _count(self.distance)
        slope = np.maximum(self.line.steep[: n + 1], 1e-9)
        rate = np.minimum(TOUCH_SPEED, np.min(arm.max_speed / slope, axis=1))
        gain = np.min(limits.arm_acceleration / slope[n]) / self.distance
        found = np.zeros(1)
        line_times(((rate / self.distance) ** 2)[None], np.array([gain]), found)
        return float(found[0])


def tool_lines(arm: Manipulator, joints: Array, length: float) -> list[ToolLine]:
    """The lines outwards from joints (k, 6) with the prop at a DEEP, `length` m or shorter."""
    count, starts = _count(length), np.ascontiguousarray(joints)
    if not len(starts):
        return []
    poses = np.repeat(forward(arm, starts)[:, None], count + 1, axis=1)
    ahead = poses[:, 0, :3, 0]
    poses[:, :, :3, 3] += STEP * np.arange(count + 1)[:, None] * ahead[:, None]
    knots, reached = _branches(arm, starts, poses[:, 1:])
    slopes = _slopes(arm, knots, ahead)
    steep = np.maximum.accumulate(np.abs(slopes), axis=1)
    reached = np.minimum(reached, np.sum(steep.max(axis=2) <= STEEPEST, axis=1) - 1)
    return [
        ToolLine(JointPath.smooth(q[: n + 1], v[: n + 1], STEP), q[: n + 1], most[: n + 1])
        if n > 0
        else ToolLine(JointPath.through(q[:1]), q[:1], most[:1])
        for q, v, most, n in zip(knots, slopes, steep, reached, strict=True)
    ]


def moved_along(deep: Array, distance: float) -> Array:
    """The pose (4, 4) of the stand-off at this distance from a DEEP, m."""
    found = deep.copy()
    found[:3, 3] += distance * deep[:3, 0]
    return found


def around(arm: Manipulator, joints: Array, radius: float = NEAR) -> SlowZone:
    """The zone of TOUCH_SPEED about the tcp at these joints (6,)."""
    x, y, z = forward(arm, joints)[:3, 3].tolist()
    return SlowZone(x, y, z, radius, TOUCH_SPEED)


def rungs(line: ToolLine, ladder: Sequence[float]) -> list[float]:
    """The distances of a ladder that a line reaches."""
    return [distance for distance in ladder if distance <= line.length + 1e-9]


def _count(distance: float) -> int:
    return max(1, round(distance / STEP))


def _branches(arm: Manipulator, starts: Array, poses: Array) -> tuple[Array, NDArray[np.int64]]:
    """Joints (k, n + 1, j) along poses (k, n, 4, 4), and the last knot that each line reaches.

    A line ends where no branch is near the one before, or its joints leave their limits. On a
    chain without closed form that is at most n ALONG_STEPS Newton steps for each line.
    """
    k, n = poses.shape[:2]
    stepped = arm.is_numeric or arm.placements is not None
    near_by = None if stepped else _nominal_candidates(arm, poses)
    knots = np.repeat(starts[:, None], n + 1, axis=1)
    reached, going = np.zeros(k, dtype=np.int64), np.ones(k, dtype=np.bool_)
    rows = np.arange(k)
    for i in range(n):
        before = knots[:, i, None]
        if near_by is None:  # no closed form: a few Newton steps from the knot before
            along = followed if arm.is_numeric else descended
            found, worth = along(arm, before[:, 0], poses[:, i], ALONG_STEPS)
            found, missing = found[:, None], np.where(worth <= EXACT**2, 0.0, np.inf)[:, None]
        else:
            found, missing = near_by[0][:, i], near_by[1][:, i]
        near = found - _TURN * np.round((found - before) / _TURN)
        away = np.abs(near - before).max(axis=2) + missing
        best = away.argmin(axis=1)
        chosen = near[rows, best]
        inside = np.all((chosen >= arm.lower) & (chosen <= arm.upper), axis=1)
        going &= inside & (away[rows, best] <= STEEPEST * STEP)
        knots[going, i + 1 :] = chosen[going, None]
        reached[going] = i + 1
    return knots, reached


def _nominal_candidates(arm: Manipulator, poses: Array) -> tuple[Array, Array]:
    """All branches along poses (k, n, 4, 4): joints (k, n, 8, 6), and inf where one is missing."""
    k, n = poses.shape[:2]
    solved = inverse(arm, poses.reshape(-1, 4, 4))
    missing = np.where(solved.valid, 0.0, np.inf)
    return solved.joints.reshape(k, n, BRANCHES, 6), missing.reshape(k, n, BRANCHES)


def _slopes(arm: Manipulator, knots: Array, ahead: Array) -> Array:
    """dq/ds (k, n, 6) for a tool that moves along `ahead` (k, 3) without turning.

    Damped least squares, which stays finite at singularities: (J^T J + l I) dq/ds = J^T (x, 0).
    """
    k, n = knots.shape[:2]
    jac = jacobian(arm, knots.reshape(-1, arm.count)).reshape(k, n, 6, arm.count)
    normal = np.swapaxes(jac, -1, -2) @ jac + _DAMPING * np.eye(arm.count)
    wanted = np.einsum("knij,ki->knj", jac[:, :, :3], ahead)
    return np.asarray(np.linalg.solve(normal, wanted[..., None])[..., 0])
