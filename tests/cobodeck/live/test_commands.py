"""Commands of pages in the process of the run: carried out, refused, on record, replayed."""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import AsyncIterator, Iterable, Iterator, Mapping
from pathlib import Path
from threading import Event, get_ident
from typing import Any

import pytest

from cobodeck.live.access import Rules
from cobodeck.live.clients import Page, PageMessage
from cobodeck.live.sources import live_run
from cobodeck.live.sources.recorded import RecordSource
from cobodeck.live.steering.orders import Orders, Refused
from cobodeck.live.steering.page_operator import MOST_ASKED, PageOperator
from cobodeck.loop.clocks import Paced
from cobodeck.loop.loop import Loop
from cobodeck.loop.ticked import Ticked
from cobodeck.record.format.value_codec import value
from cobodeck.record.read.reader import Group, Record, RecordedMessage
from cobodeck.record.read.record_replay import Replay, stage_replay
from cobodeck.record.write.run_recorder import Recorder
from cobodeck.record.write.start import recorder
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import Setup, open_setup
from engine.run.errors import Raised
from tests.cobodeck.live.folding import AT, study, study_with
from tests.waiting import until

CHART = """
chart: steered
outcomes: [done]
states:
  look: {watch: Wait, with: {time: 100 s}, next: {over: again}}
  again: {watch: Wait, with: {time: 200 s}, next: {over: .done}}
"""


class Answers:
    """Stands in for the feed."""

    dropped = 0

    def __init__(self) -> None:
        self.told: list[tuple[str, Any]] = []

    def tell(self, kind: str, value: Any) -> None:
        self.told.append((kind, value))

    def ack(self, number: int) -> Mapping[str, Any] | None:
        return next((v for k, v in self.told if k == "ack" and v["id"] == number), None)


class Steered:
    """A run with a page that commands it."""

    def __init__(self, setup: Setup, path: Path, real: bool = False, parts: bool = False) -> None:
        options = Options(duration_s=60.0)
        found = recorder(setup, options, path, AT, pytest.fail)
        assert found is not None
        self.recorder: Recorder = found
        self.loop: Loop = stage(setup, options, tap=self.recorder.tap)
        self.recorder.attend(self.loop)
        self.answers, self._count = Answers(), 0
        self.errors: list[Raised] = []
        self.loop.tell = self.errors.append
        self.page, self.ours = socket.socketpair()
        self.operator = PageOperator(setup, self.loop, self.answers, self.ours, real)  # type: ignore[arg-type]
        self.operator.attend(parts)
        self.loop.tick()

    def send(self, **order: Any) -> int:
        self._count += 1
        told = {"t": "cmd", "id": self._count, "page": 1, "who": "ann", **order}
        self.page.sendall(json.dumps(told).encode() + b"\n")
        return self._count

    def do(self, do: str, **more: Any) -> str:
        """Command, and tick until there is an answer: empty, or why not."""
        return self.answer(self.send(do=do, **more))

    def answer(self, number: int) -> str:
        until(lambda: self.loop.tick() is None and self.answers.ack(number))
        self.loop.tick()
        ack = self.answers.ack(number)
        assert ack is not None
        return "" if ack["ok"] else ack["text"]

    @property
    def active(self) -> list[str]:
        return self.loop.wired.run.active

    def close(self) -> None:
        self.page.close()
        until(lambda: self.ours.fileno() < 0)

    def finish(self) -> Path:
        self.loop.go(self.loop.now_ns)
        path = self.recorder.finish({})
        assert path is not None
        return path


@pytest.fixture(scope="module")
def setup() -> Setup:
    return study_with(CHART)


@pytest.fixture
def steered(setup: Setup, tmp_path: Path) -> Iterator[Steered]:
    found = Steered(setup, tmp_path / "run.mcap")
    yield found
    found.recorder.give_up()
    found.close()


def replayed(record: Record, setup: Setup) -> Replay:
    """The replay of a run of this setup, to its end; the same in all."""
    replay = stage_replay(record, setup)
    replay.loop.go(1 << 62)
    assert replay.difference is None
    return replay


