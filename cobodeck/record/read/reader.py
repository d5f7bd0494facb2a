"""Reads records, complete and incomplete ones.

A record is read from its beginning, chunk by chunk, as far as it is intact: if the run was killed,
all but its last second. Messages after the last complete tick are dropped.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from os import SEEK_END
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, get_args

from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, DataEnd, Message, Metadata, Schema
from mcap.stream_reader import StreamReader

from cobodeck.loop import Kind, Ticked
from cobodeck.record.format import (
    FORMAT,
    LASER,
    MessageSchema,
    damage,
    has_end,
    misfit,
    records_of,
    trace_record,
)
from cobodeck.terminal import PART
from engine.files import FileError, mistake, unreadable
from engine.run import TraceRecord

LARGEST = 1 << 28
"""Records of the file larger than this, bytes, are refused; ours are smaller."""
CASE = "case"
"""The metadata of an excerpt with which a case is played."""
MOST = 1 << 18
"""A tick with more messages than this is refused; ours have fewer."""


class RecordedMessage(NamedTuple):
    """One message: its topic, the name of its schema, its bytes, and its time in the file, ns."""

    topic: str
    schema: str
    data: bytes
    log_ns: int


class MetadataValues(NamedTuple):
    """Metadata: values by their names."""

    name: str
    values: dict[str, Any]


@dataclass(frozen=True, slots=True)
class Group:
    """The messages of one tick, in order, and the `tick` message that closes it.

    `altered`: their checksum differs from the one in the closing message.
    """

    ticked: Ticked
    told: tuple[RecordedMessage, ...]
    closing: RecordedMessage
    altered: bool = False

    def messages(self, topic: str) -> list[Any]:
        """The messages of one topic, parsed."""
        return [json.loads(told.data) for told in self.told if told.topic == topic]

    def traced(self) -> Iterator[TraceRecord]:
        """The records of the trace."""
        return map(trace_record, self.messages("trace"))


@dataclass(slots=True)
class Record:
    """A record in a file; `groups` reads it piece by piece, any number of times.

    `header` and `attachments` are read at once. Once all groups were read, `result` has the
    figures if the run was completed, and `broken` says where the file is damaged or cut off, None
    if it is whole. `schemas` are those of the messages read so far, by name.

    Raises:
        FileError: the file cannot be read, or is no record of a run.
    """

    path: Path
    header: Mapping[str, Any] = field(init=False, default_factory=dict)
    attachments: dict[str, bytes] = field(init=False, default_factory=dict)
    schemas: dict[str, MessageSchema] = field(init=False, default_factory=dict)
    result: Mapping[str, Any] | None = field(init=False, default=None)
    broken: str | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        why = "it has no header of ours"
        for found in self._records():
            if isinstance(found, MetadataValues) and found.name == "run":
                self.header = found.values
            elif isinstance(found, Attachment):
                self.attachments[found.name] = found.data
            elif isinstance(found, RecordedMessage | Chunk | DataEnd):
                break
        else:
            why = self.broken or why
        kind = self.header.get("format")
        if kind is None:
            hint = "`run` and `simulate --record X.mcap` write records"
            raise mistake(self.path, f"is no record of a run: {why}", hint=hint)
        if kind != FORMAT:
            raise mistake(self.path, f"is a {kind!r}, which is not known", hint=f"{FORMAT!r}")
        wrong = misfit(self.header)
        if wrong is not None:
            raise mistake(self.path, f"is no record of a run: its header has no right {wrong!r}")

    def groups(self) -> Iterator[Group]:
        """The ticks in order, up to the last complete one."""
        told: list[RecordedMessage] = []
        crc = 0
        for found in self._records():
            if isinstance(found, MetadataValues) and found.name == "result":
                self.result = found.values
            if not isinstance(found, RecordedMessage):
                continue
            told.append(found)
            if len(told) > MOST:
                self.broken = f"there are {MOST} messages without a tick"
                break
            if found.topic == "tick":
                try:
                    ticked, expected = _ticked(found.data)
                except (ValueError, KeyError, TypeError, RecursionError):
                    self.broken = f"after {len(told)} messages there is a tick that is none"
                    break
                altered = expected not in _checksums(told, crc)
                yield Group(ticked, tuple(told[:-1]), found, altered)
                crc = expected
                told.clear()

    def figures(self) -> Mapping[str, Any] | None:
        """The figures of a complete file, found by its index; None if the run was not completed."""
        try:
            with self.path.open("rb") as stream:
                found = [m for m in make_reader(stream).iter_metadata() if m.name == "result"]
            return unpacked(found[-1]) if found else None
        except Exception:  # noqa: BLE001  from mcap, wrong lengths, or invalid JSON
            return None

    def case(self) -> Mapping[str, Any] | None:
        """Where the case begins of which this is the excerpt; None if it is none."""
        for found in self._records():
            if isinstance(found, MetadataValues) and found.name == CASE:
                return found.values
            if isinstance(found, RecordedMessage):
                break
        return None

    def require_ticks(self) -> None:
        """Check that the record has ticks.

        Raises:
            FileError: no tick is whole.
        """
        if next(self.groups(), None) is None:
            raise mistake(self.path, f"no complete tick: {self.broken or 'it has none'}")

    def damage(self) -> str | None:
        """How the bytes of a finished record differ from what was written; None: they do not.

        An unfinished one, `.part` without an end, may break off anywhere, and is not looked at.
        """
        with self._opened() as stream:
            unfinished = self.path.suffix == PART and not has_end(stream)
            return None if unfinished else damage(stream)

    def require_intact(self) -> None:
        """Check that the record, if it is finished, is as it was written.

        Raises:
            FileError: it is damaged.
        """
        found = self.damage()
        if found is not None:
            hint = "`cobodeck recover` saves what is intact of it"
            raise mistake(self.path, f"is damaged: {found}", hint=hint)

    def understood(self, group: Group) -> AbstractContextManager[None]:
        """A context that turns any exception over the messages of a tick into one of the file.

        Raises:
            FileError: any exception was raised within.
        """
        return self.usable(f"a message of the tick at {group.ticked.at_ns / 1e9:.3f} s")

    @contextmanager
    def usable(self, what: str) -> Iterator[None]:
        """A context that turns any exception over something in the record into one of the file.

        Raises:
            FileError: any exception was raised within.
        """
        try:
            yield
        except FileError:
            raise
        except Exception as error:  # noqa: BLE001  the file may be of any origin
            raise mistake(self.path, f"{what} cannot be used: {error!r}") from None

    def _records(self) -> Iterator[object]:
        """Everything intact in the file: `RecordedMessage`, `MetadataValues` and other records."""
        self.broken, whole = "it was not read to its end", 0
        messages = _Messages(self.schemas)
        with self._opened() as stream:
            reader = StreamReader(
                stream, emit_chunks=True, validate_crcs=True, record_size_limit=LARGEST
            )
            try:
                for record in reader.records:
                    if isinstance(record, Metadata):
                        yield MetadataValues(record.name, unpacked(record))
                    elif isinstance(record, Chunk):
                        yield record
                        for held in records_of(record):
                            yield from messages.taken(held)
                    else:
                        yield from messages.taken(record)
                    whole = stream.tell()
            except Exception as error:  # noqa: BLE001  from mcap, decompression, wrong lengths
                self.broken = f"it breaks off at byte {whole} of {stream.seek(0, SEEK_END)}"
                if not whole:
                    self.broken = "it is no MCAP file"
                if not stream.tell():
                    self.broken = "it is empty: its run wrote no tick"
                if isinstance(getattr(error, "record", None), DataEnd):
                    self.broken = f"its first {whole} bytes are not those that were written"
                return
            self.broken = damage(stream)

    def _opened(self) -> BinaryIO:
        if self.path.exists() and not self.path.is_file():  # reading a pipe would block
            raise mistake(self.path, "cannot be read: it is no regular file")
        try:
            return self.path.open("rb")
        except OSError as error:
            raise unreadable(self.path, error) from None


def _checksums(told: Iterable[RecordedMessage], crc: int) -> Iterator[int]:
    """The checksums of a tick's messages: as they are, and rewritten in our JSON layout.

    `crc` is the checksum after the tick before.
    """
    for again in (lambda one: one.data, _set_again):
        found = crc
        for one in told:
            data = again(one)
            if one.topic == "tick":
                yield zlib.crc32(data[1 : max(1, data.rfind(b',"crc"'))], found)
            else:
                found = zlib.crc32(data, found ^ zlib.crc32(one.topic.encode()))


def _set_again(told: RecordedMessage) -> bytes:
    """The message rewritten in our JSON layout; unchanged if it is not JSON."""
    if told.schema == LASER:
        return told.data
    ascii_only = told.topic != "trace"
    try:
        found = json.loads(told.data)
        return json.dumps(found, separators=(",", ":"), ensure_ascii=ascii_only).encode()
    except (ValueError, RecursionError):
        return told.data


class _Messages:
    """Resolves topics and schemas of messages, which a file states once, before the first use."""

    def __init__(self, schemas: dict[str, MessageSchema]) -> None:
        self._schemas = schemas
        self._names: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}

    def taken(self, record: object) -> Iterator[object]:
        """Remember schemas and topics; turn messages into `RecordedMessage`."""
        if isinstance(record, Schema):
            self._names[record.id] = record.name
            self._schemas[record.name] = MessageSchema(record.name, record.encoding, record.data)
        elif isinstance(record, Channel):
            self._channels[record.id] = record.topic, self._names[record.schema_id]
        elif isinstance(record, Message):
            yield RecordedMessage(*self._channels[record.channel_id], record.data, record.log_time)
        else:
            yield record


def closed(told: Sequence[RecordedMessage]) -> Group:
    """The messages of a tick, of which the last one closes it; their checksum is not looked at.

    Raises:
        ValueError, KeyError, TypeError: it does not.
    """
    return Group(_ticked(told[-1].data)[0], tuple(told[:-1]), told[-1])


def _ticked(data: bytes) -> tuple[Ticked, int]:
    """A tick and its checksum.

    Raises:
        ValueError, KeyError, TypeError, RecursionError: the message is no tick.
    """
    m = json.loads(data)
    numbers = m["at_ns"], m["n"], m["missed"], m["late_ns"], m["crc"]
    right = all(type(n) is int and -1 <= n < 1 << 63 for n in numbers)
    if not right or m["kind"] not in get_args(Kind):
        raise ValueError("is no tick")
    return Ticked(m["at_ns"], m["n"], m["kind"], m["missed"], m["late_ns"]), m["crc"]


def unpacked(found: Metadata) -> dict[str, Any]:
    """The values of metadata, each of which is stored as JSON text."""
    return {name: json.loads(value) for name, value in found.metadata.items()}
