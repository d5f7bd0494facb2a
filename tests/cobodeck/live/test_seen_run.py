"""What pages are told of a run besides its state: charts, lanes, marks, a shadow's decisions."""

from __future__ import annotations

import asyncio
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, settings, strategies as some

from cobodeck.live.access import Rules
from cobodeck.live.clients import Page
from cobodeck.live.figures import figures_of, final_figures
from cobodeck.live.model import RunModel
from cobodeck.live.sources import past, seen_run
from cobodeck.live.sources.live_run import LiveSource
from cobodeck.live.sources.plots import MOST_FIELDS, plot_of
from cobodeck.live.sources.seen_lanes import SeenLanes
from cobodeck.live.sources.seen_room import SeenRoom
from cobodeck.live.sources.seen_run import SeenRun, Texts
from cobodeck.record.format.messages import command_text
from cobodeck.record.format.record_header import attachments, header_of_setup
from cobodeck.record.format.sample_messages import TOPIC, SampleWriter
from cobodeck.record.read.reader import Group, RecordedMessage, closed
from cobodeck.setup.options import Options
from engine.chart import Library, load_text
from engine.operator.commands import Replace
from hw.geometry import Pose2, Pose3
from hw.samples import UserPose
from tests.cobodeck.live.folding import study_with
from tests.repeats import examples

CHART = """
chart: waits
outcomes: [done]
states:
  one: {watch: Wait, with: {time: 5 s}, next: {over: .done}}
"""


NOWHERE: Any = SimpleNamespace(scene=None, environment=None)


class Somewhere:
    """A run as `LiveSource` knows it, without charts and room."""

    signals = ("speed",)
    setup = NOWHERE

    def __init__(self) -> None:
        self.place = SeenRoom(NOWHERE)

    def add(self, group: Group) -> None:
        """Its lanes take nothing."""

    def version(self) -> int:
        return 0

    def news(self) -> tuple[()]:
        return ()


def tick(at_s: float, *told: RecordedMessage) -> Group:
    at_ns = round(at_s * 1e9)
    ticked = {"at_ns": at_ns, "n": 0, "kind": "grid", "missed": 0, "late_ns": 0, "crc": 0}
    return closed(
        [*told, RecordedMessage("tick", "cobodeck.Tick", json.dumps(ticked).encode(), at_ns)]
    )


def sample(at_s: float, name: str, value: object) -> RecordedMessage:
    at_ns = round(at_s * 1e9)
    kind, data = SampleWriter(name).write(at_ns, value)
    return RecordedMessage(TOPIC + name, kind, data, at_ns)


def message(topic: str, **told: Any) -> RecordedMessage:
    return RecordedMessage(topic, "cobodeck.Any", json.dumps(told).encode(), 0)


def test_a_stop_on_record_is_shown_until_its_reset_and_marked() -> None:
    model, lanes = RunModel(), SeenLanes({})
    for at_s, reason, shown in ((0.0, None, False), (1.0, "stop by ann", True), (2.0, None, False)):
        group = tick(at_s, sample(at_s, "stop.engaged", reason))
        model.add(group)
        lanes.add(group)
        assert model.stop is shown
    [told] = lanes.all()
    assert told["marks"] == [{"at": 1.0, "kind": "stop", "text": "stop by ann"}]


def test_a_remark_is_marked_with_its_text_and_by_whom() -> None:
    lanes = SeenLanes({})
    given = {"$dict": [["text", "speed 2"]]}
    lanes.add(tick(1.0, message("operator", command="Remark", arguments=given, by="ann")))
    [told] = lanes.news()
    assert [mark["text"] for mark in told["marks"]] == ["ann: speed 2"]


@pytest.mark.requirement(57)
def test_differences_from_a_shadow_are_told_once_and_whole_to_who_comes_later() -> None:
    lanes = SeenLanes({})
    rows = []
    for at_s in (1.0, 2.0):
        told = {"path": "chase", "ran": "near", "shadow": "lost"}
        lanes.add(tick(at_s, message("shadow", at_ns=round(at_s * 1e9), **told)))
        rows.append({"at": at_s, **told})
        [new] = lanes.news()
        assert (new["t"], new["rows"], new["more"]) == ("shadow", rows[-1:], True)
    assert list(lanes.news()) == []
    _, whole = lanes.all()
    assert (whole["rows"], whole["more"]) == (rows, False)


def test_figures_are_those_so_far_until_those_of_the_whole_run_are_known() -> None:
    model = RunModel()
    model.at_ns = 3 * 10**9
    assert figures_of(model, 2) == [("time", "3.0 s"), ("transitions", "0"), ("escapes", "2")]
    result = {"sim_s": 4.0, "transitions": 3, "distance_m": None, "requests": 2, "served": 1}
    result |= {"response_s": {"mean": 1.5}, "errors": [], "missed": 0}
    assert final_figures(result) == [
        ("time", "4.0 s"),
        ("transitions", "3"),
        ("requests", "2, served 1"),
        ("response", "1.50 s on average"),
    ]
    assert final_figures({}) == []


def test_escapes_are_counted_up_to_an_instant() -> None:
    lanes = SeenLanes({"flee": "paper_escape"})
    enter, leave = ["enter", "flee"], ["exit", "flee", "outcome"]
    for at_s, line in ((1, enter), (2, leave), (3, enter)):
        lanes.add(tick(3.0, message("trace", line=[at_s * 10**9, *line])))
    assert [lanes.escapes(at_s) for at_s in (0.5, 1.0, 2.5, 3.0)] == [0, 1, 1, 2]


