"""The person beside the arm: what is known of them, and what the arm keeps clear of.

The body is the cylinder of R23, made slimmer where a DEEP has been granted: a DEEP nearer to the
user than half a metre would lie inside it. Tracked heads are balls, tracked arms capsules from the
shoulder to the hand. On its way to a stand-off the arm keeps a gap to them, and does not swing
behind the DEEP; on the line to the DEEP, where the prop is meant to meet the hand, it does not
touch them, and the hand ends just before the DEEP.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from hw import USER_RADIUS, Joints, Pose2, Pose3, UserPose, total
from hw.model import Point3
from states.arm.kinematics import Cylinder, Limb, Wall

USER_HEIGHT = 2.0
"""Height of the user's cylinder, m."""
TOUCH_GAP = 0.15
"""Gap between the user's cylinder and a granted DEEP, m; the arm comes from the other side."""
SLIMMEST = 0.25
"""Least radius of the slimmed cylinder, m: a person's body."""

HEAD_RADIUS, ARM_RADIUS = 0.15, 0.05
"""Radius of a head with its display, and of an arm, m."""
HEAD_GAP, ARM_GAP = 0.10, 0.05
"""Gap kept to them on the way to a stand-off, m."""
SHOULDER_HEIGHT, BELOW_HEAD, SHOULDER_HALF_WIDTH = 1.40, 0.25, 0.19
"""Height of the shoulders, m, or their distance below a tracked head, and half of their width."""

BEHIND = 0.25
"""Distance of the centre of the ball behind a DEEP, m."""
BALL_OVER_LINE = 0.21
"""Radius of that ball less the length of the line, m: it ends 4 cm before the stand-off."""
SHORT_LINE = 0.12
"""Before the stand-off of a shorter line the ball would be too small: a wall takes its place, m."""
WALL_BEHIND, WALL_HALF_WIDTH = 0.02, 0.30
"""Distance of that wall behind the DEEP and half of its width, m."""
LEVEL = 0.2
"""Sine of the angle to the floor up to which the axis of a DEEP counts as level."""
LINE_OVER_ARM = 0.01
"""Least length of the line beyond the gap kept to the arm, m, so that the stand-off is free."""
HAND_BEFORE = 0.10
"""Distance from the DEEP at which the arm ends on the line, m: the hand is what the prop meets."""

LIMBS_MOVED = 0.03
"""Motion of head or hands, m, from which the running trajectory is checked again."""
_UNTRACKED = (None, None, None)


@dataclass(frozen=True, slots=True)
class ArmSituation:
    """map_from_base, the user's body, head and hands in the map (None: unknown), joints at rest."""

    base: Pose2
    user: Pose2 | None
    joints: Joints
    head: Point3 | None = None
    left_hand: Point3 | None = None
    right_hand: Point3 | None = None

    @classmethod
    def of(cls, base: Pose2, user: UserPose | None, joints: Joints) -> ArmSituation:
        """The situation with a person as they were measured."""
        if user is None:
            return cls(base, None, joints)
        head, left, right = user.head, user.left_hand, user.right_hand
        if head is left is right is None:
            return cls(base, user.body, joints)
        return cls(base, user.body, joints, _point(head), _point(left), _point(right))

    def is_like(self, other: ArmSituation, distance: float, turn: float) -> bool:
        """True if base and user have moved less than this, m and rad; joints do not count."""
        here, there = self.user, other.user
        if here is None or there is None:
            if here is not there:
                return False
        elif here is not there and not here.distance_to(there) < distance:
            return False
        if self.base is not other.base and not self.base.is_near(other.base, distance, turn):
            return False
        limbs = (
            (self.head, other.head),
            (self.left_hand, other.left_hand),
            (self.right_hand, other.right_hand),
        )
        for a, b in limbs:  # noqa: SIM110  a generator costs a call for each
            if a is not b and not _is_near(a, b):
                return False
        return True

    def shoulder(self, side: float) -> Point3:
        """The left (1) or right (-1) shoulder, m."""
        assert self.user is not None
        x, y = self.user.transform(0.0, side * SHOULDER_HALF_WIDTH)
        return x, y, SHOULDER_HEIGHT if self.head is None else self.head[2] - BELOW_HEAD

    def limbs(self) -> tuple[Limb | None, ...]:
        """Head, left and right arm, from the shoulder on, in the map; None: it is not tracked."""
        points = self.head, self.left_hand, self.right_hand
        if self.user is None or points == _UNTRACKED:
            return ()
        tracked = iter(person_obstacles(self, None).limbs)
        return tuple([None if point is None else next(tracked) for point in points])


