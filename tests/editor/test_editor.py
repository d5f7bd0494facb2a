"""What somebody who edits a chart sees, tried with the real language server (see README.md)."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from engine.schema.document import schema_text
from engine.types import Type
from tests.editor.language_server import LanguageServer
from tests.engine.random_charts import INTERFACES, Spot, library

pytestmark = pytest.mark.slow

PLACE = Path(os.environ.get("EDITOR_TRIAL", Path(__file__).parents[2] / "out" / "editor"))
PROGRAM = PLACE / "node_modules" / "yaml-language-server" / "bin" / "yaml-language-server"
HEAD = "# yaml-language-server: $schema=chart.schema.json\nchart: main\noutcomes: [done]\n"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LanguageServer]:
    if shutil.which("node") is None:
        pytest.skip("no `node` on the PATH")
    if not PROGRAM.is_file():
        pytest.skip(
            f"no yaml-language-server in {PLACE}; tests/editor/README.md says how to get it"
        )
    folder = tmp_path_factory.mktemp("charts")
    text = schema_text(INTERFACES, library(), {"Spot": Type("Spot", python=Spot)})
    (folder / "chart.schema.json").write_text(text, encoding="utf-8")
    with LanguageServer(PROGRAM, folder) as running:
        yield running


class Seen:
    """A chart in the editor; `‸` in it is where the cursor stands."""

    def __init__(self, server: LanguageServer, name: str, body: str) -> None:
        text = HEAD + body
        before = text.split("‸", maxsplit=1)[0]
        self.server, self.name = server, name
        self.line, self.column = before.count("\n"), len(before) - before.rfind("\n") - 1
        self.lines = text.replace("‸", "").splitlines()
        self.diagnostics = server.open(name, text.replace("‸", ""))

    @property
    def offered(self) -> dict[str, dict[str, Any]]:
        """What is offered at the cursor, by label."""
        items = self.server.complete(self.name, self.line, self.column)
        labels = [item["label"] for item in items]
        assert len(set(labels)) == len(labels), f"offered twice: {sorted(labels)}"
        return {item["label"]: item for item in items}

    @property
    def hover(self) -> str:
        return self.server.hover(self.name, self.line, self.column)

    @property
    def underlined(self) -> list[tuple[str, str]]:
        """The underlined words and what is said about them."""
        found = []
        for diagnostic in self.diagnostics:
            start, end = diagnostic["range"]["start"], diagnostic["range"]["end"]
            word = self.lines[start["line"]][start["character"] : end["character"]]
            found.append((word, diagnostic["message"]))
        return found


RIGHT = """\
any:
  near: {watch: Near, with: {distance: 1 m}, priority: 2, next: {near: .done, far: .done}}
  work:
    states:
      go: {do: Drive, in: {goal: g}, with: {speed: $pace}, timeout: 5 s,
           next: {arrived: help, blocked: go, timeout: go, error: .done}}
      help: {use: helper, with: {reach: 20 cm}, in: {goal: g}, next: {done: .done, failed: go}}
