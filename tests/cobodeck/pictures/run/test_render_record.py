"""`cobodeck render X.mcap`: the picture of a run on record is that of the run."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.loop.loop import Loop
from cobodeck.pictures.run.record_picture import MEASURED, course_of
from cobodeck.pictures.run.run_course import Course
from cobodeck.pictures.run.watch import CourseWatch, used_charts
from cobodeck.record.read.reader import Record
from cobodeck.run import simulation as simulate
from cobodeck.run.build_run import stage
from cobodeck.setup.setup import Setup, open_setup
from cobodeck.terminal.console import FAILED, OK, USAGE
from tests.cobodeck.record.partial import WithoutTruth

RUN = ("--scene", "study", "--requests", "2", "--seed", "3")


@dataclass
class Watching:
    """An observer that follows the course of the run while it is recorded."""

    course: CourseWatch
    loop: Loop

    def watch(self, now_ns: int) -> None:
        self.course.watch(now_ns, self.loop.plant.truth)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Course]:
    """A record of a run, and the course that was watched live in the same run."""
    path: Path = tmp_path_factory.mktemp("runs") / "two.mcap"
    watching: list[Watching] = []

    def staged(setup: Setup, *arguments: Any, **more: Any) -> Loop:
        loop = stage(setup, *arguments, **more)
        watching.append(Watching(CourseWatch(setup.robot), loop))
        loop.observers = (*loop.observers, watching[0])
        return loop

    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(path.parent)
        patch.setattr(simulate, "stage", staged)
        assert main(["simulate", *RUN, "--record", str(path)]) == OK
    setup = open_setup(scene="study")
    charts = used_charts(setup.chart, setup.library)
    assert setup.scene is not None
    trace = watching[0].loop.wired.run.trace
    return path, watching[0].course.course("", (), setup.scene, charts, trace)


@pytest.fixture(scope="module")
def record(recorded: tuple[Path, Course]) -> Path:
    return recorded[0]


@pytest.mark.requirement(19)
def test_the_course_on_record_is_that_of_the_run(recorded: tuple[Path, Course]) -> None:
    then, now = course_of(Record(recorded[0])), recorded[1]

    assert then.title == "cobodeck in study with study"
    for name in ("charts", "end_s", "instants", "spans", "sequences", "requests", "contacts"):
        assert getattr(then, name) == getattr(now, name), name
    assert len(then.requests) == 2
    assert then.room == now.room


@pytest.mark.slow
def test_without_truth_the_course_is_that_of_the_samples(record: Path) -> None:
    seen, true = course_of(WithoutTruth(record)), course_of(Record(record))

    assert MEASURED in seen.lines[0]
    assert MEASURED not in true.lines[0]
    assert seen.contacts is None
    assert (seen.spans, seen.end_s) == (true.spans, true.end_s)
    assert len(seen.requests) == 2
    for instant in seen.instants[::100]:
        then = true.at(instant.at_s)
        assert instant.robot.distance_to(then.robot) < 0.1
        assert then.person is not None
        assert instant.person is None or instant.person.distance_to(then.person) < 0.1


def test_a_part_is_drawn_and_says_so(record: Path, tmp_path: Path, capsys: Any) -> None:
    output = tmp_path / "pictures" / "part.svg"

    assert main(["render", str(record), "--from", "10", "--to", "30", "-o", str(output)]) == OK

    assert capsys.readouterr().out == f"{output}\n"
    words = re.findall(r">([^<>\n]+)</text>", output.read_text())
    assert any(re.fullmatch(r"from 10 to 30 s of \d+\.\d s", line) for line in words)
    assert {"chase", "haptic", "escape", "inform", "requests", "path of the robot"} <= {*words}


def test_the_picture_has_the_name_of_the_record_and_stands_in_the_working_directory(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    assert main(["render", str(record)]) == OK

    assert [path.name for path in tmp_path.iterdir()] == ["two.svg"]


@pytest.mark.slow
def test_of_a_record_that_breaks_off_what_is_whole_is_drawn(
    record: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    broken = tmp_path / "broken.mcap.part"
    data = record.read_bytes()
    broken.write_bytes(data[: len(data) // 2])
    monkeypatch.chdir(tmp_path)

    assert main(["render", str(broken)]) == OK

    assert "the record breaks off" in (tmp_path / "broken.svg").read_text()
    whole, half = course_of(Record(record)), course_of(Record(broken))
    assert 0.3 * whole.end_s < half.end_s < 0.7 * whole.end_s
    assert half.instants == whole.during(0.0, half.end_s)


def test_wrong_input_is_told_with_what_would_be_right(
    record: Path, tmp_path: Path, capsys: Any
) -> None:
    def told(*arguments: str) -> tuple[int, str]:
        code = main(["render", *arguments])
        return code, capsys.readouterr().err

    none = tmp_path / "none.mcap"
    none.write_bytes(b"")
    code, text = told(str(record), "--from", "9000")
    assert code == USAGE
    assert re.search(r"two\.mcap: nothing from 9000 .* the run goes from 0 to ", text)
    code, text = told(str(none))
    assert code == FAILED
    assert "none.mcap" in text
    assert "is no record of a run" in text
    code, text = told(str(tmp_path / "gone.mcap"))
    assert code == USAGE
    assert "gone.mcap" in text
    assert told(str(record), "--to", "-1")[0] == USAGE
    code, text = told(str(record), "-o", str(tmp_path / "a.gif"))
    assert code == USAGE
    assert "unknown form" in text
