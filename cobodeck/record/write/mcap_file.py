"""A record as an MCAP file being written, in chunks of about a second."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import foxglove
from foxglove import Channel, Context, Schema
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from cobodeck.record.format import MessageSchema, Sink
from cobodeck.record.write.run_file import WriteBytes

FLUSH_NS = 900_000_000
"""Run time after which a chunk ends with the next tick, ns: a kill loses less than a second."""
CHUNK_BYTES = 16 << 20
"""Upper bound of a chunk's size, bytes; usually chunks end by time."""


class McapFile:
    """Writes metadata, attachments and messages; they are in the file once a tick has ended.

    A `RunFile`.

    Attributes:
        saved_ns: the time of the last tick that is safely in the file; None: no tick yet.
    """

    def __init__(self, sink: Sink) -> None:
        self._context = Context()
        options = MCAPWriteOptions(
            compression=MCAPCompression.Zstd,
            compression_threads=0,
            chunk_size=CHUNK_BYTES,
            profile="cobodeck",
        )
        self._writer = foxglove.open_mcap(sink, context=self._context, writer_options=options)
        self._sink = sink
        self.saved_ns: int | None = None

    @property
    def error(self) -> Exception | None:
        """The first failure to write, such as a full disk."""
        return self._sink.error

    def begin(self, header: Mapping[str, Any], attachments: Mapping[str, bytes]) -> None:
        """Write the header and the attachments, before the first tick."""
        self.write_metadata("run", header)
        for name, data in attachments.items():
            self._writer.attach(
                log_time=0, create_time=0, name=name, media_type="application/octet-stream",
                data=data,
            )  # fmt: skip
        self._writer.flush()

    def write_metadata(self, name: str, values: Mapping[str, Any]) -> None:
        """Write values; MCAP metadata maps texts to texts, so each value is written as JSON."""
        texts = {key: json.dumps(value) for key, value in values.items()}
        self._writer.write_metadata(name, texts)

    def channel(self, topic: str, schema: MessageSchema) -> WriteBytes:
        """A function that writes to a new channel, which begins with its first message."""
        channel = Channel(
            topic,
            schema=Schema(name=schema.name, encoding=schema.encoding, data=schema.data),
            message_encoding=schema.message_encoding,
            context=self._context,
        )
        return channel.base.log  # skips the checks of `channel.log`, which would double the time

    def end_tick(self, now_ns: int) -> None:
        """Note that a tick has been written; end the chunk if it is due."""
        if self.saved_ns is None or now_ns - self.saved_ns >= FLUSH_NS:
            self._writer.flush()
            self._sink.keep()
            if self._sink.error is None:
                self.saved_ns = now_ns

    def close(self) -> None:
        """Write what is left, and the summary."""
        self._writer.close()

    def finish(self) -> Path | None:
        """Close it and give it its name; None if that failed."""
        self.close()
        return self._sink.finish()

    def give_up(self, error: Exception | None = None) -> str | None:
        """Close it after an `error`, keeping what was written; without one, remove it."""
        with suppress(Exception):
            self.close()
        if error is None:
            self._sink.remove()
            return None
        reason = (
            error.strerror if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
        )
        told = f"no record: {self._sink.path}: {reason}"
        if self.saved_ns is None:
            self._sink.remove()
            return told
        self._sink.close()
        return f"{told}; `cobodeck recover {self._sink.part}` saves what was written"
