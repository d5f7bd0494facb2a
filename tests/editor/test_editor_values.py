"""What somebody sees who edits values of a chart: literals, places, signals, constants."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from engine.schema.document import schema_text
from tests.editor.language_server import LanguageServer
from tests.editor.seen import Seen, running_server
from tests.engine.schema.naming_states import CONSTANTS, INTERFACES, NAMES, RIGHT, SIGNALS, TYPES

pytestmark = pytest.mark.slow

EXCEEDS = "any:\n  a:\n    watch: Exceeds\n    with:\n"
VISIT = "states:\n  a:\n    do: Visit\n"
CHOOSE = "states:\n  a: {do: Choose}\n"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LanguageServer]:
    text = schema_text(INTERFACES, {}, TYPES, SIGNALS, CONSTANTS, NAMES)
    yield from running_server(tmp_path_factory.mktemp("charts"), text)


def test_nothing_is_underlined_in_a_right_chart(server: LanguageServer) -> None:
    body = RIGHT.split("\n", maxsplit=2)[2]
    assert Seen(server, "right.yaml", body).underlined == []


def test_a_parameter_that_names_a_signal_offers_those_of_its_type(server: LanguageServer) -> None:
    offered = Seen(server, "signal.yaml", f"{EXCEEDS}      signal: ‸\n").offered
    assert offered.keys() == {"tank.level", "tank.share"}
    assert offered["tank.level"]["documentation"] == "length, how full the tank is"


def test_a_signal_shows_what_it_is(server: LanguageServer) -> None:
    hover = Seen(server, "hover_signal.yaml", f"{EXCEEDS}      signal: tank‸.level\n").hover
    assert "`tank.level`: length, how full the tank is" in hover


def test_a_keyword_of_python_is_offered_as_charts_write_it(server: LanguageServer) -> None:
    offered = Seen(server, "for.yaml", f"{EXCEEDS}      signal: tank.level\n      ‸\n").offered
    assert offered.keys() == {"for", "limit", "older"}


def test_inputs_are_offered_once_and_parameters_not_among_them(server: LanguageServer) -> None:
    assert Seen(server, "in.yaml", f"{VISIT}    in:\n      ‸\n").offered.keys() == {"posts"}


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("with", f"{VISIT}    with:\n      home:\n        ‸\n"),
        ("default", "inputs:\n  p:\n    type: Post\n    default:\n      ‸\n" + CHOOSE),
        ("initial", "data:\n  p:\n    type: Post | none\n    initial:\n      ‸\n" + CHOOSE),
    ],
)
def test_a_literal_offers_its_fields_and_its_place(
    server: LanguageServer, name: str, body: str
) -> None:
    offered = Seen(server, f"literal_{name}.yaml", body).offered
    assert {"x", "y", "yaw", "place"} <= offered.keys()


@pytest.mark.parametrize(
    ("name", "body"),
    [
        ("in", f"{VISIT}    in:\n      posts:\n        - ‸\n"),
        ("initial", "data:\n  p:\n    type: list of Post\n    initial:\n      - ‸\n" + CHOOSE),
    ],
)
def test_an_item_of_a_list_offers_its_fields(server: LanguageServer, name: str, body: str) -> None:
    offered = Seen(server, f"list_{name}.yaml", body).offered
    assert offered.keys() == {"x", "y", "yaw", "place"}


def test_an_empty_value_offers_its_ways_to_be_written(server: LanguageServer) -> None:
    offered = Seen(server, "ways.yaml", f"{VISIT}    with:\n      home: ‸\n").offered
    assert {"{x, y, yaw}", "{place}"} <= offered.keys()


def test_places_are_offered_by_name(server: LanguageServer) -> None:
    body = f"{VISIT}    with:\n      home: {{place: ‸}}\n"
    assert Seen(server, "place.yaml", body).offered.keys() == {"dock", "kitchen"}


@pytest.mark.parametrize(
    ("name", "body", "constant"),
    [
        ("for", f"{EXCEEDS}      for: ‸\n", "$profile.tank.wait"),
        ("timeout", "states:\n  a:\n    do: Choose\n    timeout: ‸\n", "$profile.tank.wait"),
        (
            "default",
            "parameters:\n  p:\n    type: length\n    default: ‸\n" + CHOOSE,
            "$profile.tank.full",
        ),
    ],
)
def test_constants_of_the_dimension_are_offered_with_their_values(
    server: LanguageServer, name: str, body: str, constant: str
) -> None:
    offered = Seen(server, f"constant_{name}.yaml", body).offered
    assert [label for label in offered if label.startswith("$")] == [constant]
    assert offered[constant]["documentation"] == CONSTANTS[constant[1:]]
    assert offered[constant]["insertText"] == f"\\{constant}"  # a snippet, in which $ is escaped


def test_a_signal_is_offered_as_a_default(server: LanguageServer) -> None:
    body = "parameters:\n  p:\n    type: signal of length\n    default: ‸\n" + CHOOSE
    assert {"tank.level", "door.state"} <= Seen(server, "gauge.yaml", body).offered.keys()


@pytest.mark.parametrize(
    ("name", "body", "said"),
    [
        ("x", f"{VISIT}    with: {{home: {{‸x: 1}}}}\n", "A length, in mm, cm, m, km"),
        ("yaw", f"{VISIT}    with: {{home: {{ya‸w: 1}}}}\n", "It may be left out."),
        ("place", f"{VISIT}    with: {{home: {{pl‸ace: dock}}}}\n", "A place by name"),
        ("posts", f"{VISIT}    in: {{po‸sts: p}}\n", "A data key that holds a list of Post, or"),
        ("pause", f"{VISIT}    in: {{pa‸use: p}}\n", "read from a data key when the node is ent"),
        ("limit", f"{EXCEEDS}      li‸mit: 3\n", "in the unit of what it goes with"),
    ],
)
def test_a_part_of_a_value_shows_what_it_is(
    server: LanguageServer, name: str, body: str, said: str
) -> None:
    assert said in Seen(server, f"hover_{name}.yaml", body).hover


@pytest.mark.parametrize(
    ("name", "body", "word", "said"),
    [
        ("unit", f"{VISIT}    with: {{home: {{x: 1 deg, y: 1}}}}\n", "1 deg", "Wanted: length"),
        ("field", f"{VISIT}    with: {{home: {{x: 1, y: 1, z: 1}}}}\n", "z", "not allowed"),
        ("missing", f"{VISIT}    with: {{home: {{x: 1}}}}\n", "home", 'Missing property "y"'),
        ("both", f"{VISIT}    with: {{home: {{place: dock, x: 1}}}}\n", "x", "not allowed"),
        (
            "signal",
            f"{EXCEEDS}      signal: tnk.level\n",
            "tnk.level",
            'Valid values: "tank.level"',
        ),
        ("for_", f"{EXCEEDS}      for_: 3\n", "for_", "not allowed"),
        ("text", f"{VISIT}    in: {{pause: for ever}}\n", "for ever", "stands under `with`"),
        ("initial", "data: {p: {type: length, initial: 3 s}}\n" + CHOOSE, "3 s", "Wanted: length"),
        (
            "parameter",
            "data: {p: {type: length, initial: $n}}\n" + CHOOSE,
            "$n",
            "a $name with dots",
        ),
    ],
)
def test_a_mistake_in_a_value_is_underlined_where_it_stands(
    server: LanguageServer, name: str, body: str, word: str, said: str
) -> None:
    underlined = Seen(server, f"wrong_{name}.yaml", body).underlined
    assert [(w, m) for w, m in underlined if w == word and said in m], underlined


def test_outcomes_that_a_parameter_names_are_no_mistakes(server: LanguageServer) -> None:
    body = (
        "states:\n  a: {do: Choose, with: {cases: [tea]}, in: {word: w}, "
        "autonomy: {tea: low}, next: {tea: .done, other: .done}}\n"
    )
    assert Seen(server, "cases.yaml", body).underlined == []
    offered = Seen(
        server, "next.yaml", "states:\n  a:\n    do: Choose\n    next:\n      ‸\n"
    ).offered
    assert offered.keys() == {"other", "error"}
