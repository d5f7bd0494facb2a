"""A run from above: the ways of robot and person, and what happened where."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import shapely
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch

from cobodeck.pictures.actors import FOAM, USER
from cobodeck.pictures.canvas import Sheet
from cobodeck.pictures.course import Course, Instant, Request
from cobodeck.pictures.labels import Labels
from cobodeck.pictures.lanes import BEHAVIOURS, CONTACT, UNSERVED, lane_colours, time_step
from cobodeck.pictures.room import ring_of
from engine.draw import INK
from hw.geometry import Pose2
from hw.person import RADIUS
from hw.robot import Footprint
from hw.room import Point

PLACE_M = 0.3
"""What happens nearer to each other shares a mark."""
MOST_GHOSTS = 8
"""Up to so many contacts, both outlines are shown where they touched."""

_FINE_M = 0.008
_LONGEST_LIST = 4
_ARROW_M = 1.6
_MOST_ARROWS = 40
_ROBOT, _PERSON = 2.4, 1.3
_LONG_M, _FINEST = 250.0, 0.25
"""Lines get finer where the way is longer than this, down to this share."""
_DOTS = (0, (1.0, 0.9))
PERSON_FILL = "#b9cdec"

PlaceOf = Callable[[Instant], Point | None]


def robot_of(instant: Instant) -> Point | None:
    """Where the robot is."""
    return instant.robot.x, instant.robot.y


def person_of(instant: Instant) -> Point | None:
    """Where the person is."""
    return None if instant.person is None else (instant.person.x, instant.person.y)


def bounds_of(course: Course) -> tuple[float, float, float, float]:
    """The least x and y, and the greatest, m: the room's, or of all that moved."""
    if course.room is not None:
        return course.room.bounds
    places = [p for i in course.instants for p in (robot_of(i), person_of(i)) if p is not None]
    xs, ys = zip(*places, strict=True)
    return min(xs) - 1.0, min(ys) - 1.0, max(xs) + 1.0, max(ys) + 1.0


def draw_tracks(on: Sheet, course: Course) -> None:
    """Ways, marks of time, and all that happened, with labels where there is room."""
    colours = lane_colours(course)
    finer = min(1.0, max(_FINEST, _LONG_M / _length(course)))
    robot = {"lw": finer * _ROBOT, "solid_joinstyle": "round", "zorder": 6.0}
    person = {"lw": finer * _PERSON, "ls": _DOTS, "dash_capstyle": "butt", "zorder": 5.5}
    for place_of, style in ((person_of, person), (robot_of, robot)):
        for lane, colour in colours.items():
            _draw_way(on, course, lane, place_of, color=colour, **style)
        _draw_arrows(on, course, place_of, colours)
    _explain_ways(on, course, colours)
    _draw_ends(on, course)
    labels = Labels(on)
    _draw_contacts(on, course, labels)
    _draw_requests(on, course, labels)
    _draw_events(on, course, labels)
    _draw_marks(on, course, labels)
    labels.write()


def _length(course: Course) -> float:
    """Of the robot's way, m; a little more than 0 for one that stands."""
    steps = zip(course.instants, course.instants[1:], strict=False)
    return 1e-9 + sum(a.robot.distance_to(b.robot) for a, b in steps)


def _draw_way(on: Sheet, course: Course, lane: str | None, place_of: PlaceOf, **style: Any) -> None:
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
    """The places, cut where there is none."""
    pieces: list[list[Point]] = [[]]
    for place in places:
        if place is not None:
            pieces[-1].append(place)
        elif pieces[-1]:
            pieces.append([])
    return [piece for piece in pieces if piece]


def thinned(way: Sequence[Point]) -> list[Point]:
    """The same way with fewer points, nowhere farther from it than the width of a thin line."""
    if len(way) < 3:
        return list(way)
    line = shapely.simplify(shapely.LineString(way), _FINE_M, preserve_topology=False)
    return [(x, y) for x, y in line.coords]


