"""Figures 8, 9 and 10 of the paper, drawn from records and from the figures of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, FancyArrowPatch, Patch, PathPatch

from cobodeck.paper.conditions import CONDITIONS, SCENE
from cobodeck.paper.published import TABLE_2, TO_SAFETY
from cobodeck.pictures.drawing import (
    ROBOT_TRAIL,
    USER,
    Sheet,
    draw,
    ring_of,
    save,
    save_figure,
    sheet,
)
from cobodeck.pictures.run import Course, course_of, thinned
from cobodeck.record.read import Record
from cobodeck.shapes import box, wall_shapes
from engine.draw import GREY, INK, RED
from hw import Pose2
from hw.model import Footprint
from hw.scene import load_scene

Figures = Mapping[str, Any]
PARKING = "#7a4a1e"
MARK_M = 0.16
"""Radius of the mark of a person, m."""
BOX_IN = (6.4, 3.6)
BOXES = {"chase": "#0072b2", "corner": "#7a4a1e", "center": "#e69f00"}
PAPER = "#b00020"


def draw_trajectories(condition: str, record: Path, figures: Figures, to: Path) -> None:
    """Figure 8: the robot's way in a recorded run, where the person asked, the parking box."""
    course = course_of(Record(record))
    assert course.room is not None
    assert course.footprint is not None
    on = sheet(course.room.bounds, f"Figure 8, {condition}", _lines(figures))
    draw(on, wall_shapes(course.room))
    _draw_way(on, course)
    for request in figures["request_list"]:
        _draw_request(on, Pose2(*request["user"]), request["deep"])
    on.explain("person at a request", Line2D([], [], lw=0, marker="o", color=USER, ms=8))
    on.explain("request, to the DEEP", Line2D([], [], color=RED, lw=1.8, marker=">", ms=5))
    place = load_scene(SCENE).places.get(condition)
    if place is not None:
        _draw_box(on, place, course.footprint)
    save(on, to)


def _lines(figures: Figures) -> list[str]:
    parts = ", ".join((figures["planner"], figures["local_planner"], figures["localizer"]))
    way = f"{figures['distance_m']:.0f} m, {figures['escapes']} Escapes"
    return [f"{figures['requests']} requests, {way}; {figures['profile']}: {parts}"]


def _draw_way(on: Sheet, course: Course) -> None:
    way = thinned([(instant.robot.x, instant.robot.y) for instant in course.instants])
    xs, ys = zip(*way, strict=True)
    on.axes.plot(xs, ys, color=ROBOT_TRAIL, lw=0.7, alpha=0.55, solid_joinstyle="round", zorder=3.0)
    on.explain("way of the robot", Line2D([], [], color=ROBOT_TRAIL, lw=1.2))


def _draw_request(on: Sheet, user: Pose2, deep: Sequence[float]) -> None:
    on.axes.add_patch(Circle((user.x, user.y), MARK_M, fc=USER, ec="white", lw=0.6, zorder=7.0))
    ends = user.transform(MARK_M, 0.0), (deep[0], deep[1])
    arrow = FancyArrowPatch(
        *ends, color=RED, lw=1.8, arrowstyle="-|>", mutation_scale=10, shrinkA=0, shrinkB=0,
        zorder=7.1,
    )  # fmt: skip
    on.axes.add_patch(arrow)


def _draw_box(on: Sheet, place: Pose2, shape: Footprint) -> None:
    ring = ring_of(box(place, shape.half_length, shape.half_width))
    on.axes.add_patch(PathPatch(ring, fc="none", ec=PARKING, lw=2.2, zorder=6.0))
    on.explain("parking place", Patch(facecolor="none", edgecolor=PARKING, lw=2.2))


def draw_responses(conditions: Mapping[str, Figures], to: Path) -> None:
    """Figure 9: box plot of the responses of each condition, beside the paper's mean and SD."""
    groups = {
        name: [
            request["response_s"]
            for request in conditions[name]["request_list"]
            if request["response_s"] is not None
        ]
        for name in CONDITIONS
    }
    figure, axes = _axes("Figure 9: response", "response, s")
    _draw_boxes(axes, groups)
    for number, name in enumerate(CONDITIONS, 1):
        printed = TABLE_2[name]
        axes.errorbar(
            number + 0.36, printed.mean_s, yerr=printed.sd_s, color=PAPER, marker="D", ms=4,
            capsize=3, lw=1.2,
        )  # fmt: skip
    _explain(axes, "the paper's mean and SD")
    save_figure(figure, to)


def draw_to_safety(conditions: Mapping[str, Figures], to: Path) -> None:
    """Figure 10: box plot of the times of Escapes that ended safe, beside the paper's range."""
    groups = {
        name: [
            escape["time_s"]
            for escape in conditions[name]["escape_list"]
            if escape["outcome"] == "safe"
        ]
        for name in CONDITIONS
    }
    groups = {"all": [time for times in groups.values() for time in times], **groups}
    figure, axes = _axes("Figure 10: time to safety", "time to safety, s")
    _draw_boxes(axes, groups)
    below, above = TO_SAFETY.mean - TO_SAFETY.least, TO_SAFETY.most - TO_SAFETY.mean
    axes.errorbar(
        1.36, TO_SAFETY.mean, yerr=[[below], [above]], color=PAPER, marker="D", ms=4, capsize=3,
        lw=1.2,
    )  # fmt: skip
    _explain(axes, "the paper's mean and range")
    save_figure(figure, to)


def _axes(title: str, what: str) -> tuple[Figure, Axes]:
    figure = Figure(figsize=BOX_IN, layout="constrained", facecolor="white")
    axes = figure.add_subplot()
    axes.set_title(title, loc="left", fontsize=11, fontweight="bold", color=INK)
    axes.set_ylabel(what, color=INK, fontsize=9)
    axes.grid(visible=True, axis="y", color=GREY, linewidth=0.3, alpha=0.5)
    axes.tick_params(labelsize=9, colors=INK)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    return figure, axes


def _draw_boxes(axes: Axes, groups: Mapping[str, Sequence[float]]) -> None:
    """A box per group, with all its values as dots beside it; whiskers as in the paper, 1.5 IQR."""
    shown = {f"{name}\nn = {len(values)}": values for name, values in groups.items()}
    drawn = axes.boxplot(
        [list(values) for values in shown.values()], widths=0.4, patch_artist=True,
        showmeans=True, medianprops={"color": INK},
        meanprops={"marker": "D", "mfc": "white", "mec": INK, "ms": 4}, flierprops={"ms": 3},
    )  # fmt: skip
    axes.set_xticks(range(1, len(shown) + 1), list(shown))
    for name, drawn_box in zip(groups, drawn["boxes"], strict=True):
        drawn_box.set_facecolor(BOXES.get(name, GREY))
        drawn_box.set_alpha(0.55)
    axes.set_xlim(0.5, len(shown) + 0.7)


def _explain(axes: Axes, paper: str) -> None:
    """Signs in a legend above the axes, and the scale from 0 to above all that is drawn."""
    axes.set_ylim(0.0, 1.05 * axes.get_ylim()[1])
    ours = Line2D([], [], lw=0, marker="D", mfc="white", mec=INK, ms=4)
    theirs = Line2D([], [], color=PAPER, marker="D", ms=4, lw=1.2)
    axes.legend(
        [ours, theirs], ["mean", paper], fontsize=8, frameon=False, labelcolor=INK, ncols=2,
        loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2,
    )  # fmt: skip
