"""Time that the robot spent nearer to the user than its speed allows, from the chain's records.

In each cycle the safety chain records the measured gap S and the protective separation S_p needed
to stop from the measured motion. A standing base has no cycles and needs no separation.
"""

from __future__ import annotations

import math
from typing import Any

from hw import Log
from hw.safety import GRANTED, SafetyRecord

LONGEST_NS = 10_000_000
"""Upper limit of the time counted for one cycle, ns; between two drives there are no cycles."""


class SeparationWatch:
    """Sums up the cycles of a safety chain."""

    leaps = True
    """A standing base has no cycles."""

    def __init__(self, cycles: Log[SafetyRecord]) -> None:
        self._cycles = cycles.reader()
        self._stamp = -LONGEST_NS
        self._moving_ns = self._below_ns = self._granted_ns = 0
        self._least_gap = self._least_margin = math.inf

    def watch(self, now_ns: int) -> None:  # noqa: ARG002  cycles have stamps of their own
        """Read all records since the last call."""
        for record in self._cycles.read_new():
            lasted = min(LONGEST_NS, record.stamp_ns - self._stamp)
            self._stamp = record.stamp_ns
            gap = record.separation
            if gap is None:
                continue
            self._moving_ns += lasted
            if gap < self._least_gap:
                self._least_gap = gap
            if record.needed > 0.0:
                self._count(gap - record.needed, GRANTED in record.reasons, lasted)

    def report(self) -> dict[str, Any]:
        """Times in s, lengths in m; all None if no cycle had a known gap.

        `below_needed_s`: S below S_p without a granted touch; `granted_s`: with one. `min_gap_m`:
        the least S while the base moved; `min_margin_m`: the least S - S_p without a granted touch.
        """
        if not self._moving_ns:
            return dict.fromkeys(
                ("moving_s", "below_needed_s", "granted_s", "min_gap_m", "min_margin_m")
            )
        least = self._least_margin
        return {
            "moving_s": self._moving_ns * 1e-9,
            "below_needed_s": self._below_ns * 1e-9,
            "granted_s": self._granted_ns * 1e-9,
            "min_gap_m": self._least_gap,
            "min_margin_m": least if least < math.inf else None,
        }

    def _count(self, margin: float, granted: bool, lasted: int) -> None:
        below = lasted if margin < 0.0 else 0
        if granted:
            self._granted_ns += below
            return
        self._below_ns += below
        if margin < self._least_margin:
            self._least_margin = margin
