"""The newest cycles of the safety chain as rows, and records of them for whoever reads them.

One thread writes and any number of readers follow, each at its own pace. Nothing blocks: the writer
overwrites the oldest row, and a reader that is too slow learns how many it has missed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import cache
from typing import Any

import numpy as np

from hw.geometry import Twist2
from hw.jit import Structs, record_type
from hw.safety.cycle_record import REASONS, SafetyRecord

KEPT = 4096
"""Cycles kept: 34 s at 120 Hz."""
CYCLE = record_type(
    ("number", "i8"), ("stamp_ns", "i8"), ("command", "f8", (3,)), ("admitted", "f8", (3,)),
    ("cut", "?"), ("reasons", "i8"), ("separation", "f8"), ("needed", "f8"), ("allowed", "f8"),
    ("user_speed", "f8"), ("user_age", "f8"),
)  # fmt: skip
"""A `SafetyRecord` with its `number` from 1; `cut`: `admitted` is not `command`, `reasons`: bits by
their places in `REASONS`. NaN stands for None."""


class CycleLog:
    """The newest `size` cycles.

    `rows` are a ring of `CYCLE`, (size,), and `counter` counts all ever written, (1,). Compiled
    functions write there; the number of a row is 0 while it is written.
    """

    def __init__(self, size: int = KEPT, counter: Structs | None = None) -> None:
        self.size = size
        self.rows: Structs = np.zeros(size, CYCLE)
        self.counter = np.zeros(1, np.int64) if counter is None else counter

    @property
    def written(self) -> int:
        """How many cycles were written."""
        return int(self.counter[0])

    def append(self, record: SafetyRecord) -> None:
        """Add a cycle that was written elsewhere; reasons that are not in `REASONS` are left out.

        One thread only.
        """
        c, a, r = record.command, record.admitted, record
        known = [math.nan if v is None else v for v in (r.separation, r.user_speed, r.user_age)]
        number, place = self.written + 1, self.written % self.size
        self.rows[place] = (
            0, r.stamp_ns, (c.vx, c.vy, c.wz), (a.vx, a.vy, a.wz), a is not c, bits_of(r.reasons),
            known[0], r.needed, r.allowed, known[1], known[2],
        )  # fmt: skip
        self.rows["number"][place] = self.counter[0] = number

    def reader(self) -> CycleReader:
        """A new reader, which starts with the oldest cycle still held."""
        return CycleReader(self)


class CycleReader:
    """One reader's place in a log; `missed` counts cycles overwritten before they were read.

    It belongs to one thread. `rows` are those of the log.
    """

    def __init__(self, log: CycleLog) -> None:
        self.missed = 0
        self.rows = log.rows
        self._size, self._written = log.size, log.counter
        self._next = max(0, log.written - log.size)

    def take(self) -> range:
        """The cycles since the last call, oldest first: n is in row n modulo the size."""
        start, end = self._next, int(self._written[0])
        if end - start > self._size:
            self.missed += end - self._size - start
            start = end - self._size
        self._next = end
        return range(start, end)

    def read_new(self) -> list[SafetyRecord]:
        """All cycles since the last call, oldest first."""
        # one call copies a row, so that a concurrent overwrite is noticed
        taken = [(n, self.rows[n % self._size].item()) for n in self.take()]
        found = [_record(row) for n, row in taken if row[0] == n + 1]
        self.missed += len(taken) - len(found)
        return found


def bits_of(reasons: Iterable[str]) -> int:
    """A set of reasons as bits."""
    return sum(1 << REASONS.index(reason) for reason in reasons if reason in REASONS)


@cache
def reasons_of(bits: int) -> tuple[str, ...]:
    """The reasons of these bits, in the order in which the rule finds them."""
    return tuple(reason for k, reason in enumerate(REASONS) if bits >> k & 1)


def _record(row: tuple[Any, ...]) -> SafetyRecord:
    _, stamp, command, admitted, cut, bits, gap, needed, allowed, speed, age = row
    told = Twist2(*command.tolist())
    return SafetyRecord(
        stamp,
        told,
        Twist2(*admitted.tolist()) if cut else told,
        _known(gap),
        needed,
        allowed,
        _known(speed),
        _known(age),
        reasons_of(bits),
    )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
