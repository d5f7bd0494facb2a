"""What somebody who edits a chart sees, tried with the real language server (see README.md)."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from engine.schema.document import schema_text
from engine.types import Type
from tests.editor.language_server import LanguageServer
from tests.editor.seen import Seen, running_server
from tests.engine.random_charts import INTERFACES, Spot, library

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LanguageServer]:
    text = schema_text(INTERFACES, library(), {"Spot": Type("Spot", python=Spot)})
    yield from running_server(tmp_path_factory.mktemp("charts"), text)


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
