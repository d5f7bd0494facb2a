"""Does the arm touch the person where no touch is granted? Judged on true poses, like the metrics.

The person is the cylinder of R23 without an upper end, the arm its capsules. While a touch is asked
for, nothing counts, nor what is left of it until the arm has come away once. An arm inside the
outline of the rover is the outline's business.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hw.geometry import Pose2, wrap
from hw.person import RADIUS
from hw.robot import Footprint
from hw.samples import Joints
from hw.sim.world import World

Array = NDArray[np.float64]
OutlineOf = Callable[[Joints], tuple[Array, Array]]
"""Ends (m, 2, 3) of the capsules' axes in the rover frame, and their radii (m,); m."""

PARTS = 4
"""Between two looks the motion is cut into so many even parts."""


@dataclass(frozen=True, slots=True)
class _Look:
    base: Pose2
    body: Pose2
    joints: Joints

    def between(self, other: _Look, share: float) -> _Look:
        joints = zip(self.joints, other.joints, strict=True)
        return _Look(
            _between(self.base, other.base, share),
            _between(self.body, other.body, share),
            tuple(a + share * (b - a) for a, b in joints),
        )


class ArmWatch:
    """Counts touches of arm and person; `watch` once per tick."""

    def __init__(self, world: World, outline_of: OutlineOf) -> None:
        self.contacts = 0
        assert world.person is not None, "there is nobody to be touched"
        self._world, self._person, self._outline_of = world, world.person, outline_of
        self._last = self._look()
        self._out = self._is_out(self._last.joints)
        self._excused = False

    def watch(self) -> None:
        """Look at the true state of this instant."""
        last, was_out = self._last, self._out
        moved = self._joints is not last.joints
        if not (moved or was_out):
            return
        self._last = now = self._look()
        if moved:
            self._out = self._is_out(now.joints)
        if not self._out:
            self._excused = False
            return
        if not was_out:
            last = now  # where the rover was while the arm lay in its outline does not matter
        if self._person.request is not None:
            self._excused = True
            return
        touching = any(self._gap(last.between(now, k / PARTS)) <= 0.0 for k in range(1, PARTS + 1))
        if touching and not self._excused:
            self.contacts += 1
        self._excused = touching  # one touch counts once

    @property
    def _joints(self) -> Joints:
        arm = self._world.arm
        assert arm is not None, "there is no arm to touch with"
        return arm.state.joints

    def _look(self) -> _Look:
        return _Look(self._world.base.pose, self._person.body, self._joints)

    def _is_out(self, joints: Joints) -> bool:
        ends, radii = self._outline_of(joints)
        return bool((_beyond(self._world.robot.footprint, ends) + radii > 0.0).any())

    def _gap(self, look: _Look) -> float:
        ends, radii = self._outline_of(look.joints)
        x, y = look.base.inverse().transform(look.body.x, look.body.y)
        return float((_distances(ends, x, y) - radii).min()) - RADIUS


def _beyond(footprint: Footprint, ends: Array) -> Array:
    """How far each axis comes out of the outline, m; below 0 inside."""
    half = np.array((footprint.half_length, footprint.half_width))
    found: Array = (np.abs(ends[:, :, :2]) - half).max(axis=(1, 2))
    return found


def _distances(ends: Array, x: float, y: float) -> Array:
    """Distance over the floor of a point of the rover frame to each axis, m."""
    start, way = ends[:, 0, :2], ends[:, 1, :2] - ends[:, 0, :2]
    away = np.array((x, y)) - start
    square = np.maximum((way * way).sum(axis=1), 1e-12)
    share = np.clip((away * way).sum(axis=1) / square, 0.0, 1.0)
    found: Array = np.hypot(*(away - share[:, None] * way).T)
    return found


def _between(a: Pose2, b: Pose2, share: float) -> Pose2:
    yaw = a.yaw + share * wrap(b.yaw - a.yaw)
    return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), yaw)
