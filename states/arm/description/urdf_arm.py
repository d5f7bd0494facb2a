"""An arm read from a URDF (R17).

URDFs place link frames freely; only the joint axes matter. The frames of
`states.arm.kinematics.model` are laid onto those axes, so that forward kinematics stay exactly
those of the description; deviations from the nominal lengths become a calibrated chain.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from engine.files import mistake
from hw.model import (
    ALIKE,
    ArmShape,
    Capsule,
    Dh,
    Joint,
    JointRange,
    Placement,
    Urdf,
    UrdfDescription,
    inverted,
    matrix,
    nearest_arm,
    placement,
    read_urdf,
)
from states.arm.kinematics import Array, Manipulator

_ALIKE = 0.1
"""Largest angle between a joint axis and that of a UR arm, rad."""
_FAULTS = {"prismatic": "slides", "floating": "floats", "planar": "slides in a plane"}

# axes of a UR arm stretched out at zero angles, in its base frame
_DIRECTIONS = ((0, 0, 1), (0, -1, 0), (0, -1, 0), (0, -1, 0), (0, 0, -1), (0, -1, 0))


def manipulator_from_urdf(urdf: Urdf, base: str, tip: str, like: Manipulator) -> Manipulator:
    """The six-joint arm from link `base` to link `tip`; everything else is taken from `like`.

    `base` becomes the rover frame and `tip` the tcp: forward kinematics give base_from_tip.

    Raises:
        ValueError: not six revolute joints, or not laid out like those of a UR arm.
    """
    joints = _turning(urdf, base, tip)
    root_from = urdf.poses({})
    base_from = inverted(root_from[base])
    frames = [base_from @ root_from[joint.child] for joint in joints]
    axes = np.array([f[:3, :3] @ _unit(j) for f, j in zip(frames, joints, strict=True)])
    points = np.array([frame[:3, 3] for frame in frames])
    mount = _mount(axes, points)
    axes, points = axes @ mount[:3, :3], (points - mount[:3, 3]) @ mount[:3, :3]
    _require_alike(urdf, joints, axes)
    dh = _lengths(axes, points, like.shape.ur.d6)
    # a URDF does not say how much of the shoulder's height belongs to the mount: d1 is as in `like`
    raised = dh.d1 - like.shape.ur.d1
    mount[:3, 3] += raised * mount[:3, 2]
    points[:, 2] -= raised
    dh = replace(dh, d1=like.shape.ur.d1)
    chain = _laid(dh, axes, points)
    steps = [inverted(a) @ b for a, b in zip([np.eye(4), *chain], chain, strict=False)]
    tcp = inverted(mount @ chain[-1]) @ base_from @ root_from[tip]
    return replace(
        like,
        shape=replace(
            like.shape, arm=urdf.name or like.name, dh=dh, joints=_ranges(joints, like.shape)
        ),
        mount=placement(mount),
        tool=replace(like.tool, tcp=placement(tcp)),
        placements=tuple(placement(step) for step in steps),
    )


def described_arm(described: UrdfDescription, like: Manipulator) -> Manipulator:
    """The arm of a robot file's URDF on its mount, with limits and prop as in `like`.

    Raises:
        FileError: the URDF is wrong, or its arm is not laid out like a UR arm.
    """
    urdf = read_urdf(described.file)
    try:
        found = manipulator_from_urdf(urdf, described.base, described.flange, like)
    except ValueError as refused:
        raise mistake(described.file, str(refused)) from None
    link_from_flange = matrix(found.tool.tcp)
    held = replace(
        like.tool,
        tcp=placement(link_from_flange @ matrix(like.tool.tcp)),
        capsules=tuple(_moved(capsule, link_from_flange) for capsule in like.tool.capsules),
    )
    own = like.shape.joints.values()
    off = found.shape.ur.difference(like.shape.ur)
    if off > ALIKE:
        raise mistake(described.file, _another(found.shape.ur, like))
    return replace(
        found,
        shape=replace(found.shape, joints=dict(zip(found.shape.joints, own, strict=True))),
        mount=placement(_standing(described, like) @ matrix(found.mount)),
        tool=held,
    )


def _standing(described: UrdfDescription, like: Manipulator) -> Array:
    """rover_from_base of the description; the controller's base is turned by pi about z from it."""
    if described.mount is not None:
        return matrix(described.mount)
    return matrix(like.mount) @ matrix(Placement(rpy=(0.0, 0.0, math.pi)))


