"""The safety envelope as a page: from which distance who walks how fast can be escaped.

A row of panels per profile, a panel per delay: walking speed against the distance of centres, a
curve per acceleration, the reach of the profile's zones, the separation in the manner of ISO/TS
15066, and recorded Escapes as points. Below them, each failed Escape and contact from above.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from behaviors.profile import load_profile
from cobodeck.avoidable import (
    HALF_LENGTH,
    RADIUS,
    EscapePoint,
    EscapeProfile,
    JudgedRun,
    boundary,
    separation,
)
from cobodeck.pictures.drawing import save_figure
from cobodeck.pictures.judged_picture import draw_events, events_of, size_of
from engine.draw import GREY, INK, RED

PROFILES = ("paper", "tuned")
ACCELERATIONS, DELAYS_S = (0.6, 1.0, 1.5, 3.0, 6.0), (0.0, 0.1, 0.2, 0.3)
SPEEDS = tuple(0.2 + 0.23 * n for n in range(11))
"""Who is slower than 0.2 m/s stands, m/s."""
FARTHEST_M = 5.0
DRIVING, BRAKING = 1.5, 3.0
"""Speed of a robot that drives at the person, m/s, and how it brakes, m/s2, for the separation."""
COLOURS, ZONE, NORM, SAFE = "viridis_r", "#7a5c00", "#8e24aa", "#2e7d32"
PANEL_IN, HEAD_IN = (3.0, 2.9), 1.0
NOTE = (
    "Distance of centres from which somebody who walks straight at a robot that stands can be "
    "escaped, on open floor, whatever the robot's yaw: above the curve of its acceleration.\n"
    "Shaded: no motion avoids the touch at the profile's own acceleration. Points: recorded "
    "Escapes, at their entry, in the panel of the run's latency."
)

Curves = Mapping[float, Sequence[float | None]]
"""Least distances at SPEEDS without a delay, m, by acceleration, m/s2."""


def draw_envelope(
    path: Path, progress: Callable[[str, float], None], runs: Sequence[JudgedRun] = ()
) -> None:
    """Compute the distances and draw them to a file; `progress` is told what and how much is done.

    Raises:
        Problem: the file's format is unknown.
    """
    rows = profiles_of(runs)
    accelerations = sorted({*ACCELERATIONS, *(row.acceleration for row in rows)})
    curves = {}
    for n, acceleration in enumerate(accelerations):
        progress(f"{acceleration:g} m/s2", n / len(accelerations))
        curves[acceleration] = boundary(SPEEDS, acceleration)
    events = events_of(runs)
    width, height = PANEL_IN[0] * len(DELAYS_S), PANEL_IN[1] * len(rows) + HEAD_IN
    below = size_of(events)[1] if events else 0.0
    size = (max(width, size_of(events)[0]) if events else width, height + below)
    figure = Figure(figsize=size, layout="constrained", facecolor="white")
    shares = (height, below) if events else (height,)
    top, *rest = figure.subfigures(len(shares), 1, squeeze=False, height_ratios=shares).ravel()
    _draw_rows(top, rows, curves, runs)
    for bottom in rest:
        draw_events(bottom, events)
    save_figure(figure, path)


def profiles_of(runs: Iterable[JudgedRun]) -> list[EscapeProfile]:
    """The shipped profiles, and those of the runs that differ from them."""
    shipped = [EscapeProfile.of(name, load_profile(name).values) for name in PROFILES]
    return list(dict.fromkeys([*shipped, *(found.run.profile for found in runs)]))


def _draw_rows(
    figure: Figure | SubFigure,
    rows: Sequence[EscapeProfile],
    curves: Curves,
    runs: Sequence[JudgedRun],
) -> None:
    panels = figure.subplots(len(rows), len(DELAYS_S), sharex=True, sharey=True, squeeze=False)
    for profile, line in zip(rows, panels, strict=True):
        points = [p for found in runs if found.run.profile == profile for p in found.escapes]
        own = min(DELAYS_S, key=lambda delay: abs(delay - profile.latency_s))
        for delay, axes in zip(DELAYS_S, line, strict=True):
            draw_panel(axes, profile, delay, curves, points if delay == own else ())
        line[0].set_ylabel(f"{_title(profile)}\ndistance of centres, m", fontsize=8, color=INK)
    for delay, axes in zip(DELAYS_S, panels[0], strict=True):
        axes.set_title(f"the robot moves after {1e3 * delay:.0f} ms", fontsize=8, color=INK)
    for axes in panels[-1]:
        axes.set_xlabel("walking speed, m/s", fontsize=8, color=INK)
    figure.suptitle(NOTE, fontsize=8, color=GREY, x=0.01, ha="left")
    signs = _legend(curves)
    figure.legend(
        list(signs.values()), list(signs), loc="outside lower left", ncols=5, frameon=False,
        fontsize=7, labelcolor=INK,
    )  # fmt: skip


def _title(profile: EscapeProfile) -> str:
    return (
        f"{profile.name}: {profile.acceleration:g} m/s², reckons with "
        f"{1e3 * profile.reaction_s:.0f} ms"
    )


def draw_panel(
    axes: Axes,
    profile: EscapeProfile,
    delay_s: float,
    curves: Curves,
    points: Iterable[EscapePoint],
) -> None:
    """One panel on its axes."""
    speeds = np.array(SPEEDS)
    for acceleration, found in curves.items():
        least = delayed(found, delay_s)
        own = acceleration == profile.acceleration
        axes.plot(speeds, least, color=_colour(acceleration, curves), lw=2.6 if own else 1.2)
        if own:
            axes.fill_between(speeds, 0.0, least, color=RED, alpha=0.07, lw=0.0)
            _crossings(axes, profile, least)
    apart = [separation(v, DRIVING, delay_s, BRAKING) + HALF_LENGTH + RADIUS for v in SPEEDS]
    axes.plot(speeds, apart, color=NORM, lw=1.2, ls=(0, (5, 2)))
    for point in points:
        _draw_point(axes, point)
    axes.set_xlim(SPEEDS[0], SPEEDS[-1])
    axes.set_ylim(1.0, FARTHEST_M)
    axes.grid(color=GREY, alpha=0.2, lw=0.5)
    axes.tick_params(length=2, width=0.5, labelsize=7, colors=GREY)
    axes.spines[:].set(color=GREY, linewidth=0.4)


def delayed(found: Sequence[float | None], delay_s: float) -> np.ndarray:
    """Least distances after this delay, m; NaN where they are farther than was searched."""
    least = np.array([math.nan if one is None else one for one in found])
    return least + delay_s * np.array(SPEEDS)


def _crossings(axes: Axes, profile: EscapeProfile, least: np.ndarray) -> None:
    """Up to which speed the reach of each zone suffices, at the profile's own acceleration."""
    for reach in (profile.ahead, profile.around):
        axes.axhline(reach, color=ZONE, lw=0.9, ls=":")
        speed = float(np.interp(reach, least, SPEEDS))
        axes.plot([speed], [reach], marker="o", ms=4, mfc="white", mec=ZONE, zorder=4.0)
        axes.annotate(
            f"{reach:g} m: up to {speed:.2f} m/s", (SPEEDS[-1], reach), xytext=(-2, -3),
            textcoords="offset points", fontsize=6.5, color=ZONE, ha="right", va="top",
            bbox={"fc": "white", "ec": "none", "alpha": 0.75, "pad": 0.8}, zorder=3.5,
        )  # fmt: skip


