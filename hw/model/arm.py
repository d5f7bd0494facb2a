"""Jointed arms, one file each: kinematics, limits, masses and shape as their maker states them.

arm: ur5e
about: UR5e (e-series)
source: where the numbers come from, with version
payload: 5 kg
dh: {d1: 0.1625, a2: -0.425, a3: -0.3922, d4: 0.1333, d5: 0.0997, d6: 0.0996}
joints:    # six, shoulder first
  shoulder_pan_joint: {lower: -360 deg, upper: 360 deg, speed: 180 deg/s, torque: 150 Nm}
masses:    # of the moving links: centre of mass and inertia about it, in the link's frame
  shoulder: {mass: 3.761, center: [0, -0.00193, -0.02561], inertia: [0.01, 0.01, 0.007, 0, 0, 0]}
capsules:  # around the maker's meshes, in the frames of the links
  - {link: base, start: [0, 0, 0.01], end: [0, 0, 0.09], radius: 0.08}
apart:     # links, or `part`s of them, that cannot touch at any joint angles
  - [base, upper_arm]
parked:    # optional: the folded arm by prop, rad, where the file of the prop does not say it
  prop: [-2.39, -1.29, -1.8, 1.71, 0.14, -2.71]

Link frames are those of `states.arm.kinematics.model`. What stands under the arm is in the robot
file. Any other arm of six or seven joints is described by its URDF:

arm: panda
payload: 3 kg
urdf: {file: panda.urdf, base: panda_link0, flange: panda_link8}
joints:    # optional: joints for which other values count than those of the URDF
  panda_joint4: {lower: -176 deg, upper: -4 deg, speed: 120 deg/s, torque: 87 Nm}

Its capsules are fitted to the collision shapes (`hw.model.urdf.capsules`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, get_args

from engine.files import AngularSpeed, Length, Mass, Torque, did_you_mean, mistake
from engine.files.declared import (
    Fault,
    Item,
    Name,
    Range,
    Written,
    above_0,
    find_file,
    known_files,
    load_yaml,
    record,
)
from hw.geometry import AnyAngle
from hw.model.description import ArmUrdf
from hw.model.prop import JOINTS, Capsule, ParkedJoints, Placement, Point3, Radius
from hw.samples import Joints

if TYPE_CHECKING:
    from hw.model.urdf import Joint

FOLDER = Path(__file__).parent.parent / "arms"
LinkName = Literal["base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"]
LINKS: tuple[LinkName, ...] = get_args(LinkName)
SPAN_SLACK = 0.03
"""How far capsules may end before or beyond the joints that their link connects, plus radius, m."""
ALIKE = 0.005
"""Lengths that differ by less are of one arm, m; calibrations differ by up to 3 mm."""
ALIKE_TURN = 0.05
"""Joints of calibrated chains are turned by less from the nominal ones, rad; by up to 8 mrad."""

_SAME = Placement()

JointSpeed = Annotated[AngularSpeed, Range(0.01, 20.0)]
_Inertia = Annotated[float, Range(-1000.0, 1000.0)]
_DhLength = Annotated[Length, Range(-5.0, 5.0)]


@dataclass(frozen=True, slots=True)
class Dh:
    """The six lengths of a UR arm, m (Denavit-Hartenberg; a2 and a3 are negative)."""

    d1: _DhLength
    """From the base up to the shoulder lift."""
    a2: _DhLength
    """Of the upper arm; negative."""
    a3: _DhLength
    """Of the forearm; negative."""
    d4: _DhLength
    """Of the first wrist link."""
    d5: _DhLength
    """Of the second wrist link."""
    d6: _DhLength
    """From the last wrist joint to the flange."""

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

    def difference(self, other: Dh) -> float:
        """The largest difference of the lengths that a description shows: a2, a3, d4, d5; m."""
        pairs = ((self.a2, other.a2), (self.a3, other.a3), (self.d4, other.d4), (self.d5, other.d5))
        return max(abs(a - b) for a, b in pairs)

    def misfit(self, chain: Sequence[Placement]) -> str | None:
        """Why a calibrated chain is not one of an arm with these lengths; None if it is."""
        for n, (own, other) in enumerate(zip(self.placements(), chain, strict=True), start=1):
            nominal, measured = own.pose(), other.pose()
            off, turned = nominal.distance_to(measured), nominal.angle_to(measured)
            if off > ALIKE:
                return f"its joint {n} is {off * 1e3:.0f} mm off"
            if turned > ALIKE_TURN:
                return f"its joint {n} is turned by {turned:.2f} rad"
        return None


@dataclass(frozen=True, slots=True)
class LinkMass:
    """Mass of a link, kg, its centre in the link's frame, m, and its inertia about it, kg m2.

    The inertia is ixx, iyy, izz, ixy, ixz, iyz along the axes of the link's frame.
    """

    mass: Annotated[Mass, Range(0.0, 500.0)]
    """Of the link."""
    center: Point3
    """Its centre of mass, in the link's frame."""
    inertia: tuple[_Inertia, _Inertia, _Inertia, _Inertia, _Inertia, _Inertia]
    """About the centre: ixx, iyy, izz, ixy, ixz, iyz; kg m2."""


