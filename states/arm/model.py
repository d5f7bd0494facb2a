"""The arm as data: chain, limits, capsules, mount and tool.

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
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, get_args

from engine.files.finding import did_you_mean
from engine.files.item import Fault, Item, load_yaml
from engine.files.record import Name, record
from engine.files.units import Length
from engine.files.values import Count, Range
from hw.places import AnyAngle
from hw.prop import JOINTS, Capsule, Placement, Point3, Prop, Radius, Six, load_prop
from hw.robot import JointSpeed

FOLDER = Path(__file__).parent
LinkName = Literal["base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]
LINKS: tuple[LinkName, ...] = get_args(LinkName)
_DhLength = Annotated[Length, Range(-5.0, 5.0)]


@dataclass(frozen=True, slots=True)
class Dh:
    """The six lengths of a UR arm, m (Denavit-Hartenberg; a2 and a3 are negative)."""

    d1: _DhLength
    a2: _DhLength
    a3: _DhLength
    d4: _DhLength
    d5: _DhLength
    d6: _DhLength

    def placements(self) -> tuple[Placement, ...]:
        """Frame of each joint in the link before it, at zero angles."""
        quarter = 0.5 * math.pi
        return (
            Placement((0.0, 0.0, self.d1)),
            Placement(rpy=(quarter, 0.0, 0.0)),
            Placement((self.a2, 0.0, 0.0)),
            Placement((self.a3, 0.0, self.d4)),
            Placement((0.0, -self.d5, 0.0), (quarter, 0.0, 0.0)),
            Placement((0.0, self.d6, 0.0), (-quarter, 0.0, 0.0)),
        )


@dataclass(frozen=True, slots=True)
class ChassisBox:
    """A part of the rover that the arm must not touch: corners in the rover frame, m."""

    name: str
    low: Point3
    high: Point3

    def faults(self) -> Iterator[Fault]:
        """Values that contradict each other, by key."""
        if not all(a < b for a, b in zip(self.low, self.high, strict=True)):
            yield "high", f"{self.high} must be above {self.low} in all three"


@dataclass(frozen=True, slots=True)
class Manipulator:
    """A UR-like arm on its rover with its tool; speeds in rad/s, shoulder first.

    `placements` is the calibrated chain, None for the nominal one. `apart` names pairs of links or
    parts that cannot touch at any joint angles; neighbours are never checked.
    """

    name: str
    joints: tuple[str, ...]
    dh: Dh
    lower: Six
    upper: Six
    max_speed: Six
    mount: Placement
    capsules: tuple[Capsule, ...]
    apart: tuple[tuple[str, str], ...]
    body: tuple[ChassisBox, ...]
    tool: Prop
    placements: tuple[Placement, ...] | None = None

    def with_tool(self, tool: Prop) -> Manipulator:
        """The same arm with another end effector."""
        return replace(self, tool=tool)

    def calibrated(self, placements: tuple[Placement, ...] | None) -> Manipulator:
        """The same arm with the calibrated chain of one robot, or with the nominal one (None)."""
        return replace(self, placements=placements)

    def mounted(self, height: float) -> Manipulator:
        """The same arm with its base at another height, m; the box under it grows with it."""
        x, y, z = self.mount.xyz
        top = max(box.high[2] for box in self.body)
        body = tuple(
            replace(box, high=(*box.high[:2], top + height - z)) if box.high[2] == top else box
            for box in self.body
        )
        return replace(self, mount=Placement((x, y, height), self.mount.rpy), body=body)


def load_manipulator(path: Path | None = None) -> Manipulator:
    """An arm from its file, with the standard prop; by default the UR10 (CB3) on an RB-KAIROS.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    tool = load_prop()
    return load_yaml(path or FOLDER / "ur10.yaml", lambda item: manipulator_from(item, tool))


@dataclass(frozen=True, slots=True)
class _Joint:
    lower: AnyAngle
    upper: AnyAngle
    speed: JointSpeed

    def faults(self) -> Iterator[Fault]:
        if not self.lower < self.upper:
            yield "upper", f"{self.upper:g} is not above the lower limit {self.lower:g}"


@dataclass(frozen=True, slots=True)
class _Capsule:
    link: LinkName
    start: Point3
    end: Point3
    radius: Radius
    part: str = ""


@dataclass(frozen=True, slots=True)
class _Arm:
    arm: Name
    dh: Dh
    joints: Mapping[str, _Joint]
    mount: Placement
    capsules: tuple[_Capsule, ...]
    body: Annotated[tuple[ChassisBox, ...], Count(1)]
    about: str = ""
    apart: tuple[tuple[str, str], ...] = ()

    def faults(self) -> Iterator[Fault]:
        if len(self.joints) != JOINTS:
            yield "joints", f"needs {JOINTS} joints, has {len(self.joints)}"
        known = (*LINKS, *(capsule.part for capsule in self.capsules if capsule.part))
        for n, pair in enumerate(self.apart):
            for m, part in enumerate(pair):
                if part not in known:
                    yield f"apart.{n}.{m}", f"no link or part {part!r}; {did_you_mean(part, known)}"


def manipulator_from(item: Item, tool: Prop) -> Manipulator:
    """Builds an arm from a mapping as in `ur10.yaml`, with this end effector.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    read = record(item, _Arm)
    joints = read.joints.values()
    return Manipulator(
        name=read.arm,
        joints=tuple(read.joints),
        dh=read.dh,
        lower=six(joint.lower for joint in joints),
        upper=six(joint.upper for joint in joints),
        max_speed=six(joint.speed for joint in joints),
        mount=read.mount,
        capsules=tuple(
            Capsule(LINKS.index(c.link), c.part or c.link, c.start, c.end, c.radius)
            for c in read.capsules
        ),
        apart=read.apart,
        body=read.body,
        tool=tool,
    )


def six(values: Iterable[float]) -> Six:
    """Six values, one per joint, shoulder first."""
    a, b, c, d, e, f = values
    return a, b, c, d, e, f
