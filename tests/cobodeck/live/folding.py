"""Runs whose recorder writes into a model, as pages do it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from typing import Any

import pytest

from cobodeck.live.model import RunModel
from cobodeck.loop.loop import Loop
from cobodeck.record.format.schemas import MessageSchema
from cobodeck.record.read.reader import Group, RecordedMessage, closed
from cobodeck.record.write.run_file import RunFile, WriteBytes
from cobodeck.record.write.run_recorder import Recorder
from cobodeck.record.write.start import unkept_recorder
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from engine.chart import Library, load_text
from engine.run.trace import encode
from tests.cobodeck.live.known import known

AT = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)


@cache
def study() -> Setup:
    """The study's scene; runs do not change it."""
    return open_setup(scene="study", known=known())


def study_with(text: str) -> Setup:
    """The same with this chart, which is the only thing that is read anew."""
    (name,) = found = load_text(text, "given.yaml")
    library = Library()
    library.update({**study().library, **found})
    return replace(study(), chart=library[name], library=library)


class Folding:
    """A `RunFile` that folds what is written into a model, and keeps it."""

    error: Exception | None = None

    def __init__(self) -> None:
        self.model = RunModel()
        self.groups: list[Group] = []
        self.header: Mapping[str, Any] = {}
        self.attachments: Mapping[str, bytes] = {}
        self._told: list[RecordedMessage] = []

    def begin(self, header: Mapping[str, Any], attachments: Mapping[str, bytes]) -> None:
        self.header, self.attachments = header, attachments

    def channel(self, topic: str, schema: MessageSchema) -> WriteBytes:
        return lambda data, ns: self._told.append(RecordedMessage(topic, schema.name, data, ns))

    def end_tick(self, now_ns: int) -> None:
        self.groups.append(closed(self._told))
        self.model.add(self.groups[-1])
        self._told.clear()

    def write_metadata(self, name: str, values: Mapping[str, Any]) -> None:
        """Not looked at."""

    def finish(self) -> None:
        """Nothing is left."""

    def give_up(self, error: Exception | None = None) -> str | None:
        return None


def recorded(setup: Setup, options: Options, *files: RunFile) -> tuple[Loop, Recorder]:
    """A loop, ready for its first tick, whose recorder writes to these."""
    recorder = unkept_recorder(setup, options, AT, pytest.fail, files)
    loop = stage(setup, options, tap=recorder.tap)
    recorder.attend(loop)
    return loop, recorder


def require_same(model: RunModel, loop: Loop) -> None:
    """What pages are told is what the run is."""
    run = loop.wired.run
    assert set(model.active) == {node.path for node in run.entered}
    assert model.paused == run.paused
    assert model.locks == sorted(run.judge.locks)
    for path in model.active:
        node = run.nodes[path]
        if not hasattr(node, "box"):
            continue
        for key, cell in node.box.cells.items():
            if key in model.data.get(path, {}):
                assert model.data[path][key] == spaced(encode(run.life.data.get(cell)))


def spaced(text: str) -> str:
    """JSON as `json.dumps` writes it by default."""
    import json

    return json.dumps(json.loads(text), ensure_ascii=False)
