"""The view of a terminal: what it shows, and that it fits and commands no terminal."""

from __future__ import annotations

import asyncio
import itertools
import re
import sys
import unicodedata
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from cobodeck.live import terminal_session
from cobodeck.live.clients import Pages
from cobodeck.live.terminal_session import (
    DOWN,
    LEFT,
    MOST,
    RIGHT,
    UP,
    NearLink,
    asked_by,
    socket_url,
    watch_in_terminal,
)
from cobodeck.live.terminal_view import WatchedPage, view
from cobodeck.terminal.console import Problem
from engine.files.visible_text import visible
from tests.repeats import examples
from tests.waiting import until

HELLO = {
    "t": "hello", "mode": "record", "title": "cobodeck", "about": ["lab_a, tuned"], "until": 60.0,
}  # fmt: skip
CHART = {
    "t": "chart", "name": "cobodeck", "slot": 0,
    "nodes": {
        "": {"target": ""}, "chase": {"target": "chase"}, "chase/follow": {"target": ""},
        "chase/follow/drive": {"target": "DriveTo"}, "chase/danger": {"target": "Danger"},
    },
}  # fmt: skip
STATE = {
    "t": "state", "at": 12.34,
    "active": {"": 0.0, "chase": 2.0, "chase/follow/drive": 10.0, "chase/danger": 2.0},
    "last": [{"at": 10.0, "kind": "outcome", "path": "chase/follow/plan", "text": "planned"}],
    "waiting": {"chase": "haptic_request"}, "locks": ["chase"], "level": "low",
    "operator": {"name": "Ada", "you": False}, "faults": ["arm: no power"], "paused": True,
    "speed": 2.0, "stop": False, "ended": None, "breaks": ["haptic"],
}  # fmt: skip
HEALTH = {
    "t": "health", "late": 3, "missed": 1, "tick_p99_ms": 4.25, "dropped": 0,
    "ages": {"user.pose": 0.1, "base.scan": 2.5}, "children": [{"name": "can", "state": "alive"}],
}  # fmt: skip


def told(*messages: dict[str, Any]) -> WatchedPage:
    page = WatchedPage()
    for message in messages:
        page.take(message)
    return page


@pytest.mark.requirement(21)
def test_it_shows_the_active_nodes_with_their_times_and_all_that_matters() -> None:
    lines = view(told(HELLO, CHART, STATE, HEALTH), 80, 24)

    assert [line.split() for line in lines[3:10]] == [
        ["asks:", "chase:", "haptic_request?"],
        ["cobodeck"],
        ["chase", "chase", "(locked)", "10.3", "s"],
        ["follow"],
        ["drive", "DriveTo", "2.3", "s"],
        ["danger", "Danger", "10.3", "s"],
        ["operator:", "Ada", "·", "level:", "low", "·", "breakpoint:", "haptic"],
    ]
    text = "\n".join(lines)
    for part in (
        "cobodeck · record · paused", "12.3 of 60.0 s ×2", "fault: arm: no power",
        "late 3 · missed 1 · dropped 0 · tick p99 4.2 ms · can alive",
        "oldest: base.scan 2.5 s · user.pose 0.1 s", "10.00 s  outcome  chase/follow/plan  planned",
        "space: play or pause",
    ):  # fmt: skip
        assert part in text
    assert len(lines) == 24


def test_nodes_stand_in_the_order_of_the_chart() -> None:
    lines = view(told(HELLO, CHART, STATE), 80, 24)

    names = [word for line in lines for word in line.split()[:1]]

    assert names.index("drive") < names.index("danger")


def test_changes_come_on_top_of_what_was_told_and_a_state_replaces_all() -> None:
    entry = {"at": 12.5, "kind": "outcome", "path": "chase", "text": "cornered"}
    page = told(HELLO, CHART, STATE, {"t": "ev", "at": 12.5, "active": {"": 0.0}, "last": [entry]})

    assert page.state["level"] == "low"
    assert page.at == 12.5
    assert [one["path"] for one in page.last] == ["chase/follow/plan", "chase"]
    page.take({"t": "state", "at": 0.0, "active": {}, "last": []})
    assert not page.last
    assert "level" not in page.state
    assert page.at == 0.0


def test_a_hundred_active_nodes_leave_room_for_the_rest() -> None:
    active = {f"n{number}": 0.0 for number in range(100)}
    lines = view(told(HELLO, STATE | {"active": active}, HEALTH), 80, 24)

    assert len(lines) == 24
    assert any("more active nodes" in line for line in lines)
    assert any("health:" in line for line in lines)
    assert any("planned" in line for line in lines)


def test_charts_are_listed_with_their_findings() -> None:
    finding = {
        "file": "a.yaml", "line": 3, "column": 5, "severity": "error", "code": "N01",
        "message": "no state 'Dive'", "hint": "did you mean 'Drive'?",
    }  # fmt: skip
    charts = [
        {"name": "a", "file": "a.yaml", "errors": 1, "warnings": 2},
        {"name": "b", "file": "b.yaml", "errors": 0, "warnings": 0},
    ]
    page = told(
        {"t": "hello", "mode": "charts", "title": "charts"},
        {"t": "charts", "charts": charts},
        {"t": "chart", "file": "a.yaml", "stale": True, "profile": "tuned", "findings": [finding]},
    )

    text = "\n".join(view(page, 80, 24))

    assert re.search(r"^charts · the text is broken +tuned$", text, re.MULTILINE)
    assert re.search(r"^> a +1 error, 2 warnings$", text, re.MULTILINE)
    assert re.search(r"^  b +fine$", text, re.MULTILINE)
    assert "a.yaml:3:5: error[N01]\n    no state 'Dive'\n    did you mean 'Drive'?" in text


