"""The spaces of the behaviours: Chase cells, Escape poses, Haptic rover poses, and the path."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.legend_handler import HandlerBase
from matplotlib.lines import Line2D
from matplotlib.patches import Arc, Circle, FancyArrowPatch, Patch, PathPatch, Rectangle
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Affine2D

from behaviors import haptic
from behaviors.escape import escape_candidates, escape_poses, paper_escape
from behaviors.profile import Policy, Settings
from behaviors.situation import ChaseRing, Situation, timed_cells, weighted_cells
from cobodeck.pictures.drawing import Labels, Sheet, ring_of
from engine.draw import INK, RED
from hw import Joints, Pose2, Pose3, UserPose
from hw.model import Footprint
from hw.scene import Point, contains
from states.environment import Environment
from states.navigation.exact import Array

DEEP = "#1e66ff"
HAPTIC = "#2e7d32"
PATH = "#00838f"
ESCAPE_ARROW_M, RING_M = 0.42, 0.3
DROPPED = "#7f8b98"
BEST_FIRST = mpl.colormaps["rainbow_r"]
"""Purple for the highest weight, red for the lowest (R95)."""


def colours(weights: Array) -> Array:
    """RGBA colours (n, 4) of weights (n,), from red for the least to purple for the greatest."""
    span = float(np.ptp(weights)) if len(weights) else 0.0
    found: Array = BEST_FIRST((weights - weights.min()) / span if span > 0.0 else weights * 0.0 + 1)
    return found


def draw_chase(on: Sheet, environment: Environment, settings: Settings, user: UserPose) -> None:
    """The free Chase cells, coloured by weight (R93-R100); arrows show the robot's yaw there."""
    chase = settings.chase
    centre, yaw = user.body, user.body.yaw
    cells = _cells(environment, settings)
    if not len(cells):
        return
    planner = environment.static_planners["chase"]
    free = np.array([planner.is_free(centre.transform(x, y)) for x, y, _ in cells.tolist()])
    reach = math.ceil(chase.outer / chase.cell)
    image = np.zeros((2 * reach, 2 * reach, 4))
    column, row = np.floor(cells[:, :2] / chase.cell).astype(int).T + reach
    image[row[free], column[free]] = colours(cells[:, 2])[free]
    turned = Affine2D().rotate(yaw).translate(centre.x, centre.y) + on.axes.transData
    side = reach * chase.cell
    on.axes.imshow(
        image, extent=(-side, side, -side, side), origin="lower", interpolation="none",
        transform=turned, zorder=2.5, aspect=on.axes.get_aspect(), clip_on=True,
    )  # fmt: skip
    _draw_tangents(on, centre, cells[free, :2], 0.5 * (chase.inner + chase.outer), chase.cell)
    on.explain("Chase cell: weight low to high", Rainbow(), RainbowHandler())


def _cells(environment: Environment, settings: Settings) -> Array:
    """The cells of the policy's space, (n, 3), each with its weight."""
    chase = settings.chase
    ring = ChaseRing.of(chase)
    if settings.policy == "paper":
        return weighted_cells(ring, chase.best_angle, chase.best_radius)
    cells = timed_cells(environment, settings, ring)
    return np.column_stack((cells[:, :2], 1.0 / cells[:, 2]))


class Rainbow(Patch):
    """The legend's sign for the colours of all cells."""


class RainbowHandler(HandlerBase):
    """Draws a `Rainbow` in a legend."""

    def create_artists(  # noqa: PLR0913
        self,
        legend: Any,  # noqa: ARG002  matplotlib passes it
        orig_handle: Any,  # noqa: ARG002
        xdescent: float,
        ydescent: float,
        width: float,
        height: float,
        fontsize: float,  # noqa: ARG002
        trans: Any,
    ) -> list[Artist]:
        """The strips of the sign, side by side."""
        count = 24
        strip = width / count
        return [
            Rectangle(
                (i * strip - xdescent, -ydescent), 1.05 * strip, height,
                facecolor=BEST_FIRST(i / (count - 1)), lw=0, transform=trans,
            )
            for i in range(count)
        ]  # fmt: skip


