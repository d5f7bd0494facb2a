"""Figures and health of a run so far, from its model."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cobodeck.live.model import RunModel
from hw import Truth


def figures_of(model: RunModel) -> list[tuple[str, str]]:
    """Figures so far, by their names, as texts."""
    rows = [("time", f"{model.at_ns / 1e9:.1f} s"), ("transitions", str(model.transitions))]
    truth = model.truth
    if truth is not None:
        rows += _of_truth(truth)
    if model.requests:
        rows.append(("requests", str(model.requests)))
    if model.errors:
        rows.append(("errors", str(model.errors)))
    if model.missed:
        rows.append(("missed ticks", str(model.missed)))
    return rows


def health_of(model: RunModel) -> dict[str, Any]:
    """Late and missed ticks, refused samples, and how old the newest sample of each signal is.

    As the message `health` has it.
    """
    ages = {s.name: max(0.0, (model.at_ns - s.stamp_ns) / 1e9) for s in model.samples()}
    told = {"t": "health", "at": model.at_ns / 1e9, "late": model.late, "missed": model.missed}
    return {
        **told, "gates": model.refused, "ages": ages,
        "tick_p99_ms": None, "dropped": 0, "children": [],
    }  # fmt: skip


def _of_truth(truth: Truth) -> Iterator[tuple[str, str]]:
    if truth.distance_m is not None:
        yield "travelled", f"{truth.distance_m:.1f} m"
    if truth.min_gap is not None:
        yield "least gap", f"{truth.min_gap:.2f} m"
    if truth.contacts is not None:
        yield "contacts", str(len(truth.contacts))
    if truth.wall_hits is not None:
        yield "touches of walls", str(truth.wall_hits)
