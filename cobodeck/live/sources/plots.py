"""The numbers in the samples of a signal, to be plotted over time."""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Iterable
from dataclasses import fields, is_dataclass
from typing import Any

from cobodeck.live.clients import PageMessage
from cobodeck.record.format import TOPIC, Unknown, sample_of
from cobodeck.record.read import Group, RecordedMessage

MOST_POINTS = 5000
"""Of a plot; of more only some are sent."""
MOST_FIELDS = 6
"""Of a signal, as many as a page draws."""
KEPT = 500
"""Messages of each signal that are kept until pages are told; some ten times as many as come."""


def plot_of(
    signal: str, told: Iterable[RecordedMessage], *, more: bool = False
) -> PageMessage | None:
    """The values in messages of a signal; None if there are none, or no numbers that are known.

    `more`: they go on where others have ended.
    """
    names: list[str] = []
    times, rows = list[float](), list[list[float]]()
    for one in told:
        try:
            sample = sample_of(signal, one.schema, one.data)
        except Unknown:  # a class of a project that is not loaded here
            return None
        found = dict(numbers_of(sample.value))
        names = names or list(found)[:MOST_FIELDS]
        if names and found.keys() >= set(names):
            times.append(sample.stamp_ns / 1e9)
            rows.append([found[name] for name in names])
    if not rows:
        return None
    step = -(-len(rows) // MOST_POINTS)
    plot = {"t": "plot", "signal": signal, "fields": names, "at": times[::step]}
    return {**plot, "values": [list(c) for c in zip(*rows[::step], strict=True)], "more": more}


class SeenSignals:
    """The newest messages of each signal of a run that goes on, and how many there were so far."""

    def __init__(self) -> None:
        self._kept: dict[str, deque[RecordedMessage]] = {}
        self.count: Counter[str] = Counter()

    def add(self, group: Group) -> None:
        """Take the messages of a tick."""
        for told in group.told:
            if told.topic.startswith(TOPIC):
                signal = told.topic.removeprefix(TOPIC)
                if signal not in self._kept:
                    self._kept[signal] = deque(maxlen=KEPT)
                self._kept[signal].append(told)
                self.count[signal] += 1

    def since(self, signal: str, number: int = 0) -> list[RecordedMessage]:
        """Those of a signal after the first `number`, as far as they are kept."""
        kept = self._kept.get(signal, ())
        return list(kept)[max(0, len(kept) - (self.count[signal] - number)) :]


def numbers_of(value: Any, name: str = "") -> Iterable[tuple[str, float]]:
    """The numbers in a value, with the names of their fields, at most two levels deep."""
    if isinstance(value, bool | int | float):
        if math.isfinite(value):
            yield name or "value", float(value)
    elif name.count(".") < 2:
        for key, held in _fields(value):
            yield from numbers_of(held, f"{name}.{key}" if name else key)


def _fields(value: Any) -> Iterable[tuple[str, Any]]:
    if is_dataclass(value):
        return [(field.name, getattr(value, field.name)) for field in fields(value)]
    if hasattr(value, "_asdict"):
        return list(value._asdict().items())
    if isinstance(value, tuple | list) and len(value) <= 8:
        return [(str(n), held) for n, held in enumerate(value)]
    return ()
