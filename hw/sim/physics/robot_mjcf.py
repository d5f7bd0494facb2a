"""The robot as a model in MuJoCo's XML (MJCF), from its file.

A Mecanum wheel touches the floor with one roller, whose axis stays at 45 degrees in the base frame,
wherever the wheel has turned to. Here it is a sphere on two hinges, one after the other: the
roller's, free and along that axis, and the hub's, driven. A turn of the first moves the point of
contact across the roller's axis without force, so that Coulomb friction acts along the axis alone,
as on the roller. The angle of the roller's hinge is set back to 0 after each step (the sphere looks
the same), and the axes stay where they are. Without slip this gives the usual kinematics,

    r w = vx + s t vy + (s t x - y) wz   for a wheel at (x, y) with rollers along (1, s t),

as the velocity of the point of contact, (vx - y wz - r w, vy + x wz), has no part along them. Here
s is a sign and t the tangent of their angle, 1 for 45 degrees.

MuJoCo's contacts are soft and convex: what slides is lifted by the share impratio^-1/2 of the slip
that friction would stop within its time constant, and what holds creeps. With the values below
locked wheels stop within 1 % of v^2 / (2 a), hop by less than 0.3 mm, and a base that speeds up by
2 m/s2 creeps by 1 mm per metre. The Euler integrator is needed: the implicit ones solve contacts
without the damping of drives, so that the wheels slid by 9 mm per metre.
"""

from __future__ import annotations

from collections.abc import Iterator

from hw.geometry import Pose3
from hw.model import ArmModel, Placement, Prop, RobotModel
from hw.sim.physics.mechanics import GRAVITY, WHEELS, Mechanics, WheelGeometry

_POINT = 1e-6
"""Inertia of a point mass, kg m2: MuJoCo takes none of 0."""
_CONTACT = 'solref="0.01 1" solreffriction="0.1 1" solimp="0.5 0.5 0.001"'
"""Of wheel and floor. Its time constants, s: normal to the floor, where the robot then sinks in by
0.26 mm, as on rollers of 1.2e6 N/m, and along it; the second number is critical damping. See the
module."""


def robot_mjcf(robot: RobotModel, mechanics: Mechanics, geometry: WheelGeometry) -> str:
    """The text of the model: a floor, the base on its wheels, the arm with its prop.

    The base's frame is the rover's: on the floor, x ahead. The mass of the robot file is that of
    everything; the chassis has what wheels, arm and prop leave, as a box within the foam.
    """
    wheels = "".join(_wheel(robot, mechanics, geometry, n) for n in range(len(WHEELS)))
    contacts = "".join(
        f'<pair geom1="floor" geom2="wheel_{n}" condim="3" '
        f'friction="{mechanics.friction!r} {mechanics.friction!r} 1e-5 1e-5 1e-5" {_CONTACT}/>'
        for n in range(len(WHEELS))
    )
    arm = "" if robot.arm is None else _arm(robot.arm, robot.prop, mechanics)
    return f"""<mujoco model="{robot.name}">
<compiler angle="radian" inertiafromgeom="false" boundmass="1e-6" boundinertia="1e-9"/>
<option timestep="{mechanics.step!r}" gravity="0 0 -{GRAVITY}" integrator="Euler"
 cone="elliptic" impratio="1e4" tolerance="1e-10"/>
<worldbody><geom name="floor" type="plane" size="0 0 1" contype="0" conaffinity="0"/>
<body name="rover"><freejoint name="rover"/>{_chassis(robot, mechanics)}
{wheels}
{arm}</body></worldbody>
<contact>{contacts}</contact>
<actuator>{"".join(_actuators(robot, mechanics))}</actuator></mujoco>"""


def _numbers(*values: float) -> str:
    return " ".join(map(repr, map(float, values)))


def _place(pose: Pose3) -> str:
    x, y, z, i, j, k, w = pose.as_motion()
    return f'pos="{_numbers(x, y, z)}" quat="{_numbers(w, i, j, k)}"'


