"""The least distances from which a person can be escaped, over their speed and the acceleration."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cobodeck.avoidable import GAP, WALL_M, ZONES, Oncoming, least_distance
from cobodeck.pictures.drawing import save_figure
from engine.draw import GREY, INK

SPEEDS, ACCELERATIONS = (0.5, 1.0, 1.5, 2.0), (0.5, 1.0, 1.5, 2.0, 3.0)
REACTIONS_S = (None, 0.3, 0.5, 0.8)
DELAY_S = 0.2
SIZE_IN = (11.0, 6.6)
COLOURS, NEAREST_M, FARTHEST_M = "YlOrRd", 1.0, 5.0
DARK_M = 3.2
"""Beyond this distance the colour is dark, and the text on it white, m."""
NOTE = (
    f"Metres between the centres when the person sets off at a robot that stands: without a touch, "
    f"in brackets without an Escape.\nThe robot moves, and shows the sign, {DELAY_S:g} s after; "
    "each 0.1 s more adds 0.1 s of walking. Who reacts stops 0.5 s later."
)


def draw_envelope(path: Path, progress: Callable[[str, float], None]) -> None:
    """Compute the distances and draw them to a file; `progress` is told what and how much is done.

    Raises:
        Problem: the file's format is unknown.
    """
    figure = Figure(figsize=SIZE_IN, layout="constrained", facecolor="white")
    panels = figure.subplots(2, len(REACTIONS_S), sharex=True, sharey=True)
    for row, wall in enumerate((False, True)):
        for column, reaction in enumerate(REACTIONS_S):
            done = (row * len(REACTIONS_S) + column) / panels.size
            progress(f"panel {row * len(REACTIONS_S) + column + 1} of {panels.size}", done)
            _draw(panels[row, column], reaction, wall)
    for panel in panels[-1]:
        panel.set_xlabel("speed of the person, m/s", fontsize=8, color=INK)
    for panel in panels[:, 0]:
        panel.set_ylabel("acceleration, m/s²", fontsize=8, color=INK)
    figure.suptitle(NOTE, fontsize=8, color=GREY, x=0.01, ha="left")
    save_figure(figure, path)


def _draw(axes: Axes, reaction_s: float | None, wall: bool) -> None:
    cases = [[Oncoming(v, a, DELAY_S, reaction_s, wall) for v in SPEEDS] for a in ACCELERATIONS]
    touch, zone = (
        np.array([[_number(least_distance(case, aim)) for case in row] for row in cases])
        for aim in (GAP, ZONES)
    )
    axes.imshow(touch, cmap=COLOURS, vmin=NEAREST_M, vmax=FARTHEST_M, origin="lower", aspect="auto")
    for row, column in np.ndindex(touch.shape):
        text = f"{touch[row, column]:.2f}\n({zone[row, column]:.2f})"
        colour = "white" if touch[row, column] > DARK_M else INK
        axes.text(column, row, text, ha="center", va="center", fontsize=7, color=colour)
    axes.set_xticks(range(len(SPEEDS)), [f"{speed:g}" for speed in SPEEDS])
    axes.set_yticks(range(len(ACCELERATIONS)), [f"{a:g}" for a in ACCELERATIONS])
    axes.tick_params(length=0, labelsize=7, colors=GREY)
    heeds = "does not stop" if reaction_s is None else f"reacts to the sign in {reaction_s:g} s"
    where = f"wall {WALL_M:g} m behind" if wall else "open floor"
    axes.set_title(f"{where}: {heeds}", fontsize=8, color=INK)


def _number(distance: float | None) -> float:
    return np.nan if distance is None else distance
