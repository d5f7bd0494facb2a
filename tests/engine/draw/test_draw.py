"""Pictures of charts: what is in the text, and that Graphviz reads it as meant."""

from __future__ import annotations

import itertools
import math
import re
import stat
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path
from typing import Any

import pygraphviz
import pytest
from hypothesis import given, settings

from behaviors.profile.profile import load_profile
from engine.chart.chart import Chart, Node, Reference, Retry
from engine.chart.load import Library, load_files, load_text
from engine.draw.chart_shapes import BoxShape, LeafShape, Shape
from engine.draw.dot_text import Active, dot
from engine.draw.layout import FILE_FORMS, CannotRender, render
from engine.draw.mermaid_text import mermaid
from engine.draw.picture import picture
from engine.draw.style import INK, KINDS, PAGE
from engine.draw.wording import declared_by, notes_of, value_text, values_of
from engine.literals import Constant
from tests.engine.random_charts import charts, library

GOLDEN = Path(__file__).parent / "golden"
LIT = Active({"chase/danger", "chase/follow/drive"}, ("chase/danger", "required"))
TEXTS: dict[str, tuple[str, int | None, Active | None]] = {
    "chase": ("chase", 0, None),
    "nested": ("nested", 0, None),
    "cobodeck": ("cobodeck", 0, None),
    "cobodeck_expanded": ("cobodeck", None, None),
    "cobodeck_active": ("cobodeck", 1, LIT),
    "tour": ("tour", 0, None),
    "tour_expanded": ("tour", None, None),
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
    """The box in which a shape has to stand; its pins hold a colon."""
    path, colon, _ = shape.partition(":")
    return path if colon else path.rpartition("/")[0]


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


ACTION, MONITOR, GREY, RED, AMBER = "#2e7d32", "#c77700", "#525d69", "#b71c1c", "#8a5000"


def row(graph: pygraphviz.AGraph, path: str) -> str:
    """The cell of a row, wherever it stands."""
    return cell(graph, f"s:{path}")


def pin(graph: pygraphviz.AGraph, name: str) -> str:
    """The cell of a pin of a leaf or table."""
    return cell(graph, f"o:{name}")


def cell(graph: pygraphviz.AGraph, name: str) -> str:
    found = re.search(rf'<TD ID="{re.escape(name)}"[^>]*>.*?</TD>', graph.string())
    assert found is not None, name
    return found[0]


def boxes(graph: pygraphviz.AGraph) -> list[pygraphviz.AGraph]:
    return [box for sub in graph.subgraphs() for box in (sub, *boxes(sub))]


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
    assert "<B>go</B><BR/><FONT POINT-SIZE=" in label
    assert "Drive</FONT>" in label
    assert "speed: 1 m/s</FONT>" in label
    assert "retry: 2 on far after 1 s" in graph.get_node("work/see").attr["label"]


def test_outcomes_with_one_target_share_a_pin_and_time_limits_in_it_are_italic_not_red() -> None:
    graph = drawn(SIMPLE)
    name = "work/go:arrived|blocked|timeout"
    assert ">arrived | blocked<BR/><I>timeout 5 s</I><" in pin(graph, name)
    ids = {e.attr["id"] for e in graph.edges() if "work/go:" in (e.attr["id"] or "")}
    assert ids == {f"t:{name}", "t:work/go:error"}
    assert edge_named(graph, f"t:{name}").attr["color"] in ("", None, GREY)


def test_a_time_limit_alone_is_dotted_and_has_no_colour() -> None:
    text = "chart: a\noutcomes: []\nstates:\n  s: {do: X, timeout: 5 s, next: {timeout: t}}\n"
    graph = drawn(text + "  t: {do: X}\n")
    edge = edge_named(graph, "t:s:timeout")
    assert edge.attr["style"] == "dotted"
    assert edge.attr["color"] in ("", None, GREY)


def test_only_what_errors_lead_to_is_red() -> None:
    graph = drawn(SIMPLE)
    assert f'<FONT COLOR="{RED}">error</FONT>' in pin(graph, "work/go:error")
    assert f'COLOR="{GREY}"' in pin(graph, "work/go:arrived|blocked|timeout")
    assert edge_named(graph, "t:work/go:error").attr["color"] == RED
    assert RED not in row(graph, "guard")
    assert graph.get_node(":failed").attr["color"] == GREY  # the guard leads there, too
    red = {e.attr["id"] for e in graph.edges() if e.attr["color"] == RED}
    assert red == {"t:work/go:error", "t:work:failed"}
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
    assert edge_named(graph, "t:rest:rested").attr["color"] in ("", None, GREY)


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
    edges = {(e.pin.id, e.head) for e in picture(*one(SIMPLE)).edges}
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
        ("haptic_request",), ("escape_required",), ("failed",), ("cornered",),
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
    assert "<I>timeout 20 s</I>" in pin(graph, "s:timeout")


def test_values_in_a_used_chart_are_those_that_it_is_given(tmp_path: Path) -> None:
    files = {"inner": VALUES.format(name="inner"), "user": USING}
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    known = load_files(sorted(tmp_path.glob("*.yaml")))
    graph = pygraphviz.AGraph(string=dot(known["user"], known, None))
    assert "to: 7 m" in graph.get_node("one/s").attr["label"]
    assert "<I>timeout 20 s</I>" in pin(graph, "one/s:timeout")
    assert "to: 2 m" in graph.get_node("two/s").attr["label"]
    assert "<I>timeout $open</I>" in pin(graph, "two/s:timeout")


def test_values_inside_what_a_used_chart_is_given_are_those_of_the_chart_around_it() -> None:
    chart, _ = one(VALUES.format(name="a"))
    given = {"near": [{"x": Reference("long")}, Reference("open")]}
    values = values_of(chart, given, {"long": "7 m"})
    assert value_text(Reference("near"), values) == "[(x 7 m), $open]"
    assert value_text(Reference("long"), values) == "20 s"


def leaf(text: str, **changes: Any) -> tuple[str, ...]:
    """The notes of a node written as `text`, with some of its fields changed."""
    chart, _ = one(f"chart: a\noutcomes: []\nstates:\n  s: {text}\n")
    return notes_of(replace(chart.root.children[0], **changes), {"spot": {"place": "dock"}})


def test_data_that_a_node_reads_and_writes_stand_beside_its_values() -> None:
    text = "{do: X, with: {tolerance: 10 cm}, in: {goal: here, map: map}, out: {pose: goal, n: n}}"
    assert leaf(text) == ("tolerance: 10 cm", "goal ← here", "← map", "pose → goal", "→ n")
    assert leaf("{do: X, in: {a: a, b: b}}") == ("← a, b",)


def test_what_is_bound_to_an_input_without_a_key_is_a_value() -> None:
    pose = {"x": "2 m", "y": "2.5 m", "yaw": "90 deg"}
    given = {"goal": pose, "home": {"place": "kitchen"}, "n": 3, "at": "here"}
    shown = ("goal: x 2 m, y 2.5 m, yaw 90 deg", "home: place kitchen", "n: 3", "at ← here")
    assert leaf("{do: X}", inputs=given) == shown
    references = {"goal": Reference("spot"), "limit": Reference("profile.escape.ahead")}
    assert leaf("{do: X}", inputs=references) == (
        "goal: place dock",
        "limit: $profile.escape.ahead",
    )
    assert leaf("{do: X}", parameters={"tour": [pose, {"place": "dock"}]}) == (
        "tour: [(x 2 m, y 2.5 m, yaw 90 deg), (place dock)]",
    )


def test_a_constant_is_shown_by_its_value_and_where_it_comes_from() -> None:
    text = """\
chart: a
parameters: {room: {type: length, default: $p.room}}
outcomes: [x]
data: {n: {type: integer, initial: $p.n}}
states:
  s:
    do: X
    with: {a: $p.room, b: [$p.room, $p.n], c: $room, d: $p.far}
    timeout: $p.wait
    retry: {times: $p.n, on: [x]}
    next: {x: .x, timeout: .x}
"""
    constants = {"p.room": Constant("3 m", "mine: room"), "p.n": Constant(4, "--set n=4")}
    constants["p.wait"] = Constant("2 s")
    chart, known = one(text)
    shown = picture(chart, known, constants=constants)
    (shape,) = shown.root.members
    assert shape.notes == (
        "a: 3 m (mine: room)",
        "b: [3 m, 4] (mine: room, --set n=4)",
        "c: 3 m",
        "d: $p.far",
        "retry: 4 (--set n=4) on x",
    )
    assert dict(shown.declared)["parameters"] == ("room: 3 m (mine: room)",)
    assert dict(shown.declared)["data"] == ("n (integer): 4 (--set n=4)",)
    assert "timeout 2 s" in dot(chart, known, constants=constants)
    assert "3 m" in mermaid(chart, known, constants=constants)


def test_the_head_of_a_used_chart_says_what_is_not_from_the_charts_files() -> None:
    chart, known = one("chart: a\noutcomes: [x]\nstates: {u: {use: in, with: {near: 1 m}}}\n")
    inner, _ = one(VALUES.format(name="in"))
    tuned = {n: replace(p, origin=f"tuned: {n}") for n, p in inner.parameters.items()}
    used = {**known, "in": replace(inner, parameters=tuned)}
    (shape,) = picture(chart, used, None).root.members
    assert shape.notes == ("chart in", "near: 1 m", "long: 20 s (tuned: long)")


def test_a_number_of_tries_may_be_a_parameter() -> None:
    tries = Retry(Reference("spot"), ("lost",))  # type: ignore[arg-type]
    assert leaf("{do: X}", retry=tries) == ("retry: place dock on lost",)


DECLARING = """\
chart: a
outcomes: [x]
parameters:
  room: {type: length, default: 3.4 m}
  ahead: {type: duration, default: $profile.escape.ahead}
  near: length
inputs: {since: integer}
data: {goal: {type: Pose2, initial: none}, n: {type: integer, initial: 4}, map: Map}
states: {s: {do: X, next: {done: .x}}}
"""


def test_what_a_chart_declares_stands_in_its_head_with_the_values_in_force() -> None:
    chart, known = one(DECLARING)
    tuned = replace(chart.parameters["room"], origin="tuned")
    chart = replace(chart, parameters={**chart.parameters, "room": tuned})
    head = {
        "parameters": ("room: 3.4 m (tuned)", "ahead: $profile.escape.ahead", "near (length)"),
        "inputs": ("since (integer)",),
        "data": ("goal (Pose2): none", "n (integer): 4", "map (Map)"),
    }
    assert dict(declared_by(chart)) == head
    texts = dot(chart, known), unescaped(mermaid(chart, known))
    assert all(item in text for text in texts for items in head.values() for item in items)


def unescaped(text: str) -> str:
    """Mermaid text with its encoded characters as they are."""
    return re.sub(r"#(\d+);", lambda code: chr(int(code[1])), text)


def test_a_leaf_with_many_values_stays_compact_and_says_all_when_pointed_at() -> None:
    given = ", ".join(f"parameter_{n}: {n} m" for n in range(20))
    graph = drawn(f"chart: a\noutcomes: []\nstates:\n  s: {{do: X, with: {{{given}}}}}\n")
    lines = graph.get_node("s").attr["label"].split("<BR/>")
    assert len(lines) == 2 + 8  # its name, its class
    assert lines[-1].endswith(" …</FONT>")
    assert "parameter_19: 19 m" in graph.get_node("s").attr["tooltip"]
    graph = drawn(SIMPLE)
    assert graph.get_node("work/go").attr["tooltip"] == "go"


# ----------------------------------------------------------------- layout

CHARTS = Path(__file__).parents[3] / "charts"
SHOWN: list[tuple[str, int | None]] = [
    *((name, 0) for name in ("cobodeck", "chase", "haptic", "escape", "inform"))
]
SHOWN += [("cobodeck", None), ("nested", 0), ("tour", 0), ("tour", None)]
Area = tuple[float, float, float, float]
Point = tuple[float, float]


def charts_shipped() -> dict[str, Chart]:
    """The shipped charts, with the values that are drawn."""
    return load_profile("tuned").apply(load_files(sorted(CHARTS.glob("*.yaml"))))


def laid_out(name: str, depth: int | None) -> pygraphviz.AGraph:
    known = shipped() if name in ("nested", "tour") else charts_shipped()
    constants = load_profile("tuned").constants
    graph = pygraphviz.AGraph(string=dot(known[name], known, depth, constants=constants))
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
def test_each_pin_has_a_place_of_its_own_at_which_its_edge_leaves(
    name: str, depth: int | None
) -> None:
    begins: dict[str, list[Point]] = {}
    for way, points in curves(laid_out(name, depth)).items():
        begins.setdefault(way.partition(":")[0], []).append(points[0])
    for found in begins.values():
        assert all(math.dist(a, b) >= 20 for a, b in itertools.combinations(found, 2))


@pytest.mark.parametrize(("name", "depth"), SHOWN)
def test_routes_that_lead_apart_do_not_run_together(name: str, depth: int | None) -> None:
    found = curves(laid_out(name, depth))
    routes = {way: route(points) for way, points in found.items()}
    for one_, other in itertools.combinations(found, 2):
        if found[one_][-1] != found[other][-1]:
            near = (any(math.dist(p, q) < 2 for q in routes[other]) for p in routes[one_])
            assert sum(near) * STEP <= 100, (one_, other)


@pytest.mark.parametrize(("name", "depth"), SHOWN)
def test_siblings_stand_in_the_order_of_the_chart(name: str, depth: int | None) -> None:
    known = shipped() if name in ("nested", "tour") else charts_shipped()
    graph, shown = laid_out(name, depth), picture(known[name], known, depth)
    boxes_shown, inside = {box.path: box for box in shown.root.boxes()}, frames(graph)
    for edge in shown.edges:
        if edge.pin.path in boxes_shown or edge.head in boxes_shown or ":" in edge.head:
            continue
        tail, head = (area_of(graph.get_node(path)) for path in (edge.pin.path, edge.head))
        assert edge.pin.back or tail[1] > head[3], edge
        assert not edge.pin.back or edge.head == edge.pin.path or tail[3] < head[1], edge
    for box in boxes_shown.values():
        within = [inside[m.path] for m in box.members if isinstance(m, BoxShape)]
        assert within == sorted(within)


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
    for way, points in curves(graph).items():
        assert all(holds(frame, (*p, *p)) for p in route(points)), way


def curves(graph: pygraphviz.AGraph) -> dict[str, list[Point]]:
    """The points of the Bezier curves of each edge from a pin, from its tail on, points."""
    found = {}
    for edge in graph.edges():
        if edge.attr["id"]:
            words = edge.attr["pos"].replace("\\\n", "").split()
            points = [pair(word) for word in words if word[0] not in "es"]
            way = edge.attr["id"].removeprefix("t:")
            found[way] = points[::-1] if edge.attr["dir"] == "back" else points
    return found


def pair(word: str) -> Point:
    x, y = map(float, word.split(","))
    return x, y


STEP = 4.0  # points


def route(points: list[Point]) -> list[Point]:
    """Points on Bezier curves, `STEP` apart at least."""
    found = points[:1]
    for n in range(0, len(points) - 3, 3):
        for t in (k / 40 for k in range(41)):
            weights = (1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t**3
            curve = list(zip(weights, points[n : n + 4], strict=True))
            at = sum(w * p[0] for w, p in curve), sum(w * p[1] for w, p in curve)
            if math.dist(at, found[-1]) >= STEP:
                found.append(at)
    return found


def test_the_expanded_machine_fits_on_a_page() -> None:
    left, low, right, high = frames(laid_out("cobodeck", None))[""]
    # points; siblings in the order of the chart need height, so it is two pages side by side, not
    # a screen: both uses of `escape` are drawn in full, each with its own values
    assert right - left <= 2 * 1400
    assert high - low <= 1450 * 2**0.5


def luminance(color: str) -> float:
    """Relative luminance as in WCAG 2."""
    parts = (int(color[n : n + 2], 16) / 255 for n in (1, 3, 5))
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one_: str, other: str) -> float:
    low, high = sorted((luminance(one_), luminance(other)))
    return (high + 0.05) / (low + 0.05)


LEGEND = {border for border, *_ in KINDS.values() if border != MONITOR}


def test_letters_are_legible_on_all_that_they_stand_on() -> None:
    known = shipped()
    text = "".join((*golden_texts().values(), dot(known["cobodeck"], known, 0, LIT)))
    letters = set(re.findall(r'(?:FONT[^>]* COLOR|fontcolor)="(#\w+)"', text)) - LEGEND
    grounds = set(re.findall(r'(?:BGCOLOR|bgcolor|fillcolor)="(#\w+)"', text)) - {INK}
    assert {INK, GREY, AMBER, RED} == letters
    assert len(grounds) == 3 + 6  # boxes; nodes, and lit nodes
    assert all(contrast(a, b) >= 4.5 for a in letters for b in grounds)
    assert all(contrast(color, PAGE) >= 4.5 for color in LEGEND)
    mermaid_classes = re.findall(r"fill:(#\w+),stroke:#\w+,color:(#\w+)", text)
    assert all(contrast(*pair) >= 4.5 for pair in mermaid_classes if pair != (INK, INK))


def test_edges_and_borders_of_nodes_stand_out_from_the_page() -> None:
    for color in (GREY, AMBER, RED, *(border for border, *_ in KINDS.values())):
        assert contrast(color, PAGE) >= 3.0


def test_a_picture_has_a_page_of_its_own() -> None:
    root = ElementTree.fromstring(render(dot(*one(SIMPLE))))
    page, group = next(root.iter(f"{SVG}polygon")), next(root.iter(f"{SVG}g"))
    assert page.get("fill") in (PAGE, "white")
    shift = re.search(r"translate\(([-\d.]+)[ ,]([-\d.]+)\)", group.get("transform", ""))
    assert shift is not None
    corners = [tuple(map(float, c.split(","))) for c in page.get("points", "").split()]
    begin = tuple(map(float, root.get("viewBox", "").split()))
    for axis, at in enumerate(map(float, shift.groups())):
        values = [corner[axis] + at for corner in corners]
        assert min(values) <= begin[axis] + 1
        assert max(values) >= begin[axis] + begin[axis + 2] - 1


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
    assert f'BGCOLOR="{KINDS["watch"][2]}"' in row(graph, "chase/danger")
    assert f'BGCOLOR="{KINDS["watch"][1]}"' in row(graph, "chase/request")
    bold = {e.attr["id"] for e in graph.edges() if e.attr["penwidth"] == "3"}
    assert bold == {"t:chase:escape_required"}
    closed = pygraphviz.AGraph(string=dot(known["cobodeck"], known, 0, LIT))
    assert closed.get_node("chase").attr["fillcolor"] == KINDS["use"][2]


def test_svg_carries_the_ids_that_a_page_lights() -> None:
    known = shipped()
    root = ElementTree.fromstring(render(dot(known["chase"], known)))
    ids = {element.get("id") for element in root.iter()}
    assert {"s:follow", "s:follow/drive", "a_s:danger", "o:follow:failed"} <= ids
    assert {"t:follow/choose:chosen", "a_o:follow/choose:chosen"} <= ids


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
