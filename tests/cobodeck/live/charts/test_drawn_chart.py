"""The message of a chart: the picture of `render`, a shape for each node, what can be forced."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from threading import Thread
from typing import Any

import pytest
from hypothesis import given, settings

from behaviors.profile.profile import load_profile
from cobodeck.__main__ import main
from cobodeck.live.charts.drawer import Drawer
from cobodeck.live.charts.drawn_chart import chart_message, finding_message, picture_of
from cobodeck.live.charts.seen_chart import SeenNode, outcomes_at, path_of, seen_nodes
from cobodeck.project.library import findings_of, load_beside, reached
from cobodeck.project.names_in_values import known_names
from cobodeck.project.state_catalogue import shipped_charts
from cobodeck.setup.run_profile import with_values
from engine.chart.chart import Chart
from engine.chart.load import Library, load_text
from engine.draw.dot_text import dot
from engine.draw.layout import CannotRender, render
from engine.files.finding import Finding, Place
from engine.machine.machine import Machine
from engine.operator.commands import outcomes_of, output_types
from tests.cobodeck.live.known import known
from tests.engine.random_charts import charts, library
from tests.repeats import examples

CHARTS = sorted((file.stem for file in shipped_charts()), key=lambda name: name != "inform")
"""The small one first: of most properties it is the one that is not slow."""


@cache
def loaded(name: str, profile: str = "tuned") -> tuple[Chart, dict[str, Chart], Library]:
    file = next(file for file in shipped_charts() if file.stem == name)
    found = load_beside([file], known())
    applied = with_values(load_profile(profile), found, reached({name}, found))
    return applied[name], applied, found


def message(name: str, profile: str = "tuned", **options: Any) -> dict[str, Any]:
    chart, applied, _ = loaded(name, profile)
    given = {"interfaces": known().interfaces, "types": known().types, **options}
    return chart_message(chart, applied, load_profile(profile), **given)


@pytest.mark.few(1)
@pytest.mark.parametrize(
    ("name", "profile", "depth"),
    [("inform", "tuned", 0), ("cobodeck", "tuned", 0), ("paper_chase", "paper", -1)],
)
@pytest.mark.requirement(21)
def test_the_picture_is_that_of_render(name: str, profile: str, depth: int, tmp_path: Path) -> None:
    out = tmp_path / "chart.svg"
    given = ["render", name, "-o", str(out), "--depth", str(depth), "--profile", profile]
    assert main(given) == 0

    shown = message(name, profile, unfolded=frozenset() if depth == 0 else None)

    assert shown["svg"].encode() == out.read_bytes()


@pytest.mark.few(1)
@pytest.mark.parametrize("name", CHARTS)
def test_each_node_has_its_shape(name: str) -> None:
    shown = message(name)

    ids = set(re.findall(r' id="(?:a_)?s:([^"]*)"', shown["svg"]))

    assert shown["nodes"].keys() == ids


@settings(derandomize=True, deadline=None, max_examples=examples(24, least=4))
@given(charts())
@pytest.mark.slow
def test_each_node_of_any_chart_has_its_shape(value: Any) -> None:
    found = library(value)
    nodes = seen_nodes(found["main"], found, {})

    svg = render(dot(found["main"], found, None)).decode()

    assert {seen.path for seen in nodes} == set(re.findall(r' id="(?:a_)?s:([^"]*)"', svg))


@pytest.mark.slow
def test_used_charts_unfold_one_by_one() -> None:
    chart, applied, _ = loaded("cobodeck")
    svg, trouble = picture_of(chart, applied, load_profile("tuned"), {"chase"})

    ids = set(re.findall(r' id="(?:a_)?s:([^"]*)"', svg))

    assert not trouble
    assert any(path.startswith("chase/") for path in ids)
    assert not any(path.startswith("escape/") for path in ids)


@pytest.mark.few(1)
@pytest.mark.parametrize("name", CHARTS)
def test_what_is_told_of_outcomes_can_be_forced(name: str) -> None:
    """The same as the machine of a run allows, which is made without this code."""
    chart, applied, raw = loaded(name)
    if any(parameter.required for parameter in chart.parameters.values()):
        pytest.skip("cannot be run alone")
    around = replace(known_names(raw, known()), named=None)
    machine = Machine(chart, applied, known().interfaces, types=known().types, around=around)
    nodes = {
        seen.path: seen for seen in seen_nodes(chart, applied, load_profile("tuned").constants)
    }

    assert nodes.keys() == machine.vertices.keys()
    for path, vertex in machine.vertices.items():
        found = outcomes_at(nodes[path], applied, known().interfaces)
        assert found.keys() == outcomes_of(vertex), path
        for outcome, outputs in found.items():
            assert outputs.keys() == output_types(machine, vertex, outcome).keys(), (path, outcome)


@pytest.mark.requirement(21)
def test_values_are_those_in_force() -> None:
    nodes = message("paper_chase", "paper")["nodes"]

    told = {value for node in nodes.values() for value in node["values"].values()}

    assert told
    assert not any("$profile" in value for value in told)


def test_a_message_is_json() -> None:
    assert json.loads(json.dumps(message("inform")))["slot"] == 0


TEXT = """\
chart: main
outcomes: [done]
parameters:
  speed: {type: speed, default: 1 m/s, about: how fast}
  far: {type: length}
