"""Reads records, whole ones and those that break off.

A record is read from its beginning, chunk by chunk, as far as it is whole: of one that was broken
off all but the last second is there. What follows the last tick belongs to none and is dropped.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from mcap.records import Attachment, Channel, Chunk, DataEnd, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from cobodeck.loop import Ticked
from cobodeck.record.header import FORMAT
from engine.files.finding import mistake

LARGEST = 1 << 30
"""No chunk of ours is as large, bytes."""


class Told(NamedTuple):
    """One message: its topic, the name of its schema, and its bytes."""

    topic: str
    schema: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Group:
    """The messages of one tick, in order; `altered`: not those that were written with it."""

    ticked: Ticked
    told: tuple[Told, ...]
    altered: bool = False

    def of(self, topic: str) -> list[Any]:
        """The messages of one topic, parsed."""
        return [json.loads(told.data) for told in self.told if told.topic == topic]


@dataclass(slots=True)
class Record:
    """A record in a file; `groups` reads it piece by piece, any number of times.

    `header` and `attachments` are there at once. Once all groups were read, `result` has the
    figures, if the run came to its end, and `broken` says why the file ends early, if it does.

    Raises:
        FileError: the file cannot be read, or is no record of a run.
    """

    path: Path
    header: Mapping[str, Any] = field(init=False, default_factory=dict)
    attachments: dict[str, bytes] = field(init=False, default_factory=dict)
    result: Mapping[str, Any] | None = field(init=False, default=None)
    broken: str | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        for found in self._records():
            if isinstance(found, Metadata) and found.name == "run":
                self.header = unpacked(found)
            elif isinstance(found, Attachment):
                self.attachments[found.name] = found.data
            elif isinstance(found, Chunk | DataEnd):
                break
        if self.header.get("format") != FORMAT:
            other = self.header.get("format", self.broken or "it has no header of ours")
            raise mistake(self.path, f"is no record of a run: {other}", hint=f"{FORMAT!r}")

    def groups(self) -> Iterator[Group]:
        """Its ticks, in order, up to the last one that is whole."""
        told: list[Told] = []
        crc = 0
        for found in self._records():
            if isinstance(found, Metadata) and found.name == "result":
                self.result = unpacked(found)
            if not isinstance(found, Told):
                continue
            told.append(found)
            if found.topic == "tick":
                message = json.loads(found.data)
                altered = message["crc"] not in _checksums(told, crc)
                yield Group(_ticked(message), tuple(told[:-1]), altered)
                crc = zlib.crc32(found.data, message["crc"] ^ _TICK)
                told.clear()

    def _records(self) -> Iterator[object]:
        """What is in the file, messages as `Told`, as far as it is whole."""
        self.broken = "it breaks off"
        messages = _Messages()
        try:
            stream = self.path.open("rb")
        except OSError as error:
            raise mistake(self.path, f"cannot be read: {error.strerror}") from None
        with stream:
            reader = StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST)
            try:
                for record in reader.records:
                    if isinstance(record, DataEnd):
                        self.broken = None
                    if not isinstance(record, Chunk):
                        yield record
                        continue
                    yield record
                    yield from messages.of(record)
            except Exception as error:  # noqa: BLE001  of mcap, of decompression, of broken lengths
                if self.broken is not None:
                    self.broken = f"it breaks off: {type(error).__name__} {error}".rstrip()


_TICK = zlib.crc32(b"tick")


def _checksums(told: Iterable[Told], crc: int) -> Iterator[int]:
    """The checksum of a tick's messages as they are, and as they are once they are set as ours."""
    for again in (lambda one: one.data, _set_again):
        found = crc
        for one in told:
            data = again(one)
            if one.topic == "tick":
                yield zlib.crc32(data[1 : data.rindex(b',"crc"')], found)
            else:
                found = zlib.crc32(data, found ^ zlib.crc32(one.topic.encode()))


def _set_again(told: Told) -> bytes:
    """The message with the spaces of ours, whoever has copied it."""
    if told.schema == "foxglove.LaserScan":
        return told.data
    ascii_only = told.topic != "trace"
    found = json.loads(told.data)
    return json.dumps(found, separators=(",", ":"), ensure_ascii=ascii_only).encode()


class _Messages:
    """Takes chunks apart; topics and schemas are told once, in the first chunk that needs them."""

    def __init__(self) -> None:
        self._schemas: dict[int, str] = {}
        self._channels: dict[int, tuple[str, str]] = {}

    def of(self, chunk: Chunk) -> Iterator[Told]:
        """The messages of a chunk; none if a byte of it is wrong."""
        if chunk.uncompressed_size > LARGEST:
            raise ValueError(f"a chunk of {chunk.uncompressed_size} bytes")
        for record in breakup_chunk(chunk, validate_crc=True):
            if isinstance(record, Schema):
                self._schemas[record.id] = record.name
            elif isinstance(record, Channel):
                self._channels[record.id] = record.topic, self._schemas[record.schema_id]
            elif isinstance(record, Message):
                yield Told(*self._channels[record.channel_id], record.data)


def _ticked(m: Mapping[str, Any]) -> Ticked:
    return Ticked(m["at_ns"], m["n"], m["kind"], m["missed"], m["late_ns"])


def unpacked(found: Metadata) -> dict[str, Any]:
    """Metadata again: each of its texts is JSON."""
    return {name: json.loads(value) for name, value in found.metadata.items()}
