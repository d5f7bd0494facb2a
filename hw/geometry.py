"""Poses and velocities in the plane and in space.

Metres, radians, seconds; right-handed frames, x ahead, y left, z up; yaw turns from x towards y.
A pose named `map_from_base` turns coordinates of the base frame into coordinates of the map.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from typing import Annotated, ClassVar, NamedTuple

from engine.files import Angle, Length
from engine.files.declared import Range
from hw.se3 import RigidMotion, act, inverse, product, quaternion_of, unit_quaternion

FAR = 1e4
"""Coordinates beyond this are refused as a mistake, m."""
TURNS = 4.0 * math.pi
"""Angles beyond this are refused, rad: they are probably meant in degrees."""

Coordinate = Annotated[Length, Range(-FAR, FAR)]
"""A coordinate as files and charts write it."""
AnyAngle = Annotated[Angle, Range(-TURNS, TURNS)]
"""An angle as files and charts write it."""

_TURN = 2.0 * math.pi
_VERTICAL = 1.0 - 1e-14
"""Sine of a pitch from which on roll and yaw are lost in rounding: 1e-7 rad from the vertical."""


def wrap(angle: float) -> float:
    """The same angle in (-pi, pi]."""
    if -math.pi < angle <= math.pi:
        return angle
    wrapped = math.fmod(angle, _TURN)
    if wrapped > math.pi:
        return wrapped - _TURN
    if wrapped <= -math.pi:
        return wrapped + _TURN
    return wrapped


def total(values: Iterable[float]) -> float:
    """The sum from left to right; from Python 3.12 on, `sum` makes up for what rounding loses."""
    return reduce(add, values, 0.0)


def unwrap(angle: float, last: float) -> float:
    """The same angle continued from `last`, which is not wrapped: within pi of it."""
    return last + wrap(angle - last)


def _require_finite(what: str, names: str, *values: float) -> None:
    if math.isfinite(sum(values)):
        return
    for name, value in zip(names.split(), values, strict=True):
        if not math.isfinite(value):
            raise ValueError(f"{what}: {name} is {value}; a finite number is needed")


@dataclass(frozen=True, slots=True, init=False)
class Pose2:
    """A pose in the plane: x, y in m and yaw in rad.

    Charts write one as `{x: 2 m, y: 1 m, yaw: 90 deg}` or `{place: kitchen}`.
    """

    named_by: ClassVar[str] = "place"
    """The key with which a chart names one of the scene."""

    x: float
    y: float
    yaw: float

    def __init__(self, x: float, y: float, yaw: float = 0.0) -> None:
        _set_x(self, x)
        _set_y(self, y)
        _set_yaw(self, yaw)

    @classmethod
    def checked(cls, x: float, y: float, yaw: float = 0.0) -> Pose2:
        """A pose from outside data, its yaw wrapped.

        Raises:
            ValueError: a value is NaN or infinite.
        """
        _require_finite("pose", "x y yaw", x, y, yaw)
        return cls(float(x), float(y), wrap(float(yaw)))

    @classmethod
    def written(cls, x: Coordinate, y: Coordinate, yaw: AnyAngle = 0.0) -> Pose2:
        """A pose as charts write it, its yaw wrapped.

        Raises:
            ValueError: a value is NaN or infinite.
        """
        return cls.checked(x, y, yaw)

    def __matmul__(self, other: Pose2) -> Pose2:
        """Composition: `map_from_base @ base_from_tool` is map_from_tool."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(
            self.x + c * other.x - s * other.y,
            self.y + s * other.x + c * other.y,
            wrap(self.yaw + other.yaw),
        )

    def inverse(self) -> Pose2:
        """The inverse: of map_from_base, base_from_map."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return Pose2(-c * self.x - s * self.y, s * self.x - c * self.y, wrap(-self.yaw))

    def transform(self, x: float, y: float) -> tuple[float, float]:
        """A point of this frame, in the frame in which the pose is given, m."""
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        return self.x + c * x - s * y, self.y + s * x + c * y

    def upright(self) -> Pose3:
        """The pose in space, on the floor; `Pose3.flat` leads back."""
        return Pose3(
            self.x, self.y, 0.0, 0.0, 0.0, math.sin(0.5 * self.yaw), math.cos(0.5 * self.yaw)
        )

    def distance_to(self, other: Pose2) -> float:
        """Distance between the two origins, m; yaw does not count."""
        return math.hypot(other.x - self.x, other.y - self.y)

    def is_near(self, other: Pose2, metres: float, radians: float) -> bool:
        """True if two poses differ by less than this, m and rad."""
        return self.distance_to(other) < metres and abs(wrap(other.yaw - self.yaw)) < radians

    def bearing_to(self, other: Pose2) -> float:
        """Direction of the other origin relative to this pose's yaw, rad; 0 is straight ahead."""
        return wrap(math.atan2(other.y - self.y, other.x - self.x) - self.yaw)

    def moved(self, velocity: Twist2, time: float) -> Pose2:
        """The pose after `time` s at a velocity that is given in the pose's parent frame."""
        x, y = self.x + time * velocity.vx, self.y + time * velocity.vy
        return Pose2(x, y, wrap(self.yaw + time * velocity.wz))

    def between(self, other: Pose2, share: float) -> Pose2:
        """Linear interpolation, `share` 0 to 1, by the shorter turn; the yaw is not wrapped."""
        return Pose2(
            self.x + share * (other.x - self.x),
            self.y + share * (other.y - self.y),
            self.yaw + share * wrap(other.yaw - self.yaw),
        )