def _draw_tangents(on: Sheet, centre: Pose2, free: Array, radius: float, cell: float) -> None:
    """Arrows along the middle circle of the space, where it is free (R99)."""
    for step in range(-12, 12):
        bearing = math.radians(15.0 * step)
        x, y = radius * math.cos(bearing), radius * math.sin(bearing)
        if not len(free) or np.hypot(free[:, 0] - x, free[:, 1] - y).min() > cell:
            continue
        start = centre @ Pose2(x, y, bearing + 0.5 * math.pi)
        on.axes.add_patch(_arrow(start, 0.3, INK, 0.9, zorder=2.7))


def draw_escape(on: Sheet, now: Situation, joints: Joints | None, policy: Policy) -> None:
    """The Escape poses in the room as arrows along the robot's yaw, in order (R106-R110).

    A ring marks the one that a robot with its arm at `joints`, rad, would drive to now by the
    states of this policy.
    """
    environment, settings, user, robot = now.environment, now.settings, now.user, now.pose
    free = escape_poses.poses(settings, environment.static_planners["escape"], user, robot)
    if policy == "paper":
        best = paper_escape.first_in_reach(now, free)
    else:
        best = escape_candidates.candidates(now, free, environment.outline(joints)).goal
    everywhere = enumerate(escape_poses.all_poses(settings.escape, user, robot), 1)
    shown = [
        (n, pose) for n, pose in everywhere if contains(environment.room.outer, pose.x, pose.y)
    ]
    labels = Labels(on, always=True)
    labels.keep_off(_around(robot, environment.robot.footprint))
    for number, pose in shown:
        colour = RED if pose in free else DROPPED
        on.axes.add_patch(_arrow(pose, ESCAPE_ARROW_M, colour, 2.0, zorder=6.0))
        if pose not in free:
            _cross(on, pose, 0.1, DROPPED, zorder=6.05)
        if pose == best:
            ring = Circle((pose.x, pose.y), RING_M, fill=False, ec=RED, lw=1.8, zorder=8.5)
            on.axes.add_patch(ring)
        extent = 2.0 * RING_M if pose == best else 0.55 * ESCAPE_ARROW_M
        labels.mark((pose.x, pose.y), 72.0 * on.scale * extent, str(number), colour, 7.0)
    labels.write()
    on.explain("Escape pose, in order", Line2D([], [], color=RED, lw=2.0, marker=">", ms=6))
    if best is not None:
        sign = Line2D([], [], lw=0, marker="o", mfc="none", mec=RED, mew=1.8, ms=9)
        on.explain("… driven to if raised now", sign)
    if len(free) < len(shown):
        on.explain("… not free", Line2D([], [], color=DROPPED, lw=2.0, marker="x", ms=6))


def _around(pose: Pose2, shape: Footprint) -> list[Point]:
    """The corners of the robot's outline."""
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return [pose.transform(i * shape.half_length, j * shape.half_width) for i, j in signs]