def _another(found: Dh, like: Manipulator) -> str:
    """Why an arm of these lengths is not the one that the robot file names."""
    told = f"a2 {found.a2:.4f}, a3 {found.a3:.4f}, d4 {found.d4:.4f}, d5 {found.d5:.4f} m"
    known = nearest_arm(found)
    off = found.difference(known.ur)
    whose = f"those of {known.name}" if off <= ALIKE else "those of no known arm"
    hint = f"; the nearest is {known.name}, {off * 1e3:.0f} mm off" if off > ALIKE else ""
    return f"its lengths ({told}) are {whose}, not of {like.name}, which the robot file names{hint}"


def _moved(capsule: Capsule, pose: Array) -> Capsule:
    ends = np.array([[*capsule.start, 1.0], [*capsule.end, 1.0]]) @ pose.T
    (x, y, z), (u, v, w) = ends[:, :3].tolist()
    return replace(capsule, start=(x, y, z), end=(u, v, w))


def _turning(urdf: Urdf, base: str, tip: str) -> list[Joint]:
    chain = urdf.chain(base, tip)
    joints = [joint for joint in chain if joint.kind != "fixed"]
    for joint in joints:
        if joint.kind in _FAULTS or joint.mimic is not None:
            what = _FAULTS.get(joint.kind, "mimics another")
            raise ValueError(f"{urdf.name}: joint '{joint.name}' {what}; all six must turn freely")
    if len(joints) != 6:
        raise ValueError(f"{urdf.name}: {len(joints)} joints from '{base}' to '{tip}'; needs 6")
    return joints


def _unit(joint: Joint) -> Array:
    return np.array(joint.axis) / math.hypot(*joint.axis)


def _mount(axes: Array, points: Array) -> Array:
    """base_from_arm: z along the first axis, y against the second, origin level with the link."""
    z = axes[0]
    y = -(axes[1] - (axes[1] @ z) * z)
    mount = np.eye(4)
    mount[:3, 1] = y / np.linalg.norm(y)
    mount[:3, 2] = z
    mount[:3, 0] = np.cross(mount[:3, 1], z)
    mount[:3, 3] = points[0] - (points[0] @ z) * z
    return mount


def _require_alike(urdf: Urdf, joints: list[Joint], axes: Array) -> None:
    for joint, axis, wanted in zip(joints, axes, _DIRECTIONS, strict=True):
        if math.acos(min(max(float(axis @ wanted), -1.0), 1.0)) > _ALIKE:
            found = ", ".join(f"{value:.2f}" for value in axis)
            raise ValueError(
                f"{urdf.name}: the axis of '{joint.name}' is ({found}) at zero angles, seen from"
                f" the arm's base; that of a UR arm is {wanted}"
            )


def _lengths(axes: Array, points: Array, d6: float) -> Dh:
    """Nominal lengths of the axes at zero angles; d6 does not show in them."""
    side = -float(_at(axes[4], points[4], 2, points[3][2])[1])
    across = [_at(axes[i], points[i], 1, 0.0 if i < 3 else -side) for i in (1, 2, 3, 5)]
    (x2, z2), (x3, _), (x4, _), (_, z6) = ((float(p[0]), float(p[2])) for p in across)
    return Dh(d1=z2, a2=x3 - x2, a3=x4 - x3, d4=side, d5=z2 - z6, d6=d6)


def _at(axis: Array, point: Array, coordinate: int, value: float) -> Array:
    """The point of a line at which one coordinate has this value."""
    return np.asarray(point + (value - point[coordinate]) / axis[coordinate] * axis)


def _laid(dh: Dh, axes: Array, points: Array) -> list[Array]:
    """base_from_link of the nominal arm at zero angles, each moved onto the axis of its joint."""
    frame, found = np.eye(4), []
    for origin, axis, point in zip(dh.placements(), axes, points, strict=True):
        frame = frame @ matrix(origin)
        laid = np.eye(4)
        laid[:3, 2] = axis
        ahead = frame[:3, 0] - (frame[:3, 0] @ axis) * axis
        laid[:3, 0] = ahead / np.linalg.norm(ahead)
        laid[:3, 1] = np.cross(axis, laid[:3, 0])
        laid[:3, 3] = point + ((frame[:3, 3] - point) @ axis) * axis
        found.append(laid)
    return found


def _ranges(joints: list[Joint], like: ArmShape) -> dict[str, JointRange]:
    """The ranges of the joints; what a description leaves open is two turns, or as in `like`."""
    return {
        joint.name: JointRange(
            _bound(joint.lower, -2.0 * math.pi),
            _bound(joint.upper, 2.0 * math.pi),
            _bound(joint.speed, own.speed),
            own.torque,
        )
        for joint, own in zip(joints, like.joints.values(), strict=True)
    }


def _bound(value: float, otherwise: float) -> float:
    return value if math.isfinite(value) else otherwise