@dataclass(frozen=True, slots=True)
class Pose3:
    """A pose in space: position in m and a unit quaternion (qx, qy, qz, qw).

    Charts write one as `{x: 1 m, y: 0 m, z: 80 cm, pitch: -90 deg}`; angles as in URDF.
    """

    x: float
    y: float
    z: float
    qx: float = 0.0
    qy: float = 0.0
    qz: float = 0.0
    qw: float = 1.0

    @classmethod
    def checked(
        cls, position: tuple[float, float, float], quaternion: tuple[float, float, float, float]
    ) -> Pose3:
        """A pose from outside data; quaternion is (qx, qy, qz, qw) and is normalised.

        Raises:
            ValueError: a value is NaN or infinite, or the quaternion is not a unit within 1 %.
        """
        _require_finite("pose", "x y z qx qy qz qw", *position, *quaternion)
        x, y, z = (float(p) for p in position)
        return cls(x, y, z, *unit_quaternion(*quaternion))

    @classmethod
    def written(
        cls,
        x: Coordinate,
        y: Coordinate,
        z: Coordinate,
        roll: AnyAngle = 0.0,
        pitch: AnyAngle = 0.0,
        yaw: AnyAngle = 0.0,
    ) -> Pose3:
        """A pose as charts write it: turned about the fixed axes x, y and z in this order (URDF).

        Raises:
            ValueError: a value is NaN or infinite.
        """
        _require_finite("pose", "x y z roll pitch yaw", x, y, z, roll, pitch, yaw)
        return cls.from_angles(x, y, z, (roll, pitch, yaw))

    @classmethod
    def from_yaw(cls, x: float, y: float, z: float, yaw: float) -> Pose3:
        """An upright pose; m and rad."""
        return cls(x, y, z, 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))

    @classmethod
    def from_angles(cls, x: float, y: float, z: float, angles: tuple[float, float, float]) -> Pose3:
        """A pose by roll, pitch and yaw: turns about fixed axes x, y, z in this order, rad."""
        (qx, a), (qy, b), (qz, c) = ((math.sin(0.5 * r), math.cos(0.5 * r)) for r in angles)
        about_z = cls(x, y, z, qz=qz, qw=c)
        return about_z @ cls(0.0, 0.0, 0.0, qy=qy, qw=b) @ cls(0.0, 0.0, 0.0, qx=qx, qw=a)

    @classmethod
    def from_matrix(cls, rows: Sequence[Sequence[float]]) -> Pose3:
        """The pose of the upper rows (3, 4) of a homogeneous matrix."""
        return cls(rows[0][3], rows[1][3], rows[2][3], *quaternion_of(rows))

    @property
    def yaw(self) -> float:
        """Direction of the x axis projected onto the floor, rad."""
        return math.atan2(
            2.0 * (self.qw * self.qz + self.qx * self.qy),
            1.0 - 2.0 * (self.qy * self.qy + self.qz * self.qz),
        )

    @property
    def roll_pitch_yaw(self) -> tuple[float, float, float]:
        """Angles of turns about fixed axes, x, y, z in this order, rad; the pitch within pi / 2.

        With a vertical x axis only the sum or the difference of roll and yaw counts: the roll is 0.
        """
        sine = 2.0 * (self.qw * self.qy - self.qz * self.qx)
        if abs(sine) > _VERTICAL:
            sign = math.copysign(1.0, sine)
            return 0.0, sign * 0.5 * math.pi, wrap(-sign * 2.0 * math.atan2(self.qx, self.qw))
        x, y = self.qw * self.qx + self.qy * self.qz, self.qx * self.qx + self.qy * self.qy
        return math.atan2(2.0 * x, 1.0 - 2.0 * y), math.asin(sine), self.yaw

    def flat(self) -> Pose2:
        """The pose seen from above."""
        return Pose2(self.x, self.y, self.yaw)

    def as_motion(self) -> RigidMotion:
        """The pose as a plain tuple (x, y, z, qx, qy, qz, qw)."""
        return self.x, self.y, self.z, self.qx, self.qy, self.qz, self.qw

    def __matmul__(self, other: Pose3) -> Pose3:
        """Composition: `map_from_base @ base_from_tool` is map_from_tool."""
        return Pose3(*product(self.as_motion(), other.as_motion()))

    def inverse(self) -> Pose3:
        """The inverse: of map_from_base, base_from_map."""
        return Pose3(*inverse(self.as_motion()))

    def transform(self, x: float, y: float, z: float) -> tuple[float, float, float]:
        """A point of this frame, in the frame in which the pose is given, m."""
        return act(self.as_motion(), x, y, z)

    def distance_to(self, other: Pose3) -> float:
        """Distance between the two origins, m."""
        return math.dist((self.x, self.y, self.z), (other.x, other.y, other.z))

    def angle_to(self, other: Pose3) -> float:
        """Angle of the rotation between both orientations, rad, in [0, pi]."""
        *_, qx, qy, qz, qw = (self.inverse() @ other).as_motion()
        return 2.0 * math.atan2(math.hypot(qx, qy, qz), abs(qw))


