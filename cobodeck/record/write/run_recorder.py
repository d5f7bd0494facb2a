"""Records a run while it goes on; it requests no data, only takes what flows.

The messages of a tick are written together and closed by a `tick` message, so that a file that is
cut off is intact up to a tick. A chunk of the file ends about every second: a kill loses no more.
Each tick has a checksum over all messages so far, which shows where a record was altered later.
Messages are encoded once, however many take them: a file, those who watch the run, or both.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from cobodeck.loop import Loop, Ticked
from cobodeck.record.format import (
    TOPIC,
    MessageSchema,
    SampleWriter,
    TruthWriter,
    call_text,
    command_text,
    cycle_text,
    failure_text,
    log_text,
    schema_of,
    schemas,
    text,
)
from cobodeck.record.write.run_file import RunFile, WriteBytes
from cobodeck.record.write.taps import Tapped
from hw import Sample, Truth
from hw.safety import CycleReader


class RunDescription(NamedTuple):
    """The header as JSON values; attached texts by name; scene and fixed frames for viewers."""

    header: Mapping[str, Any]
    attachments: Mapping[str, bytes]
    scene: str | None = None
    frames: str | None = None


Describe = Callable[[Loop], RunDescription]


class Recorder:
    """Writes one record; see the module.

    Any failure to write, such as a full disk, is reported once, and the run goes on, as do the
    other files.

    Args:
        files: where to; the first is the one whose path `finish` returns.
        describe: what is run.
        tell: called with a message on failure.
    """

    def __init__(
        self, files: Sequence[RunFile], describe: Describe, tell: Callable[[str], None]
    ) -> None:
        self._all, self._describe, self._tell = tuple(files), describe, tell
        self._files = list(files)
        self._truth: Truth | None = None
        self._truths = TruthWriter()
        self._channels: dict[tuple[str, str], tuple[list[_Writer], int]] = {}
        self._samples: dict[str, SampleWriter] = {}
        self._crc = self._now = 0
        self._pending = False
        self._trace_read = self._commands_read = self._errors_read = 0
        self._cycles: CycleReader | None = None
        self._loop: Loop | None = None

    # what flows

    def attend(self, loop: Loop) -> None:
        """Record what flows in a loop from now on; call it before the first tick."""
        self._loop = loop
        loop.taps = (*loop.taps, self)
        loop.observers = (*loop.observers, self)
        loop.wired.inlet.taps.append(self.sample)
        if loop.plant.cycles is not None:
            self._cycles = loop.plant.cycles.reader()
        self._guarded(self._begin)

    def _begin(self) -> None:
        assert self._loop is not None, "nothing is attended"
        header, attachments, scene, frames = self._describe(self._loop)
        self._each(lambda file: file.begin(header, attachments))
        if scene is not None:
            self._log("scene", schemas.SCENE, scene)
        if frames is not None:
            self._log("frames", schemas.FRAMES, frames)

    def tap(self, name: str, part: Any) -> Any:
        """A wrapper of a part that records each call by a state."""
        return Tapped(name, part, self.call)

    def sample(self, sample: Sample, now_ns: int, refused: str | None) -> None:
        """A sample has arrived; `refused`: why it was refused, None if accepted."""
        self._now = now_ns
        self._guarded(lambda: self._sample(sample, refused))

    def _sample(self, sample: Sample, refused: str | None) -> None:
        name, stamp, value = sample
        if refused is not None:
            told = f'"signal":{text(name)},"stamp":{text(stamp)},"value":{text(value)}'
            self._log("refused", schemas.REFUSED, f'{{{told},"reason":{text(refused)}}}')
            return
        writer = self._samples.get(name)
        if writer is None:
            writer = self._samples[name] = SampleWriter(name)
        kind, data = writer.write(stamp, value)
        self._write(TOPIC + name, kind, data)

    def call(self, part: str, what: str, args: str, answer: object, error: object) -> None:
        """A state has called a part; `args` is JSON already, `error` the exception or None."""
        self._guarded(
            lambda: self._log("parts", schemas.CALL, call_text(part, what, args, answer, error))
        )

    def failed(self, part: str, error: BaseException) -> None:
        """A part has raised outside of any call."""
        self._guarded(lambda: self._log("failures", schemas.FAILURE, failure_text(part, error)))

    def shadow(self, at_ns: int, path: str, ran: str, shadow: str) -> None:
        """At this instant a shadow has decided otherwise than the chart that runs."""
        told = f'"at_ns":{at_ns},"path":{text(path)},"ran":{text(ran)},"shadow":{text(shadow)}'
        self._now = at_ns
        self._guarded(lambda: self._log("shadow", schemas.SHADOW, f"{{{told}}}"))

    def watch(self, now_ns: int) -> None:
        """Write the truth before the chart decides, and the safety chain's cycles up to now."""
        self._now = now_ns
        self._guarded(self._look)

    def _look(self) -> None:
        assert self._loop is not None, "nothing is attended"
        truth = self._loop.plant.truth
        if truth is not None and truth != self._truth:
            self._truth = truth
            self._log("truth", schemas.TRUTH, self._truths.write(truth))
        for cycle in self._cycles.read_new() if self._cycles is not None else ():
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
        checksum = zlib.crc32(told.encode(), self._crc)
        self._log("tick", schemas.TICK, f'{{{told},"crc":{checksum}}}')
        self._crc = checksum
        self._pending = False
        for file in self._files.copy():
            try:
                file.end_tick(self._now)
            except Exception as error:  # noqa: BLE001
                self._break(file, error)

    def _write_run(self, loop: Loop) -> None:
        run = loop.wired.run
        for _, command in run.carried_out.since(self._commands_read):
            self._log("operator", schemas.COMMAND, command_text(command))
        self._commands_read = run.carried_out.total
        if self._trace_read != run.trace.end:
            for line in run.trace.lines(self._trace_read):
                self._log("trace", schemas.TRACE, f'{{"line":{line}}}')
            self._trace_read = run.trace.end
        for error in run.errors.since(self._errors_read):
            self._log("log", schemas.LOG, log_text(error))
        self._errors_read = run.errors.total

    def finish(self, figures: Mapping[str, Any] | None = None) -> Path | None:
        """Write the figures, if any, complete the files; the path of the first, None if lost."""
        if figures is not None:
            self._each(lambda file: file.write_metadata("result", figures))
        paths: list[Path | None] = []
        self._each(lambda file: paths.append(file.finish()))
        return paths[0] if paths and self._files[:1] == [*self._all[:1]] else None

    def give_up(self) -> None:
        """Remove the file, because the run did not take place."""
        for file in self._all:
            file.give_up()

    # writing

    def _log(self, topic: str, schema: MessageSchema, told: str) -> None:
        self._write(topic, schema.name, told.encode(), schema)

    def _write(
        self, topic: str, kind: str, data: bytes, schema: MessageSchema | None = None
    ) -> None:
        found = self._channels.get((topic, kind))
        if found is None:
            found = self._channels[topic, kind] = self._opened(topic, schema or schema_of(kind))
        writers, key = found
        self._crc = zlib.crc32(data, self._crc ^ key)
        self._pending = True
        for writer in writers:
            try:
                writer.write(data, self._now)
            except Exception as error:  # noqa: BLE001
                self._break(writer.file, error)

    def _opened(self, topic: str, schema: MessageSchema) -> tuple[list[_Writer], int]:
        """The writers of a channel to all files, and the checksum of its topic."""
        writers: list[_Writer] = []
        self._each(lambda file: writers.append(_Writer(file.channel(topic, schema), file)))
        return writers, zlib.crc32(topic.encode())

    def _each(self, act: Callable[[RunFile], object]) -> None:
        """Call `act` with every file that still works; each fails by itself."""
        for file in self._files.copy():
            try:
                act(file)
            except Exception as error:  # noqa: BLE001
                self._break(file, error)
            else:
                if file.error is not None:
                    self._break(file, file.error)

    def _guarded(self, act: Callable[[], object]) -> None:
        """Call `act`; a failure is reported and ends recording, not the run."""
        if not self._files:
            return
        try:
            act()
        except Exception as error:  # noqa: BLE001
            for file in self._files.copy():
                self._break(file, error)
        for file in self._files.copy():
            if file.error is not None:
                self._break(file, file.error)

    def _break(self, file: RunFile, error: Exception) -> None:
        if file not in self._files:
            return
        self._files = [one for one in self._files if one is not file]
        for key, (writers, topic) in self._channels.items():
            self._channels[key] = [w for w in writers if w.file is not file], topic
        told = file.give_up(file.error or error)
        if told is not None:
            self._tell(told)


class _Writer(NamedTuple):
    """Writes to one channel of one file."""

    write: WriteBytes
    file: RunFile
