"""The position of a replay in its record, and what the record holds for the current tick."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from cobodeck.record.format import (
    TOPIC,
    SampleReader,
    Unknown,
    cycle_again,
    raised_again,
    today,
    trace_line,
    truth_again,
    value,
)
from cobodeck.record.read.reader import Group, RecordedMessage
from hw import Sample, Truth
from hw.safety import SafetyRecord

ALTERED = "the messages of this tick are not those that were written"


class ReplayMismatch(NamedTuple):
    """The first difference from the record: when (ns), what, recorded value, replayed value."""

    at_ns: int
    what: str
    recorded: str
    replayed: str

    def __str__(self) -> str:
        told = f"at {self.at_ns / 1e9:.3f} s, {self.what}"
        return f"{told}\n  recorded: {self.recorded}\n  replayed: {self.replayed}"


@dataclass(slots=True)
class Fed:
    """What a record holds for one tick; `samples` include refused ones."""

    samples: list[Sample] = field(default_factory=list)
    commands: list[Mapping[str, Any]] = field(default_factory=list)
    calls: deque[Mapping[str, Any]] = field(default_factory=deque)
    failures: list[tuple[str, Exception]] = field(default_factory=list)
    cycles: list[SafetyRecord] = field(default_factory=list)
    trace: list[str] = field(default_factory=list)
    truth: Truth | None = None


class RecordFeed:
    """Steps through a record tick by tick; an unreadable message counts as a difference."""

    def __init__(self, groups: Iterator[Group]) -> None:
        self._groups = groups
        self._readers: dict[str, SampleReader] = {}
        self.now: Group | None = None
        self.next: Group | None = next(groups, None)
        self.fed = Fed()
        self.difference: ReplayMismatch | None = None
        if self.next is not None:
            self.fed.truth = self._truth(self.next)  # the state before the first tick

    def move(self) -> Group | None:
        """Step to the next tick."""
        self.now, self.next = self.next, next(self._groups, None)
        self.fed = Fed(truth=self.fed.truth)
        if self.now is not None:
            try:
                for told in self.now.told:
                    self._add_message(told)
            except Exception as error:  # noqa: BLE001  an altered message may cause anything
                self.differ(f"{told.topic}: a message", "can be read", f"{error!r}")
        return self.now

    def _add_message(self, told: RecordedMessage) -> None:
        fed, topic = self.fed, told.topic
        if topic.startswith(TOPIC):
            fed.samples.append(self._sample(told))
            return
        found = json.loads(told.data)
        if topic == "trace":
            line = json.dumps(trace_line(found), separators=(",", ":"), ensure_ascii=False)
            fed.trace.append(line)
        elif topic == "refused":
            with suppress(Unknown):  # the sample would be refused anyway
                stamp, held = value(found["stamp"]), value(found["value"])
                fed.samples.append(Sample(found["signal"], stamp, held))
        elif topic == "operator":
            fed.commands.append(_named(found, "command"))
        elif topic == "parts":
            called = _named(found, "part", "what")
            fed.calls.append({**called, "args": today(called["args"])})
        elif topic == "failures":
            fed.failures.append((found["part"], raised_again(found["raised"])))
        elif topic == "safety":
            fed.cycles.append(cycle_again(found))
        elif topic == "truth":
            fed.truth = truth_again(found, fed.truth)

    def _sample(self, told: RecordedMessage) -> Sample:
        name = told.topic.removeprefix(TOPIC)
        reader = self._readers.get(name)
        if reader is None:
            reader = self._readers[name] = SampleReader(name)
        return reader.read(told.schema, told.data)

    def _truth(self, group: Group) -> Truth | None:
        try:
            return next((truth_again(found, None) for found in group.messages("truth")), None)
        except Exception:  # noqa: BLE001  reported when this tick is reached
            return None

    @property
    def at_end(self) -> bool:
        """Whether only the closing of the run is left."""
        return self.now is not None and self.now.ticked.kind == "end"

    @property
    def over(self) -> bool:
        """Whether no tick is left or a difference was found."""
        return self.difference is not None or self.next is None or self.at_end

    def differ(self, what: str, recorded: object, replayed: object) -> None:
        """Note a difference from the record; only the first counts."""
        group = self.now or self.next
        if self.difference is None:
            at = 0 if group is None else group.ticked.at_ns
            altered = self.now is not None and self.now.altered and what != ALTERED
            told = f"{what} ({ALTERED})" if altered else what
            self.difference = ReplayMismatch(at, told, str(recorded), str(replayed))


def _named(found: Any, *names: str) -> Mapping[str, Any]:
    """The message itself, after checking that it has these texts, and arguments.

    Raises:
        ValueError: it has not.
    """
    if not isinstance(found, dict) or not all(isinstance(found.get(name), str) for name in names):
        raise ValueError(f"it lacks {' or '.join(names)}")
    given = found.get("arguments" if "command" in names else "args")
    if not isinstance(given, list | dict):
        raise ValueError(f"nothing was given to {names[-1]}")
    return found
