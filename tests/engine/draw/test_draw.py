"""Pictures of charts: what is in the text, and that Graphviz reads it as meant."""

from __future__ import annotations

import itertools
import re
import stat
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import pygraphviz
import pytest
from hypothesis import given, settings

from engine.chart.chart import Chart, Node
from engine.chart.load import Library, load_files, load_text
from engine.draw.chart_shapes import BoxShape, LeafShape, Shape
from engine.draw.dot_text import Active, dot
from engine.draw.layout import FILE_FORMS, CannotRender, render
from engine.draw.mermaid_text import mermaid
from engine.draw.picture import picture
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
    """`python -m tests.engine.draw.test_draw` writes the texts anew; look at the difference."""
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


def leaves(node: Node, path: str = "") -> set[str]:
    """The paths of all leaves, as the chart says it."""
    found: set[str] = set()
    for child in node.children:
        below = f"{path}/{child.name}" if path else child.name
        found |= leaves(child, below) if child.children else {below}
    return found


def home(shape: str) -> str:
    """The box in which a shape has to stand: labels start with `l:`, pins hold a colon."""
    path, colon, _ = shape.removeprefix("l:").partition(":")
    return path if colon and not shape.startswith("l:") else path.rpartition("/")[0]


@settings(derandomize=True, deadline=None, max_examples=60)
@given(charts())
def test_every_shape_stands_in_its_own_box_and_none_outside(value: Any) -> None:
    known = library(value)
    graph = pygraphviz.AGraph(string=dot(known["main"], known))
    seen = members(graph)
    assert {name: path for path, names in seen.items() for name in names} == {
        name: home(name) for name in graph.nodes()
    }


@settings(derandomize=True, deadline=None, max_examples=30)
@given(charts())
def test_every_leaf_is_a_shape_or_a_row_and_no_id_comes_twice(value: Any) -> None:
    known = library(value)
    ids = ids_of(render(dot(known["main"], known)))
    assert len(ids) == len(set(ids))
    assert leaves(known["main"].root) <= {i.removeprefix("a_").removeprefix("s:") for i in ids}


def ids_of(svg: bytes) -> list[str]:
    return [name for element in ElementTree.fromstring(svg).iter() if (name := element.get("id"))]


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


def said_in_rows(shape: Shape) -> set[tuple[str, str]]:
    """Path and outcome of all that rows say about how they end their container."""
    rows = () if isinstance(shape, LeafShape) else shape.rows
    inside = shape.members if isinstance(shape, BoxShape) else ()
    found = set().union(*map(said_in_rows, (*rows, *inside)))
    return found | {
        (row.path, label.text.split()[0])
        for row in rows
        for ending in row.endings
        for label in ending.labels
    }


@settings(derandomize=True, deadline=None, max_examples=60)
@given(charts())
def test_every_way_in_next_has_its_edge_or_is_said_in_a_row(value: Any) -> None:
    known = library(value)
    graph = pygraphviz.AGraph(string=dot(known["main"], known))
    ids = [edge.attr["id"] for edge in graph.edges() if edge.attr["id"]]
    assert len(ids) == len(set(ids))
    drawn_ways = set()
    for name in ids:
        path, _, outcomes = name.partition(":")[2].rpartition(":")
        drawn_ways |= {(path, outcome) for outcome in outcomes.split("|")}
    said = said_in_rows(picture(known["main"], known).root)
    assert not said & drawn_ways
    assert ways(known["main"].root) <= said | drawn_ways


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


ACTION, MONITOR, GREY, RED, AMBER = "#2e7d32", "#c77700", "#6b7785", "#c62828", "#b26a00"


def row(graph: pygraphviz.AGraph, path: str) -> str:
    """The cell of a row, wherever it stands."""
    found = re.search(rf'<TD ID="s:{path}"[^>]*>.*?</TD>', graph.string())
    assert found is not None
    return found[0]


def boxes(graph: pygraphviz.AGraph) -> list[pygraphviz.AGraph]:
    return [box for sub in graph.subgraphs() for box in (sub, *boxes(sub))]


def label_of(graph: pygraphviz.AGraph, name: str) -> str:
    return str(graph.get_node(f"l:{name}").attr["label"])


