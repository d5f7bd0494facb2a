"""The arm on its rover: what its files say, and the same as arrays to compute with.

Frames (metres, radians, right-handed):

* `rover`: `base_link` of the rover projected to the floor, x ahead, z up.
* `base`: the start of the arm's chain; `mount` is rover_from_base. Of a UR arm it is the `base` of
  the UR controller, turned by pi about z from the ROS `base_link` of the arm.
* link 1 ... link j: each turns with its joint about its own z; of a UR arm link 6 is ROS `tool0`.
* `tcp`: the prop's own frame, equal to the DEEP when the prop is presented: x points from the
  person into the touched surface (against the flange's z), z is up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hw.model import ArmShape, Capsule, ChassisBox, Placement, Prop, matrix
from states.arm.kinematics.kernels import Array, CapsuleSet, Integers, place_tcp
from states.arm.kinematics.sampled import drawn, never_and_always

MOVED = 2
"""The first link that is checked against rover, floor and room: shoulder and base stand there."""
SEEDS = 4096
"""Joint sets from which the nearest are taken as seeds of numeric inverse kinematics."""

_SAME = Placement()


@dataclass(frozen=True)
class Manipulator:
    """An arm at rover_from_base `mount`, with its tool, on a rover with this `body`.

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
    def count(self) -> int:
        """How many joints it has."""
        return len(self.shape.joints)

    @property
    def is_numeric(self) -> bool:
        """True if there is no closed form of its inverse kinematics: it is no UR arm."""
        return self.shape.dh is None

    @cached_property
    def base(self) -> Array:
        """rover_from_base, (4, 4)."""
        return _fixed(matrix(self.mount))

    @cached_property
    def origins(self) -> Array:
        """Each joint's frame in the link before it at zero angles, (j, 4, 4)."""
        placements = self.placements or self.shape.placements
        return _fixed([matrix(placement) for placement in placements])

    @cached_property
    def tip(self) -> Array:
        """The tcp in the frame of the last link, (4, 4)."""
        if self.shape.flange == _SAME:
            return _fixed(matrix(self.tool.tcp))
        return _fixed(matrix(self.shape.flange) @ matrix(self.tool.tcp))

    @cached_property
    def dh(self) -> Array:
        """d1, a2, a3, d4, d5, d6 of the nominal chain, m."""
        dh = self.shape.ur
        return _fixed([dh.d1, dh.a2, dh.a3, dh.d4, dh.d5, dh.d6])

    @cached_property
    def lower(self) -> Array:
        """Lower limits of the joint angles, (j,), rad."""
        return _fixed(self.shape.lower)

    @cached_property
    def upper(self) -> Array:
        """Upper limits of the joint angles, (j,), rad."""
        return _fixed(self.shape.upper)

    @cached_property
    def max_speed(self) -> Array:
        """Limits of the joint speeds, (j,), rad/s."""
        return _fixed(self.shape.max_speed)

    @cached_property
    def seeds(self) -> tuple[Array, Array]:
        """Joint sets (m, j) spread over the limits, and rover_from_tcp of each, (m, 4, 4)."""
        joints = drawn(self.lower, self.upper, SEEDS)
        poses = np.zeros((SEEDS, 4, 4))
        place_tcp(self.base, self.origins, self.tip, joints, poses)
        return _fixed(joints), _fixed(poses)

    @cached_property
    def limited_points(self) -> tuple[Integers, Array]:
        """Points whose speed is limited: their moving links (k,), and they in its frame (k, 3).

        First the tcp, then both ends of every capsule's axis.
        """
        x, y, z = self.tip[:3, 3].tolist()
        found = {(self.count, (x, y, z)): None}
        for capsule in (*self.shape.capsules, *self.held):
            if capsule.link > 0:
                found |= {(capsule.link, capsule.start): None, (capsule.link, capsule.end): None}
        links = np.array([link for link, _ in found], dtype=np.int64)
        return links, _fixed([point for _, point in found])

    @cached_property
    def held(self) -> tuple[Capsule, ...]:
        """The capsules of the tool, in the frame of the last link."""
        if self.shape.flange == _SAME and all(c.link == self.count for c in self.tool.capsules):
            return self.tool.capsules
        pose = matrix(self.shape.flange)
        return tuple(_moved(capsule, self.count, pose) for capsule in self.tool.capsules)

    @cached_property
    def capsules(self) -> tuple[Capsule, ...]:
        """The capsules of arm and tool, by link."""
        own = (*self.shape.capsules, *self.held)
        return tuple(sorted(own, key=lambda capsule: capsule.link))

    @cached_property
    def solid(self) -> CapsuleSet:
        """`capsules` as arrays; pairs on one link, on neighbours or `apart` are not checked.

        Nor are, of an arm by URDF, those that `never_and_always` names.
        """
        found = self._all_pairs
        if not self.is_numeric or not len(found.pairs):
            return found
        never, always = self._sampled
        return found._replace(pairs=found.pairs[~(never | always)])

    @cached_property
    def grown(self) -> tuple[tuple[str, str], ...]:
        """Pairs of links whose capsules overlap at any angles: contact of these is not seen."""
        if not self.is_numeric or not len(self._all_pairs.pairs):
            return ()
        parts, pairs = self.parts, self._all_pairs.pairs[self._sampled[1]]
        return tuple(dict.fromkeys((parts[i], parts[j]) for i, j in pairs))

    @cached_property
    def _sampled(self) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        found = self._all_pairs
        never, always = never_and_always(found, self.lower, self.upper)
        bare = np.array([c not in self.held for c in self.capsules])[found.pairs].all(axis=1)
        return never & bare, always & bare

    @cached_property
    def _all_pairs(self) -> CapsuleSet:
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
            first=sum(c.link < MOVED for c in capsules),
        )

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """To what each of `capsules` belongs: the name of a link or that of the tool."""
        held, links = self.held, self.shape.links
        return tuple(self.tool.name if c in held else links[c.link] for c in self.capsules)


def _moved(capsule: Capsule, link: int, pose: Array) -> Capsule:
    ends = np.array([[*capsule.start, 1.0], [*capsule.end, 1.0]]) @ pose.T
    (x, y, z), (u, v, w) = ends[:, :3].tolist()
    return replace(capsule, link=link, start=(x, y, z), end=(u, v, w))


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
    links = arm.shape.links
    names = {first.part, links[first.link]}, {second.part, links[second.link]}
    if second in arm.held:  # `apart` was proven for bare links; a tool may be larger
        return False
    return any(a in names[0] and b in names[1] for a, b in arm.shape.apart)


def _reach(arm: Manipulator) -> Array:
    """Upper bound (m, j) on the distance of capsules from each joint's axis: link lengths added."""
    capsules, steps = arm.capsules, np.linalg.norm(arm.origins[:, :3, 3], axis=1)
    reach = np.zeros((len(capsules), arm.count))
    for i, capsule in enumerate(capsules):
        tip = max(math.dist((0.0, 0.0, 0.0), end) for end in (capsule.start, capsule.end))
        for joint in range(capsule.link):
            reach[i, joint] = tip + steps[joint + 1 : capsule.link].sum()
        if capsule.link:  # its own joint: only the distance from the axis counts
            reach[i, capsule.link - 1] = max(
                math.hypot(*end[:2]) for end in (capsule.start, capsule.end)
            )
    return reach
