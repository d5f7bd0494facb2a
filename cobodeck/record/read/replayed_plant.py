"""A record as the plant of a loop: its samples, stand-ins for the parts, and its clock."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import partial
from typing import Any, ClassVar

from cobodeck.loop import Inert
from cobodeck.record.format import Unknown, arguments_text, raised_again, value
from cobodeck.record.read.sample_feed import RecordFeed
from cobodeck.setup import REFERENCE
from engine import NEVER_NS
from hw import Sample, Truth
from hw.safety import CycleLog

RECORD = "(record)"
"""Name of the part that provides all samples; no real part can have this name."""


class Recorded:
    """A record as a plant; see `cobodeck.loop.plant.Plant`."""

    guard = None
    latency_ns = 0

    def __init__(self, header: Mapping[str, Any], feed: RecordFeed) -> None:
        self.paced = bool(header["real_time"])
        self.shaken = header["options"]["tier"] == REFERENCE
        self.cycles = CycleLog() if header["guard"] else None
        self.parts: dict[str, Any] = {
            name: Inert(tuple(signals)) for name, signals in header["parts"].items()
        }
        self.faults: list[Any] = []
        if "operator" in self.parts:
            self.parts["operator"].faults = self.faults
        self.parts[RECORD] = Samples(tuple(header["flowing"]), feed)
        self._feed = feed
        self._failures: list[tuple[str, Exception]] = []

    @property
    def truth(self) -> Truth | None:
        """The recorded ground truth."""
        return self._feed.fed.truth

    @property
    def failures(self) -> list[tuple[str, Exception]]:
        """Exceptions of parts in this tick; each is returned once."""
        found, self._failures = self._failures, []
        return found

    @property
    def finished(self) -> bool:
        """Whether the record is at its end."""
        return self._feed.over

    def advance(self, to_ns: int) -> None:
        """Take the recorded state of this instant; in virtual time, step to the next tick."""
        feed = self._feed
        group = feed.now if self.paced else feed.move()
        if group is None or (not self.paced and group.ticked.at_ns != to_ns):
            at = "none" if group is None else f"{group.ticked.at_ns / 1e9:.9f} s"
            feed.differ("the instant of the next tick", at, f"{to_ns / 1e9:.9f} s")
        self.read_tick()

    def read_tick(self) -> None:
        """Take the recorded cycles, faults and failures of this tick."""
        fed = self._feed.fed
        if self.cycles is not None:
            for cycle in fed.cycles:
                self.cycles.append(cycle)
        for call in fed.calls:
            if (call["part"], call["what"]) == ("operator", "report"):
                self.faults += [fault for fault in call["args"] if isinstance(fault, str)]
        self._failures += fed.failures

    leap = None

    def quiet_until(self) -> int:
        """The instant of the next tick."""
        following = self._feed.next
        return NEVER_NS if following is None else following.ticked.at_ns

    def close(self) -> None:
        """Do nothing; no device is open."""


class Samples(Inert):
    """The part that provides all recorded samples."""

    def __init__(self, signals: tuple[str, ...], feed: RecordFeed) -> None:
        super().__init__(signals)
        self._feed = feed

    def samples(self, now_ns: int) -> tuple[Sample, ...]:  # noqa: ARG002  the feed knows
        """The samples of this tick, refused ones included."""
        return tuple(self._feed.fed.samples)


class RecordedPart:
    """Stands in for a part: answers as recorded, as long as it is called as recorded."""

    def __init__(self, name: str, feed: RecordFeed) -> None:
        vars(self).update(_name=name, _feed=feed)

    def __setattr__(self, what: str, held: object) -> None:
        self._call(f".{what} =", held)

    def __getattr__(self, what: str) -> Any:
        calls = self._feed.fed.calls
        if calls and (calls[0]["part"], calls[0]["what"]) == (self._name, f".{what}"):
            return self._answer(calls.popleft())
        if what.startswith("__"):
            raise AttributeError(what)
        return partial(self._call, what)

    def _call(self, what: str, *args: Any, **named: Any) -> Any:
        feed = self._feed
        if feed.now is None or feed.difference is not None:
            return None
        given = f"{what}{arguments_text(args, named)}"
        if not feed.fed.calls:
            feed.differ(f"call of {self._name}", "no call", given)
            return None
        found = feed.fed.calls.popleft()
        if found["part"] != self._name or call_of(found) != given:
            both = {found["part"]: None, self._name: None}
            feed.differ(f"call of {', '.join(both)}", call_of(found), given)
            return None
        return self._answer(found)

    def _answer(self, found: Mapping[str, Any]) -> Any:
        if "raised" in found:
            raise raised_again(found["raised"])
        try:
            return value(found.get("answer"))
        except Unknown as unknown:
            what = f"the answer of {self._name}.{found['what']}"
            self._feed.differ(what, json.dumps(found["answer"]), unknown)
            return None


def call_of(found: Mapping[str, Any]) -> str:
    """A recorded call as text for people."""
    return f"{found['what']}{json.dumps(found['args'], separators=(',', ':'))}"


class RecordedClock:
    """A clock that returns the recorded instants in order."""

    waits: ClassVar[bool] = True
    paced: ClassVar[bool] = False

    def __init__(self, feed: RecordFeed) -> None:
        self._feed = feed

    def wait(self, until_ns: int) -> int:
        """The instant of the next tick."""
        group = self._feed.move()
        return until_ns if group is None else group.ticked.at_ns

    def wake(self) -> None:
        """Do nothing; nothing sleeps."""
