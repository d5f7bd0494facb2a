"""The only path of samples into a run: from the parts to its board."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from cobodeck.loop.sample_types import class_behind, misfit
from engine.files import did_you_mean
from engine.machine import shown
from engine.signals import Board, Measured, MeasuredSlot
from hw import RobotPart, Sample, is_finite

Hears = tuple[str, Callable[[Sample, int], None]]
"""A signal's name, and a function that takes each sample and its instant of arrival, ns."""
SampleTap = Callable[[Sample, int, str | None], None]
"""Takes a sample, its instant of arrival, ns, and why it was refused (None: accepted)."""
AHEAD_NS = 20_000_000
"""Tolerated clock difference, ns; a sample stamped further ahead is refused."""
NOT_FINITE = "a number in it is not finite"


class WrongSample(TypeError):
    """A sample that only a mistake in the part can give: of another type than it declares."""


@dataclass(slots=True)
class _Route:
    """Where the samples of a signal go; `fit` is the newest value that was checked, if any.

    `kind` is the class that its values must have, as far as it is one.
    """

    slot: MeasuredSlot | None
    kind: type
    listeners: list[Callable[[Sample, int], None]] = field(default_factory=list)
    fit: object = None
    checked: bool = False


class _Routes(dict[str, _Route]):
    """The routes by signal, each made at its first sample or listener."""

    def __init__(self, make: Callable[[str], _Route]) -> None:
        self._make = make

    def __missing__(self, name: str) -> _Route:
        route = self[name] = self._make(name)
        return route


