"""The chain of an arm in a URDF: six or seven joints that turn, with shapes and masses (R17).

URDFs place link frames freely; here link n turns with joint n about its own z, so each child frame
is turned by the least rotation that brings z onto the axis of its joint. Links that hang on the
arm by fixed joints are folded into it, with their shapes and masses; what hangs on the flange is
left out, for the prop stands for it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from hw.model.prop import Capsule, Placement
from hw.model.urdf.capsules import (
    Fitted,
    around_box,
    around_cylinder,
    around_mesh,
    around_sphere,
    without_covered,
)
from hw.model.urdf.frames import Matrix, inverted, matrix, placement
from hw.model.urdf.meshes import mesh_file, triangles
from hw.model.urdf.urdf import FARTHEST_M, Joint, Mesh, Urdf, UrdfLink

COUNTS = (6, 7)
"""How many joints an arm may have."""
_FAULTS = {
    "prismatic": "slides",
    "floating": "floats",
    "planar": "slides in a plane",
}


@dataclass(frozen=True, slots=True)
class BodyMass:
    """Mass, kg, its centre, m, and inertia about it (xx, yy, zz, xy, xz, yz), in a link's frame."""

    mass: float
    center: tuple[float, float, float]
    inertia: tuple[float, float, float, float, float, float]


@dataclass(frozen=True, slots=True)
class SerialChain:
    """An arm of j joints: `links` (j + 1) from its base on, and each in the one before (j).

    `flange` is its frame in that of the last link. `masses` are those of the moving links, empty if
    one has none.
    """

    joints: tuple[Joint, ...]
    links: tuple[str, ...]
    placements: tuple[Placement, ...]
    flange: Placement
    capsules: tuple[Capsule, ...]
    masses: tuple[BodyMass, ...]


def serial_chain(urdf: Urdf, base: str, flange: str, folder: Path) -> SerialChain:
    """The arm from link `base` to link `flange`; meshes are sought from `folder` on.

    Raises:
        ValueError: it is no chain of six or seven joints that turn, or a shape cannot be read.
    """
    way = urdf.chain(base, flange)
    joints = _turning(urdf, way, base, flange)
    bodies = _bodies(urdf, base, way, joints)
    root_from = urdf.poses({})
    base_from_root = inverted(root_from[base])
    laid = [np.eye(4)] + [base_from_root @ root_from[j.child] @ _onto(j) for j in joints]
    placed = [
        [(urdf.links[name], inverted(frame) @ base_from_root @ root_from[name]) for name in names]
        for frame, names in zip(laid, bodies, strict=True)
    ]
    links = (base, *(joint.child for joint in joints))
    capsules = [
        Capsule(n, links[n], _point(fit.ends[0]), _point(fit.ends[1]), fit.radius)
        for n, body in enumerate(placed)
        for fit in without_covered(
            [fit for link, pose in body for fit in _fits(link, pose, folder)]
        )
    ]
    if not capsules:
        raise ValueError(f"{urdf.name}: no link of the arm has a <collision> shape to keep clear")
    masses = [_inertial(body) for body in placed[1:]]
    return SerialChain(
        joints,
        links,
        tuple(placement(inverted(a) @ b) for a, b in pairwise(laid)),
        placement(inverted(laid[-1]) @ base_from_root @ root_from[flange]),
        tuple(capsules),
        tuple(masses) if all(found.mass > 0.0 for found in masses) else (),
    )


def _turning(urdf: Urdf, way: Sequence[Joint], base: str, flange: str) -> tuple[Joint, ...]:
    joints = tuple(joint for joint in way if joint.kind != "fixed")
    for joint in joints:
        fault = "mimics another" if joint.mimic is not None else _FAULTS.get(joint.kind)
        if fault is not None:
            raise ValueError(
                f"{urdf.name}: joint '{joint.name}' {fault}; an arm's joints must turn"
            )
    if len(joints) not in COUNTS:
        raise ValueError(
            f"{urdf.name}: {len(joints)} joints turn from '{base}' to '{flange}'; 6 or 7 are needed"
        )
    return joints


