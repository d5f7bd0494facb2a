"""What happened in a run: an ordered stream of records, always on.

The runner appends raw records that refer to nodes; they are expanded to paths and values only when
read. Times are ns since the run's start. `sha256` covers everything but notes and ticks.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any, NamedTuple

RawRecord = tuple[Any, ...]


class TraceRecord(NamedTuple):
    """One thing that happened at `time`, in ns.

    ======== =========================== ===============================
    kind     subject                     detail
    ======== =========================== ===============================
    enter    path                        –
    outcome  path                        outcome
    exit     path                        reason (rule 7)
    move     path of the container       child, outcome, next child
    data     path of the scope           key, value
    error    path                        class of the exception
    note     path                        text; not in the hash
    tick     path of the root            –; not in the hash
    ======== =========================== ===============================
    """

    time: int
    kind: str
    subject: str
    detail: tuple[Any, ...] = ()


class Trace:
    """The records of one run."""

    __slots__ = ("add", "raw")

    def __init__(self) -> None:
        self.raw: list[RawRecord] = []
        self.add = self.raw.append

    def __iter__(self) -> Iterator[TraceRecord]:
        for record in self.raw:
            yield from _expanded(record)

    def lines(self, start: int = 0) -> Iterator[str]:
        """Each record in the canonical encoding, beginning with raw record `start`."""
        for raw in self.raw[start:]:
            for record in _expanded(raw):
                yield encode((record.time, record.kind, record.subject, *record.detail))

    def sha256(self) -> str:
        """The hash of the run, in hexadecimal, without notes and ticks."""
        digest = hashlib.sha256()
        for record in self:
            if record.kind not in ("note", "tick"):
                item = (record.time, record.kind, record.subject, *record.detail)
                digest.update(encode(item).encode() + b"\n")
        return digest.hexdigest()

    def path(self) -> list[str]:
        """The leaves entered, one after the other."""
        left = {record.subject for record in self if record.kind == "move"}
        entered = [record for record in self if record.kind == "enter"]
        boxes = {r.subject.rpartition("/")[0] for r in entered} | left
        return [record.subject for record in entered if record.subject not in boxes]


def _expanded(raw: RawRecord) -> Iterator[TraceRecord]:
    kind, time, subject = raw[:3]
    if kind == "end":
        outcome, closed, route = raw[3:]
        yield TraceRecord(time, "outcome", subject.path, (outcome,))
        for node in closed:
            yield TraceRecord(time, "exit", node.path, ("preempted",))
        reason = "error" if outcome == "error" else "outcome"
        yield TraceRecord(time, "exit", subject.path, (reason,))
        if subject is route.top and route.target is not None:
            yield _move(time, route)
    elif kind == "move":
        yield _move(time, raw[3])
    elif kind == "lost":
        yield TraceRecord(time, "outcome", subject.path, (raw[3],))
        yield TraceRecord(time, "exit", subject.path, ("lost",))
    else:
        yield TraceRecord(time, kind, subject.path, raw[3:])


def _move(time: int, route: Any) -> TraceRecord:
    names = route.top.vertex.name, route.outcome, route.target.vertex.name
    return TraceRecord(time, "move", route.box.path, names)


def encode(value: Any) -> str:
    """The canonical text of a value: JSON, shortest floats, dataclasses by name, arrays by hash."""
    return json.dumps(plain(value), separators=(",", ":"), ensure_ascii=False, allow_nan=True)


def plain(value: Any) -> Any:
    """A value as lists, strings and numbers."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, tuple | list) and not hasattr(value, "_fields"):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): plain(value[key]) for key in sorted(value, key=str)}
    if is_dataclass(value):
        parts = [plain(getattr(value, field.name)) for field in fields(value)]
        return {type(value).__name__: parts}
    if isinstance(value, frozenset | set):
        return {type(value).__name__: sorted(encode(item) for item in value)}
    if hasattr(value, "_fields"):
        return {type(value).__name__: [plain(item) for item in value]}
    if hasattr(value, "tobytes"):
        content = str(value.dtype).encode() + str(value.shape).encode() + value.tobytes()
        return {"array": hashlib.sha256(content).hexdigest()}
    if isinstance(value, Enum):
        return {type(value).__name__: value.name}
    kind: Any = type(value)
    if kind.__repr__ is object.__repr__:  # that one has an address, which differs per process
        return {type(value).__name__: plain(getattr(value, "__dict__", {}))}
    return {type(value).__name__: repr(value)}
