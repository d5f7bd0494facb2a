"""What the arm holds: end effectors that can be exchanged, one file each (R150).

prop: panel
about: a board to be touched
mass: 1.5                  # kg, with gripper and sensor; counts against the robot's payload
tcp: {xyz: [0, 0, 0.15], rpy: [0, 1.5707963267948966, 0]}   # flange_from_tcp
capsules:                  # around all of it, in the flange frame
  - {start: [0, 0, 0.03], end: [0, 0, 0.1], radius: 0.05}
parked: […]                # the folded arm, six joints in rad
parked_paper: […]          # another one, that gives the paper's times; optional
gripper: {opening: 0.085, speed: 0.15, held: 0.05}          # optional; m, m/s, m
wrench: {force: 100, torque: 10}                            # optional; full scale, N and Nm
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hw.document import FileError, Item, find_file, read_document

FOLDER = Path(__file__).parent / "props"
FLANGE = 6
"""The link that the prop turns with: the last of six."""

Six = tuple[float, float, float, float, float, float]
Point = tuple[float, float, float]


class PropError(FileError):
    """The file of an end effector is wrong or missing."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Where a frame sits in its parent: xyz in m, rpy (fixed axes x, y, z, as in URDF) in rad."""

    xyz: Point = (0.0, 0.0, 0.0)
    rpy: Point = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Capsule:
    """All points within `radius` of the line from `start` to `end`, in the frame of a link, m.

    `part` names it: the link, or a piece of it that needs a name of its own.
    """

    link: int
    part: str
    start: Point
    end: Point
    radius: float


@dataclass(frozen=True, slots=True)
class GripperModel:
    """Fingers that open to `opening` m at `speed` m/s and hold something `held` m wide."""

    opening: float
    speed: float
    held: float


@dataclass(frozen=True, slots=True)
class WrenchModel:
    """Full scale of a force-torque sensor, N and Nm."""

    force: float
    torque: float


@dataclass(frozen=True, slots=True)
class Prop:
    """Gripper, sensor and prop as one (R150): `tcp` is flange_from_tcp, the capsules turn with it.

    `parked` are the joint angles in which the arm with this prop stays inside the bumper frame
    while the rover drives (R46, R87); `parked_paper` are others that reproduce the paper's times.
    """

    name: str
    tcp: Placement
    capsules: tuple[Capsule, ...]
    parked: Six
    parked_paper: Six
    mass: float = 0.0
    about: str = ""
    gripper: GripperModel | None = None
    wrench: WrenchModel | None = None

    @property
    def length(self) -> float:
        """How far the prop's point is ahead of the flange, m."""
        return self.tcp.xyz[2]


def prop_names() -> tuple[str, ...]:
    """The end effectors that come with the project."""
    return tuple(sorted(path.stem for path in FOLDER.glob("*.yaml")))


def load_prop(name_or_path: str | Path = "prop") -> Prop:
    """An end effector by name or by file.

    Raises:
        PropError: with file, line, key and what would be right.
    """
    path = find_file(str(name_or_path), FOLDER, "prop", PropError)
    return prop_from(read_document(path, PropError))


def prop_from(item: Item) -> Prop:
    """Builds an end effector from a mapping as in its file.

    Raises:
        FileError: with file, line, key and what would be right.
    """
    part = item.section(
        required=("prop", "mass", "tcp", "capsules", "parked"),
        optional=("about", "parked_paper", "gripper", "wrench"),
    )
    name = part["prop"].text()
    return Prop(
        name=name,
        tcp=placement_from(part["tcp"]),
        capsules=tuple(_capsule(capsule, name) for capsule in part["capsules"].items()),
        parked=as_six(part["parked"].numbers(6)),
        parked_paper=as_six(part.get("parked_paper", part["parked"]).numbers(6)),
        mass=part["mass"].number(low=0.0),
        about=part["about"].text() if "about" in part else "",
        gripper=_gripper(part["gripper"]) if "gripper" in part else None,
        wrench=_wrench(part["wrench"]) if "wrench" in part else None,
    )


def placement_from(item: Item) -> Placement:
    """A frame written `{xyz: [x, y, z], rpy: [r, p, y]}`; what is left out is 0."""
    part = item.section(optional=("xyz", "rpy"))
    xyz, rpy = (point_from(part[key]) if key in part else (0.0, 0.0, 0.0) for key in ("xyz", "rpy"))
    return Placement(xyz, rpy)


def capsule_from(part: dict[str, Item], link: int, name: str) -> Capsule:
    """A capsule from its keys `start`, `end` and `radius`."""
    radius = positive(part["radius"])
    return Capsule(link, name, point_from(part["start"]), point_from(part["end"]), radius)


def point_from(item: Item) -> Point:
    """Three numbers, m."""
    x, y, z = item.numbers(3)
    return x, y, z


def positive(item: Item) -> float:
    """A number above 0."""
    value = item.number()
    if value <= 0.0:
        raise item.fail(f"{value:g} is out of range, it must be above 0")
    return value


def as_six(values: tuple[float, ...]) -> Six:
    """Six numbers, one per joint."""
    a, b, c, d, e, f = values
    return a, b, c, d, e, f


def _capsule(item: Item, name: str) -> Capsule:
    return capsule_from(item.section(required=("start", "end", "radius")), FLANGE, name)


def _gripper(item: Item) -> GripperModel:
    part = item.section(required=GripperModel.__slots__)
    found = GripperModel(*(positive(part[name]) for name in GripperModel.__slots__))
    if found.held > found.opening:
        raise part["held"].fail(f"{found.held:g} is wider than the opening, {found.opening:g}")
    return found


def _wrench(item: Item) -> WrenchModel:
    part = item.section(required=WrenchModel.__slots__)
    return WrenchModel(*(positive(part[name]) for name in WrenchModel.__slots__))
