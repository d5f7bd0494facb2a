"""What an arm is to the algorithms: chain, limits, capsules, mount and tool, as plain numbers.

Frames (metres, radians, right-handed):

* `rover`: the rover's `base_link` projected to the floor, x ahead, z up.
* `base`: where the chain of the arm starts. It is the `base` of the UR controller, turned by pi
  about z against the ROS `base_link` of the arm; `mount` is rover_from_base.
* link 1 ... link 6: turn with joint 1 ... joint 6 about their own z; link 6 is ROS `tool0`.
* `tcp`: the prop's own frame. It coincides with the DEEP when the prop is presented: x points from
  the person into the touched surface (against the flange's z), z is up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

from hw.document import Item, read_document
from hw.prop import (
    Capsule,
    Placement,
    Point,
    Prop,
    Six,
    as_six,
    capsule_from,
    load_prop,
    placement_from,
    point_from,
)
from hw.robot import RobotModel

FOLDER = Path(__file__).parent
LINKS = ("base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")


@dataclass(frozen=True, slots=True)
class Dh:
    """The six lengths of a UR arm, m (Denavit-Hartenberg; a2 and a3 are negative)."""

    d1: float
    a2: float
    a3: float
    d4: float
    d5: float
    d6: float

    def placements(self) -> tuple[Placement, ...]:
        """Each joint's frame in the link before it, at zero angles."""
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
class Box:
    """A part of the rover the arm must not touch: corners in the rover frame, m."""

    name: str
    low: Point
    high: Point


@dataclass(frozen=True, slots=True)
class Manipulator:
    """A UR-like arm on its rover with its tool; speeds in rad/s, shoulder first.

    `placements` is the calibrated chain, None for the nominal one. `apart` names pairs of links or
    parts that cannot meet whatever the joints do; neighbours are left out anyway.
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
    body: tuple[Box, ...]
    tool: Prop
    placements: tuple[Placement, ...] | None = None

    def with_tool(self, tool: Prop) -> Manipulator:
        """The same arm with another end effector."""
        return replace(self, tool=tool)

    def calibrated(self, placements: tuple[Placement, ...] | None) -> Manipulator:
        """The same arm with the measured chain of one robot, or with the nominal one (None)."""
        return replace(self, placements=placements)

    def mounted(self, height: float) -> Manipulator:
        """The same arm with its base at another height, m; what it stands on grows with it."""
        x, y, z = self.mount.xyz
        top = max(box.high[2] for box in self.body)
        body = tuple(
            replace(box, high=(*box.high[:2], top + height - z)) if box.high[2] == top else box
            for box in self.body
        )
        return replace(self, mount=Placement((x, y, height), self.mount.rpy), body=body)


def manipulator_of(robot: RobotModel) -> Manipulator:
    """The arm of a robot: its mount, its calibration, and what it holds; or that of its URDF.

    Raises:
        FileError, ValueError: the URDF is wrong, or its arm is none that this is made for.
    """
    arm = load_manipulator().with_tool(robot.prop)
    height, described = robot.arm.mount_height, robot.arm.urdf
    if height != arm.mount.xyz[2]:
        arm = arm.mounted(height)
    if described is not None:
        from states.arm.urdf_arm import described_arm

        arm = described_arm(described, arm)
    chain = robot.arm.calibration
    return arm if chain is None else arm.calibrated(chain)


def load_manipulator(path: Path | None = None) -> Manipulator:
    """An arm from its file with the standard prop; without one the UR10 (CB3) on the RB-KAIROS.

    Raises:
        FileError: with file, line, key and what would be right.
    """
    return manipulator_from(read_document(path or FOLDER / "ur10.yaml"), load_prop())


def manipulator_from(item: Item, tool: Prop) -> Manipulator:
    """Builds an arm from a mapping as in `ur10.yaml`, with this end effector.

    Raises:
        FileError: with file, line, key and what would be right.
    """
    part = item.section(
        required=("arm", "dh", "joints", "mount", "capsules", "body"),
        optional=("about", "apart"),
    )
    joints = part["joints"].mapping()
    _require_six(part["joints"], len(joints))
    numbers = [_joint(joint) for joint in joints.values()]
    lower, upper, speed = (as_six(column) for column in zip(*numbers, strict=True))
    dh = part["dh"].section(required=Dh.__slots__)
    capsules = _capsules(part["capsules"])
    return Manipulator(
        name=part["arm"].text(),
        joints=tuple(joints),
        dh=Dh(*(dh[name].number() for name in Dh.__slots__)),
        lower=lower,
        upper=upper,
        max_speed=speed,
        mount=placement_from(part["mount"]),
        capsules=capsules,
        apart=_apart(part["apart"], capsules) if "apart" in part else (),
        body=tuple(_box(box) for box in part["body"].items()),
        tool=tool,
    )


def _joint(item: Item) -> tuple[float, float, float]:
    part = item.section(required=("lower", "upper", "speed"))
    lower, upper, speed = (part[key].number() for key in ("lower", "upper", "speed"))
    if not lower < upper:
        raise part["upper"].fail(f"{upper:g} is not above the lower limit {lower:g}")
    if speed <= 0.0:
        raise part["speed"].fail(f"{speed:g} must be above 0")
    return lower, upper, speed


def _capsules(item: Item) -> tuple[Capsule, ...]:
    return tuple(_capsule(capsule) for capsule in item.items())


def _capsule(item: Item) -> Capsule:
    part = item.section(required=("link", "start", "end", "radius"), optional=("part",))
    link = part["link"].text(LINKS)
    name = part["part"].text() if "part" in part else link
    return capsule_from(part, LINKS.index(link), name)


def _box(item: Item) -> Box:
    part = item.section(required=("name", "low", "high"))
    low, high = point_from(part["low"]), point_from(part["high"])
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise part["high"].fail(f"{high} must be above {low} in all three")
    return Box(part["name"].text(), low, high)


def _apart(item: Item, capsules: tuple[Capsule, ...]) -> tuple[tuple[str, str], ...]:
    known = tuple(dict.fromkeys((*LINKS, *(capsule.part for capsule in capsules))))
    pairs = []
    for pair in item.items():
        names = tuple(name.text(known) for name in pair.items())
        if len(names) != 2:
            raise pair.fail(f"needs two links or parts, has {len(names)}")
        pairs.append((names[0], names[1]))
    return tuple(pairs)


def _require_six(item: Item, count: int) -> None:
    if count != 6:
        raise item.fail(f"needs 6 joints, has {count}")