def test_the_second_of_two_records_is_left_to_the_page() -> None:
    page = told(HELLO, CHART, STATE, {**CHART, "name": "other", "slot": 1})

    assert page.chart["name"] == "cobodeck"


def test_colour_is_added_only_where_it_is_wanted() -> None:
    page = told(HELLO, CHART, STATE, HEALTH)

    plain, coloured = view(page, 80, 24), view(page, 80, 24, colour=True)

    assert not any("\x1b" in line for line in plain)
    assert any("\x1b[31m" in line for line in coloured)
    assert [re.sub(r"\x1b\[\d+m", "", line).rstrip() for line in coloured] == plain


WORDS = st.text(st.characters(codec="utf-8"), max_size=30)
NAMES = st.sampled_from(["a", "a/b", "a/b/c", "chase", "ü/漢字", "\x1b[2J", "é" * 90])


@settings(max_examples=examples(100, of=10))
@given(
    WORDS,
    st.dictionaries(NAMES, st.floats(0, 100)),
    st.lists(WORDS, max_size=4),
    st.integers(1, 200),
    st.integers(1, 60),
)
def test_it_fits_and_commands_no_terminal(
    title: str, active: dict[str, float], words: list[str], columns: int, rows: int
) -> None:
    last = [{"at": 1.0, "kind": word, "path": word, "text": word} for word in words]
    state = {"t": "state", "at": 9.0, "active": active, "faults": words, "last": last}
    lines = view(told(HELLO | {"title": title, "about": words}, state, HEALTH), columns, rows)

    assert len(lines) == max(rows, 5)
    for line in lines:
        wide = sum(2 if unicodedata.east_asian_width(c) in "WF" else 1 for c in line)
        accents = sum(unicodedata.combining(c) > 0 for c in line)
        assert wide - 2 * accents <= max(columns, 20)
        assert visible(line) == line


@pytest.mark.parametrize(
    ("key", "asked"),
    [
        (" ", {"t": "play", "speed": 1}),  # it is paused
        (RIGHT, {"t": "seek", "at": 13.34}),
        (LEFT, {"t": "seek", "at": 11.34}),
        (UP, {"t": "play", "speed": 4.0}),
        (DOWN, {"t": "play", "speed": 1.0}),
        ("x", None),
    ],
)
def test_keys_play_and_seek(key: str, asked: dict[str, Any] | None) -> None:
    assert asked_by(key, told(HELLO, STATE)) == pytest.approx(asked)


def test_seeking_ends_at_both_ends() -> None:
    assert asked_by(LEFT, told(HELLO, STATE | {"at": 0.2})) == {"t": "seek", "at": 0.0}
    assert asked_by(RIGHT, told(HELLO, STATE | {"at": 59.9})) == {"t": "seek", "at": 60.0}


class Telling:
    """A source that tells as much as it can, or that fails."""

    def __init__(self, error: Exception | None = None) -> None:
        self.error, self.ended = error, False
        self.asked_for: list[Any] = []

    def hello(self) -> dict[str, Any]:
        return {"mode": "record"}

    def snapshot(self, _page: object) -> list[dict[str, Any]]:
        return [] if self.error else [{"t": "state", "at": 1.0}]

    async def run(self, pages: Pages) -> None:
        if self.error is not None:
            raise self.error
        try:
            for number in itertools.count():
                pages.tell({"t": "say", "text": str(number)})
                pages.tell({"t": "frame", "at": number}, "frame")
                await asyncio.sleep(0.0)
        finally:
            self.ended = True

    async def asked(self, _page: object, message: Any) -> list[Any]:
        self.asked_for.append(message)
        return []


def test_a_source_is_not_waited_for_keeps_little_and_ends_with_its_terminal() -> None:
    source = Telling()
    link = NearLink(source)  # type: ignore[arg-type]

    until(lambda: link._queue.qsize() >= MOST)
    found = list(link.messages(1.0))
    link.ask({"t": "seek", "at": 3.0})
    until(lambda: source.asked_for)
    link.close()

    assert [message["t"] for message in found[:2]] == ["hello", "state"]
    assert len(found) <= MOST + 1
    assert source.ended
    assert link._queue.qsize() <= MOST
    link.ask({"t": "seek", "at": 3.0})
    link.close()


def test_a_terminal_that_cannot_move_is_shown_all_once(monkeypatch: pytest.MonkeyPatch) -> None:
    for stream in (sys.stdin, sys.stdout):
        monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr(terminal_session, "_once", lambda *_: 7)

    assert watch_in_terminal(NearLink(Telling())) == 7  # type: ignore[arg-type]


def test_why_a_source_fails_is_told() -> None:
    link = NearLink(Telling(Problem("the record breaks off")))  # type: ignore[arg-type]

    with pytest.raises(Problem, match="breaks off"):
        watch_in_terminal(link)


@pytest.mark.parametrize(
    "message",
    [
        {"t": "state", "active": 5},
        {"t": "state", "faults": 3},
        {"t": "charts", "charts": 7},
    ],
)
def test_what_no_page_is_told_is_refused(message: dict[str, Any]) -> None:
    link = NearLink(Telling())  # type: ignore[arg-type]
    link.messages = lambda _: iter([message])  # type: ignore[method-assign]

    with pytest.raises(Problem, match="not what pages of this version are told"):
        watch_in_terminal(link)


@pytest.mark.parametrize(
    ("url", "socket"),
    [
        ("http://127.0.0.1:81/", "ws://127.0.0.1:81/ws"),
        ("https://robot:81", "wss://robot:81/ws"),
        ("ws://[::1]:81/ws", "ws://[::1]:81/ws"),
    ],
)
def test_the_socket_of_a_page_is_found_by_its_url(url: str, socket: str) -> None:
    assert socket_url(url) == socket
