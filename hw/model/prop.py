"""Exchangeable end effectors, one file each (R150): what the arm holds.

prop: panel
about: a board to be touched
mass: 1.5                  # kg, with gripper and sensor; counts against the robot's payload
center_of_mass: [0, 0, 0.07]   # flange frame, m; half way to the tcp if it is not given
tcp: {xyz: [0, 0, 0.15], rpy: [0, 1.5707963267948966, 0]}   # flange_from_tcp
capsules:                  # around all of it, in the flange frame
  - {start: [0, 0, 0.03], end: [0, 0, 0.1], radius: 0.05}
parked:                    # the folded arm, six joints in rad, by arm; or six for any arm
  ur10: […]
parked_paper: {ur10: […]}  # a second folded pose, which reproduces the paper's times; optional
gripper: {opening: 0.085, speed: 0.15, held: 0.05}          # optional; m, m/s, m
wrench: {force: 100, torque: 10}                            # optional; full scale, N and Nm
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from engine.files import Force, Length, Mass, Speed, Torque
from engine.files.declared import (
    Fault,
    Item,
    Name,
    Range,
    above_0,
    find_file,
    known_files,
    load_yaml,
    reader_of,
    record,
)
from hw.geometry import Pose3
from hw.places import AnyAngle

FOLDER = Path(__file__).parent.parent / "props"
JOINTS = 6
ANY = ""
"""Stands for any arm."""
FLANGE = 6
"""The link that carries the prop: the last of six."""

Coordinate = Annotated[Length, Range(-10.0, 10.0)]
Point3 = tuple[Coordinate, Coordinate, Coordinate]
Angles = tuple[AnyAngle, AnyAngle, AnyAngle]
Six = tuple[AnyAngle, AnyAngle, AnyAngle, AnyAngle, AnyAngle, AnyAngle]
ToolLength = Annotated[Length, Range(-1.0, 1.0)]
Radius = Annotated[Length, Range(0.001, 1.0)]


@dataclass(frozen=True, slots=True)
class Placement:
    """A frame in its parent: xyz in m, rpy (fixed axes x, y, z, as in URDF) in rad."""

    xyz: Point3 = (0.0, 0.0, 0.0)
    rpy: Angles = (0.0, 0.0, 0.0)

    def pose(self) -> Pose3:
        """The frame as a pose: turned about x, then y, then z of its parent."""
        (x, a), (y, b), (z, c) = ((math.sin(0.5 * r), math.cos(0.5 * r)) for r in self.rpy)
        about_z = Pose3(*self.xyz, qz=z, qw=c)
        return about_z @ Pose3(0.0, 0.0, 0.0, qy=y, qw=b) @ Pose3(0.0, 0.0, 0.0, qx=x, qw=a)


@dataclass(frozen=True, slots=True)
class Capsule:
    """All points within `radius` of the segment from `start` to `end`, in a link's frame, m.

    `part` is its name: that of the link, or of a piece of it.
    """

    link: int
    part: str
    start: Point3
    end: Point3
    radius: float


@dataclass(frozen=True, slots=True)
class GripperModel:
    """Fingers that open to `opening` m at `speed` m/s and hold an object `held` m wide."""

    opening: Annotated[Length, above_0(0.5)]
    speed: Annotated[Speed, above_0(1.0)]
    held: Annotated[Length, above_0(0.5)]

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.held > self.opening:
            yield "held", f"{self.held:g} is wider than the opening, {self.opening:g}"


@dataclass(frozen=True, slots=True)
class WrenchModel:
    """Full scale of a force-torque sensor, N and Nm."""

    force: Annotated[Force, above_0(10_000.0)]
    torque: Annotated[Torque, above_0(1_000.0)]


@dataclass(frozen=True, slots=True)
class Prop:
    """Gripper, sensor and prop as one body (R150); `tcp` is flange_from_tcp.

    `parked` are the joint angles in which the arm with this prop stays inside the bumper frame
    while the rover drives (R46, R87); `parked_paper` are others that reproduce the paper's times.
    Both are those of the arm that it is `on`, first of the first arm in its file. `poses` and
    `paper_poses` hold them by the names of arms, for any arm under "".
    `center_of_mass` is that of the whole body, in the flange frame, m; a real arm's controller
    needs it.
    """

    name: str
    tcp: Placement
    capsules: tuple[Capsule, ...]
    parked: Six
    parked_paper: Six
    poses: Mapping[str, Six]
    paper_poses: Mapping[str, Six]
    mass: float = 0.0
    about: str = ""
    gripper: GripperModel | None = None
    wrench: WrenchModel | None = None
    center_of_mass: Point3 = (0.0, 0.0, 0.0)

    def suits(self, arm: str) -> bool:
        """True if it says how this arm is folded."""
        return arm in self.poses or ANY in self.poses

    def for_any(self) -> Prop:
        """This prop as if it suited any arm, to look for parked poses."""
        return replace(self, poses={ANY: self.parked})

    def on(self, arm: str) -> Prop:
        """This prop on an arm that it suits, with the parked poses of that arm."""
        parked = self.poses.get(arm) or self.poses[ANY]
        paper = self.paper_poses.get(arm) or self.paper_poses.get(ANY) or parked
        return replace(self, parked=parked, parked_paper=paper)

    @property
    def length(self) -> float:
        """Distance of the tcp ahead of the flange, m."""
        return self.tcp.xyz[2]


def prop_names() -> tuple[str, ...]:
    """Names of the shipped end effectors and of the project's own."""
    return tuple(known_files(FOLDER, "prop"))


def load_prop(name_or_path: str | Path = "prop") -> Prop:
    """An end effector by name or by file.

    Raises:
        FileError: every mistake in it, with file, line, column and a suggestion.
    """
    return load_yaml(find_file(str(name_or_path), FOLDER, "prop"), _prop)


@dataclass(frozen=True, slots=True)
class _Capsule:
    start: Point3
    end: Point3
    radius: Radius


def by_arm(item: Item) -> Mapping[str, Six]:
    """Joint angles by the names of arms; a list alone is for any arm."""
    if isinstance(item.value, list):
        return {ANY: reader_of(Six)(item)}
    found: Mapping[str, Six] = reader_of(Mapping[str, Six])(item)
    if not found:
        raise item.error("is empty", "six joint angles for each arm: `ur10: [0, -1, -2, 0, 0, 0]`")
    return found


@dataclass(frozen=True, slots=True)
class _Prop:
    prop: Name
    mass: Annotated[Mass, Range(0.0, 50.0)]
    tcp: Placement
    capsules: tuple[_Capsule, ...]
    parked: Annotated[Mapping[str, Six], by_arm]
    parked_paper: Annotated[Mapping[str, Six], by_arm] | None = None
    about: str = ""
    gripper: GripperModel | None = None
    wrench: WrenchModel | None = None
    center_of_mass: tuple[ToolLength, ToolLength, ToolLength] | None = None


def _prop(item: Item) -> Prop:
    read = record(item, _Prop)
    x, y, z = read.tcp.xyz
    return Prop(
        name=read.prop,
        tcp=read.tcp,
        capsules=tuple(Capsule(FLANGE, read.prop, c.start, c.end, c.radius) for c in read.capsules),
        parked=next(iter(read.parked.values())),
        parked_paper=next(iter((read.parked_paper or read.parked).values())),
        poses=read.parked,
        paper_poses=read.parked_paper or {},
        mass=read.mass,
        about=read.about,
        gripper=read.gripper,
        wrench=read.wrench,
        center_of_mass=read.center_of_mass or (0.5 * x, 0.5 * y, 0.5 * z),
    )