def draw_haptic(
    on: Sheet, environment: Environment, settings: Settings, deep: Pose3, robot: Pose2
) -> None:
    """The rover poses on their half circle, numbered in order, and the DEEP (R75-R77)."""
    shape, planner = settings.haptic, environment.static_planners["haptic"]
    free = set(haptic.poses(settings, planner, deep))
    half = math.degrees(max((abs(angle) for angle in shape.angles), default=0.0))
    yaw, place = math.degrees(deep.yaw), (deep.x, deep.y)
    size = 2.0 * shape.radius
    dashed: dict[str, Any] = {"color": HAPTIC, "lw": 1.0, "ls": (0, (4, 2.5))}
    ring = Arc(place, size, size, theta1=yaw - half, theta2=yaw + half, zorder=5.2, **dashed)
    on.axes.add_patch(ring)
    covered = shapely.Polygon(_around(robot, environment.robot.footprint)).buffer(0.1)
    for number, pose in enumerate(haptic.all_poses(shape, deep), 1):
        colour = HAPTIC if pose in free else DROPPED
        on.axes.add_patch(_arrow(pose @ Pose2(0.17, 0.0), 0.34, colour, 1.6, zorder=6.0))
        on.axes.add_patch(Circle((pose.x, pose.y), 0.09, fc=colour, lw=0, zorder=6.05))
        behind = pose.transform(-0.23, 0.0)
        if not covered.contains(shapely.Point(behind)):
            _number(on, behind, number, colour)
        if pose not in free:
            _cross(on, pose, 0.15, DROPPED, zorder=6.07)
    on.axes.add_patch(Circle(place, 0.1, fc=DEEP, ec="white", lw=0.8, zorder=8.2))
    dot: dict[str, Any] = {"lw": 0, "marker": "o", "mec": "white"}
    on.explain("where the user reaches (DEEP)", Line2D([], [], color=DEEP, ms=7, **dot))
    sign = Line2D([], [], color=HAPTIC, lw=1.6, marker="o", markevery=[0], ms=6)
    on.explain("Haptic pose, in order", sign)
    if len(free) < number:
        on.explain("… not free", Line2D([], [], lw=0, marker="x", mec=DROPPED, mew=1.8, ms=7))


def draw_path(on: Sheet, points: Sequence[Point]) -> None:
    """The path to the goal."""
    if len(points) < 2:
        return
    xs, ys = zip(*points, strict=True)
    on.axes.plot(xs, ys, color="white", lw=4.0, alpha=0.8, zorder=5.0)
    on.axes.plot(xs, ys, color=PATH, lw=2.0, zorder=5.1)
    on.explain("path to the goal", Line2D([], [], color=PATH, lw=2.0))


def draw_goal(on: Sheet, goal: Pose2, shape: Footprint) -> None:
    """The robot's outline at the chosen pose, with a line to its front."""
    look: dict[str, Any] = {"lw": 1.6, "ls": (0, (3, 1.5))}
    outline = ring_of(_around(goal, shape))
    on.axes.add_patch(PathPatch(outline, fc="white", alpha=0.45, lw=0, zorder=5.3))
    on.axes.add_patch(PathPatch(outline, fill=False, ec=PATH, zorder=8.5, **look))
    xs, ys = zip((goal.x, goal.y), goal.transform(shape.half_length, 0.0), strict=True)
    on.axes.plot(xs, ys, color=PATH, lw=1.6, zorder=8.5, marker="o", ms=4, markevery=[0])
    on.explain("chosen pose", Patch(fc="white", ec=PATH, **look))


def _arrow(pose: Pose2, length: float, colour: str, width: float, zorder: float) -> FancyArrowPatch:
    ends = pose.transform(-0.5 * length, 0.0), pose.transform(0.5 * length, 0.0)
    return FancyArrowPatch(
        *ends, color=colour, lw=width, arrowstyle="-|>", mutation_scale=5.0 + 4.0 * width,
        shrinkA=0, shrinkB=0, zorder=zorder,
    )  # fmt: skip


def _cross(on: Sheet, pose: Pose2, size: float, colour: str, zorder: float = 8.4) -> None:
    x, y = pose.x, pose.y
    for sign in (-1, 1):
        ends = (x - size, x + size), (y - sign * size, y + sign * size)
        on.axes.plot(*ends, color=colour, lw=1.8, solid_capstyle="round", zorder=zorder)


def _number(on: Sheet, place: Point, number: int, colour: str) -> None:
    text = on.axes.text(
        *place, str(number), color=colour, fontsize=7, ha="center", va="center",
        fontweight="bold", zorder=8.6, clip_on=True,
    )  # fmt: skip
    text.set_path_effects([withStroke(linewidth=1.6, foreground="white")])