def _draw_point(axes: Axes, point: EscapePoint) -> None:
    """A recorded Escape: by how it ended, hollow if there was no way out."""
    failed, safe = point.outcome == "failed", point.outcome == "safe"
    colour = RED if failed else SAFE if safe else GREY
    axes.plot(
        [point.speed], [min(point.distance, FARTHEST_M)], marker="X" if failed else "o", ms=4.5,
        mec=colour, mfc=colour if point.free else "white", mew=0.9, ls="", zorder=5.0,
    )  # fmt: skip


def _colour(acceleration: float, curves: Curves) -> tuple[float, float, float, float]:
    order = sorted(curves)
    share = order.index(acceleration) / max(1, len(order) - 1)
    found: tuple[float, float, float, float] = mpl.colormaps[COLOURS](0.1 + 0.8 * share)
    return found


def _legend(curves: Curves) -> dict[str, Line2D | Patch]:
    signs: dict[str, Line2D | Patch] = {
        f"{a:g} m/s²": Line2D([], [], color=_colour(a, curves), lw=1.6) for a in curves
    }
    signs["cannot be escaped"] = Patch(color=RED, alpha=0.12, lw=0.0)
    signs["reach of the zones"] = Line2D([], [], color=ZONE, lw=0.9, ls=":")
    norm = f"separation as in ISO/TS 15066, the robot at {DRIVING:g} m/s: a report, not conformity"
    signs[norm] = Line2D([], [], color=NORM, lw=1.2, ls=(0, (5, 2)))
    dots = {"Escape, safe": ("o", SAFE), "failed": ("X", RED), "broken off": ("o", GREY)}
    for name, (marker, colour) in dots.items():
        signs[name] = Line2D([], [], marker=marker, color=colour, ls="", ms=4.5)
    signs["no way out"] = Line2D([], [], marker="o", mec=INK, mfc="white", ls="", ms=4.5)
    return signs