def test_actions_are_solid_green_and_monitors_dashed_amber() -> None:
    graph = drawn(SIMPLE)
    for path, style, color in (("work/go", "rounded", ACTION), ("work/see", "dashed", MONITOR)):
        shape = graph.get_node(path)
        assert style in shape.attr["style"]
        assert shape.attr["color"] == color
    assert f'STYLE="rounded,dashed" COLOR="{MONITOR}"' in row(graph, "guard")


def test_class_and_parameters_stand_small_under_the_name() -> None:
    graph = drawn(SIMPLE)
    label = graph.get_node("work/go").attr["label"]
    assert label.startswith("<B>go</B><BR/><FONT POINT-SIZE=")
    assert "Drive</FONT>" in label
    assert "speed: 1 m/s</FONT>" in label
    assert "retry: 2 on far after 1 s" in graph.get_node("work/see").attr["label"]


def test_edges_with_one_target_are_one_and_time_limits_in_it_are_italic_not_red() -> None:
    graph = drawn(SIMPLE)
    name = "work/go:arrived|blocked|timeout"
    assert label_of(graph, name) == "arrived | blocked | <I>timeout 5 s</I>"
    ids = {e.attr["id"] for e in graph.edges() if "work/go:" in (e.attr["id"] or "")}
    assert ids == {f"{half}:{way}" for half in "ht" for way in (name, "work/go:error")}
    assert edge_named(graph, f"t:{name}").attr["color"] in ("", None, "#52606d")


def test_a_time_limit_alone_is_dotted_and_has_no_colour() -> None:
    text = "chart: a\noutcomes: []\nstates:\n  s: {do: X, timeout: 5 s, next: {timeout: t}}\n"
    graph = drawn(text + "  t: {do: X}\n")
    halves = [e for e in graph.edges() if e.attr["id"]]
    assert len(halves) == 2
    assert {e.attr["style"] for e in halves} == {"dotted"}
    assert {e.attr["color"] for e in halves} <= {"", None, "#52606d"}


def test_only_what_errors_lead_to_is_red() -> None:
    graph = drawn(SIMPLE)
    assert f'<FONT COLOR="{RED}">error</FONT>' in label_of(graph, "work/go:error")
    assert edge_named(graph, "t:work/go:error").attr["color"] == RED
    assert RED not in row(graph, "guard")
    assert graph.get_node(":failed").attr["color"] == GREY  # the guard leads there, too
    red = {e.attr["id"] for e in graph.edges() if e.attr["color"] == RED}
    assert red == {"h:work/go:error", "t:work/go:error", "t:work:failed"}
    assert graph.get_node("work:failed").attr["color"] == RED


def edge_named(graph: pygraphviz.AGraph, name: str) -> pygraphviz.Edge:
    return next(e for e in graph.edges() if e.attr["id"] == name)


GUARDED = """\
chart: guarded
outcomes: [done]
states:
  drive:
    any:
      near: {watch: Near, next: {near: .near}}
      go: {do: Drive, next: {arrived: .arrived}}
    next: {near: rest, arrived: .done}
  rest: {do: Rest, next: {rested: drive}}
"""


def test_a_guard_says_its_outcome_and_its_edge_is_amber_up_to_the_end() -> None:
    graph = drawn(GUARDED)
    assert f'→ <FONT COLOR="{AMBER}">near</FONT>' in row(graph, "drive/near")
    assert edge_named(graph, "t:drive:near").attr["color"] == AMBER
    assert edge_named(graph, "t:rest:rested").attr["color"] in ("", None, "#52606d")


def test_guards_stand_in_a_column_on_the_right_of_what_they_guard() -> None:
    known = charts_shipped()
    svg = render(dot(known["chase"], known))
    at = {name: texts_of(svg, f"a_s:follow/drive/{name}") for name in ("go", *GUARDS)}
    right = max(x for x, _ in at["go"])
    assert all(x > right for name in GUARDS for x, _ in at[name])
    assert len({min(x for x, _ in at[name]) for name in GUARDS}) == 1
    tops = [min(y for _, y in at[name]) for name in GUARDS]
    assert tops == sorted(set(tops))


GUARDS = ("settled", "far", "crowded")