inputs:
  goal: {type: Pose2, about: where to}
  also: {type: Pose2, default: none}
any:
  guard: {watch: Nothing, next: {seen: .done}}
  work:
    states:
      first: {do: Say, with: {text: a}, next: {said: second}}
      second: {do: Say, with: {text: b}, next: {said: .done}}
    next: {done: .done}
    timeout: 5 s
"""


def main_nodes() -> tuple[Chart, list[SeenNode]]:
    found = load_text(TEXT, "main.yaml")
    assert not found.findings
    return found["main"], seen_nodes(found["main"], found, {})


@pytest.mark.parametrize(
    ("word", "path"),
    [
        ("watch: Nothing", "guard"),
        ("text: a", "work/first"),
        ("second:", "work/second"),
        ("next: {done", "work"),
        ("timeout: 5", "work"),
        ("outcomes:", ""),
        ("goal:", ""),
    ],
)
def test_a_finding_belongs_to_the_innermost_node_around_its_place(word: str, path: str) -> None:
    lines = TEXT.splitlines()
    line = next(n for n, text in enumerate(lines, 1) if word in text)
    column = lines[line - 1].index(word) + 1
    place = Place("main.yaml", line, column, column + 1)

    assert path_of(place, main_nodes()[1]) == path
    assert path_of(place._replace(file="other.yaml"), main_nodes()[1]) is None


def test_a_finding_in_a_used_chart_belongs_to_the_node_that_uses_it() -> None:
    chart, applied, _ = loaded("cobodeck")
    used = applied["chase"]
    nodes = seen_nodes(chart, applied, {})
    inner = next(node for node in used.root.walk() if node.name)

    at_name = Finding("X", "a message", Place(used.file, 2, 1, 2))
    at_node = Finding("X", "a message", used.place(inner.at))

    assert finding_message(at_name, nodes)["path"] == "chase"
    assert finding_message(at_node, nodes)["path"].startswith("chase/")


def test_every_finding_of_a_chart_full_of_mistakes_has_a_node(tmp_path: Path) -> None:
    file = tmp_path / "main.yaml"
    file.write_text(TEXT.replace("said", "sung"))
    found = load_beside([file], known())
    findings = findings_of(found, known(), [file])
    nodes = seen_nodes(found["main"], found, {})

    paths = [finding_message(finding, nodes)["path"] for finding in findings]

    assert {"guard", "work/first", "work/second"} <= set(paths)


def test_the_form_has_parameters_and_inputs_with_units_and_defaults() -> None:
    chart, _ = main_nodes()
    shown = chart_message(chart, {"main": chart}, load_profile("tuned"))

    form = {field["name"]: field for field in shown["form"]}

    assert [(field["name"], field["kind"]) for field in shown["form"]] == [
        ("speed", "parameter"), ("far", "parameter"), ("goal", "input"), ("also", "input"),
    ]  # fmt: skip
    assert form["speed"]["default"] == "1 m/s"
    assert form["speed"]["unit"] == "m/s"
    assert form["speed"]["about"] == "how fast"
    assert form["far"]["default"] is None
    assert form["goal"]["about"] == "where to"
    assert "x:" in form["goal"]["what"] or "Pose2" in form["goal"]["what"]


def test_a_breakpoint_is_told_and_changes_no_picture() -> None:
    chart, _ = main_nodes()
    broken = load_text(TEXT.replace("first: {", "first: {break: true, "), "main.yaml")["main"]
    plain = chart_message(chart, {"main": chart}, load_profile("tuned"))

    shown = chart_message(broken, {"main": broken}, load_profile("tuned"))

    assert shown["svg"] == plain["svg"]
    assert [path for path, node in shown["nodes"].items() if node["break"]] == ["work/first"]


@pytest.mark.slow
def test_a_picture_that_takes_too_long_is_ended_and_the_next_one_is_drawn() -> None:
    drawer = Drawer(patience_s=1e-6)
    with pytest.raises(CannotRender, match="is not ready after 1e-06 s"):
        drawer.svg("digraph {a}")
    drawer = Drawer()
    assert "<svg" in drawer.svg("digraph {a -> b}")
    first = drawer._child
    with pytest.raises(CannotRender):
        drawer.svg("digraph {{{")
    assert "<svg" in drawer.svg("digraph {a -> b}")
    assert drawer._child is first

    drawer.stop()

    assert "<svg" in drawer.svg("digraph {a -> b}")
    assert drawer._child is not first
    drawer.close()


@pytest.mark.slow
def test_a_picture_that_is_stopped_fails_and_the_next_one_is_drawn() -> None:
    drawer, told = Drawer(), list[str]()
    large = "".join(f"n{a} -> n{a * b % 997};" for a in range(997) for b in (2, 3, 5))

    def draw() -> None:
        with pytest.raises(CannotRender) as found:
            drawer.svg(f"digraph {{{large}}}")
        told.append(str(found.value))

    drawing = Thread(target=draw)
    drawing.start()
    while drawing.is_alive():
        drawer.stop()
        drawing.join(0.01)

    assert "has ended" in told[0]
    assert "<svg" in drawer.svg("digraph {a -> b}")
    drawer.close()