@dataclass(frozen=True, slots=True)
class JointRange:
    """Range, speed and torque of a joint; rad, rad/s and Nm."""

    lower: AnyAngle
    """The lowest angle."""
    upper: AnyAngle
    """The highest angle."""
    speed: JointSpeed
    """The greatest speed."""
    torque: Annotated[Torque, above_0(10_000.0)]
    """The greatest torque."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if not self.lower < self.upper:
            yield "upper", f"{self.upper:g} is not above the lower limit {self.lower:g}"


@dataclass(frozen=True, slots=True)
class _Capsule:
    link: LinkName
    """The link whose frame it is in."""
    start: Point3
    """One end of its axis."""
    end: Point3
    """The other end."""
    radius: Radius
    """All points as near to the axis belong to it."""
    part: str = ""
    """Its name, if not that of the link."""


def _capsule(item: Item) -> Capsule:
    read = record(item, _Capsule)
    part = read.part or read.link
    return Capsule(LINKS.index(read.link), part, read.start, read.end, read.radius)


@dataclass(frozen=True)
class ArmShape:
    """A jointed arm."""

    arm: Name
    """Its name."""
    payload: Annotated[Mass, Range(0.0, 500.0)]
    """The greatest mass that it holds."""
    dh: Dh | None
    """Its Denavit-Hartenberg lengths; an arm by URDF has none."""
    joints: Mapping[str, JointRange]
    """The six joints by name, shoulder first."""
    capsules: tuple[Annotated[Capsule, _capsule, Written(_Capsule)], ...]
    """Around its links, in their frames."""
    masses: Mapping[str, LinkMass]
    """The moving links, shoulder first; empty if they are not known."""
    about: str = ""
    """Which arm it is."""
    source: str = ""
    """Where the numbers come from, with version."""
    apart: tuple[tuple[str, str], ...] = ()
    """Pairs of links, or parts of them, that cannot touch at any joint angles; never neighbours."""
    parked: Mapping[str, ParkedJoints] = field(default_factory=dict)
    """The folded arm by prop, all joints, for props that do not say them."""

    @property
    def name(self) -> str:
        """The arm's name."""
        return self.arm

    @cached_property
    def links(self) -> tuple[str, ...]:
        """The names of base and moving links, shoulder first."""
        return LINKS

    @property
    def ur(self) -> Dh:
        """The lengths of a UR arm.

        Raises:
            ValueError: it is another arm.
        """
        if self.dh is None:
            raise ValueError(f"arm {self.name} is no UR arm")
        return self.dh

    @property
    def placements(self) -> tuple[Placement, ...]:
        """Frame of each joint in the link before it, at zero angles."""
        return self.ur.placements()

    @property
    def flange(self) -> Placement:
        """The flange in the frame of the last link."""
        return _SAME

    @cached_property
    def lower(self) -> Joints:
        """Lower limits of the joint angles, rad."""
        return tuple([joint.lower for joint in self.joints.values()])

    @cached_property
    def upper(self) -> Joints:
        """Upper limits of the joint angles, rad."""
        return tuple([joint.upper for joint in self.joints.values()])

    @cached_property
    def max_speed(self) -> Joints:
        """Limits of the joint speeds, rad/s."""
        return tuple([joint.speed for joint in self.joints.values()])

    @cached_property
    def max_torque(self) -> Joints:
        """Limits of the joint torques, Nm."""
        return tuple([joint.torque for joint in self.joints.values()])

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if len(self.joints) != JOINTS:
            yield "joints", f"needs {JOINTS} joints, has {len(self.joints)}"
        if tuple(self.masses) not in ((), LINKS[1:]):
            yield "masses", f"needs the moving links in their order: {', '.join(LINKS[1:])}"
        yield from self._not_apart()
        if self.dh is None:
            yield "dh", "null; an arm by its lengths needs them, any other the key 'urdf'"
        else:
            yield from self._short(self.dh)

    def _not_apart(self) -> Iterator[Fault]:
        """Names in `apart` of parts that there are not."""
        known = dict.fromkeys((*self.links, *(capsule.part for capsule in self.capsules)))
        for n, pair in enumerate(self.apart):
            for m, part in enumerate(pair):
                if part not in known:
                    yield f"apart.{n}.{m}", f"no link or part {part!r}; {did_you_mean(part, known)}"

    def _short(self, dh: Dh) -> Iterator[Fault]:
        """Upper arm and forearm whose capsules do not span the distance between their joints."""
        for link, key, length in (("upper_arm", "a2", dh.a2), ("forearm", "a3", dh.a3)):
            own = [c for c in self.capsules if LINKS[c.link] == link]
            if not own:
                yield "capsules", f"{link} has none"
                continue
            reach = max(max(-c.start[0], -c.end[0]) + c.radius for c in own)
            thick = max(c.radius for c in own)
            if not abs(length) <= reach <= abs(length) + thick + SPAN_SLACK:
                yield (
                    f"dh.{key}",
                    f"{length:g}, but the capsules of {link} reach to {-reach:.3f}: these are not "
                    "lengths and shape of one arm",
                )


