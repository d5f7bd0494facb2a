"""A context for states that are stepped by hand."""

from __future__ import annotations

import math
from typing import Any

from engine.state import Stamped


class FakeContext:
    """What a state sees, from plain dicts; events are handed out once."""

    def __init__(self, values: dict[str, Any], parts: dict[str, Any] | None = None) -> None:
        self.values, self.parts = values, parts or {}
        self.stamps: dict[str, int] = {}
        self.pending: dict[str, list[Stamped]] = {}
        self.ages: dict[str, float] = {}
        self.events_of: set[str] = set()
        self.notes: list[str] = []
        self.now = 0

    def after(self, seconds: float) -> int:
        return self.now + round(seconds * 1e9)

    def value(self, signal: str) -> Any:
        if signal.endswith(".planner") and signal not in self.values:
            return self.values["environment"].static_planners[signal.removesuffix(".planner")]
        return self.values.get(signal)

    def sample(self, signal: str) -> Stamped | None:
        if signal not in self.values:
            return None
        return Stamped(self.values[signal], self.stamps.get(signal, 0))

    def age(self, signal: str) -> float:
        return self.ages.get(signal, 0.0) if self.values.get(signal) is not None else math.inf

    def events(self, signal: str) -> tuple[Stamped, ...]:
        return tuple(self.pending.pop(signal, ()))

    def is_event(self, signal: str) -> bool:
        return signal in self.events_of

    def note(self, text: str) -> None:
        self.notes.append(text)

    def part(self, name: str) -> Any:
        return self.parts[name]
