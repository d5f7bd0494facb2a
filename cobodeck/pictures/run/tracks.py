"""The paths of robot and person, seen from above."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.lines import Line2D

from cobodeck.pictures.drawing import FOAM, PERSON, USER, Sheet, draw
from cobodeck.pictures.run.run_course import Course, Instant
from cobodeck.pictures.run.signs import lane_colours
from cobodeck.shapes import Shape, arm_shapes, body_shapes, outline_shapes
from engine.draw import INK
from hw.scene import Point

_FINE_M = 0.008
_ARROW_M = 1.6
_MOST_ARROWS = 40
_ROBOT, _PERSON = 2.4, 1.3
_LONG_M, _FINEST = 250.0, 0.25
"""Paths longer than this, m, are drawn with thinner lines, down to this share of their width."""
_DOTS = (0, (1.0, 0.9))

PlaceOf = Callable[[Instant], Point | None]


def robot_of(instant: Instant) -> Point | None:
    """The robot's position, m."""
    return instant.robot.x, instant.robot.y


def person_of(instant: Instant) -> Point | None:
    """The person's position, m; None if unknown."""
    return None if instant.person is None else (instant.person.x, instant.person.y)


def bounds_of(course: Course) -> tuple[float, float, float, float]:
    """Least x and y, greatest x and y, m: of the room, or of all paths with a margin of 1 m."""
    if course.room is not None:
        return course.room.bounds
    places = [p for i in course.instants for p in (robot_of(i), person_of(i)) if p is not None]
    xs, ys = zip(*places, strict=True)
    return min(xs) - 1.0, min(ys) - 1.0, max(xs) + 1.0, max(ys) + 1.0


def draw_tracks(on: Sheet, course: Course) -> None:
    """The paths in the behaviors' colours, with arrow heads, and both ends marked."""
    colours = lane_colours(course)
    finer = min(1.0, max(_FINEST, _LONG_M / _length(course)))
    robot = {"lw": finer * _ROBOT, "solid_joinstyle": "round", "zorder": 6.0}
    person = {"lw": finer * _PERSON, "ls": _DOTS, "dash_capstyle": "butt", "zorder": 5.5}
    for place_of, style in ((person_of, person), (robot_of, robot)):
        for lane, colour in colours.items():
            _draw_path(on, course, lane, place_of, color=colour, **style)
        _draw_arrows(on, course, place_of, colours)
    _explain_paths(on, course, colours)
    _draw_ends(on, course)


def _length(course: Course) -> float:
    """Length of the robot's path, m; never exactly 0, as it is divided by."""
    steps = zip(course.instants, course.instants[1:], strict=False)
    return 1e-9 + sum(a.robot.distance_to(b.robot) for a, b in steps)


def _draw_path(
    on: Sheet, course: Course, lane: str | None, place_of: PlaceOf, **style: Any
) -> None:
    pieces: list[Sequence[Point]] = []
    for phase in course.phases:
        if phase.lane == lane:
            seen = course.during(phase.start_s, phase.end_s)
            pieces += [thinned(p) for p in _known(place_of(i) for i in seen)]
    if pieces:
        gap = (math.nan, math.nan)
        xs, ys = zip(*(point for piece in pieces for point in (*piece, gap)), strict=True)
        on.axes.plot(xs, ys, **style)


def _known(places: Iterable[Point | None]) -> list[list[Point]]:
    """The places as separate pieces, split where one is unknown."""
    pieces: list[list[Point]] = [[]]
    for place in places:
        if place is not None:
            pieces[-1].append(place)
        elif pieces[-1]:
            pieces.append([])
    return [piece for piece in pieces if piece]


def thinned(path: Sequence[Point]) -> list[Point]:
    """The path with fewer points (Douglas-Peucker), within about a line's width of it."""
    if len(path) < 3:
        return list(path)
    line = shapely.simplify(shapely.LineString(path), _FINE_M, preserve_topology=False)
    return [(x, y) for x, y in line.coords]


def _draw_arrows(
    on: Sheet, course: Course, place_of: PlaceOf, colours: dict[str | None, str]
) -> None:
    """Arrow heads at regular distances along the path, in its colour."""
    seen = [(i.at_s, place) for i in course.instants if (place := place_of(i)) is not None]
    if len(seen) < 2:
        return
    path = np.array([place for _, place in seen])
    gone = np.concatenate(([0.0], np.hypot(*np.diff(path, axis=0).T).cumsum()))
    spacing = max(_ARROW_M, float(gone[-1]) / _MOST_ARROWS)
    phase_of = iter(course.phases)
    phase = next(phase_of)
    for k in range(math.floor(gone[-1] / spacing + 0.5)):
        here = int(np.searchsorted(gone, (k + 0.5) * spacing))
        before = int(np.searchsorted(gone, gone[here] - 0.15))
        while phase.end_s < seen[here][0]:
            phase = next(phase_of)
        dx, dy = path[here] - path[max(0, min(before, here - 1))]
        turn = math.degrees(math.atan2(dy, dx)) - 90.0
        size = 6.5 if place_of is robot_of else 5.0
        on.axes.plot(
            *path[here], marker=(3, 0, turn), ms=size, mfc=colours[phase.lane], mec="white",
            mew=0.5, ls="", zorder=6.5,
        )  # fmt: skip


def _draw_ends(on: Sheet, course: Course) -> None:
    """Robot and person at their first places, dashed, and at their last."""
    first, last = course.instants[0], course.instants[-1]
    for instant, line in ((first, "--"), (last, "-")):
        draw(on, bodies(course, instant, fill=instant is last), lw=1.0, ls=line)
    if course.arm is not None and last.joints is not None:
        draw(on, arm_shapes(last.robot, last.joints, course.arm), zorder=4.1)
    sign: dict[str, Any] = {"lw": 0, "ms": 8}
    if course.footprint is not None:
        robot = Line2D([], [], marker="s", mfc=FOAM, mec=INK, **sign)
        on.explain("robot at the end (start: dashed)", robot)
    if last.person is not None:
        person = Line2D([], [], marker="o", mfc=PERSON, mec=USER, **sign)
        on.explain("person at the end (start: dashed)", person)


def bodies(course: Course, then: Instant, *, fill: bool = False) -> list[Shape]:
    """The outlines of robot and person, with lines to their fronts."""
    robot, person = course.footprint, then.person
    shapes = [] if robot is None else outline_shapes(then.robot, robot, "footprint", fill=fill)
    return [*shapes, *([] if person is None else body_shapes(person, "person", fill=fill))]


def _explain_paths(on: Sheet, course: Course, colours: dict[str | None, str]) -> None:
    present = {phase.lane for phase in course.phases}
    for lane, colour in colours.items():
        if lane in present:
            on.explain(lane or "no behaviour", Line2D([], [], color=colour, lw=4.0))
    on.explain("path of the robot", Line2D([], [], color=INK, lw=_ROBOT))
    if any(instant.person is not None for instant in course.instants):
        on.explain("path of the person", Line2D([], [], color=INK, lw=_PERSON, ls=_DOTS))
