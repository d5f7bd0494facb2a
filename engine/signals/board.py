"""The signals of one run: arrived samples, which of them are news, and the current values.

Only signals that can be read are built. A derived value is computed on demand, at most once per
tick, and again only if an input has changed.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from itertools import repeat, starmap
from typing import Any

from engine.files import did_you_mean
from engine.signals.signal_kinds import Derived, Measured, Signal, closure
from engine.signals.slots import (
    DerivedSlot,
    EstimatedSlot,
    MeasuredSlot,
    Slot,
    compute,
    new_tuple,
    union,
)
from engine.state import ALWAYS_NS, NEVER_NS, Stamped

Arrival = tuple[MeasuredSlot, Any, int, int]  # slot, value, stamp in ns, number of the interval
CATCH_UP = 256  # pending samples with which an estimator is updated even if nobody reads it
_EAGER = 1 << 4000  # always set in `fresh` of an eager board; no signal has this bit


@dataclass(frozen=True, slots=True)
class Usage:
    """How often a signal was computed, how often it was not, and the total time, ns."""

    built: bool
    evaluated: int
    skipped: int
    time_ns: int


@dataclass(slots=True)
class Board:
    """The signals of one run.

    `wanted` names the signals that states, safety chain and recorder may read; without it, or with
    `eager`, all declared signals are built. `eager` computes all of them in every tick. `clock`
    (ns), if given, serves to measure computing times. `now` and `paused_ns` are ns of run time.
    `interval` is the number of the grid interval that samples arriving now belong to: it counts the
    ticks of the grid; a loop that skips ticks sets it.

    `fresh` has a bit for each measured signal with news in this tick. A repeat is not news: a
    sample of a level signal (not `event`) with the value object that is held already. It only
    renews the stamp, unless the held value was too old for some reader, or an estimate changes.

    `rested` counts the instants in a row at which the same signals, those of the bits `steady`,
    were repeated and nothing else arrived; see `leap`.
    """

    declared: Mapping[str, Signal] = field(default_factory=dict)
    wanted: Iterable[str] | None = None
    eager: bool = False
    clock: Callable[[], int] | None = None
    now: int = 0
    paused_ns: int = 0
    fresh: int = 0
    version: int = 0
    ticks: int = 0
    interval: int = 0
    slots: dict[str, Slot] = field(init=False)
    inbox: deque[Arrival] = field(default_factory=deque)
    steady: int = 0
    rested: int = 0
    _taken: int = 0  # bits of the news that `rest` has taken
    inlets: dict[str, MeasuredSlot] = field(init=False)
    _measured: list[MeasuredSlot] = field(init=False)
    _estimated: list[EstimatedSlot] = field(init=False)

    def __post_init__(self) -> None:
        everything = self.eager or self.wanted is None
        names = closure(self.declared, self.declared if everything else self.wanted or ())
        self.slots = {}
        bit = 1
        for name in names:
            signal = self.declared[name]
            if isinstance(signal, Measured):
                self.slots[name] = MeasuredSlot(signal, bit)
                bit <<= 1
                continue
            sources = [self.slots[source] for source in signal.of]
            kind = DerivedSlot if isinstance(signal, Derived) else EstimatedSlot
            self.slots[name] = kind(signal, sources, self)  # type: ignore[arg-type]
        self.fresh = _EAGER if self.eager else 0
        self.inlets = {n: s for n, s in self.slots.items() if isinstance(s, MeasuredSlot)}
        self._measured = list(self.inlets.values())
        self._estimated = [s for s in self.slots.values() if isinstance(s, EstimatedSlot)]
        for estimated in self._estimated:
            estimated.begin()

    def needs(self, name: str) -> bool:
        """Whether this signal can be read at all; if not, a part need not measure it."""
        return name in self.slots

    def put(self, name: str, value: Any, stamp: int) -> None:
        """Deliver a sample for the next tick; safe to call from other threads.

        `stamp` is when the value was true, ns of run time. Signals that were not built are ignored.

        Raises:
            LookupError: no measured signal has this name.
            ValueError: a constant has a value already.
        """
        slot = self.inlets.get(name)
        if slot is None:
            self._check_measured(name)
        elif slot.constant and slot.newest is not None:
            raise ValueError(f"constant {name!r} is given once; it has a value already")
        else:
            self.inbox.append((slot, value, stamp, self.interval))

    def _check_measured(self, name: str) -> None:
        if not isinstance(self.declared.get(name), Measured):
            measured = [n for n, signal in self.declared.items() if isinstance(signal, Measured)]
            raise LookupError(f"no measured signal {name!r}; {did_you_mean(name, measured)}")

    def arrived(self) -> int:
        """The bits of the samples that wait for the next tick and are no plain repeats.

        A waiting sample arrived after the last tick, and not before its own stamp.
        """
        bits = 0
        for slot, value, stamp, _ in self.inbox.copy():
            if not slot.repeats(value, max(self.now, stamp)):
                bits |= slot.roots
        return bits

    def accept(self, name: str, age: int) -> None:
        """Register a reader that accepts values up to `age`, ns: repeats of older ones are news."""
        roots = self.slots[name].roots
        for slot in self._measured:
            if slot.roots & roots and age < slot.patience:
                slot.patience = age

    @property
    def chart_now(self) -> int:
        """Chart time, ns: run time less all pauses."""
        return self.now - self.paused_ns

    def begin(self, now: int, *, between: bool = False) -> None:
        """Start a tick at `now`, ns: take the waiting samples; values then stay until the next one.

        `between`: the tick is added, off the grid. Estimators are updated at once, so that samples
        later in the same interval find them in the same state, whoever reads them now.
        """
        self.now = now
        self.ticks += 1
        self.interval += not between
        if self.inbox or self.fresh:
            self.refresh()
        if between:
            for slot in self._estimated:
                compute(slot)

    def refresh(self) -> None:
        """The part of `begin` that is needed if samples wait or `fresh` has bits to clear."""
        self.rested = 0
        self.fresh, self._taken = self._taken | (_EAGER if self.eager else 0), 0
        if self.inbox:
            self._receive(self.ticks)
        if self.eager:
            for slot in self.slots.values():
                compute(slot)

    def rest(self, now: int) -> bool:
        """Take the waiting samples as a tick of the grid at `now`, ns, would.

        True if none of them is news, so that the tick may be left out. Otherwise it has to follow.
        """
        self.now = now
        self.fresh, steady, self.steady = self._taken, self.steady, 0
        if self.inbox:
            self._receive(self.ticks + 1)
        self._taken = self.fresh
        self.rested = 0 if self.fresh or self.steady != steady else self.rested + 1
        self.fresh |= _EAGER if self.eager else 0
        self.interval += not self._taken
        return not self._taken

    def leap(self, ticks: int, span_ns: int) -> None:
        """Pass over so many ticks of the grid, ns, in which the `steady` signals were repeated.

        For what rests on them it is as if the last samples had come this much later. Estimators
        over them have a method `leap`; see `leaps`.
        """
        self.interval += ticks
        slots: list[EstimatedSlot | MeasuredSlot] = [*self._estimated, *self._measured]
        for slot in slots:
            if slot.roots & self.steady:
                slot.leap(span_ns)

    def leaps(self, memory_s: float) -> bool:
        """Whether no estimator over `steady` signals needs repeats older than this, s."""
        resting = (slot.estimator for slot in self._estimated if slot.roots & self.steady)
        return all(getattr(estimator, "memory_s", math.inf) <= memory_s for estimator in resting)

    def _receive(self, tick: int) -> None:
        """Move the inbox into the slots, and set `fresh` to what of it is news."""
        changed = repeated = 0
        now, inbox = self.now, self.inbox
        arrived = list(starmap(inbox.popleft, repeat((), len(inbox))))  # others may put more
        for slot, value, _, _ in arrived:
            slot.heard = now
            newest = slot.newest
            if newest is not None and newest.value is value and slot.repeats(value, now):
                repeated |= slot.roots
            else:
                changed |= slot.roots
                slot.tick = tick
        self.steady = repeated = repeated & ~changed
        watched = self._watched(repeated, changed) if repeated else ()
        for slot, value, stamp, interval in arrived:
            held = new_tuple(Stamped, (value, ALWAYS_NS if slot.constant else stamp))
            slot.receive(held, tick)
            for follower, index in slot.followers:
                follower.pending.append((interval, stamp, index, held))
        self.version += 1
        if watched:
            changed |= self._changed_by(watched, repeated)
            for slot, _, _, _ in arrived:
                if slot.roots & changed:
                    slot.tick = tick
        self.fresh |= changed
        for estimated in self._estimated:
            if len(estimated.pending) >= CATCH_UP:
                compute(estimated)

    def _changed_by(self, watched: list[tuple[EstimatedSlot, object]], repeated: int) -> int:
        """The bits of repeats that are news after all, because they changed an estimate."""
        changed = 0
        for estimated, known in watched:
            compute(estimated)
            if estimated.known is not known:
                changed |= estimated.roots & repeated
        return changed

    def _watched(self, repeated: int, changed: int) -> list[tuple[EstimatedSlot, object]]:
        """The estimators that get nothing but repeats, each with its value before these."""
        found = []
        for slot in self._estimated:
            if slot.roots & repeated and not slot.roots & changed:
                if slot.pending:
                    compute(slot)
                found.append((slot, slot.known))
        return found

    def news(self, mask: int, since: int) -> bool:
        """Whether there was news of one of the signals in `mask` after tick `since`."""
        return any(slot.roots & mask and slot.tick > since for slot in self._measured)

    def silent_at(self, mask: int, older: int, since: int) -> int:
        """First run time, ns, at which a signal of `mask` is silent for more than `older` ns.

        Signals that are silent for longer at `since` already do not count; `NEVER_NS` without any.
        """
        first = NEVER_NS - 1
        for slot in self._measured:
            if slot.roots & mask and since <= slot.heard + older < first:
                first = slot.heard + older
        return first + 1

    def bits(self, names: Iterable[str]) -> int:
        """The measured signals that these depend on, as bits of `fresh`."""
        return union(self.slots[name] for name in names)

    def usage(self) -> dict[str, Usage]:
        """How often each declared signal was computed, and in how many grid intervals not."""
        found = {}
        for name in self.declared:
            slot = self.slots.get(name)
            if slot is None:
                found[name] = Usage(False, 0, self.interval, 0)
            else:
                skipped = max(0, self.interval - slot.evaluated)
                found[name] = Usage(True, slot.evaluated, skipped, slot.time_ns)
        return found
