"""What happened in a run: an ordered stream of records, always on.

The runner appends raw records that refer to nodes; they are expanded to paths and values only when
read. The newest stay in memory; older ones go to the `archive`, if there is one. Times are ns since
the run's start. `sha256` covers everything but notes and ticks, from the first record on.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from enum import Enum
from typing import Any, NamedTuple, Protocol

from engine.files import Write, Writers
from engine.run.errors import escaped

KEPT, BATCH = 1 << 16, 64
"""Raw records that stay in memory at least, some 10 MB; so many more leave it together."""
LONG_BITS = 4096
"""Integers longer than this are told in hexadecimal."""
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
    data     path of the container       key, value
    error    path                        class of the exception
    note     path                        text; not in the hash
    tick     path of the root            –; not in the hash
    ======== =========================== ===============================
    """

    time: int
    kind: str
    subject: str
    detail: tuple[Any, ...] = ()


class Archive(Protocol):
    """Where a run puts the records that it no longer keeps in memory, for example a file."""

    def append(self, line: str) -> None:
        """Add one record in the canonical encoding; it has no line break."""
        ...

    def __iter__(self) -> Iterator[str]:
        """All lines, in order."""
        ...


class Trace:
    """The records of one run.

    Iterating yields those in the archive, their values as JSON has them, and then those in memory.

    Attributes:
        raw: those in memory.
        archive: takes the older ones; without it they are only counted and hashed.
        gone: how many raw records are no longer in memory.
    """

    __slots__ = ("_digest", "add", "archive", "gone", "raw")

    def __init__(self) -> None:
        self.raw: list[RawRecord] = []
        self.add = self.raw.append
        self.archive: Archive | None = None
        self.gone = 0
        self._digest = hashlib.sha256()  # of those that are gone

    def __iter__(self) -> Iterator[TraceRecord]:
        for line in self.archive or ():
            time, kind, subject, *detail = json.loads(line)
            yield TraceRecord(time, kind, subject, tuple(detail))
        for raw in self.raw:
            yield from _expanded(raw)

    @property
    def end(self) -> int:
        """The number of raw records so far."""
        return self.gone + len(self.raw)

    def lines(self, start: int = 0) -> Iterator[str]:
        """Each record in the canonical encoding, beginning with raw record `start`.

        `start` is 0, or the number of one that is still in memory.
        """
        if not start:
            yield from self.archive or ()
        for raw in self.raw[max(0, start - self.gone) :]:
            yield from map(_line, _expanded(raw))

    def trim(self) -> None:
        """Let the oldest records go once there are too many.

        Raises:
            OSError: the archive cannot take them; it gets no more then.
        """
        if len(self.raw) < KEPT + BATCH:
            return
        oldest = self.raw[:BATCH]
        del self.raw[:BATCH]
        self.gone += BATCH
        lines = list(_hashed(self._digest, oldest))
        archive, self.archive = self.archive, None
        if archive is not None:
            for line in lines:
                archive.append(line)
            self.archive = archive

    def sha256(self) -> str:
        """The hash of the run, in hexadecimal, without notes and ticks."""
        digest = self._digest.copy()
        for _ in _hashed(digest, self.raw):
            pass
        return digest.hexdigest()

    def path(self) -> list[str]:
        """The leaves entered, one after the other."""
        left = {record.subject for record in self if record.kind == "move"}
        entered = [record for record in self if record.kind == "enter"]
        boxes = {r.subject.rpartition("/")[0] for r in entered} | left
        return [record.subject for record in entered if record.subject not in boxes]


def _line(record: TraceRecord) -> str:
    return encode((record.time, record.kind, record.subject, *record.detail))


def _hashed(digest: hashlib._Hash, raws: Iterable[RawRecord]) -> Iterator[str]:
    """The lines of these records, each once it is in the hash."""
    for raw in raws:
        for record in _expanded(raw):
            line = _line(record)
            if record.kind not in ("note", "tick"):
                digest.update(line.encode() + b"\n")
            yield line


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
    return escaped(_WRITE[type(value)](value))


def _writer(kind: type) -> Write:
    name = kind.__name__
    if (write := _WRITE.of_base(kind)) is not None:
        return write
    if issubclass(kind, tuple | list) and not hasattr(kind, "_fields"):
        return _WRITE.items_text
    if issubclass(kind, dict):
        return _pairs
    if (write := _WRITE.of_fields(kind, name)) is not None:
        return write
    if issubclass(kind, frozenset | set):
        return lambda held: _WRITE.text({name: sorted(encode(item) for item in held)})
    if hasattr(kind, "tobytes"):
        return _array
    if issubclass(kind, Enum):
        return lambda member: _WRITE.text({name: member.name})
    return lambda other: _WRITE.text({name: _representation(other)})


def _integer(held: int) -> str:
    if held.bit_length() <= LONG_BITS:
        return int.__repr__(held)
    return _WRITE.text({"int": hex(held)})


def _pairs(pairs: dict[Any, Any]) -> str:
    told = {str(key): _WRITE.text(pairs[key]) for key in sorted(pairs, key=str)}
    return f"{{{','.join([f'{_quoted(key)}:{held}' for key, held in told.items()])}}}"


def _array(array: Any) -> str:
    content = str(array.dtype).encode() + str(array.shape).encode() + array.tobytes()
    return _WRITE.text({"array": hashlib.sha256(content).hexdigest()})


def _representation(value: Any) -> Any:
    kind: Any = type(value)
    if kind.__repr__ is object.__repr__:  # that one has an address, which differs per process
        return getattr(value, "__dict__", {})
    try:
        return repr(value)
    except Exception:  # noqa: BLE001  whatever class it is of
        return "?"


_quoted = json.encoder.encode_basestring
_WRITE = Writers(_writer, string=_quoted)
_WRITE[int] = _integer
