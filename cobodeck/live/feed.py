"""The feed of a run: what its recorder writes, on its way to the process that serves pages.

The run never waits. The messages of a tick, and of those that follow at once, become one frame,
which a thread of its own writes to a socket. What waits to be written is bounded in bytes: beyond
that, whole ticks are dropped and counted. Once half of it is free again, a frame with everything
that holds now follows, so that whoever reads is right again. What goes beside the ticks, such as
answers to commands, is kept until then.

A frame is its length, 4 bytes, and a pickled tuple: its kind and its content. Only our own child
reads it; what comes back are lines of JSON.
"""

from __future__ import annotations

import json
import pickle
import socket
import struct
import threading
import time
from asyncio import IncompleteReadError, StreamReader
from collections import deque
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import suppress
from queue import SimpleQueue
from typing import Any, NamedTuple

from cobodeck.loop import Loop
from cobodeck.record.format import TOPIC, MessageSchema, SampleWriter, trace_record
from cobodeck.record.read import Group, RecordedMessage, closed
from cobodeck.record.write import WriteBytes
from engine.operator import Operator
from engine.run import encode

BOUND = 8 << 20
"""What may wait to be written, bytes; about 20 s of a run with scans."""
LARGEST = 256 << 20
"""A frame larger than this is none of ours."""
TOGETHER_S = 0.02
"""Between two frames of ticks, s: to wake the thread that writes costs more than to add a tick."""
CLOSING_S = 1.0
"""How long the end of a run may wait for the last frames, s."""
STATES = frozenset({"status", "health"})
"""Kinds of which the newest is all that matters."""
MOST_OWED = 200
"""Of other kinds, so many are kept while too much waits."""
_LENGTH = struct.Struct("<I")
_Told = tuple[int, bytes, int]
"""A message of a tick: the number of its channel, its bytes, the time of the run, ns."""


class Whole(NamedTuple):
    """Everything that holds at an instant, after ticks were dropped.

    Attributes:
        at_ns: the instant, ns of run time.
        active: when each active node was entered, ns, by path; None: before ticks were dropped.
        data: of each scope, by the path where its chart begins, each key's value as JSON.
        waiting: the outcome that waits for consent, by path.
        locks: paths; `level`: the operator's autonomy level as a number, None without one.
        samples: the newest message of each signal.
        charts: the arguments of the newest `Replace` in the dropped ticks, None if there was none.
        dropped: ticks dropped so far.
    """

    at_ns: int
    active: Mapping[str, int | None]
    data: Mapping[str, Mapping[str, str]]
    waiting: Mapping[str, str]
    locks: tuple[str, ...]
    level: int | None
    paused: bool
    outcome: str | None
    samples: tuple[RecordedMessage, ...]
    charts: Mapping[str, Any] | None
    dropped: int


