"""URDF robot descriptions: links, joints, mesh names, and the pose of every link (R17).

Reads all kinds of joints, and mimic joints; floating and planar ones stay where `origin` puts them,
so they can carry an arm, but not be part of it. Meshes are named, not loaded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from engine.files import did_you_mean
from hw.model.prop import Placement, Point3
from hw.model.urdf.elements import Element, elements
from hw.model.urdf.frames import Matrix, matrix
from hw.model.urdf.xacro_file import urdf_text

JointKind = Literal["fixed", "revolute", "continuous", "prismatic", "floating", "planar"]

_KINDS: tuple[JointKind, ...] = get_args(JointKind)
_UNMOVED = ("fixed", "floating", "planar")
_SIZES = {"box": ("size",), "cylinder": ("radius", "length"), "sphere": ("radius",)}
_TENSOR = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
_HERE = Placement()
FARTHEST_M = 50.0
"""No part of a robot is farther from the one before, or larger, m."""
MOST_RAD = 1000.0
"""Largest angle that is taken as one, rad: a file in degrees stays below, a broken one does not."""


@dataclass(frozen=True, slots=True)
class Mimic:
    """A joint that follows another one: value = multiplier * other + offset."""

    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


@dataclass(frozen=True, slots=True)
class Joint:
    """The child's frame is the parent's, moved by `origin`, then turned about or along `axis`.

    Limits in rad or m (infinite where there are none), `speed` in rad/s or m/s, `effort` in Nm or
    N.
    """

    name: str
    kind: JointKind
    parent: str
    child: str
    origin: Placement = _HERE
    axis: Point3 = (1.0, 0.0, 0.0)
    lower: float = -math.inf
    upper: float = math.inf
    speed: float = math.inf
    effort: float = math.inf
    mimic: Mimic | None = None

    @property
    def moves(self) -> bool:
        """True if the joint has a value of its own."""
        return self.kind not in _UNMOVED and self.mimic is None


@dataclass(frozen=True, slots=True)
class Mesh:
    """A mesh: file name as written, pose in its link, and scale."""

    file: str
    origin: Placement
    scale: Point3 = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Solid:
    """A box (its three sides), a cylinder about z (radius, length) or a sphere (radius), m.

    Anything else has no sizes; `kind` is its tag.
    """

    kind: str
    sizes: tuple[float, ...]
    origin: Placement


@dataclass(frozen=True, slots=True)
class UrdfLink:
    """A rigid part; mass in kg, at `center`, with the inertia ixx, iyy, izz, ixy, ixz, iyz there.

    `solids` and `collisions` (the meshes) are its collision shapes.
    """

    name: str
    visuals: tuple[Mesh, ...] = ()
    collisions: tuple[Mesh, ...] = ()
    mass: float = 0.0
    solids: tuple[Solid, ...] = ()
    center: Placement = _HERE
    inertia: tuple[float, ...] = (0.0,) * 6


@dataclass(frozen=True, slots=True)
class Urdf:
    """A tree of links; `joints` are ordered so that parents come before their children."""

    name: str
    root: str
    links: Mapping[str, UrdfLink]
    joints: tuple[Joint, ...]

    def value(self, joint: Joint, values: Mapping[str, float]) -> float:
        """Value of a joint, rad or m, from those of the moving joints (missing ones are 0)."""
        if joint.mimic is None:
            return values.get(joint.name, 0.0)
        followed = next(j for j in self.joints if j.name == joint.mimic.joint)
        return joint.mimic.multiplier * self.value(followed, values) + joint.mimic.offset

    def poses(self, values: Mapping[str, float]) -> dict[str, Matrix]:
        """root_from_link (4, 4) of every link."""
        found = {self.root: np.eye(4)}
        for joint in self.joints:
            moved = _motion(joint, self.value(joint, values))
            found[joint.child] = found[joint.parent] @ matrix(joint.origin) @ moved
        return found

    def chain(self, base: str, tip: str) -> tuple[Joint, ...]:
        """Joints from one link down to another.

        Raises:
            ValueError: a link is unknown, or the tip is not a descendant of the base.
        """
        for link in (base, tip):
            if link not in self.links:
                hint = did_you_mean(link, self.links)
                raise ValueError(f"{self.name}: no link '{link}'; {hint}")
        above = {joint.child: joint for joint in self.joints}
        found: list[Joint] = []
        link = tip
        while link != base:
            if link not in above:
                raise ValueError(f"{self.name}: '{tip}' does not hang on '{base}'")
            found.append(above[link])
            link = above[link].parent
        return tuple(reversed(found))


def read_urdf(path: Path) -> Urdf:
    """A description from a file.

    Raises:
        FileError: with file, line, element and what would be right.
    """
    return parse_urdf(urdf_text(path), str(path))


def parse_urdf(text: str, path: str = "robot.urdf") -> Urdf:
    """Like `read_urdf`, for text."""
    root = elements(text, path)
    if xacro := next((e for e in root.within() if e.tag.startswith("xacro:")), None):
        name = Path(path).with_suffix("").stem
        raise xacro.fail(f"is xacro; run `xacro {Path(path).name} > {name}.expanded.urdf` first")
    if root.tag != "robot":
        raise root.fail("is the outermost element; a URDF has <robot>")
    links = {name: _link(element) for name, element in root.named("link").items()}
    joints = [_joint(element, links) for element in root.named("joint").values()]
    if not links:
        raise root.fail("has no link")
    return _tree(root, links, joints)


def _link(element: Element) -> UrdfLink:
    inertial = element.first("inertial")
    mass = inertial.first("mass") if inertial else None
    tensor = inertial.first("inertia") if inertial else None
    return UrdfLink(
        name=element.text("name"),
        visuals=tuple(_meshes(element, "visual")),
        collisions=tuple(_meshes(element, "collision")),
        mass=mass.number("value", 0.0) if mass else 0.0,
        solids=tuple(_solids(element)),
        center=_placement(inertial) if inertial else _HERE,
        inertia=tuple(tensor.number(key, 0.0) for key in _TENSOR) if tensor else (0.0,) * 6,
    )


def _solids(link: Element) -> Iterator[Solid]:
    for shape in link.all("collision"):
        geometry = shape.need("geometry")
        for kind, keys in _SIZES.items():
            found = geometry.first(kind)
            if found is not None:
                told = found.numbers("size", (0.0,) * 3) if kind == "box" else ()
                sizes = told or tuple(found.number(key, 0.0) for key in keys)
                if not min(sizes) > 0.0:
                    raise found.fail(f"needs {' and '.join(keys)} above 0")
                if max(sizes) > FARTHEST_M:
                    raise found.fail(_too_far(" and ".join(keys), max(sizes)))
                yield Solid(kind, sizes, _placement(shape))
        if (other := _other_shape(geometry)) is not None:
            yield Solid(other, (), _placement(shape))


def _other_shape(geometry: Element) -> str | None:
    """What a geometry is instead of a shape that is read; None if it is one of these."""
    tags = [shape.tag for shape in geometry.children]
    known = {*_SIZES, "mesh"}
    return None if known.intersection(tags) else next(iter(tags), "geometry")


def _meshes(link: Element, tag: str) -> Iterator[Mesh]:
    for shape in link.all(tag):
        mesh = shape.need("geometry").first("mesh")
        if mesh is not None:
            scale = _point(mesh.numbers("scale", (1.0, 1.0, 1.0)))
            yield Mesh(mesh.text("filename"), _placement(shape), scale)


def _joint(element: Element, links: Mapping[str, UrdfLink]) -> Joint:
    kind = next((k for k in _KINDS if k == element.text("type")), None)
    if kind is None:
        raise element.fail(f"has the type '{element.text('type')}'; known: {', '.join(_KINDS)}")
    ends = [element.need(end).text("link") for end in ("parent", "child")]
    for link in ends:
        if link not in links:
            hint = did_you_mean(link, links)
            raise element.fail(f"names a link '{link}' that is not there; {hint}")
    axis, limit, mimic = (element.first(tag) for tag in ("axis", "limit", "mimic"))
    along = axis.numbers("xyz", (1.0, 0.0, 0.0)) if axis else (1.0, 0.0, 0.0)
    if kind not in ("fixed", "floating") and math.hypot(*along) < 1e-9:
        raise element.fail("has an axis of no length")
    if limit is not None and kind == "revolute":
        for end in ("lower", "upper"):
            if abs(limit.number(end, 0.0)) > MOST_RAD:
                raise limit.fail(
                    f"of '{element.text('name')}' has {end}=\"{limit.attributes[end]}\"; it is in "
                    f"rad, {MOST_RAD:g} at most; a joint without end is continuous"
                )
    bounded = limit is not None and kind in ("revolute", "prismatic")
    return Joint(
        name=element.text("name"),
        kind=kind,
        parent=ends[0],
        child=ends[1],
        origin=_placement(element),
        axis=_point(along),
        lower=limit.number("lower", 0.0) if limit and bounded else -math.inf,
        upper=limit.number("upper", 0.0) if limit and bounded else math.inf,
        speed=_most(limit, "velocity"),
        effort=_most(limit, "effort"),
        mimic=_mimic(mimic) if mimic else None,
    )


def _most(limit: Element | None, attribute: str) -> float:
    told = limit is not None and attribute in limit.attributes
    return limit.number(attribute, math.inf) if limit is not None and told else math.inf


def _mimic(element: Element) -> Mimic:
    multiplier, offset = element.number("multiplier", 1.0), element.number("offset", 0.0)
    return Mimic(element.text("joint"), multiplier, offset)


def _placement(element: Element) -> Placement:
    origin = element.first("origin")
    if origin is None:
        return Placement()
    zero = (0.0, 0.0, 0.0)
    xyz, rpy = origin.numbers("xyz", zero), origin.numbers("rpy", zero)
    if max(map(abs, xyz)) > FARTHEST_M:
        raise origin.fail(_too_far("xyz", max(xyz, key=abs)))
    if max(map(abs, rpy)) > MOST_RAD:
        most = max(rpy, key=abs)
        raise origin.fail(f"has {most:g} in rpy; angles are in rad, {MOST_RAD:g} at most")
    return Placement(_point(xyz), _point(rpy))


def _too_far(what: str, value: float) -> str:
    return f"has {value:g} in {what}; lengths are in metres, {FARTHEST_M:g} at most"


def _point(values: tuple[float, ...]) -> Point3:
    x, y, z = values
    return x, y, z


def _tree(root: Element, links: dict[str, UrdfLink], joints: list[Joint]) -> Urdf:
    """Joints ordered so that every parent comes before its children."""
    above: dict[str, Joint] = {}
    for joint in joints:
        if joint.child in above:
            raise root.fail(f"has more than one joint above link '{joint.child}'")
        above[joint.child] = joint
    tops = [name for name in links if name not in above]
    if len(tops) != 1:
        raise root.fail(f"needs one link above all others, has {', '.join(tops) or 'a ring'}")
    _check_mimics(root, joints)
    below: dict[str, list[Joint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    ordered: list[Joint] = []
    ready = [tops[0]]
    while ready:
        found = below.get(ready.pop(), [])
        ordered += found
        ready += [joint.child for joint in found]
    if len(ordered) < len(joints):
        reached = {joint.name for joint in ordered}
        loose = next(joint.child for joint in joints if joint.name not in reached)
        raise root.fail(f"has links in a ring, '{loose}' among them")
    return Urdf(root.attributes.get("name", ""), tops[0], links, tuple(ordered))


def _check_mimics(root: Element, joints: list[Joint]) -> None:
    names, ends = {joint.name: joint for joint in joints}, set[str]()
    for joint in joints:
        seen, followed = {joint.name}, joint.mimic
        while followed is not None and followed.joint not in ends:
            if followed.joint not in names:
                hint = did_you_mean(followed.joint, names)
                raise root.fail(
                    f"'{joint.name}' mimics '{followed.joint}', which is not there; {hint}"
                )
            if followed.joint in seen:
                raise root.fail(f"'{joint.name}' mimics itself in the end")
            seen.add(followed.joint)
            followed = names[followed.joint].mimic
        ends |= seen


def _motion(joint: Joint, value: float) -> Matrix:
    """Transform (4, 4) of a joint at a value, by Rodrigues' formula.

    R = I + sin(t) K + (1 - cos(t)) K^2, with K the cross product matrix of the unit axis.
    """
    moved = np.eye(4)
    if joint.kind in _UNMOVED:
        return moved
    x, y, z = np.array(joint.axis) / math.hypot(*joint.axis)
    if joint.kind == "prismatic":
        moved[:3, 3] = value * np.array([x, y, z])
        return moved
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    moved[:3, :3] += math.sin(value) * cross + (1.0 - math.cos(value)) * (cross @ cross)
    return moved
