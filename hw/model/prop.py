"""Exchangeable end effectors, one file each (R150): what the arm holds.

prop: panel
about: a board to be touched
mass: 1.5                  # kg, with gripper and sensor; counts against the robot's payload
center_of_mass: [0, 0, 0.07]   # flange frame, m; half way to the tcp if it is not given
tcp: {x: 0, y: 0, z: 0.15, pitch: 90 deg}   # flange_from_tcp; roll, pitch and yaw: 0 if left out
capsules:                  # around all of it, in the flange frame
  - {start: [0, 0, 0.03], end: [0, 0, 0.1], radius: 0.05}
parked:                    # the folded arm, six joints in rad, by arm; or six for any arm
  ur10: […]
parked_paper: {ur10: […]}  # a second folded pose, which reproduces the paper's times; optional
gripper: {opening: 0.085, speed: 0.15, held: 0.05}          # optional; m, m/s; held, m: optional
wrench: {force: 100, torque: 10}                            # optional; full scale, N and Nm
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from engine.files import Force, Length, Mass, Speed, Torque
from engine.files.declared import (
    Count,
    Fault,
    Item,
    Name,
    Range,
    Written,
    above_0,
    fields_of,
    find_file,
    known_files,
    load_yaml,
    reader_of,
    record,
)
from hw.geometry import AnyAngle, Pose3
from hw.samples import Joints

FOLDER = Path(__file__).parent.parent / "props"
JOINTS = 6
"""Joints of a UR arm."""
ANY = ""
"""Stands for any arm."""
FLANGE = 6
"""The link that carries the prop: the last of six, of any arm once it is a `Manipulator`."""

OLD_POSE = ("xyz", "rpy")
"""The keys with which poses were written before."""

Coordinate = Annotated[Length, Range(-10.0, 10.0)]
Point3 = tuple[Coordinate, Coordinate, Coordinate]
Angles = tuple[AnyAngle, AnyAngle, AnyAngle]
ParkedJoints = Annotated[tuple[AnyAngle, ...], Count(JOINTS, JOINTS + 1)]
"""Angles of all joints, shoulder first."""
ToolLength = Annotated[Length, Range(-1.0, 1.0)]
Radius = Annotated[Length, Range(0.001, 1.0)]


@dataclass(frozen=True, slots=True)
class Placement:
    """A frame in its parent: xyz in m, rpy (fixed axes x, y, z, as in URDF) in rad."""

    xyz: Point3 = (0.0, 0.0, 0.0)
    """Where it is."""
    rpy: Angles = (0.0, 0.0, 0.0)
    """How it is turned, about the fixed axes x, y and z."""

    def pose(self) -> Pose3:
        """The frame as a pose: turned about x, then y, then z of its parent."""
        return Pose3.from_angles(*self.xyz, self.rpy)


@dataclass(frozen=True, slots=True)
class SpatialPoseKeys:
    """A pose in space, in the frame of its parent."""

    x: Coordinate = 0.0
    """Along x of the parent."""
    y: Coordinate = 0.0
    """Along y."""
    z: Coordinate = 0.0
    """Along z."""
    roll: AnyAngle = 0.0
    """About the parent's x, first."""
    pitch: AnyAngle = 0.0
    """About its y, then."""
    yaw: AnyAngle = 0.0
    """About its z, last."""


def placement(item: Item) -> Placement:
    """A pose written `{x: 1.0, y: 2.0, z: 0.5, roll: 0, pitch: 0, yaw: 90 deg}`; 0 if left out.

    Raises:
        FileError: every mistake in it.
    """
    keys = item.mapping().keys()
    if keys & {*OLD_POSE} and not keys & fields_of(SpatialPoseKeys).keys():
        found = record(item, Placement)
        item.note("a pose in the old way", f"write `{_rewritten(item.value)}`")
        return found
    read = record(item, SpatialPoseKeys)
    return Placement((read.x, read.y, read.z), (read.roll, read.pitch, read.yaw))