@dataclass(frozen=True)
class DescribedArm(ArmShape):
    """An arm of six or seven joints by its URDF: any that turns, not only a UR arm.

    Its inverse kinematics are numeric. See the README of `states/arm`.
    """

    own_links: tuple[str, ...] = ()
    own_placements: tuple[Placement, ...] = ()
    own_flange: Placement = _SAME

    @cached_property
    def links(self) -> tuple[str, ...]:
        """The names of base and moving links, shoulder first."""
        return self.own_links

    @property
    def placements(self) -> tuple[Placement, ...]:
        """Frame of each joint in the link before it, at zero angles."""
        return self.own_placements

    @property
    def flange(self) -> Placement:
        """The flange in the frame of the last link."""
        return self.own_flange

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        for name, joint in self.joints.items():
            yield from ((f"joints.{name}.{key}", told) for key, told in joint.faults())
        for prop, joints in self.parked.items():
            if len(joints) != len(self.joints):
                yield f"parked.{prop}", f"{len(joints)} joint angles; it has {len(self.joints)}"
        yield from self._not_apart()


@dataclass(frozen=True, slots=True)
class DescribedArmFile:
    """A jointed arm by its URDF."""

    arm: Name
    """Its name."""
    payload: Annotated[Mass, Range(0.0, 500.0)]
    """The greatest mass that it holds."""
    urdf: ArmUrdf
    """The URDF, and where the arm begins and ends in it."""
    joints: Mapping[str, JointRange] = field(default_factory=dict)
    """Joints for which other values count than those of the URDF, by name."""
    apart: tuple[tuple[str, str], ...] = ()
    """Pairs of links that cannot touch at any joint angles, besides those found by sampling."""
    parked: Mapping[str, ParkedJoints] = field(default_factory=dict)
    """The folded arm by prop, all joints, for props that do not say them."""
    about: str = ""
    """Which arm it is."""
    source: str = ""
    """Where the numbers come from, with version."""


