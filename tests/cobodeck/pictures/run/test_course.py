"""The course of a run: its lanes, what it was about when, and parts of it."""

from __future__ import annotations

import pytest

from cobodeck.evaluate.figures import visits
from cobodeck.evaluate.metrics import Evaluator
from cobodeck.pictures.run.run_course import Course, Instant, NodeSpan, Phase, TouchRequest
from cobodeck.pictures.run.watch import CourseWatch, spans_of, used_charts
from cobodeck.run.build_run import stage
from cobodeck.setup.options import Options
from cobodeck.setup.setup import open_setup
from engine.chart.load import load_text
from engine.run.trace import TraceRecord
from hw.geometry import Pose2, Pose3
from hw.truth import Contact

CHARTS = {
    "chase": "chase",
    "haptic": "haptic",
    "escape": "escape",
    "inform": "inform",
    "ask": "inform",
}

NESTED = {
    "outer": """
chart: outer
outcomes: [done]
states:
  one: {states: {a: {use: middle, next: {done: .done}}}, next: {done: b}}
  b: {use: last, next: {done: .done}}
""",
    "middle": """
chart: middle
outcomes: [done]
any: {two: {use: last, next: {done: .done}}}
""",
    "last": """
chart: last
outcomes: [done]
states: {rest: {watch: Wait, next: {done: .done}}}
""",
}


def course(*spans: NodeSpan, charts: dict[str, str] | None = None, end_s: float = 10.0) -> Course:
    instants = tuple(Instant(float(t), Pose2(0.1 * t, 0.0)) for t in range(11))
    deep = Pose3.from_yaw(1.0, 2.0, 1.2, 0.0)
    return Course(
        "a run",
        (),
        None,
        None,
        CHARTS if charts is None else charts,
        0.0,
        end_s,
        instants,
        spans,
        frozenset({"chase/follow"}),
        (TouchRequest(1, 1.0, 3.0, deep), TouchRequest(2, 5.0, 8.0, deep, 6.0)),
        (Contact(4_000_000_000, 1.0, 1.0, "base", 0.3, 0.0, False),),
    )


def traced(*records: tuple[float, str, str, str]) -> list[TraceRecord]:
    return [
        TraceRecord(round(at * 1e9), kind, path, (detail,) if detail else ())
        for at, kind, path, detail in records
    ]


def test_a_span_goes_from_entry_to_exit_and_ends_with_the_outcome() -> None:
    records = traced(
        (0.0, "enter", "chase", ""),
        (0.0, "enter", "chase/wait", ""),
        (2.0, "outcome", "chase", "failed"),
        (2.0, "exit", "chase/wait", "preempted"),
        (2.0, "exit", "chase", "outcome"),
        (2.0, "enter", "escape", ""),
    )

    assert spans_of(records, 3.0) == (
        NodeSpan("chase", 0.0, 2.0, "failed"),
        NodeSpan("chase/wait", 0.0, 2.0, "preempted"),
        NodeSpan("escape", 2.0, 3.0),
    )


def test_what_lost_against_another_guard_ends_with_that_and_not_with_its_outcome() -> None:
    records = traced(
        (0.0, "enter", "request", ""),
        (1.0, "outcome", "request", "requested"),
        (1.0, "exit", "request", "lost"),
    )

    assert spans_of(records, 2.0) == (NodeSpan("request", 0.0, 1.0, "lost"),)


def test_the_used_charts_are_the_lanes_entered_or_not() -> None:
    assert course(NodeSpan("escape", 0.0, 1.0), NodeSpan("escape/flee", 0.0, 1.0)).lanes == tuple(
        CHARTS
    )


def test_a_chart_that_only_uses_others_is_no_lane_and_what_stands_beside_them_is_one() -> None:
    charts = {"work": "cobodeck", "work/chase": "chase"}
    spans = [NodeSpan(path, 0.0, 1.0) for path in ("", "dock", "work", "work/chase", "work/rest")]

    assert course(*spans, charts=charts).lanes == ("work/chase", "dock", "work/rest")


def test_charts_used_by_used_charts_are_found_in_document_order() -> None:
    library = {name: load_text(text, "x.yaml")[name] for name, text in NESTED.items()}

    assert list(used_charts(library["outer"], library).items()) == [
        ("one/a", "middle"),
        ("one/a/two", "last"),
        ("b", "last"),
    ]