def _draw_arrows(
    on: Sheet, course: Course, place_of: PlaceOf, colours: dict[str | None, str]
) -> None:
    """Where it goes: arrow heads every so often, in the colour of the way."""
    seen = [(i.at_s, place) for i in course.instants if (place := place_of(i)) is not None]
    if len(seen) < 2:
        return
    way = np.array([place for _, place in seen])
    gone = np.concatenate(([0.0], np.hypot(*np.diff(way, axis=0).T).cumsum()))
    spacing = max(_ARROW_M, float(gone[-1]) / _MOST_ARROWS)
    phase_of = iter(course.phases)
    phase = next(phase_of)
    for k in range(math.floor(gone[-1] / spacing + 0.5)):
        here = int(np.searchsorted(gone, (k + 0.5) * spacing))
        before = int(np.searchsorted(gone, gone[here] - 0.15))
        while phase.end_s < seen[here][0]:
            phase = next(phase_of)
        dx, dy = way[here] - way[max(0, min(before, here - 1))]
        turn = math.degrees(math.atan2(dy, dx)) - 90.0
        size = 6.5 if place_of is robot_of else 5.0
        on.axes.plot(
            *way[here], marker=(3, 0, turn), ms=size, mfc=colours[phase.lane], mec="white",
            mew=0.5, ls="", zorder=6.5,
        )  # fmt: skip


def _draw_ends(on: Sheet, course: Course) -> None:
    """Where robot and person begin, dashed, and where they end."""
    first, last = course.instants[0], course.instants[-1]
    for instant, line in ((first, "--"), (last, "-")):
        if course.footprint is not None:
            filled: dict[str, Any] = {"fc": FOAM, "fill": instant is last}
            draw_outline(on, instant.robot, course.footprint, ls=line, lw=1.0, **filled)
        if instant.person is not None:
            filled = {"fc": PERSON_FILL, "fill": instant is last}
            draw_disc(on, instant.person, ls=line, lw=1.0, **filled)
    sign: dict[str, Any] = {"lw": 0, "ms": 8}
    if course.footprint is not None:
        robot = Line2D([], [], marker="s", mfc=FOAM, mec=INK, **sign)
        on.explain("robot at the end (start: dashed)", robot)
    if last.person is not None:
        person = Line2D([], [], marker="o", mfc=PERSON_FILL, mec=USER, **sign)
        on.explain("person at the end (start: dashed)", person)


def draw_outline(on: Sheet, pose: Pose2, shape: Footprint, **style: Any) -> None:
    """The robot's outline, and a line from its middle to its front."""
    length, width = shape.half_length, shape.half_width
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    corners = [pose.transform(i * length, j * width) for i, j in signs]
    on.axes.add_patch(PathPatch(ring_of(corners), ec=INK, zorder=4.0, **style))
    xs, ys = zip((pose.x, pose.y), pose.transform(length, 0.0), strict=True)
    on.axes.plot(xs, ys, color=INK, lw=style["lw"], zorder=4.0)


def draw_disc(on: Sheet, body: Pose2, **style: Any) -> None:
    """The cylinder that stands for the person, and a line to where they face."""
    on.axes.add_patch(Circle((body.x, body.y), RADIUS, ec=USER, zorder=4.0, **style))
    xs, ys = zip((body.x, body.y), body.transform(RADIUS, 0.0), strict=True)
    on.axes.plot(xs, ys, color=USER, lw=style["lw"], zorder=4.0)


def _explain_ways(on: Sheet, course: Course, colours: dict[str | None, str]) -> None:
    present = {phase.lane for phase in course.phases}
    for lane, colour in colours.items():
        if lane in present:
            on.explain(lane or "no behaviour", Line2D([], [], color=colour, lw=4.0))
    on.explain("way of the robot", Line2D([], [], color=INK, lw=_ROBOT))
    if any(instant.person is not None for instant in course.instants):
        on.explain("way of the person", Line2D([], [], color=INK, lw=_PERSON, ls=_DOTS))


# ----------------------------------------------------------------- what happened where


def _draw_contacts(on: Sheet, course: Course, labels: Labels) -> None:
    """Where they touched, and whose it was; of few contacts also the outlines then."""
    contacts = course.contacts or ()
    if len(contacts) <= MOST_GHOSTS:
        _draw_ghosts(on, course, [contact.at_ns / 1e9 for contact in contacts])
    for by, look in CONTACT.items():
        found = [contact for contact in contacts if contact.by == by]
        if found:
            on.axes.plot([c.x for c in found], [c.y for c in found], ms=9, zorder=8.5, **look)
            on.explain(f"contact by the {by.replace('_', ' ')}", Line2D([], [], ms=8, **look))
    for contact in contacts:
        text = f"{contact.at_ns / 1e9:.1f} s {contact.part}"
        labels.mark((contact.x, contact.y), 9, text, INK, 7.0)


