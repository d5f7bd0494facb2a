"""A run over time: distance of robot and person, requests, contacts, a lane per behaviour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MultipleLocator
from numpy.typing import NDArray

from cobodeck.evaluate import FAR_M, NEAR_M
from cobodeck.pictures.drawing import Sheet
from cobodeck.pictures.run.run_course import Course, NodeSpan
from cobodeck.pictures.run.signs import (
    BEHAVIOURS,
    CONTACT,
    UNSERVED,
    WAITED,
    lane_colours,
    time_step,
)
from engine.draw import GREY, INK
from hw import Contact

Array = NDArray[np.float64]

DISTANCE_IN, LANE_IN, GAP_IN, FOOT_IN = 1.5, 0.24, 0.14, 0.5
LEFT_IN, RIGHT_IN = 1.15, 1.45

_BINS = 1200
_SMALLEST = 1.0 / 1500.0
"""Bars closer to each other than this share of the time shown are drawn as one."""
_UNHAPPY = ("failed", "error", "timeout")
_FAILED: dict[str, Any] = {"ls": "", "marker": "x", "ms": 4.5, "mew": 1.2, "color": INK}


def rows(course: Course) -> list[str]:
    """The names of the rows, from top to bottom."""
    own = [("requests", bool(course.requests)), ("contacts", course.contacts is not None)]
    return [name for name, shown in own if shown] + list(course.lanes)


def height_in(course: Course) -> float:
    """The height needed for distance and rows, inches."""
    apart = DISTANCE_IN + GAP_IN if _apart(course) else 0.0
    return apart + LANE_IN * len(rows(course)) + FOOT_IN + GAP_IN


def draw_lanes(on: Sheet, course: Course) -> None:
    """Distance and rows over one time axis, at the lower edge of the sheet."""
    figure, names = on.figure, rows(course)
    lower = _axes(figure, FOOT_IN, LANE_IN * len(names))
    _draw_rows(lower, course, names)
    _rule(lower, course)
    lower.set_xlabel("time, s", fontsize=7.5, color=GREY, loc="right", labelpad=2)
    _explain(on, course)
    if _apart(course):
        upper = _axes(figure, FOOT_IN + LANE_IN * len(names) + GAP_IN, DISTANCE_IN)
        _draw_distance(upper, course)
        _rule(upper, course)
        upper.tick_params(labelbottom=False)


def _explain(on: Sheet, course: Course) -> None:
    if any(span.ended in _UNHAPPY for lane in course.lanes for span in course.spans_of(lane)):
        on.explain(f"ended with {', '.join(_UNHAPPY)}", Line2D([], [], **_FAILED))
    if course.requests:
        on.explain("touch requested …", Patch(fc=WAITED))
        on.explain("… and served", Patch(fc=BEHAVIOURS["haptic"]))
    if any(request.served_s is None for request in course.requests):
        on.explain("… not served", Patch(fc=UNSERVED, ec=INK, lw=0.7))


def _apart(course: Course) -> bool:
    return any(instant.person is not None for instant in course.instants)


def _axes(figure: Figure, bottom_in: float, height: float) -> Axes:
    wide, tall = figure.get_size_inches()
    width = wide - LEFT_IN - RIGHT_IN
    return figure.add_axes((LEFT_IN / wide, bottom_in / tall, width / wide, height / tall))


def _rule(axes: Axes, course: Course) -> None:
    """Time along the lower edge, with grid lines at the times marked on the map."""
    axes.set_xlim(course.start_s, course.end_s)
    axes.xaxis.set_major_locator(MultipleLocator(time_step(course)))
    axes.grid(axis="x", color="#d8dde3", lw=0.6, zorder=0.0)
    axes.set_axisbelow(True)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set(color=GREY, linewidth=0.6)
    axes.tick_params(length=2.5, width=0.6, labelsize=7, colors=GREY)


# ----------------------------------------------------------------- distance


def _draw_distance(axes: Axes, course: Course) -> None:
    """Distance from base to person, and gap between their outlines; contacts are at gap 0."""
    seen = [(i.at_s, i.person, i) for i in course.instants]
    times = np.array([at for at, _, _ in seen])
    far = np.array([np.nan if body is None else i.robot.distance_to(body) for _, body, i in seen])
    gaps = np.array([np.nan if i.gap is None else i.gap for _, _, i in seen])
    high = max(FAR_M + 0.5, float(np.nanmax(far)) * 1.05)
    axes.set_ylim(min(-0.15, float(np.nanmin(gaps)) - 0.1), high)
    axes.axhspan(NEAR_M, FAR_M, color="#eef3f8", lw=0, zorder=-1.0)
    axes.axhline(0.0, color=INK, lw=0.8, zorder=2.0)
    for values, colour, width in ((far, GREY, 1.0), (gaps, INK, 1.3)):
        axes.plot(*thinned(times, values), color=colour, lw=width, zorder=3.0)
    _mark_contacts(axes, course.contacts or (), 0.0)
    axes.set_ylabel("m", fontsize=7.5, color=GREY, rotation=0, loc="top", labelpad=4)
    known = gaps[~np.isnan(gaps)]
    low = float(known[-1])
    above = max(float(far[~np.isnan(far)][-1]), low + 0.1 * high)
    _beside(axes, above, "base to person", GREY)
    _beside(axes, low, f"gap, least {known.min():.2f} m", INK)
    axes.annotate(
        f"{NEAR_M:g} to {FAR_M:g} m", (1.0, FAR_M), xycoords=("axes fraction", "data"),
        xytext=(-3, -3), textcoords="offset points", fontsize=6.5, color=GREY, ha="right", va="top",
    )  # fmt: skip


def _beside(axes: Axes, y: float, text: str, colour: str) -> None:
    axes.annotate(
        text, (1.0, y), xycoords=("axes fraction", "data"), xytext=(5, 0),
        textcoords="offset points", fontsize=7, color=colour, va="center", annotation_clip=False,
    )  # fmt: skip


def thinned(times: Array, values: Array) -> tuple[Array, Array]:
    """The curve reduced to at most four points per time bin; each bin's extremes are kept."""
    if len(times) <= 4 * _BINS:
        return times, values
    kept: list[int] = []
    for part in np.array_split(np.arange(len(times)), _BINS):
        known = part[~np.isnan(values[part])]
        extremes = (
            (known[values[known].argmin()], known[values[known].argmax()]) if len(known) else ()
        )
        kept += sorted({int(k) for k in (part[0], *extremes, part[-1])})
    return times[kept], values[kept]