@dataclass(frozen=True, slots=True)
class PersonObstacles:
    """The shapes of a person, and a wall behind the DEEP that is theirs, in the map."""

    cylinders: tuple[Cylinder, ...] = ()
    limbs: tuple[Limb, ...] = ()
    walls: tuple[Wall, ...] = ()

    def slim(self) -> PersonObstacles:
        """The body alone, as slim as it gets."""
        return PersonObstacles(tuple(replace(body, radius=SLIMMEST) for body in self.cylinders))


NOBODY = PersonObstacles()


def person_obstacles(
    situation: ArmSituation, deep: Pose3 | None, length: float | None = None
) -> PersonObstacles:
    """What the arm keeps clear of on its way to a DEEP (map_from_deep), or back without one.

    `length` of a line: on the way to the stand-off at this distance from the DEEP, m; 0: straight
    to the DEEP, but not from behind it.
    """
    user = situation.user
    if user is None:
        return NOBODY
    limbs = []
    if situation.head is not None:
        gap = HEAD_GAP if length else 0.0
        limbs.append(Limb(situation.head, situation.head, HEAD_RADIUS + gap))
    for side, hand in ((1.0, situation.left_hand), (-1.0, situation.right_hand)):
        if hand is not None:
            limbs.append(_arm(situation.shoulder(side), hand, deep, length))
    walls: tuple[Wall, ...] = ()
    if deep is not None and length is not None:
        if length >= SHORT_LINE or not _is_level(deep):
            behind = deep.transform(-BEHIND, 0.0, 0.0)
            limbs.append(Limb(behind, behind, BALL_OVER_LINE + length))
        else:
            walls = (_wall_behind(deep.flat()),)
    return PersonObstacles((cylinder(user, deep),), tuple(limbs), walls)


def _is_level(deep: Pose3) -> bool:
    return abs(deep.transform(1.0, 0.0, 0.0)[2] - deep.z) < LEVEL


def _wall_behind(deep: Pose2) -> Wall:
    left, right = (deep.transform(-WALL_BEHIND, side * WALL_HALF_WIDTH) for side in (1.0, -1.0))
    return (*left, *right)


def cylinder(user: Pose2, deep: Pose3 | None) -> Cylinder:
    """The user's body, slimmer where it would hold the DEEP."""
    radius = USER_RADIUS if deep is None else slimmed(user.distance_to(deep.flat()))
    return Cylinder(user.x, user.y, radius, USER_HEIGHT)


def slimmed(distance: float) -> float:
    """Radius of the body of a user whom the prop meets at this distance from their centre, m."""
    return min(USER_RADIUS, max(SLIMMEST, distance - TOUCH_GAP))


def _arm(shoulder: Point3, hand: Point3, deep: Pose3 | None, length: float | None) -> Limb:
    if deep is None or not length:
        return Limb(shoulder, _before(shoulder, hand, deep), ARM_RADIUS)
    return Limb(shoulder, hand, min(ARM_RADIUS + ARM_GAP, length - LINE_OVER_ARM))


def _before(shoulder: Point3, hand: Point3, deep: Pose3 | None) -> Point3:
    """The hand, or the last point before it that is HAND_BEFORE from the DEEP.

    From shoulder s towards hand h the distance to the DEEP d is HAND_BEFORE at the roots of
    |s - d + t (h - s)|^2 = HAND_BEFORE^2; the smaller counts if it lies between 0 and 1.
    """
    if deep is None:
        return hand
    way = [b - a for a, b in zip(shoulder, hand, strict=True)]
    off = [a - b for a, b in zip(shoulder, (deep.x, deep.y, deep.z), strict=True)]
    a = total(w * w for w in way)
    b = total(w * o for w, o in zip(way, off, strict=True))
    c = total(o * o for o in off) - HAND_BEFORE**2
    square = b * b - a * c
    if a <= 0.0 or square <= 0.0 or c <= 0.0:  # no way, past it, or a shoulder inside
        return hand
    t = (-b - math.sqrt(square)) / a
    if not 0.0 <= t <= 1.0:
        return hand
    x, y, z = (s + t * w for s, w in zip(shoulder, way, strict=True))
    return x, y, z


def _point(pose: Pose3 | None) -> Point3 | None:
    return None if pose is None else (pose.x, pose.y, pose.z)


def _is_near(a: Point3 | None, b: Point3 | None) -> bool:
    return a is not None and b is not None and math.dist(a, b) < LIMBS_MOVED
