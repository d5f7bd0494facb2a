"""Judged events from above: what the robot did, and the best it could have done.

One panel per event: both ways of the robot, the person's way in the future that decides, a mark
each half second, and the robot's outline where it is nearest to the person.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Polygon

from cobodeck.avoidable import (
    RADIUS,
    Array,
    JudgedEvent,
    JudgedRun,
    RecordedRun,
    RobotLimits,
    way_distance,
)
from engine.draw import GREY, INK, RED

REAL, BEST, PERSON, RECORDED = "#c77700", "#2e7d32", "#123f8c", "#7fb2f0"
PANEL_IN, COLUMNS, MOST = 3.3, 4, 60
MARK_S = 0.5
_MARGIN_M = 0.9


Event = tuple[RecordedRun, JudgedEvent]


def events_of(runs: Iterable[JudgedRun]) -> list[Event]:
    """The events of judged runs that are drawn: the first MOST."""
    return [(found.run, event) for found in runs for event in found.events][:MOST]


def size_of(events: Sequence[Event]) -> tuple[float, float]:
    """Width and height of their picture, in."""
    rows, columns = _panels(events)
    return PANEL_IN * columns, (PANEL_IN + 0.45) * rows + 0.5


def _panels(events: Sequence[Event]) -> tuple[int, int]:
    columns = min(COLUMNS, len(events))
    return math.ceil(len(events) / columns), columns


def draw_events(figure: Figure | SubFigure, events: Sequence[Event]) -> None:
    """A panel for each event, of which there is at least one."""
    rows, columns = _panels(events)
    panels = figure.subplots(rows, columns, squeeze=False).ravel()
    for panel in panels[len(events) :]:
        panel.set_axis_off()
    for panel, (run, event) in zip(panels, events, strict=False):
        draw_event(panel, run, event)
    signs = {
        "what the robot did": Line2D([], [], color=REAL, lw=2.0),
        "the best it could do": Line2D([], [], color=BEST, lw=2.0),
        "the person, in the future that decides": Line2D([], [], color=PERSON, lw=1.4),
        "the person, as recorded": Line2D([], [], color=RECORDED, lw=2.0, ls=":"),
    }
    figure.legend(
        list(signs.values()), list(signs), loc="outside lower left", ncols=min(columns, 4),
        frameon=False, fontsize=7, labelcolor=INK,
    )  # fmt: skip


def draw_event(axes: Axes, run: RecordedRun, event: JudgedEvent) -> None:
    """One event on its axes."""
    times: Any = np.arange(event.decided_s, event.until_s + 1e-6, 0.05)
    columns = [np.interp(times, run.times, column) for column in run.robot.T]
    real, recorded = np.column_stack(columns), run.way.at(times)
    person = event.walk.at(times)
    best = real if event.best is None else event.best.poses
    _frame(axes, (real, best, person, recorded))
    for wall in run.walls:
        axes.plot(wall[0::2], wall[1::2], color=INK, lw=1.6, zorder=2.0)
    _way(axes, person, color=PERSON, lw=1.4)
    _way(axes, recorded, color=RECORDED, lw=2.0, ls=":")
    _way(axes, real, color=REAL, lw=2.0)
    _nearest(axes, run.limits, real, recorded, REAL)
    if event.best is not None:
        _way(axes, best, color=BEST, lw=2.0)
        _nearest(axes, run.limits, best, event.walk.at(event.best.times), BEST)
    _title(axes, event)


def _title(axes: Axes, event: JudgedEvent) -> None:
    verdict = "avoidable" if event.avoidable else "not avoidable"
    latest = "" if event.latest_s is None else f", until {event.latest_s - event.decided_s:+.1f} s"
    gap = "–" if event.best is None else f"{event.best.gap:.2f} m"
    axes.set_title(
        f"{event.at_s:.1f} s: {event.what}\n{verdict}{latest}; best {gap}, "
        f"real {event.real_gap:.2f} m",
        fontsize=7, color=INK if event.avoidable else RED, loc="left",
    )  # fmt: skip


def _frame(axes: Axes, ways: Sequence[Array]) -> None:
    places = np.concatenate([way[:, :2] for way in ways])
    low, high = places.min(axis=0) - _MARGIN_M, places.max(axis=0) + _MARGIN_M
    half = 0.5 * max(high - low)
    middle = 0.5 * (low + high)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_aspect("equal")
    axes.tick_params(length=2, width=0.5, labelsize=6, colors=GREY)
    for side in axes.spines.values():
        side.set_color(GREY)
        side.set_linewidth(0.4)


def _way(axes: Axes, way: Array, **style: Any) -> None:
    """A way with a mark each MARK_S, an open one at its start."""
    axes.plot(way[:, 0], way[:, 1], zorder=4.0, **style)
    marks = way[:: round(MARK_S / 0.05)]
    axes.plot(marks[:, 0], marks[:, 1], ".", color=style["color"], ms=3.5, zorder=4.1)
    axes.plot(*way[0, :2], "o", mfc="white", mec=style["color"], ms=4.5, zorder=4.2)


def _nearest(axes: Axes, limits: RobotLimits, robot: Array, person: Array, colour: str) -> None:
    """Both outlines at the instant at which they are nearest."""
    n = min(range(len(robot)), key=lambda n: _gap(limits, robot[n], person[n]))
    x, y, yaw = robot[n]
    a, b, c, s = limits.half_length, limits.half_width, math.cos(yaw), math.sin(yaw)
    corners = [(a, b), (-a, b), (-a, -b), (a, -b)]
    outline = [(x + c * u - s * v, y + s * u + c * v) for u, v in corners]
    axes.add_patch(Polygon(outline, fc=colour, alpha=0.12, zorder=3.0))
    axes.add_patch(Polygon(outline, fill=False, ec=colour, lw=0.9, zorder=3.1))
    centre = float(person[n, 0]), float(person[n, 1])
    axes.add_patch(Circle(centre, RADIUS, fc=PERSON, alpha=0.08, zorder=3.0))
    axes.add_patch(Circle(centre, RADIUS, fill=False, ec=colour, lw=0.9, zorder=3.1))


def _gap(limits: RobotLimits, robot: Array, person: Array) -> float:
    dx, dy = person[:2] - robot[:2]
    c, s = math.cos(robot[2]), math.sin(robot[2])
    x, y = c * dx + s * dy, c * dy - s * dx
    return way_distance(limits.half_length, limits.half_width, x, y, x, y)
