"""What a run looks like at an instant, folded from what was recorded of it, tick by tick.

The same for a run that goes on and for a record: `add` takes the messages of a tick, `state` is
all that a page shows of it, `changes` what has changed since they were asked for last.
"""

from __future__ import annotations

import copy
import json
from collections import deque
from collections.abc import Iterator, Mapping
from typing import Any

from cobodeck.live.feed import Whole
from cobodeck.loop import LATE_NS
from cobodeck.record.format import (
    LASER,
    TOPIC,
    sample_of,
    scanner_of,
    trace_record,
    truth_again,
    value,
)
from cobodeck.record.read import Group, RecordedMessage
from engine.chart import AUTONOMY
from engine.run import ASKS
from hw import Sample, Scan, Truth

NEWEST = 200
"""So many lines of what happened last are kept."""
STATE = (
    "active", "data", "waiting", "locks", "level", "paused", "breaks", "ended", "stop", "faults"
)  # fmt: skip
"""The keys of a state that are told whole when they change; see the protocol of the page."""
SCAN_TOPIC = f"{TOPIC}base.scan"
SILENT_NS = 1_000_000_000
"""A scanner not heard for so long, ns, shows nothing any more."""
STOP_TOPIC = f"{TOPIC}stop.engaged"
_LEVELS: dict[int | None, str] = {number: name for name, number in AUTONOMY.items() if number >= 0}


