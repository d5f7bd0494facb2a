"""Robot and user seen from above: where they are, were, and will be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from behaviors.profile import EscapeSettings
from cobodeck.evaluate import ArmOutline
from cobodeck.shapes.moment import TRAIL_S
from cobodeck.shapes.shape import Layer, MapShape, arc, box, flat
from hw import USER_RADIUS, Joints, Pose2, Pose3, UserPose
from hw.model import Footprint
from hw.scene import Point
from states.maps import Array

_CAP_POINTS = 9
_KEPT_STEPS = 4
_NO_PATH = 0.05
_REACH = 0.4
_TRAIL_PARTS = 12


def robot_shapes(pose: Pose2, shape: Footprint) -> list[MapShape]:
    """The outline with its foam, the front marked, and the enclosing circle."""
    length, width, foam = shape.half_length, shape.half_width, shape.foam
    front = length - foam - 0.06
    ahead = [
        pose.transform(*p) for p in ((front, 0.0), (front - 0.22, 0.17), (front - 0.22, -0.17))
    ]
    inner = flat(box(pose, length - foam, width - foam))
    return [
        MapShape("robot", "disc", "ring", (pose.x, pose.y), radius=shape.enclosing_radius),
        MapShape("robot", "poly", "foam", flat(box(pose, length, width)), fill=True),
        MapShape("robot", "poly", "robot", inner, "robot with foam, enclosing circle", fill=True),
        MapShape("robot", "poly", "front", flat(ahead), fill=True),
    ]


def outline_shapes(
    pose: Pose2, shape: Footprint, style: str, layer: Layer = "robot", *, fill: bool = False
) -> list[MapShape]:
    """The outline alone, and a line from its middle to its front."""
    corners = flat(box(pose, shape.half_length, shape.half_width))
    front = flat(((pose.x, pose.y), pose.transform(shape.half_length, 0.0)))
    return [
        MapShape(layer, "poly", style, corners, fill=fill),
        MapShape(layer, "line", style, front),
    ]


def body_shapes(body: Pose2, style: str, *, fill: bool = False) -> list[MapShape]:
    """A person's cylinder, with a line in the direction they face."""
    place = body.x, body.y
    front = flat((place, body.transform(USER_RADIUS, 0.0)))
    return [
        MapShape("user", "disc", style, place, radius=USER_RADIUS, fill=fill),
        MapShape("user", "line", style, front),
    ]


def arm_shapes(base: Pose2, joints: Joints, arm: ArmOutline) -> list[MapShape]:
    """The arm at `joints`, rad, as the capsules of its links, the lowest first."""
    ends, radii = arm.capsules_of(joints)
    order = np.argsort(ends[:, :, 2].mean(axis=1), kind="stable")
    rings = _capsules(base, ends[order, :, :2], radii[order])
    found = []
    for k, ring in zip(order.tolist(), rings.reshape(len(order), -1).tolist(), strict=True):
        held = arm.parts[k] == arm.held
        about = f"held: {arm.held}" if held else "arm"
        points = tuple(ring)
        found.append(MapShape("arm", "poly", "held" if held else "arm", points, about, fill=True))
    return found


def _capsules(base: Pose2, ends: Array, radii: Array) -> Array:
    """Outlines (m, n, 2) in the map of capsules with these ends (m, 2, 2) on a rover at `base`."""
    c, s = math.cos(base.yaw), math.sin(base.yaw)
    ends = ends @ np.array([[c, s], [-s, c]]) + (base.x, base.y)
    along = ends[:, 1] - ends[:, 0]
    half = np.linspace(-0.5 * math.pi, 0.5 * math.pi, _CAP_POINTS)
    bearing = np.arctan2(along[:, 1], along[:, 0])[:, None] + np.concatenate((half, half + math.pi))
    middles = np.repeat(ends[:, ::-1], _CAP_POINTS, axis=1)
    circles = np.stack((np.cos(bearing), np.sin(bearing)), axis=2)
    found: Array = middles + radii[:, None, None] * circles
    return found


def user_shapes(user: UserPose, keep_off: float) -> list[MapShape]:
    """The user with the direction of view, and the distance robots keep from them, m."""
    place, body = (user.body.x, user.body.y), user.body
    view = Pose2(*place, user.head_yaw)
    nose = body.transform(0.36, 0.0), body.transform(0.5, 0.0)
    ahead = view.transform(USER_RADIUS + 0.04, 0.0), view.transform(USER_RADIUS + 0.75, 0.0)
    about, steps = f"{keep_off:g} m: distance kept from the user", range(_KEPT_STEPS)
    radii = [keep_off + (USER_RADIUS - keep_off) * step / _KEPT_STEPS for step in steps]
    return [
        *(
            MapShape("user", "disc", "kept", place, about, radius=r, fill=True, alpha=0.13)
            for r in radii
        ),
        MapShape(
            "user", "disc", "user", place, "user, direction of view", radius=USER_RADIUS, fill=True
        ),
        MapShape("user", "line", "view", flat(nose)),
        MapShape("user", "arrow", "view", flat(ahead)),
    ]


def zone_shapes(user: UserPose, escape: EscapeSettings) -> list[MapShape]:
    """The zones in which a robot triggers Escape while the user walks (R104)."""
    half = escape.half_view
    view = Pose2(user.body.x, user.body.y, user.head_yaw)
    ahead = arc(view, escape.ahead, -half, half)
    zone = flat((*ahead, *arc(view, escape.around, half, 2.0 * math.pi - half)))
    return [
        MapShape("zones", "poly", "zone", zone, fill=True, alpha=0.06),
        MapShape("zones", "poly", "zone", zone, "Escape zones"),
    ]


def deep_shapes(deep: Pose3) -> list[MapShape]:
    """Where the user reaches, and which way."""
    about, place = "where the user reaches (DEEP)", Pose2(deep.x, deep.y, deep.yaw)
    ahead = [place.transform(0.0, 0.0), place.transform(_REACH, 0.0)]
    return [
        MapShape("deep", "arrow", "deep", flat(ahead)),
        MapShape("deep", "disc", "deep", (deep.x, deep.y), about, radius=0.1, fill=True),
    ]


def path_shapes(points: Sequence[Point]) -> list[MapShape]:
    """The path to the goal."""
    return (
        [MapShape("path", "line", "path", flat(points), "path to the goal")] if points[1:] else []
    )


def goal_shapes(goal: Pose2, shape: Footprint) -> list[MapShape]:
    """The robot's outline at the chosen pose, with a line to its front."""
    ring, front = outline_shapes(goal, shape, "goal", "goal")
    return [
        MapShape("goal", "poly", "goal", ring.points, fill=True, alpha=0.45),
        MapShape("goal", "poly", "goal", ring.points, "chosen pose"),
        front,
        MapShape("goal", "disc", "goal", (goal.x, goal.y), radius=0.045, fill=True),
    ]


def trail_shapes(points: Sequence[Point], style: str) -> list[MapShape]:
    """A path already travelled, fading towards its beginning."""
    if not points or max(math.dist(points[0], point) for point in points) < _NO_PATH:
        return []
    cuts = [(len(points) - 1) * part // _TRAIL_PARTS for part in range(_TRAIL_PARTS + 1)]
    about, found = f"path of the last {TRAIL_S:g} s", []
    for part, (low, high) in enumerate(pairwise(cuts), 1):
        if high > low:
            piece, alpha = flat(points[low : high + 1]), 0.08 + 0.5 * part / _TRAIL_PARTS
            found.append(MapShape("trails", "line", style, piece, about, alpha=alpha))
    return found
