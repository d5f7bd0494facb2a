"""Robot and user seen from above."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch, PathPatch

from behaviors.profile import EscapeSettings
from cobodeck.pictures.drawing.canvas import Sheet
from cobodeck.pictures.drawing.moment import TRAIL_S
from cobodeck.pictures.drawing.room_drawing import ring_of
from engine.draw import INK, RED
from hw import USER_RADIUS, Pose2, UserPose
from hw.model import Footprint
from hw.scene import Point

USER = "#123f8c"
USER_NEAR = "#3f7fd0"
ROBOT = "#f4a522"
FOAM = "#ffe0a3"
ROBOT_TRAIL = "#c77700"

_NO_PATH = 0.05
VIEW = "#5c6773"


def draw_user(on: Sheet, user: UserPose, keep_off: float) -> None:
    """The user as a disc with the direction of view, and the distance robots keep from them, m."""
    place = (user.body.x, user.body.y)
    steps = 4
    for step in range(steps):
        radius = keep_off + (USER_RADIUS - keep_off) * step / steps
        on.axes.add_patch(Circle(place, radius, color=USER_NEAR, alpha=0.13, lw=0, zorder=4.0))
    on.axes.add_patch(
        Circle(place, USER_RADIUS, facecolor=USER, edgecolor="white", lw=0.8, zorder=7.0)
    )
    nose = _ahead(user.body, 0.36), _ahead(user.body, 0.5)
    on.axes.plot(*zip(*nose, strict=True), color="white", lw=1.6, zorder=7.1)
    start = Pose2(*place, user.head_yaw)
    view = FancyArrowPatch(
        _ahead(start, USER_RADIUS + 0.04), _ahead(start, USER_RADIUS + 0.75), color=VIEW, lw=2.2,
        arrowstyle="-|>", mutation_scale=13, shrinkA=0, shrinkB=0, zorder=7.0,
    )  # fmt: skip
    on.axes.add_patch(view)
    on.explain("user, direction of view", Patch(facecolor=USER))
    shade = Patch(facecolor=USER_NEAR, alpha=0.3)
    on.explain(f"{keep_off:g} m: distance kept from the user", shade)


def draw_zones(on: Sheet, user: UserPose, escape: EscapeSettings) -> None:
    """The zones in which a robot triggers Escape while the user walks (R104)."""
    half = escape.half_view
    view = Pose2(user.body.x, user.body.y, user.head_yaw)
    ahead = _arc(view, escape.ahead, -half, half)
    around = _arc(view, escape.around, half, 2.0 * math.pi - half)
    dashed: dict[str, Any] = {"ec": RED, "lw": 0.9, "ls": (0, (4, 2.5))}
    zone = ring_of([*ahead, *around])
    on.axes.add_patch(PathPatch(zone, fc=RED, alpha=0.06, lw=0, zorder=3.0))
    on.axes.add_patch(PathPatch(zone, fill=False, zorder=4.6, **dashed))
    on.explain("Escape zones", Line2D([], [], color=RED, lw=0.9, ls=(0, (4, 2.5))))


def _arc(centre: Pose2, radius: float, low: float, high: float) -> list[Point]:
    count = max(2, math.ceil((high - low) / math.radians(3.0)) + 1)
    angles = (low + (high - low) * i / (count - 1) for i in range(count))
    return [centre.transform(radius * math.cos(a), radius * math.sin(a)) for a in angles]


def draw_robot(on: Sheet, pose: Pose2, shape: Footprint) -> None:
    """The outline with its foam, the front marked, and the enclosing circle."""

    def box(half_length: float, half_width: float) -> list[Point]:
        signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
        return [pose.transform(i * half_length, j * half_width) for i, j in signs]

    place, foam = (pose.x, pose.y), shape.foam
    ring = Circle(place, shape.enclosing_radius, fill=False, ec=INK, lw=0.7, ls=":", zorder=6.0)
    on.axes.add_patch(ring)
    outer = box(shape.half_length, shape.half_width)
    on.axes.add_patch(PathPatch(ring_of(outer), fc=FOAM, ec=INK, lw=0.8, zorder=6.1))
    inner = box(shape.half_length - foam, shape.half_width - foam)
    on.axes.add_patch(PathPatch(ring_of(inner), fc=ROBOT, ec=INK, lw=0.8, zorder=6.2))
    front = shape.half_length - foam - 0.06
    arrow = [
        pose.transform(*p) for p in ((front, 0.0), (front - 0.22, 0.17), (front - 0.22, -0.17))
    ]
    on.axes.add_patch(PathPatch(ring_of(arrow), fc=INK, ec=INK, lw=0.5, zorder=6.3))
    on.explain("robot with foam, enclosing circle", Patch(facecolor=ROBOT, edgecolor=INK, lw=0.8))


def draw_trail(on: Sheet, points: Sequence[Point], colour: str) -> None:
    """A path already travelled, fading towards its beginning."""
    if not points or max(math.dist(points[0], point) for point in points) < _NO_PATH:
        return
    parts = 12
    on.explain(f"path of the last {TRAIL_S:g} s", Line2D([], [], color=colour, lw=2.4, alpha=0.5))
    for part in range(parts):
        low, high = (len(points) - 1) * part // parts, (len(points) - 1) * (part + 1) // parts
        if high > low:
            xs, ys = zip(*points[low : high + 1], strict=True)
            style: dict[str, Any] = {"color": colour, "lw": 2.4, "solid_capstyle": "butt"}
            on.axes.plot(xs, ys, alpha=0.08 + 0.5 * (part + 1) / parts, zorder=4.8, **style)


def _ahead(pose: Pose2, distance: float) -> Point:
    return pose.transform(distance, 0.0)
