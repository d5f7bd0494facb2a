"""States that watch any signal: how large it is, whether it changes, comes, or falls silent.

A signal that says none has no value, nor has one whose newest value is older than `older`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Generator, Iterator
from typing import Annotated, Any, Generic, TypeVar

from engine import NEVER_NS, Action, Context, Key, Monitor, On, Outcome, Run, Until, Yielded
from engine.files import Duration
from engine.files.declared import FROM_0

T = TypeVar("T")
N = TypeVar("N", bound=float)

NO_HYSTERESIS: Any = 0  # of whatever dimension the signal has


def sustained(
    ctx: Context,
    signal: Key[T],
    counts: Callable[[T, bool], bool],
    seconds: float,
    older: float | None,
) -> Generator[Yielded, None, T]:
    """Wait until a signal has had values that count for so many seconds without interruption.

    No value, or one older than `older`, s, interrupts. The time begins when this does, at the
    earliest.

    Args:
        ctx: that of a state that reads the signal up to the age `older`.
        signal: a level; of events, the last one since the entry.
        counts: whether a value counts, after one that did (True) or did not.
        seconds: with 0 the first value that counts is enough.
        older: the greatest accepted age, s; None: any.

    Returns:
        The last value.
    """
    news, since, value = On(signal), None, None
    while True:
        value = _newest(ctx, signal, value)
        if value is None or not counts(value, since is not None):
            since = None
            yield news
            continue
        since = ctx.now if since is None else since
        due = since + round(seconds * 1e9)
        if ctx.now >= due:
            return value
        yield On(signal, until=min(due, _stale_at(ctx, signal, older)), older=older)


def _newest(ctx: Context, signal: Key[T], held: T | None) -> T | None:
    """The value of a level; of an event signal that of a new event, else `held`."""
    if not ctx.is_event(signal):
        return ctx.value(signal)
    events = ctx.events(signal)
    return events[-1].value if events else held


def _stale_at(ctx: Context, signal: Key[Any], older: float | None) -> int:
    """The first instant at which the present value is too old, if no other comes."""
    return NEVER_NS if older is None else ctx.after(older - ctx.age(signal)) + 1


def silence(ctx: Context, signal: Key[Any], seconds: float) -> Generator[Yielded, None, None]:
    """Wait until nothing has come from a signal for longer than `seconds`, or what comes is none.

    What is older than that when it comes does not count. Where nothing has ever come yet, the
    signal is given the time. `ctx` is that of a state that reads the signal up to this age.
    """
    first = ctx.now if ctx.sample(signal) is not None else ctx.after(seconds)
    end = On(signal, older=seconds)
    while True:
        heard = ctx.value(signal) is not None
        if not heard and ctx.now >= first:
            return
        yield end if heard else On(signal, until=first, older=seconds)


def _is_number(value: object) -> bool:
    """False for nan, which is equal to nothing."""
    return not isinstance(value, float) or not math.isnan(value)


class _Threshold(Monitor, Generic[N]):
    """What the monitors of a number share.

    Args:
        signal: the number to watch.
        for: how long it has to last; 0 s: the first such value will do.
        hysteresis: by how much a value may be back behind the limit while the time runs, in the
            unit of the signal.
        older: a value older than this interrupts the time; by default any age will do.

    Outputs:
        value: the last value that was watched.
    """

    reads = {"$signal": "$older"}
    signal: Key[N]
    for_: Duration
    older: Duration | None

    def _counts(self, value: N, before: bool) -> bool:
        """Whether a value is beyond, after one that was (True) or was not."""
        raise NotImplementedError

    def _last(self, ctx: Context) -> Generator[Yielded, None, N]:
        """The value after the time `for_` beyond."""
        return sustained(ctx, self.signal, self._counts, self.for_, self.older)


class _Beyond(_Threshold[N]):
    """What `Above` and `Below` share.

    Args:
        limit: the limit, in the unit of the signal.
    """

    def __init__(
        self,
        signal: Key[N],
        limit: N,
        for_: Annotated[Duration, FROM_0] = 0.0,
        hysteresis: Annotated[N, FROM_0] = NO_HYSTERESIS,
        older: Annotated[Duration, FROM_0] | None = None,
    ) -> None:
        self.signal, self.for_, self.older = signal, for_, older
        self.limit, self.hysteresis = limit, hysteresis


class Above(_Beyond[N]):
    """`above` once a number has been greater than `limit` for the time `for`.

    `{watch: Above, with: {signal: user.distance, limit: 4 m, for: 1 s}, next: {above: follow}}`.
    While the time runs, a value counts until it is below `limit` less `hysteresis`. A value that is
    lost or older than `older` interrupts it.

    Outcomes:
        above: the number has been greater than `limit` for the time `for`.
    """

    outcomes = ("above",)
    outputs = {"above": {"value": N}}  # type: ignore[misc]

    def _counts(self, value: N, before: bool) -> bool:
        return value >= self.limit - self.hysteresis if before else value > self.limit

    def run(self, ctx: Context) -> Run:
        value = yield from self._last(ctx)
        return "above", {"value": value}


class Below(_Beyond[N]):
    """`below` once a number has been less than `limit` for the time `for`.

    `{watch: Below, with: {signal: user.distance, limit: 2 m, for: 0.3 s}, next: {below: stop}}`.
    While the time runs, a value counts until it is above `limit` plus `hysteresis`. A value that is
    lost or older than `older` interrupts it.

    Outcomes:
        below: the number has been less than `limit` for the time `for`.
    """

    outcomes = ("below",)
    outputs = {"below": {"value": N}}  # type: ignore[misc]

    def _counts(self, value: N, before: bool) -> bool:
        return value <= self.limit + self.hysteresis if before else value < self.limit

    def run(self, ctx: Context) -> Run:
        value = yield from self._last(ctx)
        return "below", {"value": value}


class Within(_Threshold[N]):
    """`within` once a number has been from `low` to `high` for the time `for`.

    `{watch: Within, with: {signal: user.distance, low: 2 m, high: 3 m, for: 2 s}, next: …}`.
    While the time runs, a value counts until it is outside by more than `hysteresis`. A value that
    is lost or older than `older` interrupts it.

    Args:
        low: the lower limit, in the unit of the signal.
        high: the upper limit.

    Outcomes:
        within: the number has been from `low` to `high` for the time `for`.
    """

    outcomes = ("within",)
    outputs = {"within": {"value": N}}  # type: ignore[misc]

    def __init__(
        self,
        signal: Key[N],
        low: N,
        high: N,
        for_: Annotated[Duration, FROM_0] = 0.0,
        hysteresis: Annotated[N, FROM_0] = NO_HYSTERESIS,
        older: Annotated[Duration, FROM_0] | None = None,
    ) -> None:
        for _, message in self.faults((), low, high):
            raise ValueError(f"Within: {message}")
        self.signal, self.for_, self.older = signal, for_, older
        self.low, self.high, self.hysteresis = low, high, hysteresis

    @classmethod
    def faults(
        cls, _inputs: Collection[str], low: float, high: float, **_others: object
    ) -> Iterator[tuple[str, str]]:
        """The limits are the wrong way round."""
        if low > high:
            yield "low", f"nothing is from low {low:g} to high {high:g}; swap them"

    def _counts(self, value: N, before: bool) -> bool:
        slack = self.hysteresis if before else NO_HYSTERESIS
        return bool(self.low - slack <= value <= self.high + slack)

    def run(self, ctx: Context) -> Run:
        value = yield from self._last(ctx)
        return "within", {"value": value}


class Changed(Monitor, Generic[T]):
    """`changed` once a signal has another value than when this began.

    `{watch: Changed, with: {signal: base.mode}, out: {value: mode}, next: {changed: react}}`.
    A signal that said none then has changed with its first value; where nothing had come yet, the
    first value is what later ones are compared with. No value is no change.

    Args:
        signal: the signal to watch.
        older: a value older than this counts as none; by default any age will do.

    Outcomes:
        changed: the signal has another value.

    Outputs:
        value: the new value.
    """

    outcomes = ("changed",)
    outputs = {"changed": {"value": T}}  # type: ignore[misc]
    reads = {"$signal": "$older"}

    def __init__(self, signal: Key[T], older: Annotated[Duration, FROM_0] | None = None) -> None:
        self.signal, self.older = signal, older

    def run(self, ctx: Context) -> Run:
        while (first := ctx.sample(self.signal)) is None:
            yield On(self.signal)
        while True:
            value = ctx.value(self.signal)
            if value is not None and value != first.value and _is_number(value):
                return "changed", {"value": value}
            yield On(self.signal)


class WaitFor(Monitor, Generic[T]):
    """`there` once a signal has a value: any, or the given one, for the time `for`.

    `{watch: WaitFor, with: {signal: stop.engaged}, next: {there: report}}`.
    Of an event signal, such as a button, it is an event since this began, and `for` is an error. A
    value that is lost or older than `older` interrupts the time.

    Args:
        signal: the signal to wait for.
        value: the value that it has to have; by default any.
        for: how long it has to have it.
        older: a value older than this counts as none; by default any age will do.

    Outcomes:
        there: the signal has the value, for the time `for`.

    Outputs:
        value: the value that came.
    """

    outcomes = ("there",)
    outputs = {"there": {"value": T}}  # type: ignore[misc]
    reads = {"$signal": "$older"}

    def __init__(
        self,
        signal: Key[T],
        value: T | None = None,
        for_: Annotated[Duration, FROM_0] = 0.0,
        older: Annotated[Duration, FROM_0] | None = None,
    ) -> None:
        self.signal, self.value = signal, value
        self.for_, self.older = for_, older

    def run(self, ctx: Context) -> Run:
        if ctx.is_event(self.signal):
            value = yield from self._event(ctx)
        else:
            value = yield from sustained(ctx, self.signal, self._is_meant, self.for_, self.older)
        return "there", {"value": value}

    def _is_meant(self, value: T, _before: bool = False) -> bool:
        return _is_number(value) and (self.value is None or value == self.value)

    def _event(self, ctx: Context) -> Generator[Yielded, None, T]:
        if self.for_ > 0.0:
            raise ValueError(f"WaitFor: {self.signal} is an event, which does not last; no `for`")
        while True:
            for event in ctx.events(self.signal):
                if event.value is not None and self._is_meant(event.value):
                    return event.value
            yield On(self.signal)


class Silent(Monitor, Generic[T]):
    """`silent` once a signal has had no value, or none newer than `time`.

    `{watch: Silent, with: {signal: base.scan, time: 0.5 s}, next: {silent: .failed}}`.
    Where nothing had ever come when this began, it is given that time.

    Args:
        signal: the signal to watch.
        time: how old its newest value may become.

    Outcomes:
        silent: there is no value, or none newer than `time`.
    """

    outcomes = ("silent",)
    reads = {"$signal": "$time"}

    def __init__(self, signal: Key[T], time: Annotated[Duration, FROM_0]) -> None:
        self.signal, self.time = signal, time

    def run(self, ctx: Context) -> Run:
        yield from silence(ctx, self.signal, self.time)
        return "silent"


class Wait(Monitor):
    """`over` after the time `time`: `{watch: Wait, with: {time: 5 s}, next: {over: again}}`.

    Args:
        time: how long to wait.

    Outcomes:
        over: the time has passed.
    """

    outcomes = ("over",)

    def __init__(self, time: Annotated[Duration, FROM_0]) -> None:
        self.time = time

    def run(self, ctx: Context) -> Run:
        end = ctx.after(self.time)
        while ctx.now < end:
            yield Until(end)
        return "over"


class Read(Action, Generic[T]):
    """Read the value of a signal, at once; `none` if it has none, or one older than `older`.

    `{do: Read, with: {signal: user.pose}, out: {value: met}, next: {read: greet, none: wait}}`.
    Of an event signal it is the newest event, whenever that was.

    Args:
        signal: the signal to read.
        older: a value older than this counts as none; by default any age will do.

    Outcomes:
        read: there is a value.
        none: the signal has no value, or one older than `older`.

    Outputs:
        value: the value.
    """

    outcomes = ("read", "none")
    outputs = {"read": {"value": T}}  # type: ignore[misc]
    reads = {"$signal": "$older"}

    def __init__(self, signal: Key[T], older: Annotated[Duration, FROM_0] | None = None) -> None:
        self.signal, self.older = signal, older

    def run(self, ctx: Context) -> Outcome:
        value = ctx.value(self.signal)
        return "none" if value is None else ("read", {"value": value})