def _draw_ghosts(on: Sheet, course: Course, times: Sequence[float]) -> None:
    for then in map(course.at, times):
        if course.footprint is not None:
            draw_outline(on, then.robot, course.footprint, fill=False, lw=0.6)
        if then.person is not None:
            draw_disc(on, then.person, fill=False, lw=0.6)


def _draw_requests(on: Sheet, course: Course, labels: Labels) -> None:
    """Where the person reached; the number is that of the request."""
    for served in (True, False):
        found = [r for r in course.requests if (r.served_s is not None) == served]
        colour = BEHAVIOURS["haptic"] if served else UNSERVED
        look: dict[str, Any] = {"marker": "*", "mfc": colour, "mec": INK, "mew": 0.8}
        for place, numbers in clusters([(_deep(r), r.number) for r in found]):
            on.axes.plot(*place, ls="", ms=11, zorder=8.0, **look)
            labels.mark(place, 11, _listed(numbers), INK, 7.0)
        if found:
            words = "request, served" if served else "request, not served"
            on.explain(words, Line2D([], [], lw=0, ms=10, **look))


def _deep(request: Request) -> Point:
    return request.deep.x, request.deep.y


def _draw_events(on: Sheet, course: Course, labels: Labels) -> None:
    """Where Escapes and Informs began."""
    for chart, marker, size in (("escape", "^", 9.0), ("inform", "8", 6.5)):
        begun = course.begun(chart)
        look: dict[str, Any] = {"marker": marker, "mfc": BEHAVIOURS[chart], "mec": INK, "mew": 0.7}
        places = [robot_of(course.at(span.start_s)) for span in begun]
        known = [(place, n) for n, place in enumerate(places) if place is not None]
        for place, numbers in clusters(known):
            on.axes.plot(*place, ls="", ms=size, zorder=7.8, **look)
            text = f"{len(numbers)}×" if len(numbers) > 1 else ""
            labels.mark(place, size, text, BEHAVIOURS[chart], 8.0)
        if begun:
            sign = Line2D([], [], lw=0, ms=size, **look)
            on.explain(f"{chart} begins (3×: three times)", sign)


def _draw_marks(on: Sheet, course: Course, labels: Labels) -> None:
    """Where robot and person are every so many seconds."""
    step = time_step(course)
    first, last = math.ceil(course.start_s / step), math.floor(course.end_s / step + 1e-9)
    times = [k * step for k in range(first, last + 1)]
    looks = ((robot_of, "s", "white", INK, "robot"), (person_of, "o", "white", USER, "person"))
    for place_of, marker, fill, colour, who in looks:
        known = [(p, at) for at in times if (p := place_of(course.at(at))) is not None]
        look: dict[str, Any] = {"marker": marker, "mfc": fill, "mec": colour, "mew": 1.0}
        for place, stays in _stays(known):
            on.axes.plot(*place, ls="", ms=4, zorder=7.0, **look)
            labels.mark(place, 4, _from_to(stays), colour, 6.5)
        if known:
            sign = Line2D([], [], lw=0, ms=4, **look)
            on.explain(f"{who} every {step:g} s", sign)


def clusters(found: Iterable[tuple[Point, int]]) -> list[tuple[Point, list[int]]]:
    """What is near to each other, together; the first of each has the place."""
    together: list[tuple[Point, list[int]]] = []
    for place, number in found:
        near = next((c for c in together if math.dist(c[0], place) <= PLACE_M), None)
        if near is None:
            together.append((place, [number]))
        else:
            near[1].append(number)
    return together


def _stays(known: Sequence[tuple[Point, float]]) -> list[tuple[Point, list[float]]]:
    """One after another, as long as the place stays about the same."""
    stays: list[tuple[Point, list[float]]] = []
    for place, at in known:
        if stays and math.dist(stays[-1][0], place) <= PLACE_M:
            stays[-1][1].append(at)
        else:
            stays.append((place, [at]))
    return stays


def _from_to(times: Sequence[float]) -> str:
    return f"{times[0]:g} s" if len(times) == 1 else f"{times[0]:g}–{times[-1]:g} s"


def _listed(numbers: Sequence[int]) -> str:
    """1, 2, 3, 5 as `request 1–3, 5`; so many of them where they would make a long list."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    if len(parts) > _LONGEST_LIST:
        return f"{len(numbers)} requests"
    shown = (str(p[0]) if len(p) == 1 else f"{p[0]}–{p[-1]}" for p in parts)
    return f"request {', '.join(shown)}"