@pytest.mark.requirement(48)
def test_commands_are_carried_out_refused_with_reasons_and_replayed(
    steered: Steered, setup: Setup
) -> None:
    run = steered.loop.wired.run
    assert steered.do("pause") == ""
    assert run.paused
    assert steered.do("resume") == ""
    assert not run.paused
    assert steered.do("lock", path="look") == ""
    assert run.judge.locks == {"look"}
    assert "nowhere" in steered.do("lock", path="nowhere")
    assert steered.do("level", level="low") == ""
    assert "wrong" in steered.do("level", level="wrong")
    assert "'gone'" in steered.do("force", path="look", outcome="gone")
    assert steered.do("unlock", path="look") == ""
    assert "nothing" in steered.do("consent", path="look")
    assert steered.active == ["look"]
    assert steered.do("force", path="look", outcome="over") == ""
    assert steered.active == ["again"]
    assert "real time" in steered.do("speed", speed=2)
    assert "no command" in steered.do("fly")
    assert steered.do("break", path="again") == ""

    record = Record(steered.finish())

    commands = [told for group in record.groups() for told in group.messages("operator")]
    assert {told["command"] for told in commands} >= {"Pause", "Resume", "SetLock", "ForceOutcome"}
    assert {told["by"] for told in commands} == {"ann"}
    replayed(record, setup)


def test_who_takes_and_loses_control_is_on_record(steered: Steered, setup: Setup) -> None:
    for name in ("ann", "bob", "bob", None):
        steered.send(t="held", name=name)
    assert steered.do("pause") == ""
    record = Record(steered.finish())
    commands = [told for group in record.groups() for told in group.messages("operator")]
    remarks = [c for c in commands if c["command"] == "Remark"]
    assert [(c["by"], value(c["arguments"])["text"]) for c in remarks] == [
        ("ann", "takes control"),
        ("bob", "takes control from ann"),
        ("bob", "has no control any more"),
    ]
    replayed(record, setup)


@pytest.mark.slow
@pytest.mark.requirement(57)
def test_another_chart_goes_on_or_is_refused_with_the_place(steered: Steered) -> None:
    longer = CHART.replace("200 s", "300 s")
    assert steered.do("replace", text=longer) == ""
    assert steered.loop.wired.run.machine.chart.source.text == longer
    assert "Wat" in steered.do(
        "replace", text=CHART.replace("again: {watch: Wait", "again: {watch: Wat")
    )
    assert "look" in steered.do("replace", text=CHART.replace("100 s", "50 s"))
    assert steered.do("replace", text="nonsense: [")
    assert steered.active == ["look"]


OUTER = """
chart: outer
outcomes: [done]
parameters: {long: {type: duration, default: 70 s}}
states:
  one: {use: inner, next: {done: two}}
  two: {watch: Wait, with: {time: $long}, next: {over: .done}}
"""
INNER = CHART.replace("steered", "inner")


@pytest.mark.slow
@pytest.mark.requirement(57)
def test_a_used_chart_is_changed_and_locks_breakpoints_and_values_of_the_profile_stay(
    tmp_path: Path,
) -> None:
    (tmp_path / "outer.yaml").write_text(OUTER)
    (tmp_path / "inner.yaml").write_text(INNER)
    sets = ["charts.outer.long=50 s"]
    setup = open_setup(str(tmp_path / "outer.yaml"), "study", sets=sets)
    found = Steered(setup, tmp_path / "run.mcap")
    run = found.loop.wired.run
    assert found.do("lock", path="one/again") == ""
    assert found.do("break", path="one/again") == ""

    assert found.do("replace", text=INNER.replace("200 s", "300 s")) == ""

    assert (run.machine.chart.name, found.active) == ("outer", ["one/look"])
    assert "300 s" in run.machine.library["inner"].source.text
    assert run.machine.chart.parameters["long"].default == "50 s"
    assert run.judge.locks == {"one/again"}
    assert dict(found.answers.told)["status"]["breaks"] == ["one/again"]
    wrong = found.do("replace", text=INNER.replace("over: .done", "over: .gone"))
    assert "inner.yaml:" in wrong
    assert "outer.yaml:" in found.do("replace", text=INNER.replace("done", "gone"))
    assert "no chart 'iner' runs here" in found.do("replace", text=INNER.replace("inner", "iner"))
    assert found.do("replace", text=OUTER.replace("two}}", "two}, break: true}")) == ""
    assert dict(found.answers.told)["status"]["breaks"] == ["one", "one/again"]
    assert "300 s" in run.machine.library["inner"].source.text

    found.close()
    record = Record(found.finish())
    first, last = asyncio.run(sought(record.path, (3600.0, 0.0)))[::-1]
    assert [chart["nodes"]["one/again"]["values"]["time"] for chart in (first, last)] == [
        "200 s",
        "300 s",
    ]
    assert [path for path, node in last["nodes"].items() if node["break"]] == ["one"]


async def sought(path: Path, instants: Iterable[float]) -> list[PageMessage]:
    """The charts that a page of a record is told as it goes to these instants."""
    source, page, told = RecordSource([path]), Page(1), list[PageMessage]()
    page.tell = lambda message, key=None: told.append(message)  # type: ignore[method-assign]
    source._pages.add(page)
    source._pages.tell = page.tell  # type: ignore[method-assign]
    for at in instants:
        assert not await source.asked(page, {"t": "seek", "at": at})
    assert {"state", "figures", "health"} <= {message["t"] for message in told}
    return [message for message in told if message["t"] == "chart"]