# ----------------------------------------------------------------- lanes


def _draw_rows(axes: Axes, course: Course, names: Sequence[str]) -> None:
    colours = lane_colours(course)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_yticks(range(len(names)), names)
    for row, name in enumerate(names):
        axes.axhline(row + 0.5, color="#eceff2", lw=0.6, zorder=0.5)
        if name == "requests" and row == 0 and course.requests:
            _draw_requests(axes, course, row)
        elif name == "contacts" and course.contacts is not None and row < 2:
            _draw_contacts(axes, course.contacts, row)
        else:
            _draw_lane(axes, course, row, name, colours[name])
    axes.tick_params(axis="y", length=0)
    for label in axes.get_yticklabels():
        label.set(fontsize=8, color=INK)


def _draw_lane(axes: Axes, course: Course, row: int, lane: str, colour: str) -> None:
    spans = course.spans_of(lane)
    bars = [(max(s.start_s, course.start_s), min(s.end_s, course.end_s)) for s in spans]
    _bars(axes, course, bars, row, facecolor=colour, edgecolor=colour)
    _draw_steps(axes, course, row, lane)
    ended = [s for s in spans if s.ended in _UNHAPPY and s.end_s <= course.end_s]
    if ended:
        axes.plot(
            [s.end_s for s in ended], [row] * len(ended), zorder=4.0, clip_on=False, **_FAILED
        )
    total = sum(end - start for start, end in bars)
    lasted = f"{total:.0f} s" if total >= 100.0 else f"{total:.1f} s"
    _beside_row(axes, row, f"{len(spans)}×, {lasted}{_failed(ended)}" if spans else "never")