class Feed:
    """A `RunFile` that is read while it is written.

    Args:
        to: the socket that it is written to; closed at the end.
        bound: of what may wait, bytes.
        now: a clock, s.

    Attributes:
        dropped: ticks that were not written, because too much waited.
        error: why nothing more is written.
    """

    def __init__(
        self, to: socket.socket, bound: int = BOUND, now: Callable[[], float] = time.monotonic
    ) -> None:
        self.error: Exception | None = None
        self.dropped = 0
        self._socket, self._bound, self._now = to, bound, now
        self._frames: SimpleQueue[bytes | None] = SimpleQueue()
        self._given = self._written = 0  # bytes; each is changed by one thread alone
        self._channels: list[tuple[str, str]] = []
        self._told = 0  # channels that the reader knows
        self._tick: list[_Told] = []
        self._ticks: list[list[_Told]] = []  # not yet sent
        self._due = 0.0  # when they are
        self._behind = False
        self._loop: Loop | None = None
        self._entered: dict[str, int] = {}  # in dropped ticks
        self._charts: Mapping[str, Any] | None = None  # likewise
        self._states: dict[str, Any] = {}  # told once there is room again
        self._owed = deque[tuple[str, Any]](maxlen=MOST_OWED)  # likewise
        self._thread = threading.Thread(target=self._write, daemon=True, name="feed")
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Bytes that wait to be written."""
        return self._given - self._written

    def attend(self, loop: Loop) -> None:
        """Take what holds after a drop from this loop."""
        self._loop = loop

    # what the recorder does

    def begin(self, header: Mapping[str, Any], attachments: Mapping[str, bytes]) -> None:  # noqa: ARG002
        """Send the header; who serves the run has its texts already."""
        self._put("begin", dict(header))

    def channel(self, topic: str, schema: MessageSchema) -> WriteBytes:
        """A function that adds a message to the tick."""
        number = len(self._channels)
        self._channels.append((topic, schema.name))
        add = self._tick.append
        return lambda data, now_ns: add((number, data, now_ns))

    def end_tick(self, now_ns: int) -> None:
        """Send the tick, soon, or drop it if too much waits."""
        messages = self._tick.copy()
        self._tick.clear()
        if self._behind or self.waiting > self._bound:
            self._leave_out(messages, now_ns)
            return
        if self._owed or self._states:
            self._tell_owed()
        self._ticks.append(messages)
        if self._now() >= self._due:
            self.flush()

    def flush(self) -> None:
        """Send all ticks so far."""
        if self._ticks:
            self._due = self._now() + TOGETHER_S
            self._announce()
            self._put("ticks", self._ticks)
            self._ticks.clear()

    def write_metadata(self, name: str, values: Mapping[str, Any]) -> None:
        """Send values, such as the figures."""
        self.flush()
        self._put(name, dict(values))

    def finish(self) -> None:
        """Leave it open: `close` ends it, once it is known where the record is."""

    def give_up(self, error: Exception | None = None) -> str | None:
        """Send nothing any more; `close` ends it, as the run must not wait for that."""
        self.error = self.error or error
        return None if error is None else f"no live page any more, the run goes on: {error}"

    # beside the record

    def tell(self, kind: str, value: Any) -> None:
        """Send something else at once, or, if too much waits, once there is room again."""
        if self._behind or self.waiting > self._bound:
            if kind in STATES:
                self._states[kind] = value
            else:
                self._owed.append((kind, value))
            return
        self._tell_owed()
        self._put(kind, value)

    def close(self) -> None:
        """Send what waits, as far as it is taken at once, and close the socket."""
        self._tell_owed()
        self._frames.put(None)
        self._thread.join(CLOSING_S)
        with suppress(OSError):
            self._socket.shutdown(socket.SHUT_WR)
        self._socket.close()

    def _tell_owed(self) -> None:
        self.flush()
        for kind, value in (*self._states.items(), *self._owed):
            self._put(kind, value)
        self._states.clear()
        self._owed.clear()

    def _leave_out(self, messages: list[_Told], now_ns: int) -> None:
        """Drop a tick, or send all that holds at its end, once there is room for it."""
        self.flush()
        self._remember(messages)
        if self._behind and self.waiting <= self._bound // 2:
            self._behind = False
            self._announce()
            self._put("whole", self._whole(now_ns))
            self._tell_owed()
        else:
            self._behind = True
            self.dropped += 1

    def _announce(self) -> None:
        if self._told < len(self._channels):
            self._put("channels", self._channels[self._told :])
            self._told = len(self._channels)

    def _put(self, kind: str, content: Any) -> None:
        if self.error is None:
            data = pickle.dumps((kind, content), pickle.HIGHEST_PROTOCOL)
            self._given += len(data)
            self._frames.put(_LENGTH.pack(len(data)) + data)

    def _write(self) -> None:
        while (frame := self._frames.get()) is not None:
            try:
                self._socket.sendall(frame)
            except OSError as error:
                self.error = error
                return
            self._written += len(frame) - _LENGTH.size

    def _remember(self, messages: list[_Told]) -> None:
        """Keep what cannot be asked of the run later."""
        for number, data, _ in messages:
            topic = self._channels[number][0]
            if topic == "trace":
                time, kind, path, _ = trace_record(json.loads(data))
                if kind == "enter":
                    self._entered[path] = time
            elif topic == "operator":
                told = json.loads(data)
                if told["command"] == "Replace":
                    self._charts = told["arguments"]

    def _whole(self, now_ns: int) -> Whole:
        assert self._loop is not None, "no loop is attended"
        run = self._loop.wired.run
        boxes = [node for node in run.entered if hasattr(node, "box")]
        entered, self._entered = self._entered, {}
        charts, self._charts = self._charts, None
        return Whole(
            now_ns,
            {node.path: entered.get(node.path) for node in run.entered},
            {
                box.path: {key: encode(run.life.data.get(cell)) for key, cell in cells.items()}
                for box in boxes
                if (cells := box.box.cells)
            },
            Operator(run).waiting(),
            tuple(sorted(run.judge.locks)),
            run.judge.level,
            run.paused,
            run.outcome,
            tuple(_newest(self._loop, now_ns)),
            charts,
            self.dropped,
        )


def _newest(loop: Loop, now_ns: int) -> list[RecordedMessage]:
    found = []
    for name, slot in loop.wired.board.inlets.items():
        if slot.newest is not None and not slot.constant:
            kind, data = SampleWriter(name).write(slot.newest.stamp, slot.newest.value)
            found.append(RecordedMessage(TOPIC + name, kind, data, now_ns))
    return found


async def frames(stream: StreamReader) -> AsyncIterator[tuple[str, Any]]:
    """What a feed has, each with its kind; a `tick` as `Group`. Ends with the stream."""
    channels: list[tuple[str, str]] = []
    while True:
        try:
            [size] = _LENGTH.unpack(await stream.readexactly(_LENGTH.size))
            assert size <= LARGEST, f"a frame of {size} bytes"
            kind, content = pickle.loads(await stream.readexactly(size))  # from our own parent
        except (IncompleteReadError, OSError):
            return
        if kind == "channels":
            channels += content
        elif kind == "ticks":
            for told in content:
                yield "tick", _group(told, channels)
        else:
            yield kind, content


def _group(told: list[_Told], channels: list[tuple[str, str]]) -> Group:
    return closed([RecordedMessage(*channels[n], data, ns) for n, data, ns in told])