@dataclass(frozen=True, slots=True, init=False)
class Twist2:
    """A velocity in the plane: vx, vy in m/s and wz in rad/s; the frame depends on its use."""

    vx: float
    vy: float
    wz: float

    def __init__(self, vx: float, vy: float = 0.0, wz: float = 0.0) -> None:
        _set_vx(self, vx)
        _set_vy(self, vy)
        _set_wz(self, wz)

    @classmethod
    def checked(cls, vx: float, vy: float, wz: float) -> Twist2:
        """A velocity from outside data.

        Raises:
            ValueError: a value is NaN or infinite.
        """
        _require_finite("velocity", "vx vy wz", vx, vy, wz)
        return cls(float(vx), float(vy), float(wz))

    @property
    def speed(self) -> float:
        """Length of the translation, m/s."""
        return math.hypot(self.vx, self.vy)

    def rotated(self, yaw: float) -> Twist2:
        """The velocity rotated by yaw, rad: for a base with that yaw, from its frame to the map."""
        c, s = math.cos(yaw), math.sin(yaw)
        return Twist2(c * self.vx - s * self.vy, s * self.vx + c * self.vy, self.wz)

    def scaled_to(self, speed: float, yaw_rate: float) -> Twist2:
        """The velocity scaled as a whole, so that neither limit is exceeded, m/s and rad/s."""
        scale = speed / self.speed if self.speed > speed else 1.0
        if abs(self.wz) * scale > yaw_rate:
            scale = yaw_rate / abs(self.wz)
        return Twist2(scale * self.vx, scale * self.vy, scale * self.wz)


# Slots are set directly: these two classes are created ten thousand times a second.
_set_x, _set_y, _set_yaw = (vars(Pose2)[name].__set__ for name in ("x", "y", "yaw"))
_set_vx, _set_vy, _set_wz = (vars(Twist2)[name].__set__ for name in ("vx", "vy", "wz"))
STILL = Twist2(0.0, 0.0, 0.0)


def displacement_of(velocity: Twist2, time: float) -> Pose2:
    """Displacement by a constant velocity in the moving frame, over `time` s: an arc.

    The integral of R(wz s) (vx, vy): (a -b; b a) (vx, vy) time, with a = sin(t)/t and b = (1 -
    cos(t))/t for the turn t.
    """
    turn = velocity.wz * time
    along, across = 1.0, 0.5 * turn
    if abs(turn) >= 1e-9:
        sine = math.sin(0.5 * turn)
        along, across = math.sin(turn) / turn, 2.0 * (sine * sine) / turn
    x, y = velocity.vx * time, velocity.vy * time
    return Pose2(along * x - across * y, across * x + along * y, wrap(turn))


def velocity_of(moved: Pose2, time: float) -> Twist2:
    """The constant velocity in the moving frame that gives this displacement in `time` s.

    Inverts `displacement_of`: (h cot h, h; -h, h cot h) / time with h half the turn.
    """
    half = 0.5 * moved.yaw
    along = 1.0 - half * half / 3.0 if abs(half) < 1e-4 else half / math.tan(half)
    x, y = along * moved.x + half * moved.y, along * moved.y - half * moved.x
    return Twist2(x / time, y / time, moved.yaw / time)


class Outline(NamedTuple):
    """Bounding rectangle of the robot, its sides parallel to the axes of the base frame, m.

    Distances of its sides from base_link, all positive.
    """

    front: float
    back: float
    left: float
    right: float

    def distance(self, x: float, y: float) -> float:
        """Distance of a point (base frame) from the rectangle, m; 0 inside."""
        along = max(x - self.front, -self.back - x, 0.0)
        across = max(y - self.left, -self.right - y, 0.0)
        return math.hypot(along, across)
