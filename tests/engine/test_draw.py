"""Pictures of charts: what is in the text, and that Graphviz reads it as meant."""

from __future__ import annotations

import stat
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pygraphviz
import pytest
from hypothesis import given, settings

from engine.chart import Chart, Node
from engine.draw.dot import FILE_FORMS, Active, CannotRender, dot, render
from engine.draw.mermaid import mermaid
from engine.draw.picture import picture
from engine.load import Library, load_files, load_text
from tests.engine.random_charts import charts, library

GOLDEN = Path(__file__).parent / "golden"
LIT = Active({"chase/danger", "chase/follow/drive"}, ("chase/danger", "required"))
TEXTS: dict[str, tuple[str, int | None, Active | None]] = {
    "chase": ("chase", 0, None),
    "nested": ("nested", 0, None),
    "cobodeck": ("cobodeck", 0, None),
    "cobodeck_expanded": ("cobodeck", None, None),
    "cobodeck_active": ("cobodeck", 1, LIT),
}


def shipped() -> Library:
    found = load_files(sorted(GOLDEN.glob("*.yaml")))
    assert not found.findings
    return found


def golden_texts() -> dict[str, str]:
    known = shipped()
    texts = {f"{name}.dot": dot(known[c], known, d, a) for name, (c, d, a) in TEXTS.items()}
    return texts | {"nested.mmd": mermaid(known["nested"], known)}


def update_golden() -> None:
    """`python -m tests.engine.test_draw` writes the texts anew; look at the difference."""
    for name, text in golden_texts().items():
        (GOLDEN / name).write_text(text, encoding="utf-8")


@pytest.mark.parametrize("name", [*(f"{name}.dot" for name in TEXTS), "nested.mmd"])
def test_texts_are_as_they_were(name: str, request: pytest.FixtureRequest) -> None:
    if request.config.getoption("--update-golden", default=False):
        update_golden()
    assert golden_texts()[name] == (GOLDEN / name).read_text(encoding="utf-8")


def one(text: str) -> tuple[Chart, Library]:
    found = load_text(text)
    return next(iter(found.values())), found


def drawn(text: str) -> pygraphviz.AGraph:
    chart, known = one(text)
    return pygraphviz.AGraph(string=dot(chart, known))


def members(graph: pygraphviz.AGraph) -> dict[str, set[str]]:
    """Box path to the shapes that Graphviz sees directly inside, not in a box further in."""
    boxes = {box.name: box for box in graph.subgraphs() if (box.name or "").startswith("cluster")}
    found = {}
    for name, box in boxes.items():
        inner = {n for sub in box.subgraphs() if "cluster" in (sub.name or "") for n in sub}
        found[name.removeprefix("cluster_")] = set(box.nodes()) - inner
        found |= members(box)
    return found


def written(node: Node, path: str = "") -> dict[str, set[str]]:
    """Box path to the paths of its leaves, as the chart says it."""
    found: dict[str, set[str]] = {path: set()}
    for child in node.children:
        below = f"{path}/{child.name}" if path else child.name
        if child.children:
            found |= written(child, below)
        else:
            found[path].add(below)
    return found


@settings(derandomize=True, deadline=None, max_examples=60)
@given(charts())
def test_every_shape_stands_in_its_own_box_and_none_outside(value: Any) -> None:
    known = library(value)
    graph = pygraphviz.AGraph(string=dot(known["main"], known))
    seen = members(graph)
    assert {path: {n for n in names if ":" not in n} for path, names in seen.items()} == written(
        known["main"].root
    )
    for path, names in seen.items():
        assert all(n.rpartition(":")[0] == path for n in names if ":" in n)
    assert set(graph.nodes()) == set().union(*seen.values())


def test_an_edge_written_early_would_take_its_head_along() -> None:
    text = 'digraph { subgraph "cluster_" { subgraph "cluster_a" { x; x -> y } y } }'
    assert members(pygraphviz.AGraph(string=text))["a"] == {"x", "y"}


def ways(node: Node, path: str = "") -> set[tuple[str, str]]:
    """Path and outcome of everything the chart's `next` says about leaves."""
    found = set()
    for child in node.children:
        below = f"{path}/{child.name}" if path else child.name
        found |= {(below, outcome) for outcome in child.next}
        found |= ways(child, below)
    return found


