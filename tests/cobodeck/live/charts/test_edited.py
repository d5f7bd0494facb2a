"""Edit and see: what pages are told when files are saved, broken, replaced, deleted."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
from collections.abc import Awaitable, Callable
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from cobodeck.__main__ import main
from cobodeck.live.charts import chart_folder, edited
from cobodeck.live.charts.chart_folder import PATIENCE, ChartFolder, Shown
from cobodeck.live.charts.chart_reader import ChartReader
from cobodeck.live.charts.drawer import Drawer
from cobodeck.live.charts.edited import EditedCharts
from cobodeck.live.charts.file_watch import YOUNG_NS, FileWatch
from cobodeck.live.charts.started_runs import StartedRun, StartedRuns
from cobodeck.terminal.console import Problem
from engine.draw.layout import render
from engine.files.source import MAX_BYTES
from tests.cobodeck.live.known import known

GOOD = """\
chart: mine
outcomes: [done]
states:
  park: {do: ParkArm, next: {parked: .done, failed: .done, error: .done}}
"""
WRONG = GOOD.replace("parked: .done", "parked: .gone")
BROKEN = GOOD.replace("states:", "states: [")
OTHER = GOOD.replace("chart: mine", "chart: other")


@pytest.fixture(autouse=True)
def drawn_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are drawn in this process: that of pages is a matter of `test_drawn_chart.py`."""
    monkeypatch.setattr(Drawer, "svg", lambda _, text: render(text).decode())


@pytest.fixture
def folder(tmp_path: Path, without_shipped_charts: None) -> Path:
    (tmp_path / "mine.yaml").write_text(GOOD)
    (tmp_path / "other.yaml").write_text(OTHER)
    (tmp_path / "robot.yaml").write_text("robot: x\n")
    return tmp_path


def shown(charts: ChartFolder, profile: str = "tuned") -> dict[str, Any]:
    return charts.chart(Shown(charts.first, profile), 0)


def save(file: Path, text: str) -> None:
    """As editors do that write a new file and put it in place of the old one."""
    new = file.with_suffix(".new")
    new.write_text(text)
    new.replace(file)


@pytest.mark.requirement(57)
def test_a_save_is_seen_and_drawn_anew(folder: Path) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    before = shown(charts)

    save(folder / "mine.yaml", GOOD.replace("park:", "fold:"))

    assert charts.look()
    after = shown(charts)
    assert "park" in before["nodes"]
    assert "fold" in after["nodes"]
    assert ">fold<" in after["svg"]
    assert not after["stale"]
    assert not charts.look()


def test_the_last_good_picture_stays_while_the_text_is_broken(folder: Path) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    before = shown(charts)

    save(folder / "mine.yaml", BROKEN)
    assert charts.look()
    broken = shown(charts)
    save(folder / "mine.yaml", GOOD)
    assert charts.look()

    assert broken["stale"]
    assert broken["svg"] == before["svg"]
    assert {finding["code"] for finding in broken["findings"]} == {"Y01"}
    assert shown(charts) == before


def test_a_chart_that_never_was_good_has_findings_and_no_picture(folder: Path) -> None:
    (folder / "mine.yaml").write_text(BROKEN)
    message = shown(ChartFolder(folder / "mine.yaml", known()))

    assert message["stale"]
    assert message["svg"] == ""
    assert message["findings"]
    assert json.dumps(message)


def test_mistakes_are_shown_at_their_nodes_in_a_picture_of_now(folder: Path) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    save(folder / "mine.yaml", WRONG.replace("park:", "fold:"))
    assert charts.look()

    message = shown(charts)

    assert not message["stale"]
    assert ">fold<" in message["svg"]
    assert "fold" in {finding["path"] for finding in message["findings"]}


def test_a_file_that_is_half_written_is_waited_for(folder: Path) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    shown(charts)

    (folder / "mine.yaml").write_text("")
    seen = [charts.look() for _ in range(PATIENCE)]
    (folder / "mine.yaml").write_text(GOOD)

    assert seen == [False] * PATIENCE
    assert charts.look()
    assert not shown(charts)["stale"]