class RunModel:
    """A run at the instant `at_ns`; see the module.

    Attributes:
        active: when each node that is active was entered, s, by path; "" is the root.
        data: by the path where a chart begins, each key's value as JSON.
        waiting: the outcome that waits for consent, by path.
        last: what happened last: time, kind, path, text.
        newest: the newest message of each signal; `truth` that of the ground truth.
        transitions, missed, late, errors, requests: how many so far.
        refused: how many samples of each signal so far.
    """

    def __init__(self) -> None:
        self.at_ns = 0
        self.active: dict[str, float] = {}
        self.data: dict[str, dict[str, str]] = {}
        self.waiting: dict[str, str] = {}
        self.locks: list[str] = []
        self.level: str | None = None
        self.paused = False
        self.breaks: list[str] = []
        self.ended: str | None = None
        self.stop = False
        self.faults: list[str] = []
        self.last: deque[dict[str, Any]] = deque(maxlen=NEWEST)
        self.newest: dict[str, RecordedMessage] = {}
        self.transitions = self.missed = self.late = self.errors = self.requests = 0
        self.refused: dict[str, int] = {}
        self._scans: dict[str, RecordedMessage] = {}  # the newest of each scanner
        self._truth: RecordedMessage | None = None
        self._changed: set[str] = set()
        self._said = 0  # lines of `last` so far

    # folding

    def add(self, group: Group) -> None:
        """Take the messages of a tick."""
        for told in group.told:
            topic = told.topic
            if topic.startswith(TOPIC):
                self._take(told)
                self.requests += is_request(told)
            elif topic == "truth":
                self._truth = told
            elif topic in _FOLDED:
                _FOLDED[topic](self, json.loads(told.data), told.log_ns)
        ticked = group.ticked
        self.at_ns = max(0, ticked.at_ns)
        self.missed += ticked.missed
        self.late += ticked.late_ns > LATE_NS
        if ticked.kind == "end":
            self._set("active", {})

    def _take(self, told: RecordedMessage) -> None:
        self.newest[told.topic] = told
        if told.topic == SCAN_TOPIC and told.schema == LASER:
            self._scans[scanner_of(told.data)] = told
        elif told.topic == STOP_TOPIC:
            self.tell("stop", stop_reason(told) is not None)

    def renew(self, whole: Whole) -> None:
        """Take everything that holds now, after ticks were dropped."""
        self.at_ns = whole.at_ns
        before = self.active
        self._set("active", {
            path: before.get(path, whole.at_ns / 1e9) if since is None else since / 1e9
            for path, since in whole.active.items()
        })  # fmt: skip
        self._set("data", {path: dict(held) for path, held in whole.data.items()})
        self._set("waiting", dict(whole.waiting))
        self._set("locks", list(whole.locks))
        self._set("level", _LEVELS.get(whole.level))
        self._set("paused", whole.paused)
        self._set("ended", whole.outcome)
        for told in whole.samples:
            self._take(told)
        self._say(whole.at_ns, "note", "", f"{whole.dropped} ticks were not shown")

    def tell(self, key: str, held: Any) -> None:
        """Set something that is not on record, such as the faults of the operator's console."""
        if getattr(self, key) != held:
            self._set(key, held)

    def _set(self, key: str, held: Any) -> None:
        setattr(self, key, held)
        self._changed.add(key)

    def _say(self, at_ns: int, kind: str, path: str, text: str, **more: str) -> None:
        self.last.append({"at": at_ns / 1e9, "kind": kind, "path": path, "text": text, **more})
        self._said += 1
        self._changed.add("last")

    def _trace(self, message: Mapping[str, Any], _ns: int) -> None:
        at_ns, kind, path, detail = trace_record(message)
        if kind == "enter":
            self.active[path] = at_ns / 1e9
            self._changed.add("active")
            self._answered(path)
        elif kind == "exit":
            self.active.pop(path, None)
            self._changed.add("active")
            self._answered(path, below=True)
            if not path:
                self._set("waiting", {})
        elif kind == "outcome" and not path:
            self._set("ended", detail[0])
        elif kind == "move":
            child, outcome, target = detail
            self.transitions += 1
            self._answered(f"{path}/{child}" if path else child, below=True)
            told = f"{child}.{outcome} → {target}"
            self._say(at_ns, "move", path, told, child=child, outcome=outcome)
        elif kind == "data":
            key, held = detail
            self.data.setdefault(path, {})[key] = json.dumps(held, ensure_ascii=False)
            self._changed.add("data")
        elif kind in ("error", "note"):
            self._note(at_ns, kind, path, str(detail[0]))

    def _note(self, at_ns: int, kind: str, path: str, text: str) -> None:
        _, asks, outcome = text.partition(ASKS)
        if kind == "note" and asks:
            self.waiting[path] = outcome
            self._changed.add("waiting")
        self._say(at_ns, kind, path, text)

    def _answered(self, path: str, below: bool = False) -> None:
        """Nothing at `path` waits any more."""
        gone = [w for w in self.waiting if w == path or (below and w.startswith(f"{path}/"))]
        for waiting in gone:
            del self.waiting[waiting]
            self._changed.add("waiting")

    def _command(self, message: Mapping[str, Any], ns: int) -> None:
        name, given = message["command"], value(message["arguments"])
        if name in ("Pause", "Resume", "Break"):
            self._set("paused", name != "Resume")
        elif name == "SetLock":
            self._set("locks", _with(self.locks, given["path"], given["locked"]))
        elif name == "SetBreak":
            self._set("breaks", _with(self.breaks, given["path"], given["breaks"]))
        elif name == "SetLevel":
            self._set("level", _LEVELS.get(given["level"]))
        elif name == "Answer":
            self._answered(given["path"])
        elif name == "End":
            self._set("ended", given["outcome"])
        by = message.get("by") or "operator"
        told = ", ".join(f"{k} {v}" for k, v in given.items() if k != "charts" and v)
        if name != "Remark":  # the trace has it as a note
            self._say(ns, "command", str(given.get("path", "")), f"{by}: {name} {told}".rstrip())

    def _log(self, message: Mapping[str, Any], ns: int) -> None:
        self.errors += 1
        self._say(ns, "error", message.get("name", ""), message["message"])

    def _refused(self, message: Mapping[str, Any], _ns: int) -> None:
        name = message["signal"]
        self.refused[name] = self.refused.get(name, 0) + 1

    # what is asked for

    def state(self) -> dict[str, Any]:
        """Everything, as the message `state` has it."""
        found: dict[str, Any] = {"t": "state", "at": self.at_ns / 1e9, "last": list(self.last)}
        return found | {key: copy.copy(getattr(self, key)) for key in STATE}

    def changes(self) -> dict[str, Any] | None:
        """What has changed since the last call, as the message `ev` has it; None: nothing."""
        changed, self._changed = self._changed, set()
        said, self._said = self._said, 0
        if not changed:
            return None
        found = {key: copy.copy(getattr(self, key)) for key in STATE if key in changed}
        if said:
            found["last"] = list(self.last)[-said:]
        return {"t": "ev", "at": self.at_ns / 1e9, **found}

    def sample(self, name: str) -> Sample | None:
        """The newest sample of a signal; None if there is none, or its class is unknown here."""
        told = self.newest.get(TOPIC + name)
        return None if told is None else _sample(told)

    def scans(self) -> Iterator[Scan]:
        """The newest scan of each scanner."""
        for told in self._scans.values():
            found = _sample(told)
            if found is not None and self.at_ns - found.stamp_ns <= SILENT_NS:
                assert isinstance(found.value, Scan)
                yield found.value

    def samples(self) -> Iterator[Sample]:
        """The newest sample of each signal."""
        yield from filter(None, map(_sample, self.newest.values()))

    @property
    def truth(self) -> Truth | None:
        """The ground truth, where it is recorded."""
        return None if self._truth is None else truth_again(json.loads(self._truth.data), None)

    def copied(self) -> RunModel:
        """The same, to be changed independently."""
        found = copy.copy(self)
        for key, held in vars(self).items():
            if isinstance(held, dict | list | set | deque):
                setattr(found, key, copy.copy(held))
        found.data = {path: dict(held) for path, held in self.data.items()}
        return found


def is_request(told: RecordedMessage) -> bool:
    """Whether the person asks for a touch with this message."""
    if told.topic != f"{TOPIC}vr.haptic_request":
        return False
    return json.loads(told.data)["value"] is not None


def stop_reason(told: RecordedMessage) -> str | None:
    """Why the stop line is pulled, of a message of it; None: it is not."""
    found = json.loads(told.data)["value"]
    return None if found is None else str(found)


_FOLDED = {
    "trace": RunModel._trace,
    "operator": RunModel._command,
    "log": RunModel._log,
    "refused": RunModel._refused,
}


def _with(held: list[str], path: str, there: bool) -> list[str]:
    return sorted({*held, path}) if there else [one for one in held if one != path]


def _sample(told: RecordedMessage) -> Sample | None:
    try:
        return sample_of(told.topic.removeprefix(TOPIC), told.schema, told.data)
    except Exception:  # noqa: BLE001  a class of a project that is not loaded here
        return None