def _chassis(robot: RobotModel, mechanics: Mechanics) -> str:
    """A uniform box within the foam, from the floor up to the arm, or as high as it is wide."""
    outline, rest = robot.footprint, robot.mass - len(WHEELS) * mechanics.roller_mass
    length, width = outline.length - 2.0 * outline.foam, outline.width - 2.0 * outline.foam
    height = width
    if robot.arm is not None:
        height = robot.arm.mount.xyz[2]
        rest -= sum(link.mass for link in robot.arm.model.masses.values())
    if robot.prop is not None:
        rest -= robot.prop.mass
    x, y, z = (a * a * rest / 12.0 for a in (length, width, height))
    return (
        f'<inertial pos="0 0 {0.5 * height!r}" mass="{rest!r}" '
        f'diaginertia="{_numbers(y + z, x + z, x + y)}"/>'
    )


def _wheel(robot: RobotModel, mechanics: Mechanics, geometry: WheelGeometry, number: int) -> str:
    ahead, left, sign = WHEELS[number]
    base, weight = robot.base, 0.25 * robot.mass * GRAVITY
    radius, mass = geometry.radius, mechanics.roller_mass
    torque = mechanics.wheel_torque(base)
    place = _numbers(ahead * geometry.half_wheelbase, left * geometry.half_track, radius)
    return f"""<body name="wheel_{number}" pos="{place}">
<inertial pos="0 0 0" mass="{mass!r}" diaginertia="{_numbers(*3 * [mass * radius**2])}"/>
<joint name="roller_{number}" axis="1 {sign * geometry.tangent!r} 0"/>
<joint name="hub_{number}" axis="0 1 0" armature="{mechanics.wheel_inertia!r}"
 frictionloss="{base.rolling_resistance * weight * radius!r}"
 actuatorfrcrange="{_numbers(-torque, torque)}"/>
<geom name="wheel_{number}" type="sphere" size="{radius!r}" contype="0" conaffinity="0"/></body>
"""


def _arm(arm: ArmModel, prop: Prop | None, mechanics: Mechanics) -> str:
    """The links one in another, from the shoulder on.

    A mass is in the frame of its link, and so is the prop, which is fixed to the last.
    """
    text, shape = "", arm.model
    if prop is not None and prop.mass > 0.0:
        flange = "" if shape.flange == Placement() else f" {_place(shape.flange.pose())}"
        text = (
            f'<body name="prop"{flange}>'
            f'<inertial pos="{_numbers(*prop.center_of_mass)}" mass="{prop.mass!r}" '
            f'diaginertia="{_numbers(*3 * [_POINT])}"/></body>'
        )
    chain = arm.calibration or shape.placements
    for n in reversed(range(len(chain))):
        link, torque = shape.masses[shape.links[n + 1]], shape.max_torque[n]
        pose = chain[n].pose()
        if n == 0:
            pose = arm.mount.pose() @ pose
        text = f"""<body name="link_{n + 1}" {_place(pose)}>
<inertial pos="{_numbers(*link.center)}" mass="{link.mass!r}"
 fullinertia="{_numbers(*link.inertia)}"/>
<joint name="joint_{n}" axis="0 0 1" armature="{mechanics.rotor_inertia!r}"
 actuatorfrcrange="{_numbers(-torque, torque)}"/>{text}</body>"""
    return text


def _actuators(robot: RobotModel, mechanics: Mechanics) -> Iterator[str]:
    """Both parts of each drive, then the torques of the arm; they are limited at the joints."""
    gain, integral = mechanics.drive_gains(robot)
    for n in range(len(WHEELS)):
        yield f'<velocity joint="hub_{n}" kv="{gain!r}"/>'
    for n in range(len(WHEELS)):
        yield (
            f'<general joint="hub_{n}" dyntype="integrator" gainprm="{integral!r}" '
            f'biastype="affine" biasprm="0 {-integral!r} 0"/>'
        )
    if robot.arm is not None:
        for n in range(len(robot.arm.model.joints)):
            yield f'<motor joint="joint_{n}"/>'