@settings(derandomize=True, deadline=None, max_examples=60)
@given(charts())
def test_every_way_in_next_has_its_edge(value: Any) -> None:
    known = library(value)
    graph = pygraphviz.AGraph(string=dot(known["main"], known))
    ids = [edge.attr["id"] for edge in graph.edges() if edge.attr["id"]]
    assert len(ids) == len(set(ids))
    seen = set()
    for name in ids:
        path, _, outcomes = name.removeprefix("t:").rpartition(":")
        seen |= {(path, outcome) for outcome in outcomes.split("|")}
    assert ways(known["main"].root) <= seen


@settings(derandomize=True, deadline=None, max_examples=15)
@given(charts())
def test_graphviz_and_mermaid_take_whatever_is_drawn(value: Any) -> None:
    known = library(value)
    ElementTree.fromstring(render(dot(known["main"], known, None)))
    text = mermaid(known["main"], known, None)
    assert text.count("subgraph ") == sum(line.strip() == "end" for line in text.splitlines())


SIMPLE = """\
chart: simple
outcomes: [done, failed]
any:
  guard: {watch: Near, next: {near: .failed}}
  work:
    states:
      go: {do: Drive, with: {speed: 1 m/s}, timeout: 5 s,
           next: {arrived: see, blocked: see, timeout: see, error: .failed}}
      see: {watch: Near, retry: {times: 2, on: far, wait: 1 s}, next: {near: .done, far: go}}
"""


def test_actions_are_solid_green_and_monitors_dashed_amber() -> None:
    graph = drawn(SIMPLE)
    action, monitor = graph.get_node("work/go"), graph.get_node("guard")
    assert (action.attr["style"], action.attr["color"]) == ("rounded,filled", "#2e7d32")
    assert (monitor.attr["style"], monitor.attr["color"]) == ("rounded,filled,dashed", "#c77700")


def test_class_and_parameters_stand_small_under_the_name() -> None:
    graph = drawn(SIMPLE)
    label = graph.get_node("work/go").attr["label"]
    assert label.startswith("<B>go</B><BR/><FONT POINT-SIZE=")
    assert "Drive</FONT>" in label
    assert "speed: 1 m/s</FONT>" in label
    assert "retry: 2 on far after 1 s" in graph.get_node("work/see").attr["label"]


def test_edges_with_one_target_are_one_and_alarms_in_it_are_red() -> None:
    graph = drawn(SIMPLE)
    edges = [e for e in graph.edges() if e == ("work/go", "work/see")]
    assert len(edges) == 1
    label = edges[0].attr["label"]
    assert "arrived | blocked | " in label
    assert '<FONT COLOR="#c62828">timeout 5 s</FONT>' in label
    assert edges[0].attr["color"] == "#52606d"


@pytest.mark.parametrize(
    ("tail", "head"),
    [("guard", ":failed"), ("work/go", "work:failed"), ("work:failed", ":failed")],
)
def test_edges_of_guards_and_errors_are_red_up_to_the_end(tail: str, head: str) -> None:
    graph = drawn(SIMPLE)
    assert graph.get_edge(tail, head).attr["color"] == "#c62828"


def test_edges_to_a_pin_have_no_arrow_and_those_from_it_have() -> None:
    graph = drawn(SIMPLE)
    assert graph.get_edge("work/go", "work:failed").attr["arrowhead"] == "none"
    assert graph.get_edge("work:failed", ":failed").attr["arrowhead"] in ("", "normal", None)


def test_outcomes_of_the_chart_have_a_double_border() -> None:
    graph = drawn(SIMPLE)
    assert graph.get_node(":done").attr["peripheries"] == "2"
    assert graph.get_node("work:done").attr["peripheries"] in ("", "1", None)


def test_a_box_hands_on_what_its_next_does_not_name() -> None:
    edges = {(e.tail, e.head) for e in picture(*one(SIMPLE)).edges}
    assert ("work:done", ":done") in edges


def test_conditions_stand_on_the_pin_they_lead_to() -> None:
    known = shipped()
    graph = pygraphviz.AGraph(string=dot(known["nested"], known))
    half, done = graph.get_node("work/serve:half"), graph.get_node("work/prepare:done")
    assert "if lift done and look failed" in half.attr["label"]
    assert "if lift failed and look seen" in half.attr["label"]
    assert "all have ended" in done.attr["label"]


