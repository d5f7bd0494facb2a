"""Benchmarks as one page of small plots: run time against error, a plot per error.

Where there is no error the run time stands over the size of the work. A line is one varied setting
of one variant; its values stand at the points, and a ring marks the one that we use.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, NullLocator

from cobodeck.pictures.drawing import save_figure
from cobodeck.terminal import Problem
from engine.draw import GREY, INK

COLUMNS, WIDTH_IN, HEIGHT_IN = 3, 4.9, 2.7
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7f7f7f")
MARKERS = "osD^vP*"
LABEL_PT = ((3.0, 3.0), (-3.0, -8.0), (3.0, -8.0), (-3.0, 3.0))
"""Where the values of a line stand from its points, line by line in turn."""
TOGETHER_PX = 8.0
MOST_TICKS, FEWEST_TICKS = 5, 2
TIMES = ((1e6, "s"), (1e3, "ms"), (1.0, "µs"))
"""Units of time: how many µs they have."""
TableRow = Mapping[str, Any]
_Place = tuple[float, float]
TableRows = Sequence[TableRow]


@dataclass(frozen=True, slots=True)
class BenchPlot:
    """One plot: its title, and the rows of its lines, by label; a line may be a single point."""

    title: str
    lines: Mapping[str, TableRows]

    @property
    def rows(self) -> list[TableRow]:
        """The rows of all lines."""
        return [row for line in self.lines.values() for row in line]

    @property
    def has_errors(self) -> bool:
        """True if errors are drawn, else sizes."""
        return self.rows[0]["error"] is not None


def draw_bench(rows: TableRows, path: Path) -> None:
    """Draw the curves among the rows to a file.

    Raises:
        Problem: there is none, or the file's format is unknown.
    """
    plots = list(bench_plots(rows))
    if not plots:
        raise Problem("no row of these benchmarks has a setting and a time to draw")
    columns = min(COLUMNS, len(plots))
    height = math.ceil(len(plots) / columns)
    size = (columns * WIDTH_IN, height * HEIGHT_IN)
    figure = Figure(figsize=size, layout="constrained", facecolor="white")
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.12)  # type: ignore[union-attr,call-arg]
    places = figure.subplots(height, columns, squeeze=False).flat
    for place, plot in itertools.zip_longest(places, plots):
        if plot is None:
            place.set_axis_off()
        else:
            _draw(place, plot)
    save_figure(figure, path)


def bench_plots(rows: TableRows) -> Iterator[BenchPlot]:
    """The plots of all curves: what has a time, and a varied setting with two values at least."""
    found: dict[tuple[Any, ...], dict[str, list[TableRow]]] = {}
    for row in rows:
        if row["time_us"] is not None:
            kind = row["bench"], row["name"], row["error_unit"]
            found.setdefault(kind, {}).setdefault(_label(row), []).append(row)
    for (bench, name, unit), lines in found.items():
        if unit is None:
            lines = {label: line for label, line in lines.items() if line[0]["knob"] is not None}
        if any(len({row["value"] for row in line}) > 1 for line in lines.values()):
            yield BenchPlot(f"{bench}: {name}", lines)


def _label(row: TableRow) -> str:
    """The variant, with the varied setting; over a size that is told by the axis."""
    only = row["knob"] is None or row["error"] is None
    return str(row["variant"]) if only else f"{row['variant']}, {row['knob']}"


def _draw(axes: Axes, plot: BenchPlot) -> None:
    scale, unit = _unit(plot.rows)
    drawn = {
        label: [_point(plot, row, scale) for row in line] for label, line in plot.lines.items()
    }
    styles = list(zip(itertools.cycle(COLOURS), MARKERS, strict=False))
    for (label, points), (colour, marker) in zip(
        drawn.items(), itertools.cycle(styles), strict=False
    ):
        axes.plot(
            *zip(*points, strict=True), color=colour, marker=marker, markersize=3.5,
            linewidth=1.0, label=label,
        )  # fmt: skip
    for axis, values in zip(
        (axes.xaxis, axes.yaxis), zip(*itertools.chain(*drawn.values()), strict=True), strict=True
    ):
        _scale(axis, values)
    for n, (label, points) in enumerate(drawn.items()):
        colour = styles[n % len(styles)][0]
        _mark(axes, plot.lines[label], points, colour, LABEL_PT[n % len(LABEL_PT)])
    time, what = f"time, {unit}", _what(plot)
    axes.set_xlabel(time if plot.has_errors else what, fontsize=7, color=INK)
    axes.set_ylabel(what if plot.has_errors else time, fontsize=7, color=INK)
    axes.set_title(plot.title, fontsize=9, color=INK, loc="left", pad=14)
    axes.text(0.0, 1.02, _reference(plot), transform=axes.transAxes, fontsize=6.5, color=GREY)
    axes.grid(visible=True, color=GREY, linewidth=0.3, alpha=0.4)
    axes.spines[["top", "right"]].set_visible(False)
    axes.tick_params(labelsize=7, colors=GREY)
    _explain(axes, plot)


def _unit(rows: TableRows) -> tuple[float, str]:
    middle = sorted(row["time_us"] for row in rows)[len(rows) // 2]
    return next((scale, unit) for scale, unit in TIMES if middle >= scale or scale == 1.0)


def _point(plot: BenchPlot, row: TableRow, scale: float) -> _Place:
    time = row["time_us"] / scale
    return (time, row["error"]) if plot.has_errors else (row["value"], time)


def _mark(
    axes: Axes, line: TableRows, points: Sequence[_Place], colour: str, off: tuple[float, float]
) -> None:
    """The values of a line's setting at its points; rings about what we use.

    Points that lie on each other share a label, with the first and the last of their values.
    """
    for point in (point for row, point in zip(line, points, strict=True) if row.get("default")):
        axes.plot(
            *point, marker="o", markersize=9, markerfacecolor="none", markeredgecolor=INK,
            markeredgewidth=1.0, linestyle="none",
        )  # fmt: skip
    if line[0]["error"] is None or line[0]["knob"] is None:
        return
    for group in _together(axes, points):
        ends = dict.fromkeys(f"{round(line[k]['value'], 4):g}" for k in (group[0], group[-1]))
        axes.annotate(
            "…".join(ends), points[group[0]], xytext=off, textcoords="offset points",
            fontsize=6, color=colour, ha="left" if off[0] > 0.0 else "right",
        )  # fmt: skip


def _together(axes: Axes, points: Sequence[_Place]) -> list[list[int]]:
    """The numbers of the points, those in one group that follow and lie on each other."""
    places = axes.transData.transform(points).tolist()
    groups: list[list[int]] = []
    for n, place in enumerate(places):
        if groups and math.dist(place, places[groups[-1][0]]) < TOGETHER_PX:
            groups[-1].append(n)
        else:
            groups.append([n])
    return groups


def _what(plot: BenchPlot) -> str:
    first = plot.rows[0]
    return str(first["error_unit"] if plot.has_errors else first["knob"])


def _reference(plot: BenchPlot) -> str:
    told = ", ".join(dict.fromkeys(row["reference"] for row in plot.rows if row["reference"]))
    return f"against {told}" if told and plot.has_errors else told


def _explain(axes: Axes, plot: BenchPlot) -> None:
    """The legend, beside the plot."""
    labelled, _ = axes.get_legend_handles_labels()
    handles: list[Any] = [*labelled]
    if any(row.get("default") for row in plot.rows):
        handles.append(
            Line2D(
                [], [], linestyle="none", marker="o", markersize=8, markerfacecolor="none",
                markeredgecolor=INK, label="what we use",
            )
        )  # fmt: skip
    axes.legend(
        handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), frameon=False, fontsize=6.5,
        labelcolor=INK, borderaxespad=0.0,
    )  # fmt: skip


def _scale(axis: Axis, values: Sequence[float]) -> None:
    """A logarithmic axis with ticks at round numbers; zeros stand apart, below all others."""
    positive = [value for value in values if value > 0.0]
    least, most = (min(positive), max(positive)) if positive else (1.0, 1.0)
    ticks = round_numbers(least, most)
    beside = 1.25 * (most / least) ** 0.07
    low, high = least / beside, most * beside
    scale, name = axis.axes, axis.axis_name  # type: ignore[attr-defined]
    if len(positive) < len(values):
        low, ticks = -0.4 * least, [0.0, *ticks]
        getattr(scale, f"set_{name}scale")("symlog", linthresh=least, linscale=0.3)
    else:
        getattr(scale, f"set_{name}scale")("log")
    axis.set_major_locator(FixedLocator(ticks))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter("{x:g}")
    getattr(scale, f"set_{name}lim")(low, high)


def round_numbers(least: float, most: float) -> list[float]:
    """A few round numbers from `least` to `most`, both above 0; for ticks."""
    first, last = math.floor(math.log10(least)), math.ceil(math.log10(most))
    for steps in ((1.0,), (1.0, 3.0), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)):
        ticks = [
            float(f"{step}e{power}") for power in range(first, last + 1) for step in steps
        ]  # fmt: skip
        ticks = [tick for tick in ticks if least / 1.3 <= tick <= most * 1.5]
        if len(ticks) > FEWEST_TICKS:
            break
    every = max(1, math.ceil(len(ticks) / (MOST_TICKS + 1)))
    return ticks[::every] or [float(f"{least:.2g}")]