def test_a_deleted_file_keeps_its_picture_and_says_that_it_is_gone(folder: Path) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    before = shown(charts)

    (folder / "mine.yaml").unlink()
    seen = [charts.look() for _ in range(PATIENCE + 1)]

    assert seen == [*[False] * PATIENCE, True]
    assert shown(charts)["stale"]
    assert shown(charts)["svg"] == before["svg"]
    assert "No such file" in shown(charts)["findings"][0]["message"]


def test_a_used_chart_that_changes_is_drawn_anew(folder: Path) -> None:
    (folder / "mine.yaml").write_text(
        "chart: mine\noutcomes: [done]\nstates:\n  a: {use: other, next: {done: .done}}\n"
    )
    charts = ChartFolder(folder / "mine.yaml", known())
    assert not shown(charts)["findings"]

    save(folder / "other.yaml", OTHER.replace("[done]", "[ended]").replace(".done", ".ended"))

    assert charts.look()
    assert "a" in {finding["path"] for finding in shown(charts)["findings"]}


def test_a_new_chart_joins_the_list(folder: Path) -> None:
    charts = ChartFolder(folder, known())
    assert [file.stem for file in charts.files] == ["mine", "other"]

    (folder / "third.yaml").write_text(WRONG.replace("mine", "third"))
    while not charts.look():
        pass

    listed = {one["name"]: one["errors"] for one in charts.listing()["charts"]}
    assert listed.keys() == {"mine", "other", "third"}
    assert listed["mine"] == 0
    assert listed["third"] > 0


def test_a_folder_without_charts_is_refused(tmp_path: Path) -> None:
    with pytest.raises(Problem, match="no charts"):
        ChartFolder(tmp_path, known())


def test_a_profile_that_changes_changes_the_picture(folder: Path) -> None:
    profile = folder / "own.yaml"
    profile.write_text("profile: own\nbase: tuned\ncharts: {mine: {wait: 5 s}}\n")
    text = GOOD.replace("states:", "parameters:\n  wait: {type: duration, default: 1 s}\nstates:")
    (folder / "mine.yaml").write_text(text)
    charts = ChartFolder(folder / "mine.yaml", known())

    assert "5 s" in shown(charts, str(profile))["svg"]
    assert "5 s" not in shown(charts)["svg"]
    charts.look()
    save(profile, profile.read_text().replace("5 s", "7 s"))

    assert charts.look()
    assert "7 s" in shown(charts, str(profile))["svg"]
    save(profile, "profile: [")
    assert charts.look()
    assert shown(charts, str(profile))["stale"]


