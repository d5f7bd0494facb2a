"""Writes a run down while it goes on; asks for nothing, takes what flows.

The messages of a tick stand together and the `tick` closes them, so that a file that breaks off
is whole up to a tick. A chunk of the file ends with each second of the run: a kill loses no more.
Each tick carries a checksum over all messages so far; what was altered later is found at its place.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import foxglove
from foxglove import Channel, Context, Schema
from foxglove.mcap import MCAPCompression, MCAPWriteOptions

from cobodeck.loop import Loop, Ticked
from cobodeck.record import schemas
from cobodeck.record.messages import (
    call_text,
    command_text,
    cycle_text,
    failure_text,
    log_text,
    truth_text,
)
from cobodeck.record.samples import TOPIC, SampleWriter, schema_of
from cobodeck.record.schemas import MessageSchema
from cobodeck.record.sink import Sink
from cobodeck.record.taps import Tapped
from cobodeck.record.values import quoted, text
from hw.log import LogReader
from hw.safety_record import SafetyRecord
from hw.samples import Sample
from hw.truth import Truth

SECOND_NS = 10**9
CHUNK_BYTES = 16 << 20
"""A chunk ends with each second, not by its size; this is only a bound."""


class Description(NamedTuple):
    """What is run, as values that JSON has; texts that belong to it, by name; what stands there."""

    header: Mapping[str, Any]
    attachments: Mapping[str, bytes]
    scene: str | None = None


Describe = Callable[[Loop], Description]


class Recorder:
    """Writes one record; see the module.

    Whatever keeps it from writing, full disks included, is told once, and the run goes on.

    Args:
        sink: the file.
        describe: what is run.
        tell: is given what went wrong.
    """

    def __init__(self, sink: Sink, describe: Describe, tell: Callable[[str], None]) -> None:
        self._sink, self._describe, self._tell = sink, describe, tell
        self._broken = False
        self._truth: Truth | None = None
        self._context = Context()
        options = MCAPWriteOptions(
            compression=MCAPCompression.Zstd,
            compression_threads=0,
            chunk_size=CHUNK_BYTES,
            profile="cobodeck",
        )
        self._file = foxglove.open_mcap(sink, context=self._context, writer_options=options)
        self._channels: dict[tuple[str, str], tuple[Channel, int]] = {}
        self._samples: dict[str, SampleWriter] = {}
        self._crc = self._second = self._now = 0
        self._pending = False
        self._trace_read = self._commands_read = self._errors_read = 0
        self._cycles: LogReader[SafetyRecord] | None = None
        self._loop: Loop | None = None

    # what flows

    def attend(self, loop: Loop) -> None:
        """Take what flows in a loop from now on, before its first tick."""
        self._loop = loop
        loop.taps = (*loop.taps, self)
        loop.observers = (*loop.observers, self)
        loop.wired.inlet.taps.append(self.sample)
        if loop.plant.cycles is not None:
            self._cycles = loop.plant.cycles.reader()
        self._guarded(self._begin)

    def _begin(self) -> None:
        assert self._loop is not None, "nothing is attended"
        header, attachments, scene = self._describe(self._loop)
        self._file.write_metadata("run", packed(header))
        for name, data in attachments.items():
            self._file.attach(
                log_time=0, create_time=0, name=name, media_type="application/octet-stream",
                data=data,
            )  # fmt: skip
        if scene is not None:
            self._log("scene", schemas.SCENE, scene)
        self._file.flush()

    def tap(self, name: str, part: Any) -> Any:
        """A part in front of which each call by a state is written down."""
        return Tapped(name, part, self.call)

    def sample(self, sample: Sample, now_ns: int, refused: str | None) -> None:
        """A sample has arrived; `refused`: why it was not let in."""
        self._now = now_ns
        self._guarded(lambda: self._sample(sample, refused))

    def _sample(self, sample: Sample, refused: str | None) -> None:
        name, stamp, value = sample
        if refused is not None:
            told = f'"signal":{text(name)},"stamp":{text(stamp)},"value":{text(value)}'
            self._log("refused", schemas.REFUSED, f'{{{told},"reason":{quoted(refused)}}}')
            return
        writer = self._samples.get(name)
        if writer is None:
            writer = self._samples[name] = SampleWriter(name)
        kind, data = writer.write(stamp, value)
        self._write(TOPIC + name, kind, data)

    def call(self, part: str, what: str, args: str, answer: object, error: object) -> None:
        """A state has called a part; `args` are JSON already, the rest is what came of it."""
        self._guarded(
            lambda: self._log("parts", schemas.CALL, call_text(part, what, args, answer, error))
        )

    def failed(self, part: str, error: BaseException) -> None:
        """A part has raised by itself."""
        self._guarded(lambda: self._log("failures", schemas.FAILURE, failure_text(part, error)))

    def watch(self, now_ns: int) -> None:
        """The truth before the chart decides, and the cycles of the chain up to now."""
        self._now = now_ns
        self._guarded(self._look)

    def _look(self) -> None:
        assert self._loop is not None, "nothing is attended"
        truth = self._loop.plant.truth
        if truth is not None and truth != self._truth:
            self._truth = truth
            self._log("truth", schemas.TRUTH, truth_text(truth))
        for cycle in self._cycles.take() if self._cycles is not None else ():
            self._log("safety", schemas.CYCLE, cycle_text(cycle))

    def tick(self, ticked: Ticked) -> None:
        """A tick is over."""
        self._now = max(0, ticked.at_ns)
        self._guarded(lambda: self._tick(ticked))

    def _tick(self, ticked: Ticked) -> None:
        assert self._loop is not None, "nothing is attended"
        if ticked.kind == "taken" and not self._pending:
            return
        self._write_run(self._loop)
        if ticked.kind == "end":
            self._look()
        t = ticked
        told = f'"at_ns":{t.at_ns},"n":{t.number},"kind":"{t.kind}"'
        told += f',"missed":{t.missed},"late_ns":{t.late_ns}'
        self._crc = zlib.crc32(told.encode(), self._crc)
        self._log("tick", schemas.TICK, f'{{{told},"crc":{self._crc}}}')
        self._pending = False
        if self._now // SECOND_NS != self._second:
            self._second = self._now // SECOND_NS
            self._file.flush()

    def _write_run(self, loop: Loop) -> None:
        run = loop.wired.run
        for _, command in run.carried_out[self._commands_read :]:
            self._log("operator", schemas.COMMAND, command_text(command))
        self._commands_read = len(run.carried_out)
        if self._trace_read != len(run.trace.raw):
            for line in run.trace.lines(self._trace_read):
                self._log("trace", schemas.TRACE, f'{{"line":{line}}}')
            self._trace_read = len(run.trace.raw)
        for error in run.errors[self._errors_read :]:
            self._log("log", schemas.LOG, log_text(error))
        self._errors_read = len(run.errors)

    def finish(self, figures: Mapping[str, Any] | None = None) -> Path | None:
        """Write the figures, if there are some, and give the file its name; None: it failed."""
        if figures is not None:
            self._guarded(lambda: self._file.write_metadata("result", packed(figures)))
        self._guarded(self._file.close)
        path = None if self._broken else self._sink.finish()
        self._guarded(lambda: None)
        return path

    # writing

    def _log(self, topic: str, schema: MessageSchema, told: str) -> None:
        self._write(topic, schema.name, told.encode(), schema)

    def _write(
        self, topic: str, kind: str, data: bytes, schema: MessageSchema | None = None
    ) -> None:
        found = self._channels.get((topic, kind))
        if found is None:
            found = self._channels[topic, kind] = self._channel(topic, schema or schema_of(kind))
        channel, key = found
        self._crc = zlib.crc32(data, self._crc ^ key)
        self._pending = True
        channel.log(data, log_time=self._now)

    def _channel(self, topic: str, schema: MessageSchema) -> tuple[Channel, int]:
        channel = Channel(
            topic,
            schema=Schema(name=schema.name, encoding=schema.encoding, data=schema.data),
            message_encoding=schema.message_encoding,
            context=self._context,
        )
        return channel, zlib.crc32(topic.encode())

    def _guarded(self, act: Callable[[], object]) -> None:
        """Whatever goes wrong, the run goes on."""
        if self._broken:
            return
        problem = None
        try:
            act()
        except Exception as error:  # noqa: BLE001
            problem = f"{type(error).__name__}: {error}"
        if self._sink.error is not None:
            problem = self._sink.error.strerror or str(self._sink.error)
        if problem is not None:
            self._broken = True
            self._tell(f"no record: {self._sink.path}: {problem}; what there is: {self._sink.part}")


def packed(values: Mapping[str, Any]) -> dict[str, str]:
    """What metadata of a file can hold: texts; each value is JSON."""
    return {name: json.dumps(value) for name, value in values.items()}
