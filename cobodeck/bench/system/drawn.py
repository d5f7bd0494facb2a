"""The rows of the pictures: which figures are drawn, and how they are read."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

OneRow = Mapping[str, Any]
"""A value of a knob, as `comparison.compared` gives it."""
COST = "CPU, ms per s"
NONE = (math.nan, math.nan, math.nan)
NOTES = {
    "precision": (
        "What precision is worth. Differences from ours (shaded) are of runs of the same worlds. "
        "Bounds of 95 %."
    ),
    "keys": (
        "What the keys of the profile do: people at random, 200 requests a value; ours is shaded. "
        "Bounds of 95 %."
    ),
    "disturbed": "Which disturbances are borne; ours is shaded. Bounds of 95 %.",
}


def _cost(row: OneRow) -> tuple[float, float, float]:
    return (row["cpu_ms_per_s"],) * 3


def _hardest(row: OneRow) -> tuple[float, float, float]:
    return NONE if row["impact_m_s"] is None else (row["impact_m_s"],) * 3


def _mean(kind: str, name: str, row: OneRow) -> tuple[float, float, float]:
    found = row[kind][name]
    return NONE if found is None else (found["mean"], found["low"], found["high"])


def _share(name: str, row: OneRow) -> tuple[float, float, float]:
    found = row["shares"][name]
    if found is None:
        return NONE
    share = found["hits"] / found["of"]
    return 100.0 * share, 100.0 * found["low"], 100.0 * found["high"]


FIGURES: Mapping[str, Mapping[str, Callable[[OneRow], tuple[float, float, float]]]] = {
    "precision": {
        COST: _cost,
        "response, s,\nless ours": partial(_mean, "differences", "response_s"),
        "Escapes per\nrequest, less ours": partial(_mean, "differences", "escapes_per_request"),
        "least gap, m,\nless ours": partial(_mean, "differences", "least_gap_m"),
        "unserved, %": partial(_share, "unserved"),
        "prop error, mm": partial(_mean, "means", "prop_error_mm"),
        "pose error, mm": partial(_mean, "means", "pose_error_mm"),
    },
    "keys": {
        "response, s": partial(_mean, "means", "response_s"),
        "Escapes\nper request": partial(_mean, "means", "escapes_per_request"),
        "runs with any\ntouch, %": partial(_share, "touched"),
        "least gap, m,\nof a run": partial(_mean, "means", "least_gap_m"),
        "3 to 4 m away\nwhile they walk": partial(_mean, "means", "beside_share_3_4"),
        "driven, m\nper minute": partial(_mean, "means", "travelled_m"),
        "unserved, %": partial(_share, "unserved"),
    },
    "disturbed": {
        "runs with a touch\nby the robot, %": partial(_share, "touched_by_robot"),
        "runs with any\ntouch, %": partial(_share, "touched"),
        "hardest touch, m/s": _hardest,
        "Escapes\nper request": partial(_mean, "means", "escapes_per_request"),
        "unserved, %": partial(_share, "unserved"),
        "response, s": partial(_mean, "means", "response_s"),
        "runs with a\nstop, %": partial(_share, "stopped"),
    },
}
"""The rows of each picture, by their titles."""
