"""Judges each failed Escape and each contact of a recorded run: could it have been avoided?

It was avoidable if some motion of three phases, begun at the decision, touches nobody, with the
person's future known. The decision is the entry into Escape; for a contact that of the last Escape
before it, or, if that was over, the moment when the person began to walk again.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from cobodeck.avoidable.futures import unwarned, walking_since
from cobodeck.avoidable.motion_search import (
    RADIUS,
    BestMotion,
    Question,
    Walk,
    best_motion,
    is_avoidable,
)
from cobodeck.avoidable.recorded_escapes import EscapeVisit, RecordedRun
from cobodeck.avoidable.shapes import way_distance

What = Literal["failed Escape", "contact by the robot", "contact by the person"]
Future = Literal["unwarned", "recorded"]

HORIZON_S, AFTER_S = 3.0, 1.0
"""A motion is judged for HORIZON_S at least, and until AFTER_S after the event, s."""
EARLIER_S, EVERY_S = 2.0, 0.1
"""Decisions are tried from EARLIER_S before the actual one on, each EVERY_S."""


@dataclass(frozen=True, slots=True)
class JudgedEvent:
    """A failed Escape or a contact; times in s since the start of the run.

    Attributes:
        what: what it is; `at_s` when, `decided_s` when the robot had to decide.
        future: the one that decides; `best` is the best motion against it, None if each one
            touches a wall.
        latest_s: the latest decision for which there was a way without contact; None: there was
            none in the time searched.
        other: the best motion against the other future.
        real_gap: the least gap of what the robot did until `until_s`, m; at most 0 in contact.
        walk: the person in `future`.
    """

    what: What
    at_s: float
    decided_s: float
    until_s: float
    future: Future
    best: BestMotion | None
    latest_s: float | None
    other: BestMotion | None
    real_gap: float
    walk: Walk

    @property
    def avoidable(self) -> bool:
        """True if there was a way without contact at the decision."""
        return self.best is not None and self.best.free

    def plain(self) -> dict[str, Any]:
        """As values for JSON."""
        other: Future = "recorded" if self.future == "unwarned" else "unwarned"
        return {
            "what": self.what,
            "at_s": self.at_s,
            "decided_s": self.decided_s,
            "until_s": self.until_s,
            "future": self.future,
            "avoidable": self.avoidable,
            "latest_s": self.latest_s,
            "real_gap_m": self.real_gap,
            "best": {self.future: _plain(self.best), other: _plain(self.other)},
        }


def _plain(motion: BestMotion | None) -> dict[str, Any] | None:
    if motion is None:
        return None
    return {
        "gap_m": motion.gap,
        "clear_after_s": motion.clear_s,
        "phases": [{"action": action, "for_s": span} for action, span in motion.phases],
        "motions": motion.tried,
        "path": motion.poses.tolist(),
    }


def judge(run: RecordedRun) -> Iterator[JudgedEvent]:
    """All failed Escapes and all contacts of a run, in order of time."""
    events: list[tuple[float, float, What]] = [
        (escape.end_s, escape.start_s, "failed Escape")
        for escape in run.escapes
        if escape.outcome == "failed" and escape.end_s is not None
    ]
    for at_s, by in run.contacts:
        what: What = "contact by the robot" if by == "robot" else "contact by the person"
        events.append((at_s, decision_before(run, at_s), what))
    for at_s, decided_s, what in sorted(events):
        yield judged(run, what, at_s, decided_s)


def avoidable_contacts(run: RecordedRun) -> int:
    """The number of contacts for which there was a way without contact at the decision."""
    questions = (
        question_at(run, at_s, decision_before(run, at_s), "recorded") for at_s, _ in run.contacts
    )
    return sum(map(is_avoidable, questions))


def decision_before(run: RecordedRun, at_s: float) -> float:
    """When the robot had to decide what to do about a contact at this time, s.

    When it entered the last Escape, unless that was over before the person began to walk again.
    """
    walks_s = walking_since(run, at_s)
    last = max((e for e in run.escapes if e.start_s <= at_s), key=_entry, default=None)
    if last is None or (last.end_s is not None and last.end_s < walks_s):
        return walks_s
    return last.start_s


def _entry(escape: EscapeVisit) -> float:
    return escape.start_s


def judged(run: RecordedRun, what: What, at_s: float, decided_s: float) -> JudgedEvent:
    """One event; failed Escapes are judged by the unwarned future, contacts by the recorded one."""
    future: Future = "unwarned" if what == "failed Escape" else "recorded"
    asked = question_at(run, at_s, decided_s, future)
    other = question_at(run, at_s, decided_s, "recorded" if future == "unwarned" else "unwarned")
    until_s = decided_s + asked.horizon_s
    return JudgedEvent(
        what,
        at_s,
        decided_s,
        until_s,
        future,
        best_motion(asked),
        latest(run, at_s, decided_s, future),
        best_motion(other),
        gap_between(run, decided_s, until_s),
        asked.walk,
    )


def latest(run: RecordedRun, at_s: float, decided_s: float, future: Future) -> float | None:
    """The latest time up to the event from which there was a way without contact, s."""
    first = max(float(run.times[0]), decided_s - EARLIER_S)
    after, before = (math.floor(s / EVERY_S + 1e-6) for s in (at_s - decided_s, decided_s - first))
    for n in range(after, -before - 1, -1):
        start_s = decided_s + n * EVERY_S
        if is_avoidable(question_at(run, at_s, start_s, future)):
            return start_s
    return None


def question_at(run: RecordedRun, at_s: float, start_s: float, future: Future) -> Question:
    """What could be done from `start_s` on about an event at `at_s`."""
    horizon_s = max(HORIZON_S, at_s + AFTER_S - start_s)
    walk = run.way if future == "recorded" else unwarned(run, start_s, start_s + horizon_s)
    return Question(
        run.robot_at(start_s),
        run.limits,
        walk,
        start_s,
        horizon_s,
        blind_s=run.blind_between(start_s, start_s + horizon_s),
        walls=run.walls,
    )


def gap_between(run: RecordedRun, start_s: float, end_s: float) -> float:
    """The least gap of robot and person in a span of time, m."""
    inside = np.flatnonzero((run.times >= start_s - 1e-6) & (run.times <= end_s + 1e-6))
    a, b = run.limits.half_length, run.limits.half_width
    off = run.person[inside, :2] - run.robot[inside, :2]
    c, s = np.cos(run.robot[inside, 2]), np.sin(run.robot[inside, 2])
    seen = np.stack([c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0]], axis=1).tolist()
    ways = zip(seen, seen[1:] or seen, strict=False)
    return min(way_distance(a, b, *before, *after) for before, after in ways) - RADIUS
