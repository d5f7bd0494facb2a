"""Numerical stability as curves: errors over offset, time and steps, conditions near singularities.

What is computed far from the origin or long after the start is compared with the same at home. Near
a singularity the condition number tells by how much errors of the input may grow, and beside it
stands the error that remains. `float32` is what rounding the input to single precision does.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from cobodeck.bench.harness import ROUNDS, BenchRow
from hw import Pose2, wrap
from hw.model import load_robot
from hw.motion import Motion
from hw.scene import Room
from states.arm.description import manipulator_of
from states.arm.kinematics import deviation, forward, inverse, jacobian
from states.localization.filter import (
    SLIPPING,
    Measurement,
    MeasurementSource,
    PlanarFilter,
    planar_config,
)
from states.localization.matching import match
from states.localization.wheels import WheelMotion
from states.maps import Array, room_field
from states.navigation.exact import ExactPlanner

NAME = "stability"
OFFSETS_M = tuple(10.0**k for k in range(8))
STAMPS_S = (1.0, 1e3, 8.64e4, 3.15e7, 1.7e9, 9e9)
"""From a second over a day and a year to now, since 1970, and nearly all that 64 bits hold."""
STEPS = tuple(10**k for k in range(2, 7))
FROM_SINGULAR = tuple(10.0**k for k in range(-12, 0))
ANGLES = (1e-4, 1e-3, 1e-2, 0.1, 0.2, 0.4, 0.8)
LONG, NOTHING = 40.0, 1e17
"""Length of a corridor, m, and the condition of what is not known at all."""
RATIOS = tuple(10.0**k for k in range(0, 13, 2))
HOME = "the same at the origin"
JOINTS = (0.4, -1.2, 1.5, -0.9, 1.3, 0.2)
ROOM = ((0.0, 0.0), (12.0, 0.0), (12.0, 10.0), (0.0, 10.0))
COLUMN = ((5.0, 4.6), (5.4, 4.6), (5.4, 5.2), (5.0, 5.2))


def rows(rounds: int = ROUNDS) -> Iterator[BenchRow]:  # noqa: ARG001  nothing here is timed
    """All curves; each row is a point, its error against what is exact or at home."""
    yield from _over_offset()
    yield from _over_stamps()
    yield from _over_steps()
    yield from _near_singular_arms()
    yield from _open_directions()
    yield from _unequal_axes()


def _row(name: str, variant: str, knob: str, at: float, error: float, unit: str) -> BenchRow:
    reference = HOME if knob in ("offset_m", "stamp_s") else "exact"
    return BenchRow(
        NAME, name, variant, knob, at, error=error, error_unit=unit, reference=reference
    )


def _over_offset() -> Iterator[BenchRow]:
    """Errors of places by how far the origin is away; float64 itself has steps of 2e-16 of it."""
    for name, answers in {
        "path": _path, "scan match": _matched, "filter": _filtered, "velocity": _velocity,
    }.items():  # fmt: skip
        home = answers(0.0)
        for offset in OFFSETS_M:
            off = float(np.abs(answers(offset) - home).max())
            yield _row(name, "cobodeck", "offset_m", offset, off, "m")
    for offset in OFFSETS_M:
        single = abs(float(np.float32(offset + 1.1)) - (offset + 1.1))
        yield _row("coordinate", "float32", "offset_m", offset, single, "m")
        yield _row("coordinate", "float64", "offset_m", offset, math.ulp(offset), "m")


def _ring(ring: tuple[tuple[float, float], ...], off: float) -> tuple[tuple[float, float], ...]:
    return tuple((x + off, y + off) for x, y in ring)


def _path(off: float) -> Array:
    planner = ExactPlanner(_ring(ROOM, off), (_ring(COLUMN, off),), inflation_radius=0.77)
    path = planner.plan((2.0 + off, 5.0 + off), (9.0 + off, 4.7 + off))
    assert path is not None
    return np.asarray(path.line[:, :2] - off)


def _matched(off: float) -> Array:
    room, here = Room(_ring(ROOM, off), columns=(_ring(COLUMN, off),)), Pose2(3.0, 3.0, 0.4)
    points = np.array([here.inverse().transform(x, y) for x, y in _seen()])
    start = Pose2(3.1 + off, 2.95 + off, 0.43)
    found = match(room_field(room), points, start, np.diag([0.04, 0.04, 0.01])).map_from_base
    return np.array([found.x - off, found.y - off])


def _seen() -> list[tuple[float, float]]:
    """Points on the walls."""
    shares = np.linspace(0.02, 0.98, 45).tolist()
    sides = zip(ROOM, ROOM[1:] + ROOM[:1], strict=True)
    return [(a + s * (c - a), b + s * (d - b)) for (a, b), (c, d) in sides for s in shares]


def _filtered(off: float) -> Array:
    source = MeasurementSource("pose", ("x", "y", "yaw"), gate=None)
    filter_ = PlanarFilter(planar_config(source))
    for k in range(50):
        values = (2.0 + 0.02 * k + off, 3.0 + off, wrap(3.0 + 0.01 * k))
        filter_.correct(Measurement(k * 20_000_000, "pose", values, (1e-4, 1e-4, 1e-4)))
    return np.array([filter_.pose.x - off, filter_.pose.y - off])


def _velocity(off: float) -> Array:
    motion = Motion(0.3)
    for k in range(30):
        motion.add_pose(k * 20_000_000, off + 0.03 * k, off - 0.01 * k, 0.0)
    assert motion.velocity is not None
    return np.array([motion.velocity.vx, motion.velocity.vy])


def _over_stamps() -> Iterator[BenchRow]:
    """The speed by wheels; beside it, what stamps kept as float64 would make of 1 m/s."""
    for stamp in STAMPS_S:
        since, apart = round(stamp * 1e9) + 123_456_789, 20_000_001
        wheels = WheelMotion(SLIPPING)
        for k in range(20):
            wheels.add_odometry(since + k * apart, Pose2(k * apart * 1e-9, 0.0))
        speed = wheels.trail.last_velocity().vx
        yield _row("speed by wheels", "cobodeck", "stamp_s", stamp, abs(speed - 1.0), "m/s")
        span = float(since + apart) - float(since)
        off = abs(apart / span - 1.0)
        yield _row("speed by wheels", "float64 stamps", "stamp_s", stamp, off, "m/s")


def _over_steps() -> Iterator[BenchRow]:
    """Rounding of a pose that is composed of so many steps on a circle of 1.8 m."""
    step, turn = Pose2(0.02, 0.001, 0.011), complex(math.cos(0.011), math.sin(0.011))
    pose, done = Pose2(0.0, 0.0), 0
    for count in STEPS:
        for _ in range(count - done):
            pose = pose @ step
        done = count
        exact = complex(0.02, 0.001) * (1.0 - turn**count) / (1.0 - turn)
        off = math.hypot(pose.x - exact.real, pose.y - exact.imag)
        yield _row("composed steps", "cobodeck", "steps", count, off, "m")


def _near_singular_arms() -> Iterator[BenchRow]:
    """Inverse kinematics with a straight wrist and a straight elbow, so many rad off."""
    arm = manipulator_of(load_robot("rbkairos_ur10"))
    for name, joint in (("wrist", 4), ("elbow", 2)):
        for off in FROM_SINGULAR:
            joints = np.array(JOINTS)
            joints[joint] = off
            pose, slopes = forward(arm, joints), jacobian(arm, joints)
            condition = float(np.linalg.cond(slopes))
            knob = "from_singular_rad"
            yield _row(f"{name}, Jacobian", "cobodeck", knob, off, condition, "condition")
            for variant, told in (("cobodeck", pose), ("float32", pose.astype(np.float32))):
                found = inverse(arm, told).branches()
                missed = deviation(forward(arm, found), pose[None])[0].min() if len(found) else 1.0
                yield _row(f"{name}, tool", variant, knob, off, float(missed), "m")


def _open_directions() -> Iterator[BenchRow]:
    """Two walls that are so many rad from parallel: the information of a match in between.

    Along walls that are as good as parallel it claims nothing (`NOTHING`).
    """
    for angle in ANGLES:
        rise = LONG * math.tan(0.5 * angle)
        ring = ((0.0, 0.0), (LONG, rise), (LONG, 4.0 + rise), (0.0, 4.0 + 2.0 * rise))
        here = Pose2(0.5 * LONG, 2.0 + rise)
        shares = np.linspace(0.4, 0.6, 90).tolist()
        places = [(s * LONG, s * rise) for s in shares]
        places += [(s * LONG, 4.0 + (2.0 - s) * rise) for s in shares]
        points = np.array([here.inverse().transform(x, y) for x, y in places])
        known = match(room_field(Room(ring)), points, here, np.diag([0.01, 0.01, 0.01])).information
        condition = min(NOTHING, float(np.linalg.cond(known[:2, :2])))
        name = "walls of a corridor, match"
        yield _row(name, "cobodeck", "angle_rad", angle, condition, "condition")


def _unequal_axes() -> Iterator[BenchRow]:
    """A filter that knows one direction so many times better: condition, and error of the pose."""
    for ratio in RATIOS:
        source = MeasurementSource("pose", ("x", "y", "yaw"), gate=None)
        filter_ = PlanarFilter(planar_config(source))
        fine, coarse = 1e-3, 1e-3 * math.sqrt(ratio)
        c, s = math.cos(0.7), math.sin(0.7)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        covariance = turn @ np.diag([fine**2, coarse**2, 1e-4]) @ turn.T
        for k in range(100):
            told = Measurement(k * 10_000_000, "pose", (2.0, 3.0, 3.1), covariance)
            filter_.correct(told)
        condition = float(np.linalg.cond(filter_.covariance[:2, :2]))
        off = math.hypot(filter_.pose.x - 2.0, filter_.pose.y - 3.0)
        name = "filter, covariance"
        yield _row(name, "cobodeck", "variance_ratio", ratio, condition, "condition")
        yield _row("filter, constant pose", "cobodeck", "variance_ratio", ratio, off, "m")
