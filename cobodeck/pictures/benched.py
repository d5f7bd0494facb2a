"""Run time against error of a benchmark, one line per varied setting."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from cobodeck.pictures.drawing import save_figure
from cobodeck.terminal import Problem
from engine.draw import GREY, INK

SIZE_IN = (9.0, 6.0)
TableRows = Sequence[Mapping[str, Any]]


def draw_bench(rows: TableRows, path: Path) -> None:
    """Draw the rows that have a varied setting (`knob`), a time and an error, to a file.

    Raises:
        Problem: there are no such rows, or the file's format is unknown.
    """
    drawn = list(_lines(rows))
    if not drawn:
        raise Problem("no row of these benchmarks has a setting, a time and an error to draw")
    figure = Figure(figsize=SIZE_IN, layout="constrained")
    axes = figure.add_subplot()
    for title, line in drawn:
        times = [row["time_us"] for row in line]
        errors = [row["error"] for row in line]
        axes.plot(times, errors, marker="o", markersize=4, linewidth=1, label=title)
        for row, time, error in zip(line, times, errors, strict=True):
            axes.annotate(
                f"{row['value']:g}", (time, error), xytext=(4, 4), textcoords="offset points",
                fontsize=7, color=INK,
            )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter("{x:g}")
        axis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("time, µs", color=INK)
    axes.set_ylabel(f"error, {drawn[0][1][0]['error_unit']}", color=INK)
    axes.grid(visible=True, which="both", color=GREY, linewidth=0.3, alpha=0.5)
    axes.legend(frameon=False, fontsize=8, labelcolor=INK)
    save_figure(figure, path)


def _lines(rows: TableRows) -> Iterator[tuple[str, TableRows]]:
    """Titles, each with the consecutive rows of one benchmark and one setting."""
    whole = (row for row in rows if None not in (row["knob"], row["time_us"], row["error"]))
    for key, line in groupby(whole, key=lambda row: (row["name"], row["variant"], row["knob"])):
        name, variant, knob = key
        what = name if variant == "cobodeck" else f"{name} {variant}"
        yield f"{what}, {knob}", list(line)
