"""Two arms that are no UR arms, as URDFs written here: seven axes, and six with a ball wrist.

The first has the Denavit-Hartenberg values, limits, speeds and torques that Franka publishes for
the Panda; its shapes are rough. The second is of no maker: its axes are not z, and links turn as
drawn.
"""

from __future__ import annotations

import math
from pathlib import Path

from hw.model import FOLDER as ROBOTS

PANDA_DH = (  # a, d, alpha of each joint, after Craig
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -0.5 * math.pi),
    (0.0, 0.316, 0.5 * math.pi),
    (0.0825, 0.0, 0.5 * math.pi),
    (-0.0825, 0.384, -0.5 * math.pi),
    (0.0, 0.0, 0.5 * math.pi),
    (0.088, 0.0, 0.5 * math.pi),
)
PANDA_FLANGE = 0.107
_PANDA_LIMITS = (
    (-2.8973, 2.8973, 2.175, 87),
    (-1.7628, 1.7628, 2.175, 87),
    (-2.8973, 2.8973, 2.175, 87),
    (-3.0718, -0.0698, 2.175, 87),
    (-2.8973, 2.8973, 2.61, 12),
    (-0.0175, 3.7525, 2.61, 12),
    (-2.8973, 2.8973, 2.61, 12),
)
_PANDA_SHAPES = (
    '<sphere radius="0.09"/>@0 0 0.06',
    '<cylinder radius="0.06" length="0.283"/>@0 0 -0.1915',
    '<cylinder radius="0.06" length="0.12"/>@0 0 0',
    '<cylinder radius="0.06" length="0.15"/>@0 0 -0.145',
    '<cylinder radius="0.06" length="0.12"/>@0 0 0',
    '<cylinder radius="0.06" length="0.1"/>@0 0 -0.26|<box size="0.1 0.08 0.2"/>@0 0.06 -0.13',
    '<cylinder radius="0.05" length="0.08"/>@0 0 -0.03',
    '<cylinder radius="0.045" length="0.14"/>@0 0 0.02',
)
BALL_AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
BALL_STEPS = ((0, 0, 0.399), (0.05, 0, 0), (0, 0, 0.448), (0.1, 0, 0.042), (0.351, 0, 0), (0, 0, 0))
BALL_FLANGE = 0.082
_BALL_LIMITS = (
    (-2.96, 2.96, 5.0, 200),
    (-1.74, 2.26, 4.2, 200),
    (-3.49, 1.22, 5.2, 100),
    (-4.71, 4.71, 7.0, 30),
    (-2.26, 2.26, 7.0, 30),
    (-6.28, 6.28, 10.5, 20),
)
_BALL_SHAPES = (
    '<cylinder radius="0.1" length="0.2"/>@0 0 0.1',
    '<cylinder radius="0.09" length="0.15"/>@0 0 -0.04',
    '<box size="0.1 0.14 0.4"/>@0 0 0.2',
    '<box size="0.16 0.12 0.12"/>@0.03 0 0.03',
    '<box size="0.18 0.08 0.08"/>@0.19 0 0',
    '<sphere radius="0.055"/>@0 0 0',
    '<box size="0.05 0.08 0.08"/>@0.055 0 0',
)


def panda_urdf(shapes: tuple[str, ...] = _PANDA_SHAPES) -> str:
    """The Panda from `panda_link0` to `panda_link8`."""
    joints = []
    for n, ((a, d, alpha), limit) in enumerate(zip(PANDA_DH, _PANDA_LIMITS, strict=True), start=1):
        at = f"{a!r} {-math.sin(alpha) * d!r} {math.cos(alpha) * d!r}"
        joints.append(_joint(f"panda_joint{n}", n, at, f"{alpha!r} 0 0", "0 0 1", limit))
    flange = _fixed("panda_joint8", 7, 8, f"0 0 {PANDA_FLANGE}", "0 0 0")
    return _robot("panda", shapes, [*joints, flange])


def ball_urdf() -> str:
    """The arm with a ball wrist from `panda_link0` to `panda_link7`; axes z, y, y, x, y, x."""
    joints = [
        _joint(f"joint{n}", n, " ".join(map(repr, step)), "0 0 0", axis, limit)
        for n, (step, axis, limit) in enumerate(
            zip(BALL_STEPS, BALL_AXES, _BALL_LIMITS, strict=True), start=1
        )
    ]
    flange = _fixed("flange", 6, 7, f"{BALL_FLANGE} 0 0", f"0 {0.5 * math.pi!r} 0")
    return _robot("ball", _BALL_SHAPES, [*joints, flange])


def arm_file(folder: Path, name: str, more: str = "") -> Path:
    """An arm file of one of both, with its URDF beside it."""
    urdf, flange = (panda_urdf(), 8) if name == "panda" else (ball_urdf(), 7)
    (folder / f"{name}.urdf").write_text(urdf)
    path = folder / f"{name}.yaml"
    told = f"{{file: {name}.urdf, base: panda_link0, flange: panda_link{flange}}}"
    path.write_text(f"arm: {name}\npayload: 3 kg\nurdf: {told}\n{more}")
    return path


def robot_file(folder: Path, name: str, parked: str) -> Path:
    """A rover with one of both, folded like this."""
    arm_file(folder, name, f"parked: {{prop: {parked}}}\n")
    shipped = (ROBOTS / "rbkairos_ur10.yaml").read_text()
    text = shipped.replace("robot: rbkairos_ur10", f"robot: rover_{name}")
    text = text.replace("  model: ur10 ", f"  model: {name}.yaml ")
    text = text.replace("z: 0.511, yaw: 180 deg}", "z: 0.511}")
    text = text.replace("payload: 10.0", "payload: 3.0")
    path = folder / f"rover_{name}.yaml"
    path.write_text(text)
    return path


def _joint(
    name: str, n: int, at: str, rpy: str, axis: str, limit: tuple[float, float, float, float]
) -> str:
    lower, upper, speed, effort = limit
    return (
        f'<joint name="{name}" type="revolute"><parent link="panda_link{n - 1}"/>'
        f'<child link="panda_link{n}"/><origin xyz="{at}" rpy="{rpy}"/><axis xyz="{axis}"/>'
        f'<limit lower="{lower}" upper="{upper}" velocity="{speed}" effort="{effort}"/></joint>'
    )


def _fixed(name: str, parent: int, child: int, at: str, rpy: str) -> str:
    return (
        f'<joint name="{name}" type="fixed"><parent link="panda_link{parent}"/>'
        f'<child link="panda_link{child}"/><origin xyz="{at}" rpy="{rpy}"/></joint>'
    )


def _robot(name: str, shapes: tuple[str, ...], joints: list[str]) -> str:
    links = [
        f'<link name="panda_link{n}"><inertial><mass value="2"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
        + "".join(_collision(*shape.split("@")) for shape in several.split("|"))
        + "</link>"
        for n, several in enumerate(shapes)
    ]
    links.append(f'<link name="panda_link{len(shapes)}"/>')
    return f'<robot name="{name}">{"".join(links)}{"".join(joints)}</robot>'


def _collision(geometry: str, at: str) -> str:
    return f'<collision><origin xyz="{at}"/><geometry>{geometry}</geometry></collision>'