def texts_of(svg: bytes, name: str) -> list[tuple[float, float]]:
    """Where the texts of an element begin."""
    root = ElementTree.fromstring(svg)
    element = next(e for e in root.iter() if e.get("id") == name)
    return [(float(t.get("x", "")), float(t.get("y", ""))) for t in element.iter(f"{SVG}text")]


SVG = "{http://www.w3.org/2000/svg}"


def test_edges_to_a_pin_have_no_arrow_and_those_from_it_have() -> None:
    graph = drawn(SIMPLE)
    assert edge_named(graph, "t:work/go:error").attr["arrowhead"] == "none"
    assert edge_named(graph, "t:work:failed").attr["arrowhead"] in ("", "normal", None)


def test_outcomes_of_the_chart_have_a_grey_double_border() -> None:
    graph = drawn(SIMPLE)
    assert graph.get_node(":done").attr["peripheries"] == "2"
    assert graph.get_node(":done").attr["color"] == GREY
    assert graph.get_node("work:done").attr["peripheries"] in ("", "1", None)


def test_a_box_hands_on_what_its_next_does_not_name() -> None:
    edges = {(e.tail, e.head) for e in picture(*one(SIMPLE)).edges}
    assert ("work:done", ":done") in edges


def test_pins_are_grey_whatever_brings_their_outcomes_about() -> None:
    known = charts_shipped()
    graph = pygraphviz.AGraph(string=dot(known["cobodeck"], known, 1))
    for name in ("chase:haptic_request", "chase:fault|user_lost|error", "haptic:released|failed"):
        assert graph.get_node(name).attr["color"] == GREY


def test_outcomes_that_lead_to_one_place_share_a_pin() -> None:
    known = charts_shipped()
    pins = {pin.outcomes for pin in picture(known["cobodeck"], known, 1).root.members[0].pins}
    assert pins == {
        ("haptic_request",), ("escape_required", "failed"), ("cornered",),
        ("fault", "user_lost", "error"),
    }  # fmt: skip


def test_conditions_stand_on_the_pin_they_lead_to() -> None:
    known = shipped()
    graph = pygraphviz.AGraph(string=dot(known["nested"], known))
    half, prepare = graph.get_node("work/serve:half"), graph.get_node("work/prepare")
    assert "if lift done and look failed" in half.attr["label"]
    assert "if lift failed and look seen" in half.attr["label"]
    assert "done all have ended" in prepare.attr["label"]


VALUES = """\
chart: {name}
outcomes: [x]
parameters:
  long: {{type: duration, default: 20 s}}
  near: {{type: length}}
states:
  s: {{do: Go, with: {{to: $near}}, timeout: $long, next: {{timeout: .x}}}}
"""
USING = """\
chart: user
outcomes: [x]
parameters: {far: {type: length, default: 7 m}, open: {type: duration}}
states:
  one: {use: inner, with: {near: $far}, next: {x: two}}
  two: {use: inner, with: {near: 2 m, long: $open}}
"""


def test_values_of_parameters_are_shown_and_names_where_they_are_open() -> None:
    graph = drawn(VALUES.format(name="a"))
    assert "to: $near" in graph.get_node("s").attr["label"]
    assert label_of(graph, "s:timeout") == "<I>timeout 20 s</I>"


def test_values_in_a_used_chart_are_those_that_it_is_given(tmp_path: Path) -> None:
    files = {"inner": VALUES.format(name="inner"), "user": USING}
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    known = load_files(sorted(tmp_path.glob("*.yaml")))
    graph = pygraphviz.AGraph(string=dot(known["user"], known, None))
    assert "to: 7 m" in graph.get_node("one/s").attr["label"]
    assert label_of(graph, "one/s:timeout") == "<I>timeout 20 s</I>"
    assert "to: 2 m" in graph.get_node("two/s").attr["label"]
    assert label_of(graph, "two/s:timeout") == "<I>timeout $open</I>"


# ----------------------------------------------------------------- layout

CHARTS = Path(__file__).parents[3] / "charts"
SHOWN = [*((name, 0) for name in ("cobodeck", "chase", "haptic", "escape", "inform"))]
SHOWN += [("cobodeck", None), ("nested", 0)]
Area = tuple[float, float, float, float]