def test_charts_are_those_of_an_instant_and_their_text_is_the_one_that_runs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(seen_run, "chart_message", lambda chart, *_, **__: chart.source.text)
    setup = study_with(CHART)
    header = {**header_of_setup(setup, Options()), "signals": []}
    texts = Texts(Path("run"), header, attachments(setup))
    seen = SeenRun(texts, setup.catalogue)
    assert seen.text()["text"] == CHART
    longer = CHART.replace("5 s", "6 s")
    library = Library()
    library.update(load_text(longer, "waits.yaml"))
    command = Replace(setup.machine().changed(library["waits"], library), by="ann")
    seen.add(tick(2.0, RecordedMessage("operator", "", command_text(command).encode(), 0)))

    assert [seen.chart(at) for at in (0, 1_999_999_999, 2 * 10**9)] == [CHART, CHART, longer]
    assert seen.chart() == longer
    told = {"t": "text", "chart": "waits", "text": longer, "charts": ["waits"]}
    assert seen.text() == seen.text("waits") == told
    with pytest.raises(ValueError, match="no chart 'wait' runs here"):
        seen.text("wait")


@pytest.mark.requirement(145)
@settings(max_examples=examples(50, least=20), deadline=None)
@given(
    steps=some.lists(some.sampled_from(["tick", "drop"]), max_size=12),
    at_s=some.integers(0, 12),
)
def test_an_instant_of_a_run_that_goes_on_is_what_all_before_it_led_to(
    steps: list[str], at_s: int
) -> None:
    model, kept = RunModel(), past.SeenTicks()
    states = [model.state()]
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(past, "BLOCK", 3)
        for second, step in enumerate(steps, 1):
            if step == "drop":  # what is whole then follows from no tick
                kept.close()
                model.tell("level", f"after {second}")
            told = tick(second, message("trace", line=[second, "enter", f"n{second}"]))
            kept.add(told, model)
            model.add(told)
            states.append(model.state())
        seen = past.SeenInstant(kept, SeenRoom(NOWHERE))
        seen.seek(at_s * 10**9)

    there = min(at_s, len(steps))
    assert seen.model.state() | {"level": None} == states[there] | {"level": None}


@pytest.mark.requirement(48)
def test_what_is_kept_of_a_run_is_bounded_and_the_oldest_goes() -> None:
    kept, model = past.SeenTicks(bound=2000), RunModel()
    for second in range(3 * past.BLOCK):
        told = tick(second, sample(second, "speed", math.sin(second)))
        kept.add(told, model)
        model.add(told)
    times = [group.ticked.at_ns for group in kept.groups()]
    assert times == [s * 10**9 for s in range(3 * past.BLOCK)][-len(times) :]
    assert past.BLOCK <= len(times) < 3 * past.BLOCK
    seen = past.SeenInstant(kept, SeenRoom(NOWHERE))
    seen.seek(0)
    assert seen.model.at_ns in (times[0] - 10**9, times[0])


@pytest.mark.requirement(145)
def test_a_page_looks_back_at_a_run_and_the_others_do_not() -> None:
    source: Any = LiveSource(Somewhere(), None, None, Rules())  # type: ignore[arg-type]
    for second in (1.0, 2.0, 3.0):
        source._take("tick", tick(second, sample(second, "stop.engaged", "by ann")))
    page = Page(1)

    state, frame = asyncio.run(source.asked(page, {"t": "seek", "at": 2.5}))

    assert (state["t"], state["at"], state["back"]) == ("state", 2.0, True)
    assert frame == {"t": "frame", "at": 2.0, "shapes": [], "back": True}
    assert source._state()["at"] == 3.0
    assert "back" not in source._state()
    with pytest.raises(ValueError, match="`at` is a number, s in the run"):
        asyncio.run(source.asked(page, {"t": "seek", "at": "2"}))
    assert asyncio.run(source.asked(page, {"t": "seek", "at": None})) == []


def test_of_a_signal_with_many_fields_a_plot_has_those_that_are_drawn() -> None:
    body, hand = Pose2(1.0, 2.0, 0.5), Pose3(0.1, 0.2, 0.3)
    poses = [UserPose(body, 0.5), UserPose(body, 0.6, hand, hand, hand)]
    for first in (0, 1):
        told = plot_of(
            "user.pose", [sample(float(n), "user.pose", poses[(n + first) % 2]) for n in range(4)]
        )
        assert told is not None
        assert told["fields"][:4] == ["body.x", "body.y", "body.yaw", "head_yaw"]
        assert len(told["values"]) == len(told["fields"]) <= MOST_FIELDS
        assert told["at"] == [[0.0, 1.0, 2.0, 3.0], [0.0, 2.0]][first]


def test_a_plot_of_a_run_begins_with_all_that_was_read_and_has_each_sample_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    source: Any = LiveSource(Somewhere(), None, None, Rules())  # type: ignore[arg-type]
    page, times = Page(1), list[float]()
    source._pages.add(page)
    for at_s in (2.0, 3.0):
        source._take("tick", tick(at_s, sample(at_s, "speed", 10.0 * at_s)))

    [told] = asyncio.run(source.asked(page, {"t": "plot", "signal": "speed", "on": True}))

    assert told == {
        "t": "plot", "signal": "speed", "fields": ["value"], "at": [2.0, 3.0],
        "values": [[20.0, 30.0]], "more": False,
    }  # fmt: skip
    monkeypatch.setattr(page, "tell", lambda told, _key=None: times.extend(told["at"]))
    for new in ((4.0, 5.0), (), (6.0,)):
        for at_s in new:
            source._take("tick", tick(at_s, sample(at_s, "speed", at_s)))
        source._tell_changes()
    assert times == [4.0, 5.0, 6.0]
