"""What happened in a run: a numbered stream of values, always on, that can be replayed.

The runner appends one record per edge, with vertices in it; paths and values are written out only
when somebody reads. Times are ns since the run's start. `sha256` covers everything but notes.
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
        """Each record in the canonical encoding; `start`: from this raw record on."""
        for raw in self.raw[start:]:
            for record in _expanded(raw):
                yield encode((record.time, record.kind, record.subject, *record.detail))

    def sha256(self) -> str:
        """The hash of the run; notes do not count."""
        digest = hashlib.sha256()
        for record in self:
            if record.kind not in ("note", "tick"):
                item = (record.time, record.kind, record.subject, *record.detail)
                digest.update(encode(item).encode() + b"\n")
        return digest.hexdigest()

    def path(self) -> list[str]:
        """The leaves entered, one after the other."""
        left = {record[2].path for record in self.raw if record[0] == "move"}
        entered = [record for record in self if record.kind == "enter"]
        boxes = {r.subject.rpartition("/")[0] for r in entered} | left
        return [record.subject for record in entered if record.subject not in boxes]


def _expanded(raw: RawRecord) -> Iterator[TraceRecord]:
    kind, time, subject = raw[:3]
    if kind == "end":
        yield TraceRecord(time, "outcome", subject.path, (raw[3],))
        for closed in raw[4]:
            yield TraceRecord(time, "exit", closed.path, ("preempted",))
        yield TraceRecord(
            time, "exit", subject.path, ("error" if raw[3] == "error" else "outcome",)
        )
    elif kind == "move":
        route = raw[3]
        names = route.top.vertex.name, route.outcome, route.target.vertex.name
        yield TraceRecord(time, kind, subject.path, names)
    elif kind == "lost":
        yield TraceRecord(time, "outcome", subject.path, (raw[3],))
        yield TraceRecord(time, "exit", subject.path, ("lost",))
    elif kind == "data":
        yield TraceRecord(time, kind, subject.path, (raw[3], raw[4]))
    else:
        yield TraceRecord(time, kind, subject.path, raw[3:])


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
    if kind.__repr__ is object.__repr__:  # it holds an address, another one in each process
        return {type(value).__name__: plain(getattr(value, "__dict__", {}))}
    return {type(value).__name__: repr(value)}