def _bodies(
    urdf: Urdf, base: str, way: Sequence[Joint], joints: Sequence[Joint]
) -> list[list[str]]:
    """The names of the links that are one body, for the base and each moving link."""
    on_way, found = {joint.child: joint for joint in way}, [[base]]
    body = {base: 0}
    ends_at = way[-1].child
    for joint in urdf.joints:
        if joint.parent not in body or (joint.parent == ends_at and joint.child not in on_way):
            continue
        if joint in joints:
            found.append([])
            body[joint.child] = len(found) - 1
        elif joint.kind == "fixed":
            body[joint.child] = body[joint.parent]
        else:
            raise ValueError(
                f"{urdf.name}: the arm branches: joint '{joint.name}' moves '{joint.child}', which "
                f"hangs on '{joint.parent}' beside the way to '{ends_at}'; what hangs on the "
                "flange may move, what hangs on the arm before it must be fixed"
            )
        found[body[joint.child]].append(joint.child)
    return found


def _onto(joint: Joint) -> Matrix:
    """The least rotation that turns z onto the joint's axis, (4, 4)."""
    x, y, z = np.array(joint.axis) / math.hypot(*joint.axis)
    found = np.eye(4)
    if z < -1.0 + 1e-12:  # half a turn about x
        found[1, 1] = found[2, 2] = -1.0
        return found
    skew = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])
    found[:3, :3] += skew + skew @ skew / (1.0 + z)
    return found


def _fits(link: UrdfLink, pose: Matrix, folder: Path) -> Iterator[Fitted]:
    """Capsules around a link's collision shapes, in the frame in which its pose is given."""
    for solid in link.solids:
        if solid.kind == "box":
            found = around_box(solid.sizes)
        elif solid.kind == "cylinder":
            found = around_cylinder(*solid.sizes)
        elif solid.kind == "sphere":
            found = around_sphere(*solid.sizes)
        else:
            raise ValueError(
                f"link '{link.name}' has a <{solid.kind}> as <collision>; boxes, cylinders, "
                "spheres and meshes are read"
            )
        yield from (fit.moved(pose @ matrix(solid.origin)) for fit in found)
    for mesh in link.collisions:
        try:
            corners = _scaled(triangles(mesh_file(mesh.file, folder)), mesh)
        except (OSError, ValueError) as refused:
            raise ValueError(f"link '{link.name}' {refused}") from None
        yield from (fit.moved(pose @ matrix(mesh.origin)) for fit in around_mesh(corners))


def _scaled(corners: Matrix, mesh: Mesh) -> Matrix:
    """Corners of triangles in metres.

    Raises:
        ValueError: the mesh is larger than any link.
    """
    size = float(np.abs(corners).max()) * max(map(abs, mesh.scale))
    if not size <= FARTHEST_M:
        raise ValueError(
            f"has the mesh '{mesh.file}', which reaches out to {size:.3g} m; if it is in "
            'millimetres, give it scale="0.001 0.001 0.001"'
        )
    return corners * mesh.scale


def _inertial(body: Sequence[tuple[UrdfLink, Matrix]]) -> BodyMass:
    """Mass of links that are one body, in its frame (parallel axis theorem)."""
    mass = sum(link.mass for link, _ in body)
    poses = [pose @ matrix(link.center) for link, pose in body]
    center = sum(
        (link.mass * pose[:3, 3] for (link, _), pose in zip(body, poses, strict=True)), np.zeros(3)
    ) / max(mass, 1e-12)
    tensor = np.zeros((3, 3))
    for (link, _), pose in zip(body, poses, strict=True):
        xx, yy, zz, xy, xz, yz = link.inertia
        own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        off = pose[:3, 3] - center
        tensor += pose[:3, :3] @ own @ pose[:3, :3].T
        tensor += link.mass * (off @ off * np.eye(3) - np.outer(off, off))
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = tensor.tolist()
    return BodyMass(mass, _point(center), (xx, yy, zz, xy, xz, yz))


def _point(values: Matrix) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
