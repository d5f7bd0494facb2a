"""Why requests were not served: the outcome of the Haptic behaviour that they started."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from engine.machine import Box
from engine.run import ChartRun

Interval = tuple[int, int]
"""When a request began and ended, ns."""

IN_TIME = "not served in time"
"""Reason if no Haptic ended early: the user let go, or the run ended, before the prop arrived."""

REASONS: Mapping[str, str] = {
    "deep_blocked": "DEEP in or behind a wall",
    "no_pose": "no Haptic pose",
    "no_way": "Haptic poses cut off",
    "out_of_reach": "DEEP out of reach",
    "no_path": "no path to the Haptic pose",
    "stuck": "stuck on the path",
    "lost": "base or user lost",
    "no_solution": "DEEP out of reach",
    "blocked": "no free path for the arm",
    "failed": "the arm did not get there",
    "timeout": "took too long",
}
"""Reason for a failed Haptic, by the first of these outcomes with which one of its leaves ended,
since it last chose a pose."""

BROKEN_OFF: Mapping[str, str] = {
    "fault": "broken off by a fault",
    "user_lost": "base or user lost",
    "error": "broken off by an error",
}
"""Reason for a Haptic that was broken off, by its outcome."""


def refusals(run: ChartRun, unserved: Iterable[Interval]) -> dict[str, int]:
    """The number of unserved requests by reason.

    A request counts once, with the last Haptic that ended early during it; `IN_TIME` if none did.
    """
    failed, found = failures(run), dict[str, int]()
    for begin, end in unserved:
        reason = next((r for time, r in reversed(failed) if begin <= time <= end), IN_TIME)
        found[reason] = found.get(reason, 0) + 1
    return found


def failures(run: ChartRun) -> list[tuple[int, str]]:
    """When each Haptic failed or was broken off, ns, and the reason, in order."""
    boxes = {
        vertex.path
        for vertex in run.machine.vertices.values()
        if isinstance(vertex, Box) and vertex.chart == "haptic"
    }
    leaves = {
        leaf.path
        for leaf in run.machine.leaves
        if any(leaf.path.startswith(f"{box}/") for box in boxes)
    }
    begins = boxes | {leaf for leaf in leaves if leaf.endswith("/choose")}
    found, first = [], "failed"
    for record in run.trace:
        if record.kind == "enter" and record.subject in begins:
            first = "failed"
        if record.kind != "outcome":
            continue
        outcome = record.detail[0]
        if record.subject in leaves and outcome in REASONS and first == "failed":
            first = outcome
        elif record.subject in boxes and outcome in ("failed", *BROKEN_OFF):
            found.append((record.time, BROKEN_OFF.get(outcome) or REASONS[first]))
    return found
