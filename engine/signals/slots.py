"""Slots: the state of each signal in one run, and how its value is computed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import is_, itemgetter
from typing import TYPE_CHECKING, Any, Protocol

from engine.signals.event_log import EventLog
from engine.state import ALWAYS_NS, NEVER_NS, Stamped

if TYPE_CHECKING:
    from engine.signals.signal_kinds import Derived, Estimated, Measured

_arrival = itemgetter(0, 1, 2)  # interval, stamp, order in `of`
new_tuple = tuple.__new__  # makes a `Stamped` in 60 % of the time that its constructor takes


class Versions(Protocol):
    """What a slot asks of its board: the number of its last change, and a clock, ns, if any."""

    version: int
    clock: Callable[[], int] | None


class Slot:
    """One signal of one run: its `newest` sample, and a `version` that grows with each.

    `roots` has the bits of the measured signals that it depends on. `computed`: only reading it
    brings it up to date.
    """

    computed = True
    __slots__ = ("evaluated", "name", "newest", "roots", "time_ns", "version")

    def __init__(self, name: str, roots: int) -> None:
        self.name = name
        self.newest: Stamped | None = None
        self.version = 0
        self.roots = roots
        self.evaluated = 0
        self.time_ns = 0

    def read(self) -> Stamped | None:
        """The newest value."""
        return self.newest


class MeasuredSlot(Slot):
    """Holds what a part delivered."""

    computed = False
    __slots__ = ("constant", "event", "followers", "heard", "log", "patience", "tick")

    def __init__(self, signal: Measured, roots: int) -> None:
        super().__init__(signal.name, roots)
        self.constant = signal.constant
        self.event = signal.event
        self.log = EventLog()
        self.tick = -1  # of the last news
        self.heard = -NEVER_NS  # instant of the last arrival, news or not
        self.patience = NEVER_NS  # the smallest of the maximum ages that readers accept, ns
        self.followers: list[tuple[EstimatedSlot, int]] = []

    def repeats(self, value: Any, now: int) -> bool:
        """True if a sample arriving at `now`, ns, holds the known object, and in time.

        In time means: before the known value became too old for any reader.
        """
        newest = self.newest
        if newest is None or newest.value is not value or self.event:
            return False
        return now - newest.stamp <= self.patience

    def receive(self, held: Stamped, tick: int) -> None:
        """Accept a sample; a late one does not replace a newer one."""
        self.evaluated += 1
        if self.event:
            self.log.add(held, tick)
        newest = self.newest
        if newest is None or held.stamp >= newest.stamp:
            self.newest = held
            self.version += 1

    def leap(self, span_ns: int) -> None:
        """Take the newest sample as repeated until this much later, ns."""
        assert self.newest is not None
        value, stamp = self.newest
        self.newest = Stamped(value, stamp + span_ns)
        self.heard += span_ns


class DerivedSlot(Slot):
    """Computes its value when asked."""

    __slots__ = ("board", "checked", "function", "seen", "sources", "values")

    def __init__(self, signal: Derived, sources: list[Slot], board: Versions) -> None:
        super().__init__(signal.name, union(sources))
        self.function = signal.function
        self.sources = sources
        self.seen: list[int] = [-1] * len(sources)
        self.values: list[Any] = []  # of the inputs for which `newest` was computed
        self.checked = -1
        self.board = board

    def read(self) -> Stamped | None:
        """The value for the current inputs; what `function` raises is raised to every reader."""
        if self.checked == self.board.version:
            return self.newest
        inputs = [s.read() if s.computed else s.newest for s in self.sources]
        versions = [source.version for source in self.sources]
        if versions != self.seen:
            self._evaluate(inputs)
            self.seen = versions
        self.checked = self.board.version
        return self.newest

    def _evaluate(self, inputs: list[Stamped | None]) -> None:
        self.version += 1
        oldest = ALWAYS_NS
        values: list[Any] = []
        for sample in inputs:
            if sample is None or sample.value is None:
                self.newest = None
                return
            values.append(sample.value)
            oldest = sample.stamp if sample.stamp < oldest else oldest
        if self.newest is not None and all(map(is_, values, self.values)):
            self.newest = new_tuple(Stamped, (self.newest.value, oldest))
            return
        self.evaluated += 1
        clock = self.board.clock
        before = 0 if clock is None else clock()
        value = self.function(*values)
        self.time_ns += 0 if clock is None else clock() - before
        self.newest, self.values = Stamped(value, oldest), values


class EstimatedSlot(Slot):
    """Feeds its estimator every sample once, sorted by interval of arrival, stamp, order in `of`.

    Once an estimator has raised, its state is undefined: every later read raises the same again.
    """

    __slots__ = (
        "board", "checked", "complete", "estimates", "estimator", "failure", "followers",
        "idempotent", "memoryless", "names", "needed", "only", "pending", "stamp", "stamps",
        "taken",
    )  # fmt: skip

    def __init__(self, signal: Estimated, sources: list[Slot], board: Versions) -> None:
        super().__init__(signal.name, union(sources))
        self.estimator = signal.make()
        self.stamp = getattr(self.estimator, "stamp", None)
        self.idempotent = getattr(self.estimator, "idempotent", False)
        self.memoryless = getattr(self.estimator, "memoryless", False)
        self.names = signal.of
        self.needed = frozenset(signal.needed)
        self.only = signal.needed[0] if len(self.needed) == 1 else None
        self.complete = not self.needed  # each needed input has delivered
        self.estimates = [source for source in sources if isinstance(source, EstimatedSlot)]
        self.pending: list[tuple[int, int, int, Stamped]] = []
        self.stamps: dict[str, int] = {}  # the newest of each needed input, ns
        self.taken: dict[str, object] = {}  # the newest value of each input
        self.checked = -1
        self.failure: Exception | None = None
        self.followers: list[tuple[EstimatedSlot, int]] = []
        self.board = board
        for index, source in enumerate(sources):
            assert isinstance(source, MeasuredSlot | EstimatedSlot)
            source.followers.append((self, index))

    def begin(self) -> None:
        """Before any sample: publish the value of an estimator that needs no input."""
        if not self.needed:
            self._speak(self.estimator.value(), 0, 0)

    @property
    def known(self) -> object:
        """What a reader gets: the value, or the exception of the estimator."""
        return self.failure if self.newest is None or self.failure else self.newest.value

    def read(self) -> Stamped | None:
        """The estimate after all samples that have arrived."""
        if self.checked == self.board.version:
            return self.newest
        try:
            if self.failure is not None:
                raise self.failure.with_traceback(None)
            for source in self.estimates:
                source.read()
            if self.pending:
                self._catch_up()
        except Exception as error:
            self.failure, self.newest = error, None
            self.pending.clear()
            raise
        self.checked = self.board.version
        return self.newest

    def _catch_up(self) -> None:
        pending, self.pending = self.pending, []
        if len(pending) > 1:
            pending.sort(key=_arrival)
            if self.memoryless and not self.followers:
                del pending[:-1]
        clock = self.board.clock
        before = 0 if clock is None else clock()
        for interval, _, index, sample in pending:
            self._feed(interval, self.names[index], sample)
        self.time_ns += 0 if clock is None else clock() - before

    def _feed(self, interval: int, name: str, sample: Stamped) -> None:
        self.evaluated += 1
        self.version += 1
        value, stamp = sample
        if name in self.needed:
            stamps = self.stamps
            if name not in stamps or stamp > stamps[name] or stamps[name] == ALWAYS_NS:
                stamps[name] = stamp
                self.complete = self.complete or len(stamps) == len(self.needed)
        if self.idempotent:
            if self.newest is not None and value is self.taken.get(name):
                self._speak(self.newest.value, interval, stamp)
                return
            self.taken[name] = value
        self.estimator.update(name, sample)
        self._speak(self.estimator.value(), interval, stamp)

    def _speak(self, value: object, interval: int, arrived: int) -> None:
        if value is None or not self.complete:
            self.newest = None
            return
        if self.stamp is not None:
            stamp = self.stamp()
        elif self.only is not None:
            stamp = self.stamps[self.only]
        else:
            stamp = min(self.stamps.values(), default=None)
        before, stamp = self.newest, ALWAYS_NS if stamp is None else stamp
        if before is not None and before.value is value and before.stamp == stamp:
            return  # followers have this sample already
        self.newest = held = new_tuple(Stamped, (value, stamp))
        for follower, index in self.followers:
            follower.pending.append((interval, arrived, index, held))

    def leap(self, span_ns: int) -> None:
        """Let the estimator pass over repeats for so long, ns; the next one renews its stamp."""
        compute(self)
        estimator: Any = self.estimator
        if self.failure is None:
            estimator.leap(span_ns)


def union(slots: Iterable[Slot]) -> int:
    """The roots of all `slots`, as one bit mask."""
    roots = 0
    for slot in slots:
        roots |= slot.roots
    return roots


def compute(slot: Slot) -> None:
    """Update a slot that nobody has read; an exception is left to its readers."""
    try:  # noqa: SIM105  a context manager takes twice as long, in every tick
        slot.read()
    except Exception:  # noqa: BLE001
        pass
