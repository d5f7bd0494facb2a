"""What a page shows of one run besides its state: charts, room, shapes, lanes and plots."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

from cobodeck.live.charts import chart_message
from cobodeck.live.clients import Message
from cobodeck.live.model import RunModel, is_request
from cobodeck.live.sources.seen_room import SeenRoom, layers
from cobodeck.pictures.run import NodeSpan, Visits, lanes_of, used_charts
from cobodeck.project import Catalogue, catalogue
from cobodeck.record.format import charts_again, trace_line, value
from cobodeck.record.read import Group, Record, written_setup
from cobodeck.setup import Setup
from cobodeck.terminal import Problem
from engine.chart import Chart
from engine.run import TraceRecord
from engine.signals import types_of

MOST_SPANS = 20_000
"""Visits of lanes that are kept; older ones are not shown any more."""


class Texts(NamedTuple):
    """The header and the attached texts of a run."""

    path: Path
    header: Mapping[str, Any]
    attachments: Mapping[str, bytes]


class SeenRun:
    """A run as pages see it; `slot`: which of two side by side.

    Raises:
        Problem, FileError: its texts are missing or malformed.
    """

    def __init__(self, texts: Texts | Record, known: Catalogue, slot: int = 0) -> None:
        self.setup: Setup = written_setup(texts, known)
        self._header, self._file = texts.header, texts.path.name
        self._known, self.slot = known, slot
        self._types = types_of(known.signals)
        self.place = SeenRoom(self.setup)
        self._chart = self.setup.chart
        self._charts: Mapping[str, Chart] = self.setup.library
        self._used = used_charts(self._chart, self._charts)
        self._visits, self._spans = Visits(), deque[NodeSpan](maxlen=MOST_SPANS)
        self._marks: deque[Message] = deque(maxlen=MOST_SPANS)
        self._new = _News()
        self._end_s = 0.0
        self._message: Message | None = None

    @classmethod
    def written(cls, header: Mapping[str, Any], attachments: Mapping[str, bytes]) -> SeenRun:
        """A run from its texts, before it begins.

        Raises:
            Problem, FileError: as the class.
        """
        texts = Texts(Path("this run"), header, attachments)
        try:
            found = cls(texts, catalogue())
        except Problem:  # code of the project that cannot be imported
            found = cls(texts, catalogue(own=False))
        found.charts()  # drawn now, while nobody waits
        return found

    def begin(self, header: Mapping[str, Any]) -> None:
        """Take what is known once the run has begun, such as its signals."""
        self._header = header

    def hello(self) -> dict[str, Any]:
        """What `hello` says of it."""
        header: Any = self._header
        about = [f"{header['plant']}, {header['profile']['name']}"]
        if "began" in header:
            about.append(f"began {header['began']}")
        signals = [{"name": n, "type": str(self._types.get(n, ""))} for n in self.signals]
        return {
            "title": self._chart.name,
            "about": about,
            "tick_hz": self.setup.tick_hz,
            "signals": signals,
            "layers": layers(),
        }

    def charts(self) -> list[Message]:
        """The charts, as they are now."""
        if self._message is None:
            self._message = chart_message(
                self._chart,
                self._charts,
                self.setup.profile,
                interfaces=self._known.interfaces,
                types=self._known.types,
                slot=self.slot,
            )
        return [self._message]

    def room(self) -> Message:
        """What does not move."""
        return self.place.message() | self.slotted

    def replace(self, arguments: Mapping[str, Any]) -> None:
        """Go on with another chart, as the command `Replace` on record has it."""
        given, self._message = value(arguments), None
        self._charts = charts_again(given)
        self._chart = self._charts[given["chart"]]
        self._used = used_charts(self._chart, self._charts)

    # what moves

    @property
    def signals(self) -> Sequence[str]:
        """The names of those that the run has."""
        found: Sequence[str] = self._header["signals"]
        return found

    @property
    def slotted(self) -> dict[str, int]:
        """What messages of the second of two runs have beside theirs."""
        return {"slot": self.slot} if self.slot else {}

    def plot(self, model: RunModel, signal: str, *, more: bool) -> Message | None:
        """The newest value of a signal, as numbers; None if it has none."""
        sample = model.sample(signal)
        if sample is None:
            return None
        found = dict(numbers_of(sample.value))
        if not found:
            return None
        told = {"t": "plot", "signal": signal, "fields": list(found), "at": [sample.stamp_ns / 1e9]}
        return {**told, "values": [[number] for number in found.values()], "more": more}

    # lanes

    def add(self, group: Group) -> None:
        """Take the messages of a tick."""
        self._end_s = max(0, group.ticked.at_ns) / 1e9
        for told in group.told:
            if is_request(told):
                self._mark(told.log_ns / 1e9, "request", "the person asks for a touch")
        if group.ticked.missed:
            self._mark(self._end_s, "missed", f"{group.ticked.missed} ticks missed")
        for told in group.messages("trace"):
            time_ns, kind, path, *detail = trace_line(told)
            if kind == "enter" and self._used.get(path) == "escape":
                self._mark(time_ns / 1e9, "escape", path)
            ended = self._visits.add(TraceRecord(time_ns, kind, path, tuple(detail)))
            if ended is not None and self._is_lane(path):
                self._spans.append(ended[1])
                self._new.spans.append(ended[1])
            elif kind == "error":
                self._mark(time_ns / 1e9, "error", f"{path}: {detail[0]}")
        for told in group.messages("operator"):
            self._mark(self._end_s, "command", told["command"])
            if told["command"] == "Replace":
                self.replace(told["arguments"])

    def _mark(self, at: float, kind: str, text: str) -> None:
        mark = {"at": at, "kind": kind, "text": text}
        self._marks.append(mark)
        self._new.marks.append(mark)

    def _is_lane(self, path: str) -> bool:
        return path in lanes_of(self._used, (path,))

    def lanes(self) -> Message:
        """All lanes, whole."""
        self._new = _News()
        return self._lanes("lanes", self._spans, list(self._marks))

    def new_lanes(self) -> Message | None:
        """What is new since the last call; None: nothing."""
        new, self._new = self._new, _News()
        if not (new.spans or new.marks):
            return None
        return self._lanes("lanes+", new.spans, list(new.marks))

    def _lanes(self, kind: str, spans: Iterable[NodeSpan], marks: Sequence[Message]) -> Message:
        spans = tuple(spans)
        begun = [path for path in self._visits.open if self._is_lane(path)]
        paths = lanes_of(self._used, (*(span.path for span in spans), *begun))
        if kind == "lanes+":
            paths = tuple(dict.fromkeys((*(s.path for s in spans), *begun)))
        rows: dict[str, list[Any]] = {path: [] for path in paths}
        for span in spans:
            rows.setdefault(span.path, []).append([span.start_s, span.end_s, span.ended])
        for path in begun:
            rows[path].append([self._visits.open[path][1], None, ""])
        lanes = [{"path": p, "name": self._used.get(p, p), "spans": s} for p, s in rows.items()]
        told = {"t": kind, "lanes": lanes, "marks": marks, "from": 0.0, "to": self._end_s}
        return told | {"title": self._file} | self.slotted


class _News:
    """Of lanes, what nobody was told yet; bounded, as nobody may ask."""

    def __init__(self) -> None:
        self.spans: deque[NodeSpan] = deque(maxlen=MOST_SPANS)
        self.marks: deque[Message] = deque(maxlen=MOST_SPANS)


def numbers_of(value: Any, name: str = "") -> Iterable[tuple[str, float]]:
    """The numbers in a value, with the names of their fields, at most two levels deep."""
    if isinstance(value, bool | int | float):
        if math.isfinite(value):
            yield name or "value", float(value)
    elif name.count(".") < 2:
        for key, held in _fields(value):
            yield from numbers_of(held, f"{name}.{key}" if name else key)


def _fields(value: Any) -> Iterable[tuple[str, Any]]:
    if is_dataclass(value):
        return [(field.name, getattr(value, field.name)) for field in fields(value)]
    if hasattr(value, "_asdict"):
        return list(value._asdict().items())
    if isinstance(value, tuple | list) and len(value) <= 8:
        return [(str(n), held) for n, held in enumerate(value)]
    return ()
