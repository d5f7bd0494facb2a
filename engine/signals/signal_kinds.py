"""Named, stamped values: measured by parts, derived by pure functions, estimated with memory.

This module declares them; the values of one run are on its board (`engine.signals.board`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from engine.state import Stamped
from engine.types import ANY, Type, from_annotation


@dataclass(frozen=True, slots=True)
class Measured:
    """A signal that a part delivers.

    `event`: each reader gets every sample once. `constant`: it is set once and does not age.
    `part` names who gives it, and `comes` says when; both are for pages only.
    """

    name: str
    type: Any = object
    event: bool = False
    about: str = ""
    constant: bool = False
    part: str = ""
    comes: str = ""


@dataclass(frozen=True, slots=True)
class Derived:
    """A signal that is a pure function of others; `None` while one of them has no value.

    It has the stamp of the oldest of them; of constants alone, it does not age either.
    """

    name: str
    of: tuple[str, ...]
    function: Callable[..., Any]
    type: Any = object
    about: str = ""


class Estimator(Protocol):
    """A filter with memory that is fed every sample once, in order.

    While its estimate is unchanged, `value` has to return the same object, so that samples that
    repeat a known value are not taken for news.
    With an optional `idempotent = True`, a sample with the value object of the one before it
    changes nothing, and is not fed. With an optional `memoryless = True` the estimate is that of
    the last sample, and of several at once only that one is fed, unless other estimators follow.
    With an optional `memory_s` and a method `leap(span_ns)`, the loop may pass over repeats: see
    `engine/LEAPS.md`.
    An optional method `stamp() -> int | None` gives the run time, ns, that the value refers to, or
    `None` if it does not age. Without it the stamp is the oldest among the newest stamps of the
    inputs it needs.
    """

    def update(self, signal: str, sample: Stamped) -> None:
        """Take one sample of one of the inputs."""
        ...

    def value(self) -> Any:
        """The current estimate, `None` while there is none; must not change the estimator."""
        ...


@dataclass(frozen=True, slots=True)
class Estimated:
    """A signal with memory: `make` gives a new estimator for each run.

    It has no value before every input in `needs` (by default all of `of`) has delivered one. With
    empty `needs` it can have a value from the start.
    """

    name: str
    of: tuple[str, ...]
    make: Callable[[], Estimator]
    type: Any = object
    about: str = ""
    needs: tuple[str, ...] | None = None

    @property
    def needed(self) -> tuple[str, ...]:
        """The inputs without which it has no value."""
        return self.of if self.needs is None else self.needs


Signal = Measured | Derived | Estimated


def declare(signals: Iterable[Signal]) -> dict[str, Signal]:
    """Signals by name.

    Raises:
        ValueError: for a duplicate name, an unknown input, a cycle, a derived signal over an event,
            an estimator over a derived signal, or one that needs what is not among its inputs.
    """
    named: dict[str, Signal] = {}
    for signal in signals:
        if signal.name in named:
            raise ValueError(f"signal {signal.name!r} is declared twice")
        named[signal.name] = signal
    for signal in named.values():
        for source in _inputs(signal):
            if source not in named:
                raise ValueError(f"signal {signal.name!r} rests on unknown {source!r}")
            of = named[source]
            if isinstance(signal, Derived) and isinstance(of, Measured) and of.event:
                raise ValueError(f"derived {signal.name!r} cannot rest on event {source!r}")
            if isinstance(signal, Estimated) and isinstance(of, Derived):
                raise ValueError(f"estimated {signal.name!r} cannot rest on derived {source!r}")
        if isinstance(signal, Estimated) and (odd := sorted({*signal.needed} - {*signal.of})):
            rests = ", ".join(signal.of)
            raise ValueError(f"estimated {signal.name!r} needs {odd[0]!r}, but rests on {rests}")
    closure(named, named)
    return named


def types_of(signals: Collection[str] | Mapping[str, Signal]) -> dict[str, Type]:
    """The types of the values of signals, by name; `any` where it is not known."""
    if not isinstance(signals, Mapping):
        return dict.fromkeys(signals, ANY)
    return {name: _type(signal.type) for name, signal in signals.items()}


def _type(annotation: Any) -> Type:
    try:
        return from_annotation(annotation)
    except TypeError:  # a type that no chart could name
        return ANY


def _inputs(signal: Signal) -> tuple[str, ...]:
    return () if isinstance(signal, Measured) else signal.of


def closure(declared: Mapping[str, Signal], wanted: Iterable[str]) -> list[str]:
    """The wanted signals and all they depend on, inputs first, in a deterministic order.

    Raises:
        ValueError: for cyclic dependencies.
    """
    order: dict[str, bool] = {}

    def visit(name: str, path: tuple[str, ...]) -> None:
        if name in path:
            raise ValueError(f"signals in a circle: {' -> '.join((*path, name))}")
        if name not in order:
            for source in _inputs(declared[name]):
                visit(source, (*path, name))
            order[name] = True

    for name in sorted(wanted):
        visit(name, ())
    return list(order)


def roots(declared: Mapping[str, Signal], wanted: Iterable[str]) -> set[str]:
    """The measured signals that must be delivered for every wanted signal to have a value.

    Inputs that an estimator takes without needing them are left out; undeclared names are included.
    """
    found: set[str] = set()
    waiting, seen = [*wanted], set()
    while waiting:
        name = waiting.pop()
        if name in seen:
            continue
        seen.add(name)
        signal = declared.get(name)
        if signal is None or isinstance(signal, Measured):
            found.add(name)
        else:
            waiting += signal.needed if isinstance(signal, Estimated) else signal.of
    return found
