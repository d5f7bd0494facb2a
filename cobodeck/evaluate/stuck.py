"""What was next to the robot when a drive came to nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from cobodeck.evaluate.metrics import PoseSource
from engine.run import ChartRun
from hw.model import Footprint
from hw.scene import Scene
from hw.sim.contact import BESIDE_M, nearest

OUTCOMES = ("stuck", "no_path")
"""Outcomes of a leaf whose drive came to nothing."""


@dataclass(slots=True)
class StuckWatch:
    """Notes what was next to the robot whenever a drive came to nothing; call `watch` once a tick.

    Drives of one node that end alike, one after the other beside the same, are listed once.
    """

    plant: PoseSource
    run: ChartRun
    scene: Scene
    footprint: Footprint
    found: list[dict[str, Any]] = field(default_factory=list)
    _read: int = 0

    @property
    def leaps(self) -> bool:
        """Nothing ends in a leap."""
        return True

    def watch(self, now_ns: int) -> None:
        """Look at what has ended since the last instant."""
        trace = self.run.trace
        read, self._read = self._read, trace.gone + len(trace.raw)
        if read == self._read:
            return
        for raw in trace.raw[max(0, read - trace.gone) :]:
            if raw[0] == "end" and raw[3] in OUTCOMES:
                self._note(now_ns, raw[1] / 1e9, raw[2].path, raw[3])

    def _note(self, now_ns: int, at_s: float, node: str, outcome: str) -> None:
        truth = self.plant.truth
        if truth is None or truth.base is None:
            return
        # a way is closed by what may still be far off
        within = BESIDE_M if outcome == "stuck" else math.inf
        near = nearest(self.scene, self.footprint, truth, now_ns, within)
        if near is None:
            return
        last = self.found[-1] if self.found else {}
        if (last.get("node"), last.get("outcome"), last.get("near")) == (node, outcome, near.what):
            last["until_s"], last["count"] = at_s, last["count"] + 1
            return
        self.found.append(
            {
                "at_s": at_s,
                "until_s": at_s,
                "count": 1,
                "node": node,
                "outcome": outcome,
                "x": truth.base.x,
                "y": truth.base.y,
                "near": near.what,
                "near_x": near.x,
                "near_y": near.y,
                "gap_m": near.gap,
            }
        )