@pytest.mark.requirement(48, 49)
def test_a_stop_does_not_wait_for_a_tick(steered: Steered) -> None:
    line = steered.loop.plant.parts["stop_line"]
    assert line.reason is None

    steered.send(do="stop")

    until(lambda: line.reason is not None)
    assert "ann" in line.reason
    assert steered.do("reset") == ""
    assert line.reason is None


def test_a_stop_while_parts_are_closed_is_on_record_and_the_rest_is_refused(
    steered: Steered, setup: Setup
) -> None:
    steered.send(do="end")
    until(lambda: steered.loop.tick() == "stopped")
    plant, sent = steered.loop.plant, []

    def close() -> None:
        sent.extend((steered.send(do="stop"), steered.send(do="pause")))
        until(lambda: len(steered.operator._ready) == 2)
        type(plant).close(plant)

    plant.close = close  # type: ignore[method-assign]
    record = Record(steered.finish())
    steered.operator.close()

    acks = [steered.answers.ack(number) for number in sent]
    assert [ack and (ack["ok"], ack["text"]) for ack in acks] == [
        (True, "done"),
        (False, "the run has ended"),
    ]
    *_, last = record.groups()
    commands = [(m["command"], value(m["arguments"]), m["by"]) for m in last.messages("operator")]
    assert commands == [("Remark", {"text": "stop"}, "ann")]
    again = replayed(record, setup).loop.wired.run.carried_out
    assert [command.by for _, command in again] == ["ann", "ann"]


def test_lines_that_are_none_disturb_nothing(steered: Steered) -> None:
    lines = (b"\xff\xfe\n", b"[]\n", b"{}\n", b"null\n", b'{"t": "cmd"}\n', b"[" * 60_000 + b"\n")
    for line in lines:
        steered.page.sendall(line)

    assert steered.do("pause") == ""
    assert {error.path for error in steered.errors} == {"live page"}


WRONG: tuple[tuple[dict[str, Any], str], ...] = (
    ({"do": "lock"}, "the path of a node; given: nothing"),
    ({"do": "lock", "path": ["look"]}, "the path of a node"),
    ({"do": "level", "level": []}, "off, low, high or full"),
    ({"do": "force", "path": "look", "outcome": 5}, "one of the node's outcomes"),
    ({"do": "force", "path": "look", "outcome": "over", "outputs": [1]}, "comes with []"),
    ({"do": "force", "path": "look", "outcome": "over", "outputs": {"x": 1}}, "comes with []"),
    ({"do": "force", "path": "\ud800", "outcome": "over"}, "no node"),
    ({"do": "replace", "text": {"chart": "x"}}, "a chart in YAML"),
    ({"do": "replace", "text": "{" * 5000}, "Y06"),
    ({"do": "replace", "text": "a: &a [x]\nb: *a"}, "alias"),
    ({"do": "speed", "speed": 10**400}, "real time"),
    ({"do": "[]"}, "no command '[]'"),
)


def test_a_command_of_a_wrong_type_is_refused_with_what_would_be_right(steered: Steered) -> None:
    for order, right in WRONG:
        assert right in steered.do(**order)
    assert steered.errors == []
    assert steered.active == ["look"]


def test_speeds_are_numbers_between_bounds(setup: Setup) -> None:
    loop = stage(setup, Options(), clock=Paced())
    orders = Orders(setup, loop, False)
    for speed in (True, "2", None, 0.0, -1, 101, 10**400, float("nan"), float("inf")):
        with pytest.raises(Refused, match=r"2 or 0\.5|0\.1 to 100"):
            orders.act({"do": "speed", "speed": speed})
    assert orders.act({"do": "speed", "speed": 20})() is None
    assert loop.clock.speed == 20.0
    loop.wired.run.close()


def test_a_stop_does_not_wait_while_something_is_made_ready(steered: Steered) -> None:
    """Nor is it undone by a reset that somebody asked for before it."""
    go_on, line = Event(), steered.loop.plant.parts["stop_line"]
    orders = steered.operator._orders
    ready = orders.act
    orders.act = lambda order: go_on.wait(60.0) and ready(order)  # type: ignore[method-assign]
    reset = steered.send(do="reset")

    steered.send(do="stop")

    until(lambda: line.reason is not None)
    go_on.set()
    assert "again" in steered.answer(reset)
    assert line.reason is not None
    assert steered.do("reset") == ""
    assert line.reason is None


