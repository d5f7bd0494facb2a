"""Why requests were not served: the outcome of the Haptic behaviour that they started."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from cobodeck.evaluate.figures import boxes_of
from engine.run import ChartRun
from hw import Pose2, Pose3


class Unserved(NamedTuple):
    """A request that was not served: when it began and ended, ns; its DEEP, and who asked."""

    begin: int
    end: int
    deep: Pose3
    user: Pose2 | None


IN_TIME = "not served in time"
"""Reason if no Haptic ended early: the user let go, or the run ended, before the prop arrived."""

TOO_NEAR, NO_POSE = "DEEP in, behind or too near a wall", "no Haptic pose"
WALLED = (TOO_NEAR, NO_POSE)
"""Reasons by which walls are in the way."""
REASONS: Mapping[str, str] = {
    "deep_blocked": TOO_NEAR,
    "no_pose": NO_POSE,
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


def refused(run: ChartRun, unserved: Iterable[Unserved]) -> Iterator[tuple[Unserved, str]]:
    """The unserved requests, each with its reason.

    It is that of the last Haptic that ended early during the request; `IN_TIME` if none did.
    """
    failed = failures(run)
    for one in unserved:
        within = (reason for time, reason in reversed(failed) if one.begin <= time <= one.end)
        yield one, next(within, IN_TIME)


def failures(run: ChartRun) -> list[tuple[int, str]]:
    """When each Haptic failed or was broken off, ns, and the reason, in order."""
    boxes = boxes_of(run, "haptic")
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
