"""The arm on its rover: what its files say, and the same as arrays to compute with.

Frames (metres, radians, right-handed):

* `rover`: `base_link` of the rover projected to the floor, x ahead, z up.
* `base`: the start of the arm's chain. It is the `base` of the UR controller, turned by pi about z
  from the ROS `base_link` of the arm; `mount` is rover_from_base.
* link 1 ... link 6: each turns with its joint about its own z; link 6 is ROS `tool0`.
* `tcp`: the prop's own frame, equal to the DEEP when the prop is presented: x points from the
  person into the touched surface (against the flange's z), z is up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from hw.model import FLANGE, LINKS, ArmShape, Capsule, ChassisBox, Placement, Prop
from states.arm.kinematics.kernels import Array, CapsuleSet, Integers

UPPER_ARM = LINKS.index("upper_arm")


@dataclass(frozen=True)
class Manipulator:
    """A UR-like arm at rover_from_base `mount`, with its tool, on a rover with this `body`.

    `placements` is the calibrated chain, each joint's frame in the link before it; None: the
    nominal one of `shape`. What is computed with are arrays, made when first needed and read-only.
    """

    shape: ArmShape
    mount: Placement
    body: tuple[ChassisBox, ...]
    tool: Prop
    placements: tuple[Placement, ...] | None = None

    def with_tool(self, tool: Prop) -> Manipulator:
        """The same arm with another end effector."""
        return replace(self, tool=tool)

    def calibrated(self, placements: tuple[Placement, ...] | None) -> Manipulator:
        """The same arm with the calibrated chain of one robot, or with the nominal one (None)."""
        return replace(self, placements=placements)

    @cached_property
    def nominal(self) -> Manipulator:
        """The same arm by the maker's drawing: ten times faster to invert than a calibrated one."""
        return self if self.placements is None else self.calibrated(None)

    @property
    def name(self) -> str:
        """The arm's name."""
        return self.shape.name

    @cached_property
    def base(self) -> Array:
        """rover_from_base, (4, 4)."""
        return _fixed(matrix(self.mount))

    @cached_property
    def origins(self) -> Array:
        """Each joint's frame in the link before it at zero angles, (6, 4, 4)."""
        placements = self.placements or self.shape.dh.placements()
        return _fixed([matrix(placement) for placement in placements])

    @cached_property
    def tip(self) -> Array:
        """flange_from_tcp, (4, 4)."""
        return _fixed(matrix(self.tool.tcp))

    @cached_property
    def dh(self) -> Array:
        """d1, a2, a3, d4, d5, d6 of the nominal chain, m."""
        dh = self.shape.dh
        return _fixed([dh.d1, dh.a2, dh.a3, dh.d4, dh.d5, dh.d6])

    @cached_property
    def lower(self) -> Array:
        """Lower limits of the joint angles, (6,), rad."""
        return _fixed(self.shape.lower)

    @cached_property
    def upper(self) -> Array:
        """Upper limits of the joint angles, (6,), rad."""
        return _fixed(self.shape.upper)

    @cached_property
    def max_speed(self) -> Array:
        """Limits of the joint speeds, (6,), rad/s."""
        return _fixed(self.shape.max_speed)

    @cached_property
    def limited_points(self) -> tuple[Integers, Array]:
        """Points whose speed is limited: their moving links (k,), and they in its frame (k, 3).

        First the tcp, then both ends of every capsule's axis.
        """
        found = {(FLANGE, self.tool.tcp.xyz): None}
        for capsule in (*self.shape.capsules, *self.tool.capsules):
            if capsule.link > 0:
                found |= {(capsule.link, capsule.start): None, (capsule.link, capsule.end): None}
        links = np.array([link for link, _ in found], dtype=np.int64)
        return links, _fixed([point for _, point in found])

    @cached_property
    def capsules(self) -> tuple[Capsule, ...]:
        """The capsules of arm and tool, by link."""
        own = (*self.shape.capsules, *self.tool.capsules)
        return tuple(sorted(own, key=lambda capsule: capsule.link))

    @cached_property
    def solid(self) -> CapsuleSet:
        """`capsules` as arrays; pairs on one link, on neighbours or `apart` are not checked."""
        capsules = self.capsules
        return CapsuleSet(
            base=self.base,
            origins=self.origins,
            links=np.array([c.link for c in capsules], dtype=np.int64),
            ends=np.array([[c.start, c.end] for c in capsules], dtype=np.float64),
            radii=np.array([c.radius for c in capsules], dtype=np.float64),
            pairs=_pairs(self),
            reach=_reach(self),
            boxes=np.array([[b.low, b.high] for b in self.body], np.float64).reshape(-1, 2, 3),
            first=sum(c.link < UPPER_ARM for c in capsules),
        )

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """To what each of `capsules` belongs: the name of a link or that of the tool."""
        held = self.tool.capsules
        return tuple(self.tool.name if c in held else LINKS[c.link] for c in self.capsules)


def matrix(placement: Placement) -> Array:
    """A placement as a 4x4 matrix: R = Rz(yaw) Ry(pitch) Rx(roll), as in URDF."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(placement.rpy), np.cos(placement.rpy)
    pose = np.eye(4)
    pose[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    pose[:3, 3] = placement.xyz
    return pose


def _fixed(values: ArrayLike) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _pairs(arm: Manipulator) -> Integers:
    capsules = arm.capsules
    found = [
        (i, j)
        for j, second in enumerate(capsules)
        for i, first in enumerate(capsules[:j])
        if second.link - first.link > 1 and not _apart(arm, first, second)
    ]
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _apart(arm: Manipulator, first: Capsule, second: Capsule) -> bool:
    names = {first.part, LINKS[first.link]}, {second.part, LINKS[second.link]}
    if second in arm.tool.capsules:  # `apart` was proven for bare links; a tool may be larger
        return False
    return any(a in names[0] and b in names[1] for a, b in arm.shape.apart)


def _reach(arm: Manipulator) -> Array:
    """Upper bound (m, 6) on the distance of capsules from each joint's axis: link lengths added."""
    capsules, steps = arm.capsules, np.linalg.norm(arm.origins[:, :3, 3], axis=1)
    reach = np.zeros((len(capsules), 6))
    for i, capsule in enumerate(capsules):
        tip = max(math.dist((0.0, 0.0, 0.0), end) for end in (capsule.start, capsule.end))
        for joint in range(capsule.link):
            reach[i, joint] = tip + steps[joint + 1 : capsule.link].sum()
        if capsule.link:  # its own joint: only the distance from the axis counts
            reach[i, capsule.link - 1] = max(
                math.hypot(*end[:2]) for end in (capsule.start, capsule.end)
            )
    return reach