def test_a_stop_in_the_moment_of_a_reset_holds(steered: Steered) -> None:
    line = steered.loop.plant.parts["stop_line"]
    steered.send(do="stop")
    until(lambda: line.reason is not None)
    release, stops = line.reset, steered.operator._stops

    def reset() -> bool:
        steered.send(do="stop", who="bob")
        until(lambda: steered.operator._stops > stops)
        return bool(release())

    line.reset = reset  # type: ignore[method-assign]

    assert "again" in steered.do("reset")

    assert line.reason is not None
    assert "bob" in line.reason


def test_stops_again_and_again_are_all_answered_and_one_is_on_record(steered: Steered) -> None:
    sent = [steered.send(do="stop", who=who) for who in ("ann", "bob") for _ in range(20)]
    until(lambda: steered.loop.tick() is None and steered.answers.ack(sent[-1]))
    assert all(steered.answers.ack(number) for number in sent)
    steered.do("ack", path="a", outcome=["b"], level={})

    record = Record(steered.finish())
    told = [message for group in record.groups() for message in group.messages("operator")]
    remarks = [(one["by"], value(one["arguments"])["text"]) for one in told]
    assert remarks == [("ann", "stop"), ("bob", "stop"), ("ann", "ack")]


def test_commands_that_wait_are_bounded(steered: Steered) -> None:
    go_on = Event()
    orders = steered.operator._orders
    ready = orders.act
    orders.act = lambda order: go_on.wait(60.0) and ready(order)  # type: ignore[method-assign]
    sent = [steered.send(do="pause") for _ in range(MOST_ASKED + 10)]

    refused = steered.answer(sent[-1])
    go_on.set()

    assert refused == "too many commands wait"
    assert steered.answer(sent[0]) == ""


def test_an_error_of_the_program_refuses_a_command_and_the_run_goes_on(steered: Steered) -> None:
    def broken(*_: object) -> str | None:
        raise ZeroDivisionError("oh")

    orders = steered.operator._orders
    for act in (broken, lambda _order: broken):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(orders, "act", act)
            told = steered.do("pause")
        assert "an error of the program" in told
        assert "ZeroDivisionError: oh" in told
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(orders, "stop", broken)
        assert "ZeroDivisionError: oh" in steered.do("stop")
    assert [error.text for error in steered.errors] == ["oh"] * 3
    assert steered.do("pause") == ""


class Unreadable:
    @property
    def faults(self) -> list[str]:
        raise ZeroDivisionError("oh")


def test_what_pages_are_told_of_a_run_may_fail(steered: Steered) -> None:
    """An error is told once, and the run goes on."""
    loop, answers = steered.loop, steered.answers
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(loop.plant.parts, "operator", Unreadable())
        ticks = loop.ticks
        for _ in range(3):
            loop.tick()
    assert loop.ticks == ticks + 3
    assert [error.text for error in steered.errors] == ["oh"]
    [said] = [value for kind, value in answers.told if kind == "say"]
    assert "an error of the program" in said


@pytest.mark.slow
@pytest.mark.requirement(55)
def test_who_has_control_on_parts_is_missed_also_when_the_server_dies(tmp_path: Path) -> None:
    for end in (False, True):
        found = Steered(study(), tmp_path / f"{end}.mcap", parts=True)
        line = found.loop.plant.parts["stop_line"]
        found.send(t="held", name="ann")
        if end:
            found.page.close()
        until(lambda line=line: line.reason is not None)
        assert ("not served" in line.reason) is end
        found.close()
        found.finish()


@pytest.mark.requirement(49)
def test_real_parts_are_not_reset_from_pages(setup: Setup, tmp_path: Path) -> None:
    found = Steered(setup, tmp_path / "run.mcap", real=True)
    assert "console" in found.do("reset")
    found.close()
    found.finish()


def test_another_chart_is_drawn_beside_the_loop_that_takes_commands(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    command = b'{"command":"Replace","arguments":{"$dict":[]}}'
    told = RecordedMessage("operator", "cobodeck.Command", command, 0)
    drawn_in: list[int] = []

    class Run:
        @property
        def place(self) -> Run:
            return self

        @property
        def obstacles(self) -> Run:
            return self

        def add(self, _group: Group) -> None:
            pass

        def chart(self) -> dict[str, Any]:
            drawn_in.append(get_ident())
            return {}

    async def frames(_reader: object) -> AsyncIterator[tuple[str, Group]]:
        yield "tick", Group(Ticked(0, 0, "grid"), (told,), told)

    monkeypatch.setattr(live_run, "frames", frames)
    source = live_run.LiveSource(Run(), None, None, Rules())  # type: ignore[arg-type]
    asyncio.run(source._read())

    assert len(drawn_in) == 1
    assert drawn_in[0] != get_ident()
