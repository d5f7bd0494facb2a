"""The signals of one run: what has arrived, what of it is news, and the values there are.

Only what somebody can ask for is built, and a derived value is computed when a state asks, at most
once per tick, and again only if an input changed.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from engine.files.finding import did_you_mean
from engine.live_signals import DerivedSlot, EstimatedSlot, MeasuredSlot, Slot, compute, union
from engine.signals import Derived, Measured, Signal, closure
from engine.state import NEVER_NS

Arrival = tuple[MeasuredSlot, Any, int, int]  # and value, stamp, number of the interval
CATCH_UP = 256  # samples that may wait for an estimator
_EAGER = 1 << 4000  # in `fresh` of an eager board; no signal has this bit


@dataclass(frozen=True, slots=True)
class Usage:
    """How often a signal was computed, how often it was not, and the time it took."""

    built: bool
    evaluated: int
    skipped: int
    time_ns: int


def _no_clock() -> int:
    return 0


@dataclass(slots=True)
class Board:
    """The signals of one run.

    `wanted` names what states, safety chain and recorder may ask for; without it, or with
    `eager`, everything declared is built, and `eager` computes all of it in every tick.
    `clock` (ns) only serves to report where the time goes.

    `fresh` has a bit for each measured signal with news in this tick. A repeat is none: a sample of
    a level signal with the value object that is there already. It only makes values younger, unless
    that was too old for some reader, or an estimator over it has another value by it.
    """

    declared: Mapping[str, Signal] = field(default_factory=dict)
    wanted: Iterable[str] | None = None
    eager: bool = False
    clock: Callable[[], int] = _no_clock
    now: int = 0
    paused_ns: int = 0
    fresh: int = 0
    version: int = 0
    ticks: int = 0
    slots: dict[str, Slot] = field(init=False)
    inbox: deque[Arrival] = field(default_factory=deque)
    _ahead: int = 0  # of the interval's number over that of the ticks
    _taken: int = 0  # fresh bits of what `rest` has taken
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
        """Whether anybody can ask for this signal; a part need not measure it otherwise."""
        return name in self.slots

    def put(self, name: str, value: Any, stamp: int) -> None:
        """Deliver a sample for the next tick; safe to call from other threads.

        Raises:
            LookupError: nothing measured has this name.
            ValueError: a constant is given a second time.
        """
        slot = self.inlets.get(name)
        if slot is None:
            self._check_measured(name)
        elif slot.constant and slot.newest is not None:
            raise ValueError(f"constant {name!r} is given once; it has a value already")
        else:
            self.inbox.append((slot, value, stamp, self.ticks + self._ahead))

    def _check_measured(self, name: str) -> None:
        if not isinstance(self.declared.get(name), Measured):
            measured = [n for n, signal in self.declared.items() if isinstance(signal, Measured)]
            raise LookupError(f"no measured signal {name!r}; {did_you_mean(name, measured)}")

    def arrived(self) -> int:
        """The bits of what waits for the next tick and is no plain repeat.

        What waits came after the last tick, and not before its own stamp.
        """
        bits = 0
        for slot, value, stamp, _ in self.inbox.copy():
            if not slot.repeats(value, max(self.now, stamp)):
                bits |= slot.roots
        return bits

    def accept(self, name: str, age: int) -> None:
        """Somebody takes a signal up to this age, ns: what ends a longer silence is news."""
        roots = self.slots[name].roots
        for slot in self._measured:
            if slot.roots & roots:
                slot.patience = min(slot.patience, age)

    @property
    def interval(self) -> int:
        """The number of the interval of the grid in which samples arrive now.

        It counts the ticks of the grid; a loop that misses ticks sets it.
        """
        return self.ticks + self._ahead

    @interval.setter
    def interval(self, number: int) -> None:
        self._ahead = number - self.ticks

    @property
    def chart_now(self) -> int:
        """Chart time: run time less all pauses."""
        return self.now - self.paused_ns

    def begin(self, now: int, *, between: bool = False) -> None:
        """Start a tick: take what has arrived, and hold it still until the next one.

        `between`: the tick is none of the grid. Estimators go on at once, so that what arrives
        later in the same interval meets them alike, whoever reads them now.
        """
        self.now = now
        if between:
            self._ahead -= 1
        self.ticks += 1
        if self.inbox or self.fresh:
            self.refresh()
        if between:
            for slot in self._estimated:
                compute(slot)

    def refresh(self) -> None:
        """The part of `begin` that is due after news."""
        self.fresh, self._taken = self._taken | (_EAGER if self.eager else 0), 0
        if self.inbox:
            self._take(self.ticks)
        if self.eager:
            for slot in self.slots.values():
                compute(slot)

    def rest(self, now: int) -> bool:
        """Take what has arrived, as a tick at this instant of the grid would.

        True if none of it is news: the instant is over. Else the tick has to follow.
        """
        self.now = now
        self.fresh = self._taken
        if self.inbox:
            self._take(self.ticks + 1)
        self._taken = self.fresh
        self.fresh |= _EAGER if self.eager else 0
        self._ahead += not self._taken
        return not self._taken

    def _take(self, tick: int) -> None:
        """Hand the inbox to the slots, and find out what of it is news."""
        self.version += 1
        changed = repeated = 0
        now, inbox = self.now, self.inbox
        arrived = [inbox.popleft() for _ in range(len(inbox))]  # others may put more meanwhile
        for slot, value, _, _ in arrived:
            slot.heard = now
            if slot.repeats(value, now):
                repeated |= slot.roots
            else:
                changed |= slot.roots
                slot.tick = tick
        repeated &= ~changed
        watched = self._watched(repeated, changed) if repeated else []
        for slot, value, stamp, interval in arrived:
            slot.take(value, stamp, interval, tick)
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
        """The bits of repeats that are news all the same: they changed an estimate."""
        changed = 0
        for estimated, known in watched:
            compute(estimated)
            if estimated.known is not known:
                changed |= estimated.roots & repeated
        return changed

    def _watched(self, repeated: int, changed: int) -> list[tuple[EstimatedSlot, object]]:
        """The estimators that only repeats reach, and what each of them gives before these."""
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
        """When a signal of `mask`, not silent for `older` ns at `since`, has been for longer."""
        heard = [slot.heard + older for slot in self._measured if slot.roots & mask]
        return min((at for at in heard if at >= since), default=NEVER_NS - 1) + 1

    def bits(self, names: Iterable[str]) -> int:
        """The measured signals that these rest on, as bits of `fresh`."""
        return union(self.slots[name] for name in names)

    def usage(self) -> dict[str, Usage]:
        """What was built and computed, and at how many instants of the grid it was not."""
        found = {}
        for name in self.declared:
            slot = self.slots.get(name)
            if slot is None:
                found[name] = Usage(False, 0, self.interval, 0)
            else:
                skipped = max(0, self.interval - slot.evaluated)
                found[name] = Usage(True, slot.evaluated, skipped, slot.time_ns)
        return found