def test_depth_counts_the_charts_that_are_opened() -> None:
    known = shipped()
    closed = pygraphviz.AGraph(string=dot(known["cobodeck"], known, 0))
    opened = pygraphviz.AGraph(string=dot(known["cobodeck"], known, 1))
    assert {"chase", "haptic", "escape", "inform"} <= set(closed.nodes())
    assert "chase/follow/drive" in opened.nodes()
    assert "chase" not in opened.nodes()
    assert dot(known["cobodeck"], known, 1) == dot(known["cobodeck"], known, None)


def test_a_chart_that_uses_itself_is_opened_once() -> None:
    text = "chart: a\noutcomes: [x]\nstates:\n  again: {use: a, next: {x: .x}}\n"
    assert '"again"' in dot(*one(text), None)


@pytest.mark.parametrize("target", ["nowhere", "."])
def test_a_target_that_does_not_exist_does_not_stop_the_picture(target: str) -> None:
    text = f'chart: a\noutcomes: [x]\nstates:\n  s: {{use: b, next: {{x: "{target}"}}}}\n'
    assert b"<svg" in render(dot(*one(text)))


TEXT = """\
chart: a
about: {about}
outcomes: []
states:
  s: {{do: X, about: {about}, with: {{p: {about}}}}}
"""


def test_signs_of_markup_come_out_as_they_are() -> None:
    svg = render(dot(*one(TEXT.format(about=r"""'<b> & "quoted" \\N \G'""")))).decode()
    shown = "".join(ElementTree.fromstring(svg).itertext()).replace("\xa0", " ")
    assert shown.count(r"""<b> & "quoted" \\N \G""") == 2


def test_control_characters_do_not_break_the_picture() -> None:
    assert b"<svg" in render(dot(*one(TEXT.format(about=r'"\x01\n\t\u202e"'))))


def test_active_paths_and_their_boxes_are_lit_and_the_last_way_is_bold_to_its_end() -> None:
    known = shipped()
    graph = pygraphviz.AGraph(string=dot(known["cobodeck"], known, None, LIT))
    assert graph.get_node("chase/danger").attr["fillcolor"] == "#ffd166"
    assert graph.get_node("chase/request").attr["fillcolor"] == "#fff6e0"
    bold = {(e[0], e[1]) for e in graph.edges() if e.attr["penwidth"] == "3"}
    assert bold == {
        ("chase/danger", "chase:escape_required"),
        ("chase:escape_required", "escape:"),
    }
    closed = pygraphviz.AGraph(string=dot(known["cobodeck"], known, 0, LIT))
    assert closed.get_node("chase").attr["fillcolor"] == "#9cc7f5"


def test_svg_carries_the_ids_that_a_page_lights() -> None:
    known = shipped()
    root = ElementTree.fromstring(render(dot(known["chase"], known)))
    ids = {element.get("id") for element in root.iter()}
    assert {"s:follow", "s:follow/drive", "o:follow:failed", "t:danger:required"} <= ids


@pytest.mark.parametrize("form", FILE_FORMS)
def test_pictures_are_made_without_a_dot_program(
    form: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    starts = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}
    assert render(dot(*one(SIMPLE)), form).startswith(starts[form])


def test_a_dot_program_serves_where_pygraphviz_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    program = tmp_path / "dot"
    program.write_text('#!/bin/sh\necho "made with $*"\n')
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    assert render("digraph {}", "pdf") == b"made with -Kdot -Tpdf\n"


def test_what_a_dot_program_complains_of_is_passed_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    program = tmp_path / "dot"
    program.write_text("#!/bin/sh\necho 'syntax error in line 1' >&2\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    with pytest.raises(CannotRender, match="syntax error in line 1"):
        render("digraph {", "svg")


def test_without_any_graphviz_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setitem(sys.modules, "pygraphviz", None)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(CannotRender, match="pip install pygraphviz"):
        render("digraph {}")


def test_drawing_text_needs_no_graphviz() -> None:
    code = "import sys, engine.draw.dot, engine.draw.mermaid; sys.exit('pygraphviz' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


if __name__ == "__main__":
    update_golden()