def _draw_steps(axes: Axes, course: Course, row: int, lane: str) -> None:
    """The names of steps, where their bars are long enough."""
    size, span = 6.5, course.end_s - course.start_s
    letter_s = 0.72 * size / 72.0 * span / _width_in(axes)
    for step in course.steps(lane):
        start, end = max(step.start_s, course.start_s), min(step.end_s, course.end_s)
        name = step.path.rpartition("/")[2]
        if end - start > letter_s * (len(name) + 1):
            axes.vlines((start, end), row - 0.36, row + 0.36, color="white", lw=0.6, zorder=2.5)
            axes.text(
                0.5 * (start + end), row, name, fontsize=size, color="white", ha="center",
                va="center", zorder=3.0, clip_on=True,
            )  # fmt: skip


def _width_in(axes: Axes) -> float:
    figure = axes.get_figure(root=True)
    assert figure is not None
    return float(axes.get_position().width * figure.get_figwidth())


def _failed(ended: Sequence[NodeSpan]) -> str:
    return f", {len(ended)} failed" if ended else ""


def _draw_requests(axes: Axes, course: Course, row: int) -> None:
    """Requests: waiting and being served in two greens, white if never served."""
    served = [(r, r.served_s) for r in course.requests if r.served_s is not None]
    unserved = [(r.start_s, r.end_s) for r in course.requests if r.served_s is None]
    _bars(axes, course, [(r.start_s, at) for r, at in served], row, facecolor=WAITED)
    held = [(at, r.end_s) for r, at in served]
    _bars(axes, course, held, row, facecolor=BEHAVIOURS["haptic"])
    _bars(axes, course, unserved, row, facecolor=UNSERVED, edgecolor=INK)
    if len(course.requests) <= 40:
        for request in course.requests:
            axes.text(
                max(request.start_s, course.start_s), row, f" {request.number}", fontsize=6.5,
                color=INK, va="center", ha="left", zorder=4.0, clip_on=True,
            )  # fmt: skip
    _beside_row(axes, row, f"{len(served)} of {len(course.requests)} served")


def _draw_contacts(axes: Axes, contacts: Sequence[Contact], row: int) -> None:
    _mark_contacts(axes, contacts, row)
    robots = sum(contact.by == "robot" for contact in contacts)
    _beside_row(axes, row, f"{len(contacts)}×, {robots} by the robot" if contacts else "none")


def _mark_contacts(axes: Axes, contacts: Sequence[Contact], height: float) -> None:
    for by, look in CONTACT.items():
        times = [contact.at_ns / 1e9 for contact in contacts if contact.by == by]
        if times:
            axes.plot(times, [height] * len(times), ms=7, zorder=5.0, clip_on=False, **look)


def _beside_row(axes: Axes, row: int, text: str) -> None:
    _beside(axes, row, text, INK)


def _bars(
    axes: Axes,
    course: Course,
    times: Sequence[tuple[float, float]],
    row: int,
    **style: Any,
) -> None:
    """Bars from start to end, s; short ones stay visible, almost adjacent ones are joined."""
    joined: list[tuple[float, float]] = []
    for start, end in times:
        if joined and start - joined[-1][1] < _SMALLEST * (course.end_s - course.start_s):
            joined[-1] = joined[-1][0], max(end, joined[-1][1])
        else:
            joined.append((start, end))
    if not joined:
        return
    low, high = row - 0.36, row + 0.36
    corners = [
        corner for a, b in joined for corner in ((a, low), (b, low), (b, high), (a, high), (a, low))
    ]
    codes = [Path.MOVETO, *[Path.LINETO] * 3, Path.CLOSEPOLY] * len(joined)
    look: Mapping[str, Any] = {"linewidth": 0.7, "edgecolor": style["facecolor"], **style}
    axes.add_patch(PathPatch(Path(corners, codes), zorder=2.0, **look))