class Inlet:
    """Polls the parts for samples and passes them on.

    A sample is refused if a number in it is NaN or infinite, or if its stamp is more than
    `ahead_ns` ahead; `refused` counts these by signal. One that is not of its signal's type is
    refused, and it is a `WrongSample`: its class is looked at each time, its fields in the first
    sample of each signal and wherever numbers cannot be compared. None always stands for "nothing".

    A part that raises or gives such a sample is not polled again; `failures` has the exception.
    `taps` receive every sample, and every estimate that is passed to listeners (`notify`).

    Set `begins` if parts measured before the run began: of those samples only the newest count.
    """

    def __init__(
        self,
        board: Board,
        sources: Mapping[str, RobotPart] | None = None,
        hears: Iterable[Hears] = (),
        ahead_ns: int = AHEAD_NS,
    ) -> None:
        self.board = board
        self.sources = dict(sources or {})
        self.refused: dict[str, int] = {}
        self.failures: list[tuple[str, Exception]] = []
        self.taps: list[SampleTap] = []
        self._ahead_ns = ahead_ns
        self.begins = False
        self._routes = _Routes(self._route)
        measured = [s for s in board.declared.values() if isinstance(s, Measured)]
        self._types = {s.name: s.type for s in measured if not s.constant}
        self._measured = {s.name for s in measured if board.needs(s.name) and not s.constant}
        for name, listener in hears:
            self.listen(name, listener)

    def listen(self, name: str, listener: Callable[[Sample, int], None]) -> None:
        """Call `listener` with the samples of a signal; this causes no part to be polled."""
        self._routes[name].listeners.append(listener)

    def _route(self, name: str) -> _Route:
        slot = self.board.inlets[name] if name in self._measured else None
        return _Route(slot, class_behind(self._types.get(name)))

    @property
    def flowing(self) -> set[str]:
        """The signals of the parts that are polled."""
        return {name for part in self.sources.values() for name in part.signals}

    def poll(self, now_ns: int) -> None:
        """Poll the parts and take all samples that have arrived by now."""
        begins, self.begins = self.begins, False
        for name, part in list(self.sources.items()):
            found: Any = ()
            sample: Any = None
            try:
                found = part.samples(now_ns)
                for sample in _newest(found) if begins else found:
                    self.deliver(sample, now_ns)
            except Exception as error:  # noqa: BLE001  a driver may raise anything
                error = _malformed(found, sample) or error
                if isinstance(error, WrongSample):
                    error.__traceback__ = None  # its place is the part, not the check
                self.failures.append((name, error))
                del self.sources[name]

    def deliver(self, sample: Sample, now_ns: int) -> None:
        """Check one sample that has arrived now, and pass it on.

        Raises:
            WrongSample: it is not of its type.
        """
        name, stamp, value = sample
        route = self._routes[name]
        problem: str | WrongSample | None = None
        if type(stamp) is not int and not isinstance(stamp, int):
            problem = _wrong(name, f"its stamp is {stamp!r}; wanted: whole ns, as from now()")
        elif stamp > now_ns + self._ahead_ns:
            problem = "its stamp is ahead"
        elif value is not route.fit:
            problem = self._check(name, value, route)
        for tap in self.taps:
            tap(sample, now_ns, None if problem is None else str(problem))
        if problem is not None:
            self.refused[name] = self.refused.get(name, 0) + 1
            if isinstance(problem, WrongSample):
                raise problem
            return
        if route.slot is not None:
            self.board.inbox.append((route.slot, value, stamp, self.board.interval))
        for listener in route.listeners:
            listener(sample, now_ns)

    def notify(self, sample: Sample, now_ns: int) -> None:
        """Pass an estimate from the board to listeners; it is not put back on the board.

        The same object is passed on once.
        """
        route = self._routes[sample.name]
        if route.fit is sample.value:
            return
        route.fit, route.checked = sample.value, True
        for tap in self.taps:
            tap(sample, now_ns, None)
        for listener in route.listeners:
            listener(sample, now_ns)

    def put(self, name: str, value: Any, stamp_ns: int) -> None:
        """Put a value on the board that no part measures: a constant, or a value from a test.

        Raises:
            WrongSample: it is not of its signal's type, or a number in it is not finite.
        """
        wrong = self.why_not(name, value)
        if wrong is not None:
            raise _wrong(name, wrong)
        self.board.put(name, value, stamp_ns)

    def why_not(self, name: str, value: Any) -> str | None:
        """Why `put` would refuse a value for its type or its numbers; None if it would not."""
        wrong = None if value is None else misfit(value, self._types.get(name, object))
        if wrong is None and name in self._types and not is_finite(value):
            wrong = NOT_FINITE
        return wrong

    def _check(self, name: str, value: object, route: _Route) -> str | WrongSample | None:
        """Why a new value is refused; None if it is not."""
        if not route.checked or not isinstance(value, route.kind):
            wrong = self._misfit(name, value)
            if wrong is not None:
                return _wrong(name, wrong)
        if value is None:
            return None
        if is_finite(value):
            route.fit, route.checked = value, True
            return None
        wrong = misfit(value, self._types.get(name, object))
        return NOT_FINITE if wrong is None else _wrong(name, wrong)

    def _misfit(self, name: str, value: object) -> str | None:
        """Why the first value of a signal, or one of another class, is wrong; None if it is not."""
        declared = self.board.declared
        if self.sources and name not in declared and name not in self.flowing:
            return f"no signal of this name is declared; {did_you_mean(name, declared)}"
        return None if value is None else misfit(value, self._types.get(name, object))


def _wrong(name: str, why: str) -> WrongSample:
    return WrongSample(f"sample {name!r}: {why}")


def _malformed(found: Any, sample: Any) -> WrongSample | None:
    """What a part has returned in place of samples; `sample` is the last one taken from it."""
    right = "return a list of Sample(name, stamp_ns, value), empty if there is nothing new"
    if isinstance(found, Sample) or not isinstance(found, Iterable):
        return WrongSample(f"samples() returned {shown(found)}; {right}")
    if sample is not None and not (isinstance(sample, tuple) and len(sample) == 3):
        return WrongSample(f"samples() returned {shown(sample)} among the samples; {right}")
    return None


def _newest(samples: Iterable[Sample]) -> Iterable[Sample]:
    """The newest sample of each signal and device."""
    found: dict[tuple[str, object], Sample] = {}
    for sample in samples:
        value = sample.value
        device = getattr(value, "tracker", None) or getattr(value, "sensor", None)
        found[sample.name, device] = sample
    return found.values()
