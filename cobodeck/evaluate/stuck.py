"""Why a drive came to nothing: its goal itself, or what was next to the robot."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from cobodeck.evaluate.metrics import PoseSource
from engine.run import ChartRun
from hw import Pose2
from hw.model import Footprint
from hw.scene import Scene, contains
from hw.sim.contact import BESIDE_M, nearest

OUTCOMES = ("stuck", "no_path")
"""Outcomes of a leaf whose drive came to nothing."""
PLACE_M = 0.5
"""A base that is nearer than this to where it was, m, is still at that place."""


@dataclass(slots=True)
class StuckWatch:
    """Notes what was next to the robot whenever a drive came to nothing; call `watch` once a tick.

    Drives that come to nothing at one place are listed once, as the first of them, from `at_s` to
    `until_s`, that of the last one before the base leaves the place.
    """

    plant: PoseSource
    run: ChartRun
    scene: Scene
    footprint: Footprint
    found: list[dict[str, Any]] = field(default_factory=list)
    _place: tuple[float, float] | None = None  # of the last entry, until the base has left it
    _read: int = 0
    _goals: dict[str, tuple[Pose2, ...]] = field(default_factory=dict)  # of running leaves, by path

    @property
    def leaps(self) -> bool:
        """Nothing ends in a leap."""
        return True

    def watch(self, now_ns: int) -> None:
        """Look at what has ended since the last instant."""
        if self._place is not None:
            self._leave(self._place)
        trace = self.run.trace
        read, self._read = self._read, trace.gone + len(trace.raw)
        if read == self._read:
            return
        for raw in trace.raw[max(0, read - trace.gone) :]:
            if raw[0] == "end" and raw[3] in OUTCOMES:
                self._note(now_ns, raw[1] / 1e9, raw[2].path, raw[3])
        self._goals = self._running()  # before what comes next writes other goals

    def _leave(self, place: tuple[float, float]) -> None:
        """Forget the place if the base is no longer there."""
        truth = self.plant.truth
        if truth is None or truth.base is None:
            return
        if math.dist((truth.base.x, truth.base.y), place) > PLACE_M:
            self._place = None

    def _running(self) -> dict[str, tuple[Pose2, ...]]:
        """The poses that running leaves have as inputs, by the path of the leaf."""
        inputs_of = self.run.life.inputs_of
        return {node.leaf.path: _poses(inputs_of(node.leaf).values()) for node in self.run.running}

    def _why_no_goal(self, node: str) -> str | None:
        """Why the robot cannot stand where this leaf drives to; None if it can."""
        room = self.scene.room
        for goal in self._goals.get(node, ()):
            shown = f"its goal ({goal.x:.1f}, {goal.y:.1f}) is"
            if not contains(room.outer, goal.x, goal.y):
                return f"{shown} outside of the room"
            if not room.is_free(goal.x, goal.y):
                return f"{shown} in a wall or column"
            gap = room.clearance(goal.x, goal.y)
            if gap < self.footprint.half_diagonal:
                return f"{shown} {gap:.2f} m from a wall"
        return None

    def _note(self, now_ns: int, at_s: float, node: str, outcome: str) -> None:
        truth = self.plant.truth
        if truth is None or truth.base is None:
            return
        if self._place is not None:
            last = self.found[-1]
            last["until_s"], last["count"] = at_s, last["count"] + 1
            return
        # a way is closed by what may still be far off
        within = BESIDE_M if outcome == "stuck" else math.inf
        near = nearest(self.scene, self.footprint, truth, now_ns, within)
        if near is None:
            return
        goal = self._why_no_goal(node) if outcome == "no_path" else None
        self._place = truth.base.x, truth.base.y
        self.found.append(
            {
                "at_s": at_s,
                "until_s": at_s,
                "count": 1,
                "node": node,
                "outcome": outcome,
                "goal": goal,
                "near": near.what,
                "x": truth.base.x,
                "y": truth.base.y,
                "near_x": near.x,
                "near_y": near.y,
                "gap_m": near.gap,
            }
        )


def _poses(values: Iterable[Any]) -> tuple[Pose2, ...]:
    """The poses among these values, and in lists among them."""
    items = (item for value in values for item in (value if type(value) is tuple else (value,)))
    return tuple(item for item in items if isinstance(item, Pose2))