def arm_names() -> tuple[str, ...]:
    """Names of the shipped arms and of the project's own."""
    return tuple(known_files(FOLDER, "arm"))


def load_arm(name_or_path: str | Path = "ur10") -> ArmShape:
    """An arm by name or by file.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    return load_yaml(find_file(str(name_or_path), FOLDER, "arm"), arm_from)


def nearest_arm(dh: Dh) -> ArmShape:
    """The known arm whose lengths are nearest to these."""
    known = [arm for arm in map(load_arm, arm_names()) if arm.dh is not None]
    return min(known, key=lambda arm: dh.difference(arm.ur))


def arms_of(chain: Sequence[Placement]) -> list[str]:
    """The names of the known arms of which a calibrated chain may be."""
    lengths = {name: load_arm(name).dh for name in arm_names()}
    return [name for name, dh in lengths.items() if dh is not None and not dh.misfit(chain)]


def arm_from(item: Item) -> ArmShape:
    """An arm from a mapping as in its file.

    Raises:
        FileError: every mistake in it, with file, line, column and what would be right.
    """
    keys = item.mapping()
    if "urdf" not in keys or "dh" in keys:
        return record(item, ArmShape)
    return _described(item, record(item, DescribedArmFile))


def _described(item: Item, read: DescribedArmFile) -> DescribedArm:
    from hw.model.urdf import read_urdf, serial_chain

    told, urdf = read.urdf, read_urdf(read.urdf.file)
    try:
        chain = serial_chain(urdf, told.base, told.flange, told.file.parent)
    except ValueError as refused:
        raise mistake(told.file, str(refused)) from None
    names = tuple(joint.name for joint in chain.joints)
    item.require(_misnamed(read.joints, names))
    ranges = {joint.name: read.joints.get(joint.name) or _range(joint) for joint in chain.joints}
    lacking = {name: what for name, what in ranges.items() if isinstance(what, str)}
    item.require(("urdf", what) for what in lacking.values())
    made = DescribedArm(
        arm=read.arm,
        payload=read.payload,
        dh=None,
        joints={name: what for name, what in ranges.items() if not isinstance(what, str)},
        capsules=chain.capsules,
        masses={
            link: LinkMass(found.mass, found.center, found.inertia)
            for link, found in zip(chain.links[1:], chain.masses, strict=False)
        },
        about=read.about,
        source=read.source,
        apart=read.apart,
        parked=read.parked,
        own_links=chain.links,
        own_placements=chain.placements,
        own_flange=chain.flange,
    )
    item.require(made.faults())
    return made


def _misnamed(joints: Iterable[str], known: Sequence[str]) -> Iterator[Fault]:
    for name in joints:
        if name not in known:
            yield "joints", f"the arm has no joint {name!r}; {did_you_mean(name, known)}"


def _range(joint: Joint) -> JointRange | str:
    """The range of a joint in a URDF, or what is missing in it."""
    told = {"velocity": joint.speed, "effort": joint.effort}
    missing = [key for key, value in told.items() if not 0.0 < value < math.inf]
    if joint.kind == "continuous":
        missing.append("lower and upper, for it turns on without end (continuous)")
    elif not joint.lower < joint.upper:
        missing.append("lower below upper")
    if not missing:
        return JointRange(joint.lower, joint.upper, joint.speed, joint.effort)
    return (
        f"joint '{joint.name}' has no {', no '.join(missing)}; give all in this file: "
        f"`joints: {{{joint.name}: {{lower: -180 deg, upper: 180 deg, speed: 90 deg/s, "
        "torque: 50 Nm}}`"
    )