"""


def test_nothing_is_underlined_in_a_right_chart(server: LanguageServer) -> None:
    assert Seen(server, "right.yaml", RIGHT).underlined == []


def test_an_empty_node_offers_every_key_and_ready_made_nodes(server: LanguageServer) -> None:
    seen = Seen(server, "empty.yaml", "states:\n  a:\n    ‸\n")
    assert {"do", "watch", "use", "states", "any", "all", "next", "timeout"} <= seen.offered.keys()
    assert {"action", "monitor", "guarded"} <= seen.offered.keys()


def test_do_offers_actions_with_their_docstrings(server: LanguageServer) -> None:
    offered = Seen(server, "do.yaml", "states:\n  a:\n    do: ‸\n").offered
    assert offered.keys() == {"Drive", "Say"}
    assert "Drives to `goal`." in str(offered["Drive"]["documentation"])


def test_watch_offers_monitors_and_use_charts(server: LanguageServer) -> None:
    watch = Seen(server, "watch.yaml", "any:\n  a:\n    watch: ‸\n").offered
    assert watch.keys() == {"Near", "Tripped"}
    assert Seen(server, "use.yaml", "any:\n  a: {use: ‸}\n").offered.keys() == {"helper"}


def test_with_offers_the_parameters_of_the_class(server: LanguageServer) -> None:
    body = "states:\n  a:\n    do: Say\n    next: {said: a}\n    with:\n      text: x\n      ‸\n"
    assert Seen(server, "with.yaml", body).offered.keys() == {"loud", "times"}


def test_a_parameter_offers_its_choices(server: LanguageServer) -> None:
    body = "states:\n  a:\n    do: Drive\n    with:\n      speed: 1 m/s\n      mode: ‸\n"
    assert {"fast", "safe"} == Seen(server, "mode.yaml", body).offered.keys()


NEXT = "states:\n  a:\n    do: Drive\n    in: {goal: g}\n    with: {speed: 1}\n"


def test_next_offers_the_outcomes_of_the_class(server: LanguageServer) -> None:
    offered = Seen(server, "next.yaml", f"{NEXT}    next:\n      ‸\n").offered
    assert offered.keys() == {"arrived", "blocked", "error"}
    limited = Seen(server, "limit.yaml", f"{NEXT}    timeout: 5 s\n    next:\n      ‸\n").offered
    assert limited.keys() == {"arrived", "blocked", "error", "timeout"}


def test_a_missing_outcome_is_underlined_at_next(server: LanguageServer) -> None:
    seen = Seen(server, "missing.yaml", f"{NEXT}    next: {{arrived: .done}}\n")
    assert seen.underlined == [("next", 'Missing property "blocked".')]


def test_a_node_that_leads_nowhere_is_underlined_at_its_name(server: LanguageServer) -> None:
    assert Seen(server, "nowhere.yaml", NEXT).underlined == [("a", 'Missing property "next".')]


def test_kept_outcomes_need_no_way_out(server: LanguageServer) -> None:
    assert Seen(server, "kept.yaml", NEXT.replace("states", "all")).underlined == []


@pytest.mark.parametrize(
    ("name", "body", "word", "said"),
    [
        ("class", "states:\n  a: {do: Drove}\n", "Drove", 'Valid values: "Drive", "Say"'),
        (
            "key",
            f"{NEXT}    nxt: {{}}\n    next: {{arrived: a, blocked: a}}\n",
            "nxt",
            "not allowed",
        ),
        ("unit", NEXT.replace("1}", "5 s}"), "5 s", "Wanted: speed, in m/s"),
        ("sideways", "any:\n  a: {watch: Tripped, next: {tripped: b}}\n", "b", "Wanted: `.x`"),
        ("form", "states:\n  a: {next: {x: a}}\n", "a", 'Missing property "do"'),
    ],
)
def test_a_mistake_is_underlined_where_it_stands_and_the_message_says_what_is_right(
    server: LanguageServer, name: str, body: str, word: str, said: str
) -> None:
    underlined = Seen(server, f"wrong_{name}.yaml", body).underlined
    assert [(w, m) for w, m in underlined if w == word and said in m]


def test_two_mistakes_are_two_lines_and_no_more(server: LanguageServer) -> None:
    body = f"{NEXT}    nxt: {{}}\n    next: {{arrived: .done}}\n"
    assert sorted(word for word, _ in Seen(server, "two.yaml", body).underlined) == ["next", "nxt"]


def test_a_class_shows_its_docstring(server: LanguageServer) -> None:
    hover = Seen(server, "hover.yaml", NEXT.replace("Drive", "Dr‸ive")).hover
    assert hover.startswith("#### Drive\n\nDrives to `goal`.")


def test_a_parameter_shows_its_units_and_default(server: LanguageServer) -> None:
    hover = Seen(server, "hover_with.yaml", NEXT.replace("speed", "sp‸eed")).hover
    assert "m/s, cm/s, mm/s, km/h" in hover
    body = "states:\n  a:\n    do: Say\n    with: {text: x, ti‸mes: 2}\n"
    assert "Default: 1." in Seen(server, "hover_default.yaml", body).hover


def test_a_key_of_the_language_shows_what_it_means(server: LanguageServer) -> None:
    hover = Seen(server, "hover_key.yaml", f"{NEXT}    time‸out: 5 s\n").hover
    assert hover.startswith("Give up after this long")