def test_the_lanes_of_a_chart_that_uses_none_are_its_top_nodes() -> None:
    spans = [NodeSpan(path, 0.0, 1.0) for path in ("", "round", "round/go", "rest")]

    assert course(*spans, charts={}).lanes == ("round", "rest")


def test_a_run_is_about_the_lane_entered_last() -> None:
    spans = NodeSpan("watch", 0.0, 10.0), NodeSpan("go", 2.0, 4.0), NodeSpan("rest", 4.0, 6.0)

    assert course(*spans, charts={}).phases == (
        Phase(0.0, 2.0, "watch"),
        Phase(2.0, 4.0, "go"),
        Phase(4.0, 6.0, "rest"),
        Phase(6.0, 10.0, "watch"),
    )


def test_where_no_lane_is_active_a_run_is_about_none() -> None:
    assert course(NodeSpan("chase", 2.0, 4.0)).phases == (
        Phase(0.0, 2.0, None),
        Phase(2.0, 4.0, "chase"),
        Phase(4.0, 10.0, None),
    )


def test_a_part_of_a_run_has_what_lies_in_it() -> None:
    whole = course(
        NodeSpan("chase", 0.0, 2.0), NodeSpan("haptic", 2.0, 5.5), NodeSpan("chase", 5.5, 10.0)
    )

    part = whole.between(2.5, 4.5)

    assert (part.start_s, part.end_s) == (2.5, 4.5)
    assert [instant.at_s for instant in part.instants] == [3.0, 4.0]
    assert part.spans == (NodeSpan("haptic", 2.0, 5.5),)
    assert [request.number for request in part.requests] == [1]
    assert part.contacts == whole.contacts
    assert part.phases == (Phase(2.5, 4.5, "haptic"),)
    assert part.begun("haptic") == ()
    assert whole.between(4.5, None).contacts == ()


def test_a_part_outside_the_run_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing from 12 to 10 s: the run goes from 0 to 10 s"):
        course().between(12.0, None)


def test_steps_are_the_children_of_sequences_in_a_lane() -> None:
    paths = ("chase", "chase/danger", "chase/follow", "chase/follow/park", "escape/flee")

    steps = course(*(NodeSpan(path, 0.0, 1.0) for path in paths)).steps("chase")

    assert [step.path for step in steps] == ["chase/follow/park"]


def test_the_instant_at_a_time_is_the_last_one_up_to_then() -> None:
    run = course()

    assert [run.at(t).at_s for t in (-1.0, 3.0, 3.9, 99.0)] == [0.0, 3.0, 3.0, 10.0]


def test_the_course_of_a_simulated_run_has_what_its_figures_count() -> None:
    setup = open_setup(None, "lab_b", "paper")
    loop = stage(setup, Options("random", 2, seed=1))
    watch = CourseWatch(setup.robot)

    class Watching:
        def watch(self, now_ns: int) -> None:
            watch.watch(now_ns, loop.plant.truth)

    loop.observers = (*loop.observers, Watching())
    loop.go(10**12)
    trace = loop.wired.run.trace
    run = watch.course("a run", (), setup.scene, used_charts(setup.chart, setup.library), trace)
    (judge,) = (o for o in loop.observers if isinstance(o, Evaluator))
    judge.finish()
    figures = judge.report()

    served = [r.served_s - r.start_s for r in run.requests if r.served_s is not None]
    assert len(run.requests) == figures["requests"] == 2
    assert served == pytest.approx(judge.requests.response_s)
    assert [(c.at_ns / 1e9, c.by) for c in run.contacts or ()] == [
        (c["at_s"], c["by"]) for c in figures["contact_list"]
    ]
    assert run.contacts
    behaviours = ("chase", "haptic", "escape", "inform")
    assert run.charts == {name: f"paper_{name}" for name in behaviours} | {
        "retreat": "paper_escape"
    }
    for name in behaviours:
        found = [(span.start_s, span.end_s) for span in run.begun(name)]
        counted = visits(loop.wired.run, name)
        assert [start for start, _ in found] == [v.entered_ns / 1e9 for v in counted]
        ends = [run.end_s if v.ended_ns is None else v.ended_ns / 1e9 for v in counted]
        assert [end for _, end in found] == ends
    assert min(i.gap for i in run.instants if i.gap is not None) < 0.02
    assert run.end_s == loop.now_ns / 1e9
    assert sum(phase.end_s - phase.start_s for phase in run.phases) == pytest.approx(run.end_s)
