"""Time that the robot spent nearer to the user than its speed allows, from the chain's records.

In each cycle the safety chain records the measured gap S and the protective separation S_p needed
to stop from the measured motion. A standing base has no cycles and needs no separation.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from hw import Struct, Structs, compiled, record_type
from hw.safety import GRANTED, CycleLog, bits_of

LONGEST_NS = 10_000_000
"""Upper limit of the time counted for one cycle, ns; between two drives there are no cycles."""
SUMS = record_type(
    ("stamp_ns", "i8"), ("moving_ns", "i8"), ("below_ns", "i8"), ("granted_ns", "i8"),
    ("least_gap", "f8"), ("least_margin", "f8"),
)  # fmt: skip
"""The stamp of the newest cycle, times and lengths so far, m; see `SeparationWatch.report`."""
_GRANTED = bits_of((GRANTED,))


class SeparationWatch:
    """Sums up the cycles of a safety chain."""

    leaps = True
    """A standing base has no cycles."""

    def __init__(self, cycles: CycleLog) -> None:
        self._cycles = cycles.reader()
        self._sums: Structs = np.zeros(1, SUMS)
        self._sums[0] = -LONGEST_NS, 0, 0, 0, math.inf, math.inf
        _add(self._sums, self._cycles.rows, 0, 0)  # compiles it

    def watch(self, now_ns: int) -> None:  # noqa: ARG002  cycles have stamps of their own
        """Take all cycles since the last call."""
        new = self._cycles.take()
        if new:
            _add(self._sums, self._cycles.rows, new.start, new.stop)

    def report(self) -> dict[str, Any]:
        """Times in s, lengths in m; all None if no cycle had a known gap.

        `below_needed_s`: S below S_p without a granted touch; `granted_s`: with one. `min_gap_m`:
        the least S while the base moved; `min_margin_m`: the least S - S_p without a granted touch.
        """
        _, moving, below, granted, gap, margin = self._sums[0].item()
        if not moving:
            return dict.fromkeys(
                ("moving_s", "below_needed_s", "granted_s", "min_gap_m", "min_margin_m")
            )
        return {
            "moving_s": moving * 1e-9,
            "below_needed_s": below * 1e-9,
            "granted_s": granted * 1e-9,
            "min_gap_m": gap,
            "min_margin_m": margin if margin < math.inf else None,
        }


@compiled
def _add(sums: Structs, rows: Structs, start: int, end: int) -> None:
    """Add cycles from a ring of `hw.safety.CYCLE`."""
    now = sums[0]
    for n in range(start, end):
        row = rows[n % len(rows)]
        lasted = min(LONGEST_NS, row.stamp_ns - now.stamp_ns)
        now.stamp_ns = row.stamp_ns
        if math.isnan(row.separation):
            continue
        now.moving_ns += lasted
        now.least_gap = min(now.least_gap, row.separation)
        if row.needed > 0.0:
            _count(now, row.separation - row.needed, row.reasons & _GRANTED != 0, lasted)


@compiled
def _count(now: Struct, margin: float, granted: bool, lasted: int) -> None:
    below = lasted if margin < 0.0 else 0
    if granted:
        now.granted_ns += below
        return
    now.below_ns += below
    now.least_margin = min(now.least_margin, margin)