def test_pages_outlive_whatever_a_text_brings_about(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    before = shown(charts)
    save(folder / "mine.yaml", GOOD.replace("park:", "fold:"))
    charts.look()

    def failing(*args: object, **options: object) -> None:
        raise RecursionError("too deep")

    monkeypatch.setattr(chart_folder, "chart_message", failing)

    assert "mine.yaml cannot be shown: RecursionError: too deep" in shown(charts)["trouble"]
    assert shown(charts)["svg"] == before["svg"]


def test_a_look_waits_for_a_message_that_is_made(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    begun, released = Event(), Event()

    def reading(*_: object) -> None:
        begun.set()
        released.wait(60.0)
        raise OSError("no disk")

    monkeypatch.setattr(ChartReader, "read", reading)
    making = Thread(target=shown, args=(charts,))
    making.start()
    assert begun.wait(60.0)
    looking = Thread(target=charts.look)
    looking.start()
    looking.join(0.1)

    waited = looking.is_alive()
    released.set()
    making.join()
    looking.join()

    assert waited
    assert "OSError: no disk" in shown(charts)["trouble"]


def test_only_the_newest_messages_are_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    charts = ChartFolder(folder / "mine.yaml", known())
    made: list[str] = []

    def keeping(_: object, one: Shown) -> dict[str, Any]:
        made.append(one.profile)
        return {"t": "chart"}

    monkeypatch.setattr(ChartFolder, "_message", keeping)
    monkeypatch.setattr(chart_folder, "KEPT", 2)

    for profile in "abaca":
        charts.chart(Shown(charts.first, profile), 0)
    charts.chart(Shown(charts.first, "b"), 0)

    assert "".join(made) == "abcb"


@pytest.mark.usefixtures("without_shipped_charts")
def test_a_folder_that_is_gone_has_no_charts_any_more(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "mine.yaml").write_text(GOOD)
    (tmp_path / "other.yaml").write_text(OTHER)
    charts = ChartFolder(inner, known())

    shutil.rmtree(inner)
    while charts.files:
        charts.look()

    assert charts.listing()["charts"] == []
    assert "No such file" in shown(charts)["findings"][0]["message"]


@pytest.mark.slow
def test_findings_are_those_of_validate(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(WRONG + "  a: {use: chase, next: {fault: .done}}\n  b: {do: Nothing}\n")
    main(["validate", str(file), "--json", "--no-project"])
    told = json.loads(capsys.readouterr().out)["findings"]

    message = ChartFolder(file, known()).chart(Shown(file, "tuned"), 0)

    assert len(told) > 3
    assert [{k: v for k, v in one.items() if k != "path"} for one in message["findings"]] == told


class FakePage:
    """A page that keeps what it is told."""

    name = "somebody"
    layers: set[str] | None = None

    def __init__(self, number: int = 1) -> None:
        self.number = number
        self.plots: set[str] = set()
        self.told: list[Any] = []

    def tell(self, message: Any, key: str | None = None) -> None:
        self.told.append(message)

    def answer(self, message: Any) -> None:
        self.told.append(message)


class FakePages(list[FakePage]):
    async def some(self) -> None:
        pass

    def tell(self, message: Any, key: str | None = None) -> None:
        for page in self:
            page.tell(message)


def served(
    target: Path, play: Callable[[EditedCharts, FakePages], Awaitable[None]], pages: int = 1
) -> FakePages:
    there = FakePages(FakePage(number + 1) for number in range(pages))

    async def run() -> None:
        source = EditedCharts(target, known())
        task = asyncio.create_task(source.run(there))  # type: ignore[arg-type]
        try:
            await play(source, there)
        finally:
            task.cancel()

    asyncio.run(run())
    return there


async def heard(page: FakePage, what: Callable[[Any], bool]) -> Any:
    async with asyncio.timeout(60.0):
        while not (found := [message for message in page.told if what(message)]):
            await asyncio.sleep(0.005)
    return found[-1]


@pytest.mark.requirement(21, 57)
def test_a_page_is_told_of_a_save_and_another_one_that_shows_another_chart_is_not(
    folder: Path,
) -> None:
    async def play(source: EditedCharts, pages: FakePages) -> None:
        first, second = pages
        await heard(first, lambda m: m["t"] == "chart")
        assert [message["t"] for message in source.snapshot(first)] == ["charts", "chart"]
        (answer,) = await source.asked(second, {"t": "show", "chart": "other", "slot": 0})
        assert answer["name"] == "other"

        save(folder / "mine.yaml", GOOD.replace("park:", "fold:"))

        await heard(first, lambda m: m["t"] == "chart" and "fold" in m["nodes"])
        assert not [m for m in second.told if m["t"] == "chart" and "fold" in m["nodes"]]

    served(folder, play, pages=2)


def test_two_charts_stand_side_by_side_each_with_its_profile(folder: Path) -> None:
    async def play(source: EditedCharts, pages: FakePages) -> None:
        (page,) = pages
        (second,) = await source.asked(page, {"t": "second", "chart": "other"})
        (paper,) = await source.asked(page, {"t": "profile", "name": "paper", "slot": 1})
        await heard(page, lambda m: m.get("slot") == 0)
        begin = [message for message in source.snapshot(page) if message["t"] == "chart"]

        assert (second["name"], second["slot"]) == ("other", 1)
        assert paper["profile"] == "paper"
        assert [(m["name"], m["slot"], m["profile"]) for m in begin] == [
            ("mine", 0, "tuned"), ("other", 1, "paper"),
        ]  # fmt: skip
        assert await source.asked(page, {"t": "second", "chart": None}) == []
        assert len([m for m in source.snapshot(page) if m["t"] == "chart"]) == 1

    served(folder, play)


def test_used_charts_are_unfolded_one_by_one_and_all(folder: Path) -> None:
    text = "chart: mine\noutcomes: [done]\nstates:\n"
    text += "  a: {use: other, next: {done: b}}\n  b: {use: other, next: {done: .done}}\n"
    (folder / "mine.yaml").write_text(text)

    async def play(source: EditedCharts, pages: FakePages) -> None:
        (page,) = pages

        async def ask(path: str | None, on: bool) -> Any:
            (found,) = await source.asked(page, {"t": "unfold", "path": path, "on": on, "slot": 0})
            return found["unfolded"], "s:a/park" in found["svg"], "s:b/park" in found["svg"]

        assert await ask("a", True) == (["a"], True, False)
        assert await ask("a", False) == ([], False, False)
        assert await ask(None, True) == (None, True, True)
        assert await ask("a", False) == (["b"], False, True)
        assert await ask(None, False) == ([], False, False)

    served(folder, play)


def test_a_picture_of_what_was_saved_again_is_given_up(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stopped = Event()
    given_up: list[str] = []

    def chart(_: ChartFolder, one: Shown, slot: int) -> dict[str, Any]:
        stopped.clear()
        save(one.file, BROKEN)
        assert stopped.wait(60.0)
        given_up.append(one.file.stem)
        return {"t": "chart", "slot": slot}

    monkeypatch.setattr(edited, "LONG_S", 0.0)
    monkeypatch.setattr(edited, "stop_drawing", stopped.set)
    monkeypatch.setattr(ChartFolder, "chart", chart)

    async def play(source: EditedCharts, pages: FakePages) -> None:
        assert await source.asked(pages[0], {"t": "second", "chart": "other"}) == []
        assert "other" in given_up
        assert [m["t"] for m in source.snapshot(pages[0])] == ["charts"]

    served(folder, play)


ASKED_WRONGLY: list[dict[str, Any]] = [
    {"t": "show", "chart": "mene", "slot": 0},
    {"t": "show", "chart": {}, "slot": 0},
    {"t": "show", "chart": "mine", "slot": 7},
    {"t": "show", "chart": "mine", "slot": "x"},
    {"t": "profile", "name": "tunet", "slot": 0},
    {"t": "profile", "name": "tuned", "slot": 1},
    {"t": "unfold", "path": "a", "on": True, "slot": 1},
    {"t": "seek", "at": 3.0},
]


def test_what_a_page_asks_wrongly_is_answered_in_a_sentence(folder: Path) -> None:
    async def play(source: EditedCharts, pages: FakePages) -> None:
        for message in ASKED_WRONGLY:
            (answer,) = await source.asked(pages[0], message)
            assert answer["t"] == "say", message
            assert len(answer["text"]) > 10, message

    served(folder, play)


def test_there_is_nothing_to_command_but_a_start(folder: Path) -> None:
    async def play(source: EditedCharts, pages: FakePages) -> None:
        answer = await source.commanded(pages[0], {"t": "cmd", "id": 3, "do": "pause"})

        assert answer == {
            "t": "ack", "id": 3, "ok": False,
            "text": "nothing runs here; start a chart, its page has all commands",
        }  # fmt: skip

    served(folder, play)


def test_a_chart_that_is_not_shown_starts_by_the_profile_of_the_command(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[str] = []

    async def start(_: StartedRuns, chart: Path, profile: str, *_form: object) -> StartedRun:
        given.extend((chart.stem, profile))
        await asyncio.sleep(0)
        return StartedRun(None, "not begun")

    monkeypatch.setattr(StartedRuns, "start", start)
    charts, page = EditedCharts(folder, known(), "paper"), FakePage(1)
    order = {"t": "cmd", "id": 1, "do": "start", "chart": "other"}

    async def main() -> None:
        assert await charts.commanded(page, order) is None  # the page goes on meanwhile
        again = await charts.commanded(page, {**order, "id": 2})
        assert "begins already" in again["text"]
        while not page.told:
            await asyncio.sleep(0)

    asyncio.run(main())

    assert given == ["other", "paper"]
    assert page.told == [{"t": "ack", "id": 1, "ok": False, "text": "not begun", "url": None}]


def test_a_start_that_fails_unforeseen_is_answered_and_another_may_follow(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def start(*_: object) -> StartedRun:
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(StartedRuns, "start", start)
    charts, page = EditedCharts(folder, known()), FakePage(1)

    async def main() -> None:
        for number in (1, 2):
            order = {"t": "cmd", "id": number, "do": "start", "chart": "other"}
            assert await charts.commanded(page, order) is None
            while charts._starting:
                await asyncio.sleep(0)

    asyncio.run(main())

    assert [(one["id"], one["ok"]) for one in page.told] == [(1, False), (2, False)]
    assert "ZeroDivisionError: oh" in page.told[0]["text"]


# the watch of files


class Moments:
    """A clock that stands until it is moved."""

    def __init__(self) -> None:
        self.now = 10**18

    def __call__(self) -> int:
        return self.now


@pytest.fixture
def file(tmp_path: Path) -> Path:
    found = tmp_path / "a.yaml"
    found.write_text("one")
    return found


def stamped(file: Path, text: str, at_ns: int) -> None:
    file.write_text(text)
    os.utime(file, ns=(at_ns, at_ns))


def test_a_second_save_in_the_same_moment_is_seen(file: Path) -> None:
    clock = Moments()
    watch = FileWatch(clock)
    stamped(file, "one", clock.now)
    assert watch.changed([file]) == set()

    stamped(file, "two", clock.now)

    assert watch.changed([file]) == {file}
    assert watch.changed([file]) == set()


def test_bytes_of_an_old_file_are_read_once(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Moments()
    watch = FileWatch(clock)
    stamped(file, "one", clock.now - YOUNG_NS)
    read: list[Path] = []
    bytes_of = Path.read_bytes
    monkeypatch.setattr(Path, "read_bytes", lambda path: read.append(path) or bytes_of(path))

    for _ in range(5):
        watch.changed([file])

    assert read == [file]


def test_a_file_that_was_only_touched_has_not_changed(file: Path) -> None:
    watch = FileWatch()
    watch.changed([file])
    os.utime(file, ns=(1, 1))

    assert watch.changed([file]) == set()


def test_files_that_go_and_come_have_changed(file: Path, tmp_path: Path) -> None:
    watch = FileWatch()
    other = tmp_path / "b.yaml"
    watch.changed([file, other])
    file.unlink()
    other.write_text("")

    assert watch.changed([file, other]) == {file, other}


def test_files_too_large_for_charts_are_not_read(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    os.truncate(file, MAX_BYTES + 1)
    monkeypatch.setattr(Path, "read_bytes", lambda path: pytest.fail(f"{path} is read"))
    watch = FileWatch()
    assert watch.changed([file]) == set()

    os.truncate(file, MAX_BYTES + 2)

    assert watch.changed([file]) == {file}


def test_pipes_are_not_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.yaml")
    watch = FileWatch()

    assert watch.changed([tmp_path / "pipe.yaml"]) == set()
    assert watch.changed([tmp_path / "pipe.yaml"]) == set()


def test_the_folder_around_is_called_by_its_name(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    assert EditedCharts(Path(), known()).hello()["title"] == folder.name