def charts_shipped() -> Library:
    return load_files(sorted(CHARTS.glob("*.yaml")))


def laid_out(name: str, depth: int | None) -> pygraphviz.AGraph:
    known = shipped() if name == "nested" else charts_shipped()
    graph = pygraphviz.AGraph(string=dot(known[name], known, depth))
    graph.layout(prog="dot")
    return graph


def area_of(shape: pygraphviz.Node) -> Area:
    """The least x and y, then the greatest, points."""
    x, y = map(float, shape.attr["pos"].split(","))
    width, height = (72.0 * float(shape.attr[side]) for side in ("width", "height"))
    return x - width / 2, y - height / 2, x + width / 2, y + height / 2


def frames(graph: pygraphviz.AGraph) -> dict[str, Area]:
    found = {}
    for box in boxes(graph):
        if (box.name or "").startswith("cluster_"):
            left, low, right, high = map(float, box.graph_attr["bb"].split(","))
            found[box.name.removeprefix("cluster_")] = left, low, right, high
    return found


def holds(outer: Area, inner: Area) -> bool:
    return (
        outer[0] <= inner[0]
        and outer[1] <= inner[1]
        and inner[2] <= outer[2]
        and inner[3] <= outer[3]
    )


@pytest.mark.parametrize(("name", "depth"), SHOWN)
def test_every_label_stands_inside_the_frame_of_its_box(name: str, depth: int | None) -> None:
    graph = laid_out(name, depth)
    inside = frames(graph)
    for shape in graph.nodes():
        assert holds(inside[home(shape)], area_of(shape)), shape
    assert not [e for e in graph.edges() if e.attr["label"] or e.attr["xlabel"]]


@pytest.mark.parametrize(("name", "depth"), SHOWN)
def test_no_label_is_written_over_another_or_over_a_shape(name: str, depth: int | None) -> None:
    graph = laid_out(name, depth)
    shapes = {shape: area_of(shape) for shape in graph.nodes()}
    for (one_, a), (other, b) in itertools.combinations(shapes.items(), 2):
        apart = a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1]
        assert apart, (one_, other)


@pytest.mark.parametrize(("name", "depth"), SHOWN)
def test_no_route_leaves_the_frame(name: str, depth: int | None) -> None:
    graph = laid_out(name, depth)
    frame = frames(graph)[""]
    for edge in graph.edges():
        assert all(holds(frame, (*point, *point)) for point in points_of(edge)), edge.attr["id"]


def points_of(edge: pygraphviz.Edge) -> list[tuple[float, float]]:
    numbers = [float(n) for n in re.findall(r"-?[\d.]+(?:e[+-]\d+)?", edge.attr["pos"] or "")]
    return list(zip(numbers[::2], numbers[1::2], strict=True))


def test_the_expanded_machine_fits_on_one_screen() -> None:
    left, low, right, high = frames(laid_out("cobodeck", None))[""]
    # points; with Inform in it twice, 380 points of its width, it is half as wide again as high
    assert right - left <= 1900
    assert high - low <= 1250


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
    assert 'BGCOLOR="#ffd166"' in row(graph, "chase/danger")
    assert 'BGCOLOR="#fff6e0"' in row(graph, "chase/request")
    bold = {e.attr["id"] for e in graph.edges() if e.attr["penwidth"] == "3"}
    assert bold == {"t:chase:escape_required"}
    closed = pygraphviz.AGraph(string=dot(known["cobodeck"], known, 0, LIT))
    assert closed.get_node("chase").attr["fillcolor"] == "#9cc7f5"


def test_svg_carries_the_ids_that_a_page_lights() -> None:
    known = shipped()
    root = ElementTree.fromstring(render(dot(known["chase"], known)))
    ids = {element.get("id") for element in root.iter()}
    assert {"s:follow", "s:follow/drive", "a_s:danger", "o:follow:failed"} <= ids
    assert {"t:follow/choose:chosen", "l:follow/choose:chosen"} <= ids


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
    code = (
        "import sys, engine.draw.dot_text, engine.draw.mermaid_text;"
        " sys.exit('pygraphviz' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


if __name__ == "__main__":
    update_golden()
