"""Colours and markers shared by the map and the lanes of a run."""

from __future__ import annotations

from itertools import cycle
from typing import Any

from cobodeck.pictures.run.run_course import Course
from cobodeck.project import behaviour_of
from engine.draw import INK

BEHAVIOURS = {"chase": "#0072b2", "haptic": "#009e73", "escape": "#d55e00", "inform": "#cc79a7"}
OTHERS = ("#e69f00", "#56b4e9", "#882255", "#999933", "#332288", "#44aa99")
"""Colours of other lanes, from palettes safe for colour-blind readers (Okabe and Ito, Tol)."""
NONE = "#9aa5b1"
WAITED, UNSERVED = "#a8dccb", "#ffffff"

_X: dict[str, Any] = {"ls": "", "marker": "X", "mec": INK, "mew": 0.8}
CONTACT = {
    "robot": {"mfc": INK, **_X},
    "slow_arm": {"mfc": NONE, **_X},
    "person": {"mfc": "w", **_X},
}
"""The marker of a contact, by its cause."""

_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600)
_MOST_STEPS = 14


def lane_colours(course: Course) -> dict[str | None, str]:
    """A colour for each lane, the same for the same behaviour in every picture."""
    others = cycle(OTHERS)
    charts = course.charts
    known = {path: BEHAVIOURS.get(behaviour_of(charts.get(path, ""))) for path in course.lanes}
    return {None: NONE} | {path: colour or next(others) for path, colour in known.items()}


def time_step(course: Course) -> float:
    """Time between two marks, s: a round number that gives at most 14 of them."""
    span = course.end_s - course.start_s
    return next((step for step in _STEPS if span / step <= _MOST_STEPS), _STEPS[-1])
