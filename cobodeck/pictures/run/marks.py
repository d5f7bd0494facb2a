"""Where events of a run happened: contacts, requests, Escapes, Informs, and time marks."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from matplotlib.lines import Line2D

from cobodeck.pictures.drawing import USER, Labels, Sheet, draw
from cobodeck.pictures.run.run_course import Course, TouchRequest
from cobodeck.pictures.run.signs import BEHAVIOURS, CONTACT, UNSERVED, time_step
from cobodeck.pictures.run.tracks import bodies, person_of, robot_of
from engine.draw import INK
from hw.scene import Point

PLACE_M = 0.3
"""Events closer to each other than this share a mark, m."""
MOST_GHOSTS = 8
"""With more contacts than this, the outlines of robot and person at contacts are not drawn."""

HIT: dict[str, Any] = {"ls": "", "marker": "X", "mfc": "#d81b60", "mec": INK, "mew": 0.8}
"""The mark of a wall or thing that has held the robot."""
_LONGEST_LIST = 4


def draw_marks(on: Sheet, course: Course) -> None:
    """All events, labelled where there is room: contacts first, then requests and times."""
    labels = Labels(on)
    _draw_contacts(on, course, labels)
    _draw_hits(on, course, labels)
    _draw_requests(on, course, labels)
    _draw_events(on, course, labels)
    _draw_times(on, course, labels)
    labels.write()


def _draw_contacts(on: Sheet, course: Course, labels: Labels) -> None:
    """Places and causes of contacts; with few contacts, also the outlines."""
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


def _draw_hits(on: Sheet, course: Course, labels: Labels) -> None:
    """What held the robot, and how often."""
    for hit in course.hits:
        on.axes.plot(hit.x, hit.y, ms=9, zorder=8.4, **HIT)
        often = f" {hit.count}×" if hit.count > 1 else ""
        labels.mark((hit.x, hit.y), 9, f"{hit.at_ns / 1e9:.1f} s {hit.what}{often}", INK, 7.0)
    if course.hits:
        on.explain("ran into (3×: three times)", Line2D([], [], ms=8, **HIT))


def _draw_ghosts(on: Sheet, course: Course, times: Sequence[float]) -> None:
    for then in map(course.at, times):
        draw(on, bodies(course, then), lw=0.6)


def _draw_requests(on: Sheet, course: Course, labels: Labels) -> None:
    """Where the person reached for the prop, with the number of the request."""
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


def _deep(request: TouchRequest) -> Point:
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


def _draw_times(on: Sheet, course: Course, labels: Labels) -> None:
    """Where robot and person are at regular time steps."""
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
    """Groups of places within `PLACE_M`; each group is at the place of its first member."""
    together: list[tuple[Point, list[int]]] = []
    for place, number in found:
        near = next((c for c in together if math.dist(c[0], place) <= PLACE_M), None)
        if near is None:
            together.append((place, [number]))
        else:
            near[1].append(number)
    return together


def _stays(known: Sequence[tuple[Point, float]]) -> list[tuple[Point, list[float]]]:
    """Groups of consecutive times at about the same place."""
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
    """1, 2, 3, 5 as `requests 1–3, 5`; only how many if the list would be long."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    if len(parts) > _LONGEST_LIST:
        return f"{len(numbers)} requests"
    shown = (str(p[0]) if len(p) == 1 else f"{p[0]}–{p[-1]}" for p in parts)
    return f"request{'s' * (len(numbers) > 1)} {', '.join(shown)}"