def _rewritten(old: Mapping[str, Sequence[Any]]) -> str:
    """A pose in the old way as it is written now."""
    values = [value for key in OLD_POSE for value in old.get(key, (0, 0, 0))]
    pairs = zip(fields_of(SpatialPoseKeys), values, strict=True)
    kept = (f"{key}: {value}" for key, value in pairs if value or key in "xyz")
    return f"{{{', '.join(kept)}}}"


SpatialPose = Annotated[Placement, placement, Written(SpatialPoseKeys, old=Placement)]


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
    """Fingers that open to `opening` m at `speed` m/s; `held`: the width of what they hold, m."""

    opening: Annotated[Length, above_0(0.5)]
    """How far apart the fingers go."""
    speed: Annotated[Speed, above_0(1.0)]
    """How fast they move."""
    held: Annotated[Length, above_0(0.5)] | None = None
    """How wide the object is that they hold from the start; without it they start wide open."""

    def faults(self) -> Iterator[Fault]:
        """Contradictions, by key."""
        if self.held is not None and self.held > self.opening:
            yield "held", f"{self.held:g} is wider than the opening, {self.opening:g}"


@dataclass(frozen=True, slots=True)
class WrenchModel:
    """Full scale of a force-torque sensor, N and Nm."""

    force: Annotated[Force, above_0(10_000.0)]
    """The largest force."""
    torque: Annotated[Torque, above_0(1_000.0)]
    """The largest torque."""


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
    parked: Joints
    parked_paper: Joints
    poses: Mapping[str, Joints]
    paper_poses: Mapping[str, Joints]
    mass: float = 0.0
    about: str = ""
    gripper: GripperModel | None = None
    wrench: WrenchModel | None = None
    center_of_mass: Point3 = (0.0, 0.0, 0.0)

    def suits(self, arm: str) -> bool:
        """True if it says how this arm is folded."""
        return arm in self.poses or ANY in self.poses

    def for_any(self) -> Prop:
        """This prop as if it suited any arm, folded nohow, to look for parked poses."""
        return replace(self, poses={ANY: ()}, paper_poses={})

    def also(self, arm: str, poses: Mapping[str, Joints]) -> Prop:
        """This prop, folded on this arm as in `poses` (by prop) unless its own file says how."""
        if self.name not in poses:
            return self
        return replace(self, poses={arm: poses[self.name], **self.poses})

    def on(self, arm: str) -> Prop:
        """This prop on an arm that it suits, with the parked poses of that arm."""
        parked = self.poses[arm if arm in self.poses else ANY]
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
    """One end of its axis."""
    end: Point3
    """The other end."""
    radius: Radius
    """All points as near to the axis belong to it."""


def by_arm(item: Item) -> Mapping[str, Joints]:
    """Joint angles by the names of arms; a list alone is for any arm."""
    if isinstance(item.value, list):
        return {ANY: reader_of(ParkedJoints)(item)}
    found: Mapping[str, Joints] = reader_of(Mapping[str, ParkedJoints])(item)
    if not found:
        raise item.error("is empty", "six joint angles for each arm: `ur10: [0, -1, -2, 0, 0, 0]`")
    return found


ByArm = Annotated[Mapping[str, Joints], by_arm, Written(Mapping[str, ParkedJoints] | ParkedJoints)]


@dataclass(frozen=True, slots=True)
class PropFile:
    """What the arm holds."""

    prop: Name
    """Its name."""
    mass: Annotated[Mass, Range(0.0, 50.0)]
    """With gripper and sensor; counts against the robot's payload."""
    tcp: SpatialPose
    """The point that touches, flange_from_tcp."""
    capsules: tuple[_Capsule, ...]
    """Around all of it, in the flange frame."""
    parked: ByArm
    """The folded arm, all joints, by arm; or those of any arm."""
    parked_paper: ByArm | None = None
    """A second folded pose, which reproduces the paper's times."""
    about: str = ""
    """What it is."""
    gripper: GripperModel | None = None
    """The gripper, if there is one."""
    wrench: WrenchModel | None = None
    """The force-torque sensor, if there is one."""
    center_of_mass: tuple[ToolLength, ToolLength, ToolLength] | None = None
    """In the flange frame; half way to the tcp if it is not given."""


def _prop(item: Item) -> Prop:
    read = record(item, PropFile)
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
