"""An arm written as a URDF: what `hw.model.urdf` must read back unchanged."""

from __future__ import annotations

import math
from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import numpy as np

from hw.model.arm import LINKS
from hw.model.prop import Capsule, Placement
from hw.model.robot import ChassisBox
from states.arm.kinematics.model import Manipulator


def urdf_of(model: Manipulator) -> str:
    """The arm with its capsules as collision shapes, from the floor under the rover to the tcp."""
    names = ("arm_base", *LINKS[1:])
    shape, joints = model.shape, tuple(model.shape.joints)
    origins = model.placements or shape.dh.placements()
    parts = [f"<robot name={quoteattr(model.name)}>", '  <link name="base_footprint">']
    parts += [_box_shape(box) for box in model.body]
    parts += ["  </link>", _fixed("mount", "base_footprint", names[0], model.mount)]
    capsules = (*shape.capsules, *model.tool.capsules)
    for k, name in enumerate(names):
        shapes = [s for c in capsules if c.link == k for s in _capsule_shapes(c)]
        parts += [f'  <link name="{name}">', *shapes, "  </link>"]
        if k:
            limits = shape.lower[k - 1], shape.upper[k - 1], shape.max_speed[k - 1]
            parts.append(_turning_joint(joints[k - 1], names[k - 1], name, origins[k - 1], limits))
    parts += ['  <link name="tool0"/>', '  <link name="tcp"/>']
    parts.append(_fixed("flange", names[-1], "tool0", Placement()))
    parts.append(_fixed("prop", "tool0", "tcp", model.tool.tcp))
    return "\n".join([*parts, "</robot>", ""])


def _turning_joint(
    name: str, parent: str, child: str, origin: Placement, limits: tuple[float, float, float]
) -> str:
    lower, upper, speed = limits
    return (
        f'  <joint name={quoteattr(name)} type="revolute">{_ends(parent, child)}{_origin(origin)}'
        f'<axis xyz="0 0 1"/><limit lower="{lower!r}" upper="{upper!r}" velocity="{speed!r}"'
        ' effort="0"/></joint>'
    )


def _fixed(name: str, parent: str, child: str, origin: Placement) -> str:
    return f'  <joint name="{name}" type="fixed">{_ends(parent, child)}{_origin(origin)}</joint>'


def _ends(parent: str, child: str) -> str:
    return f'<parent link="{parent}"/><child link="{child}"/>'


def _origin(origin: Placement) -> str:
    xyz, rpy = (" ".join(repr(float(v)) for v in values) for values in (origin.xyz, origin.rpy))
    return f'<origin xyz="{xyz}" rpy="{rpy}"/>'


def _box_shape(box: ChassisBox) -> str:
    size = tuple(b - a for a, b in zip(box.low, box.high, strict=True))
    x, y, z = ((a + b) / 2.0 for a, b in zip(box.low, box.high, strict=True))
    extent = " ".join(repr(value) for value in size)
    return _shape(Placement((x, y, z)), f'<box size="{extent}"/>')


def _capsule_shapes(capsule: Capsule) -> Iterator[str]:
    """URDF has no capsules: a cylinder between two spheres."""
    start, end = np.array(capsule.start), np.array(capsule.end)
    for centre in (capsule.start, capsule.end)[: 1 if np.array_equal(start, end) else 2]:
        yield _shape(Placement(centre), f'<sphere radius="{capsule.radius!r}"/>')
    length = float(np.linalg.norm(end - start))
    if length == 0.0:
        return
    x, y, z = (end - start) / length
    x0, y0, z0 = (float(value) for value in 0.5 * (start + end))
    tilted = (0.0, math.acos(z), math.atan2(y, x))
    cylinder = f'<cylinder radius="{capsule.radius!r}" length="{length!r}"/>'
    yield _shape(Placement((x0, y0, z0), tilted), cylinder)


def _shape(origin: Placement, geometry: str) -> str:
    return f"    <collision>{_origin(origin)}<geometry>{geometry}</geometry></collision>"
