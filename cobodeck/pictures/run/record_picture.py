"""`cobodeck render X.mcap`: the course of a recorded run, and its picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from cobodeck.evaluate import Senses
from cobodeck.loop import Inlet
from cobodeck.pictures.run.run_course import Course
from cobodeck.pictures.run.watch import CourseWatch, used_charts
from cobodeck.project import catalogue
from cobodeck.record.format import TOPIC, SampleReader, truth_again
from cobodeck.record.read import Group, Record, written_setup
from cobodeck.setup import Setup
from cobodeck.terminal import ENDING, OK, Problem, ProgressLine, show
from engine.files import visible
from engine.run import TraceRecord
from engine.signals import Board
from hw import Truth
from hw.model import Footprint

MEASURED = "poses as measured"
SENSED = ("base.pose", "user.pose", "arm.joints", "vr.haptic_request")


def draw_run(
    path: Path, output: Path | None, start_s: float | None = None, end_s: float | None = None
) -> int:
    """Draw a recorded run, or a part of it, to a file.

    Raises:
        Problem: there is nothing to draw; FileError: the record cannot be read.
    """
    from cobodeck.pictures.drawing import form_of, save
    from cobodeck.pictures.run.run_picture import run_picture

    to = output or Path(f"{path.name.partition(ENDING)[0]}.svg")
    form_of(to)
    progress = ProgressLine("render")
    try:
        course = course_of(Record(path), progress.at)
    finally:
        progress.done()
    try:
        course = course.between(start_s, end_s)
    except ValueError as error:
        raise Problem(f"{path}: {error}") from None
    save(run_picture(course), to)
    show(str(to))
    return OK


def course_of(
    record: Record, progress: Callable[[str, float | None], None] | None = None
) -> Course:
    """The course of a recorded run, from the truth if the record has it, else from samples.

    Raises:
        Problem, FileError: the record does not hold what was run.
    """
    record.require_ticks()
    setup, header = written_setup(record, catalogue(own=False)), record.header
    reader = CourseReader(setup)
    length_s = (record.figures() or {}).get("sim_s")
    for group in record.groups():
        with record.understood(group):
            reader.add(group)
        if progress is not None:
            now_s = group.ticked.at_ns / 1e9
            progress(f"{now_s:.0f} s", now_s / length_s if length_s else None)
    lines = _lines(record, reader.measured)
    return reader.course(visible(_title(setup, header)), tuple(map(visible, lines)))


class CourseReader:
    """Makes the course of a run from its ticks, in order."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._watch, self._known = CourseWatch(setup.robot), _Known(setup.robot.footprint)
        self._trace: list[TraceRecord] = []

    @property
    def measured(self) -> bool:
        """Whether poses are measured ones, as the ticks hold no truth."""
        return self._known.measured

    def add(self, group: Group) -> None:
        """Take the messages of a tick."""
        self._known.add_tick(group)
        self._trace += group.traced()
        if group.ticked.kind in ("grid", "left_out"):
            self._watch.watch(group.ticked.at_ns, self._known.truth)

    def course(self, title: str = "", lines: tuple[str, ...] = ()) -> Course:
        """The course so far."""
        charts = used_charts(self._setup.chart, self._setup.library)
        return self._watch.course(title, lines, self._setup.scene, charts, self._trace)


def _title(setup: Setup, header: Mapping[str, Any]) -> str:
    """What was run, where and with which user."""
    if header["options"]["tier"] == 0:
        return f"{setup.chart.name}, its logic alone"
    scene, person = setup.scene, header["user"]
    where = f"on {setup.robot.name}" if scene is None else f"in {scene.name}"
    return f"{setup.chart.name} {where}" + (f" with {Path(person).name}" if person else "")


def _lines(record: Record, measured: bool) -> tuple[str, ...]:
    """The lines under the title; complete once the whole record has been read."""
    header: Any = record.header
    about = [
        f"{header['plant']}, {header['profile']['name']}, seed {header['options']['seed']}",
        header["began"].partition(".")[0].replace("T", " "),
    ]
    if measured:
        about.append(MEASURED)
    outcome = None if record.result is None else record.result.get("outcome")
    ends = f"outcome: {outcome}" if outcome else ""
    if record.broken is not None:
        ends = "the record breaks off"
    return tuple(filter(None, (", ".join(about), ends)))


class _Known:
    """Follows the poses in a record tick by tick."""

    def __init__(self, footprint: Footprint) -> None:
        self._truth: Truth | None = None
        self._inlet = Inlet(Board())
        self._senses = Senses(self._inlet, footprint)
        self._readers = {TOPIC + name: SampleReader(name) for name in SENSED}

    def add_tick(self, group: Group) -> None:
        """Take the data of one tick."""
        for found in group.messages("truth"):
            self._truth = truth_again(found, self._truth)
        if self._truth is not None:
            return
        for told in group.told:
            if told.topic in self._readers:
                sample = self._readers[told.topic].read(told.schema, told.data)
                self._inlet.deliver(sample, group.ticked.at_ns)

    @property
    def measured(self) -> bool:
        """True if poses are measured ones because the record holds no truth."""
        return self._truth is None and self._senses.truth.base is not None

    @property
    def truth(self) -> Truth:
        """The true state, or else the measured one."""
        return self._senses.truth if self._truth is None else self._truth
