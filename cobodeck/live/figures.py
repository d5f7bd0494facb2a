"""Figures and health of a run: so far, at its end, and of a part of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any

from cobodeck.live.clients import PageMessage, number
from cobodeck.live.model import RunModel
from cobodeck.pictures.run import Course
from hw import Truth

FigureRows = list[tuple[str, str]]
"""Figures by their names, as texts."""


def figures_of(model: RunModel, escapes: int = 0) -> FigureRows:
    """Figures so far; `escapes`: how often the robot has had to."""
    rows = [("time", f"{model.at_ns / 1e9:.1f} s"), ("transitions", str(model.transitions))]
    truth = model.truth
    if truth is not None:
        rows += _of_truth(truth)
    if model.requests:
        rows.append(("requests", str(model.requests)))
    if escapes:
        rows.append(("escapes", str(escapes)))
    if model.errors:
        rows.append(("errors", str(model.errors)))
    if model.missed:
        rows.append(("missed ticks", str(model.missed)))
    return rows


def final_figures(result: Mapping[str, Any]) -> FigureRows:
    """The main figures of a run that has ended, of those on record; unknown ones are left out."""
    get = result.get
    response = (get("response_s") or {}).get("mean")
    told = (
        ("time", get("sim_s"), "{:.1f} s"),
        ("transitions", get("transitions"), "{}"),
        ("travelled", get("distance_m"), "{:.1f} m"),
        ("least gap", get("min_gap_m"), "{:.2f} m"),
        ("requests", get("requests") or None, f"{{}}, served {get('served')}"),
        ("response", response, "{:.2f} s on average"),
        ("escapes", get("escapes") or None, f"{{}}, {get('escape_failures')} failed"),
        ("contacts", get("contacts"), "{}"),
        ("touches of walls", get("wall_hits"), "{}"),
        ("errors", len(get("errors") or ()) or None, "{}"),
        ("missed ticks", get("missed") or None, "{}"),
    )
    return [(name, form.format(found)) for name, found, form in told if found is not None]


def health_of(model: RunModel) -> dict[str, Any]:
    """Late and missed ticks, refused samples, and how old the newest sample of each signal is.

    As the message `health` has it.
    """
    ages = {s.name: max(0.0, (model.at_ns - s.stamp_ns) / 1e9) for s in model.samples()}
    counts = {"late": model.late, "missed": model.missed, "gates": model.refused}
    return {"t": "health", **counts, "ages": ages}


def range_of(message: PageMessage) -> tuple[float, float]:
    """The part of a run that a page asks for, s in the run.

    Raises:
        ValueError: the message has none.
    """
    low, high = (number(message, key, "s in the run") for key in ("from", "to"))
    return low, high


def range_message(course: Course, between: tuple[float, float]) -> dict[str, Any]:
    """The figures of a part of a run.

    Raises:
        ValueError: that part is empty.
    """
    rows = [*_of_course(course.between(*between))]
    return {"t": "figures", "rows": rows, "range": list(between)}


def _of_course(course: Course) -> Iterator[tuple[str, str]]:
    yield "time", f"{course.end_s - course.start_s:.1f} s"
    poses = [instant.robot for instant in course.instants]
    if poses:
        travelled = sum(a.distance_to(b) for a, b in pairwise(poses))
        yield "travelled", f"{travelled:.1f} m"
    gaps = [instant.gap for instant in course.instants if instant.gap is not None]
    if gaps:
        yield "least gap", f"{min(gaps):.2f} m"
    served = [r for r in course.requests if r.served_s is not None]
    if course.requests:
        yield "requests", f"{len(course.requests)}, served {len(served)}"
    times = [r.served_s - r.start_s for r in served if r.served_s is not None]
    if times:
        yield "response", f"{sum(times) / len(times):.2f} s on average"
    if course.contacts is not None:
        yield "contacts", str(len(course.contacts))
    if course.hits:
        yield "touches of walls and things", str(len(course.hits))
    for lane in course.lanes:
        spans = course.spans_of(lane)
        low, high = course.start_s, course.end_s
        lasted = sum(min(s.end_s, high) - max(s.start_s, low) for s in spans)
        if spans:
            yield course.charts.get(lane, lane), f"{len(spans)} times, {lasted:.1f} s"


def _of_truth(truth: Truth) -> Iterator[tuple[str, str]]:
    if truth.distance_m is not None:
        yield "travelled", f"{truth.distance_m:.1f} m"
    if truth.min_gap is not None:
        yield "least gap", f"{truth.min_gap:.2f} m"
    if truth.contacts is not None:
        yield "contacts", str(len(truth.contacts))
    if truth.wall_hits is not None:
        yield "touches of walls", str(truth.wall_hits)
