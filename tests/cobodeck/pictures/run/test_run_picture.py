"""Pictures of runs: nothing that matters is lost, nothing is written over anything else."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cobodeck.pictures.drawing.arm_outline import ARM, HELD
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch

from cobodeck.evaluate.evaluators import arm_outline
from cobodeck.pictures.drawing.canvas import Sheet, save
from cobodeck.pictures.run.lanes import rows, thinned
from cobodeck.pictures.run.run_course import Course, Instant, NodeSpan, TouchRequest
from cobodeck.pictures.run.run_picture import run_picture
from cobodeck.pictures.run.signs import BEHAVIOURS, CONTACT, time_step
from cobodeck.pictures.run.tracks import thinned as thinned_way
from hw.geometry import Pose2, Pose3
from hw.model.robot import load_robot
from hw.scene.scene import load_scene
from hw.sim.contact.contact import gap
from hw.truth import Contact

CHARTS = {name: name for name in ("chase", "haptic", "escape", "inform")}
LAB = load_scene("lab_a")
ROBOT = load_robot(LAB.robot).footprint


def walk(seconds: float, hz: float = 30.0) -> tuple[Instant, ...]:
    """Both go round in loops that never close."""
    return tuple(_instant(k / hz) for k in range(round(seconds * hz) + 1))


def _instant(t: float) -> Instant:
    robot = Pose2(3.3 + 2.0 * math.cos(0.21 * t), 5.0 + 3.0 * math.sin(0.17 * t), 0.1 * t)
    person = Pose2(3.3 + 1.1 * math.sin(0.31 * t), 5.0 + 1.2 * math.cos(0.43 * t), 0.2 * t)
    return Instant(t, robot, person, gap(ROBOT, robot, person.x, person.y))


def contact(at_s: float, by: str = "robot") -> Contact:
    part, closing = {"robot": ("base", 0.3), "slow_arm": ("wrist", 0.1), "person": ("base", 0.0)}[
        by
    ]
    return Contact(round(at_s * 1e9), 2.0 + 0.01 * at_s, 3.0, part, closing, 0.4, False)


def reached(number: int, start_s: float, served_s: float | None = None) -> TouchRequest:
    deep = Pose3.from_yaw(1.0 + number, 2.0, 1.2, 0.0)
    return TouchRequest(number, start_s, start_s + 10.0, deep, served_s)


def course(seconds: float = 60.0, *spans: NodeSpan) -> Course:
    spans = spans or (
        NodeSpan("chase", 0.0, 20.0, "escape_required"),
        NodeSpan("chase/follow/approach", 0.0, 20.0, "preempted"),
        NodeSpan("escape", 20.0, 25.0, "failed"),
        NodeSpan("inform", 25.0, 30.0, "restarted"),
        NodeSpan("haptic", 30.0, seconds),
    )
    return Course(
        "a run", ("profile tuned",), LAB.room, ROBOT, CHARTS, 0.0, seconds, walk(seconds), spans,
        frozenset({"chase/follow"}), (reached(1, 28.0, 33.0), reached(2, 45.0)),
        (contact(21.0), contact(24.0, "person"), contact(40.0, "slow_arm")),
    )  # fmt: skip


def test_the_arm_is_drawn_at_the_end_of_a_run() -> None:
    robot = load_robot(LAB.robot)
    arm, joints = arm_outline(robot), robot.parked
    *before, last = walk(30.0)
    shown = replace(course(30.0), instants=(*before, replace(last, joints=joints)), arm=arm)

    on, bare = run_picture(shown), run_picture(course(30.0))

    links = [p for p in on.axes.patches if p.get_facecolor() in map(to_rgba, (ARM, HELD))]
    assert len(links) == len(arm.parts)
    places = [0.5 * (box.min + box.max) for p in links if (box := p.get_path().get_extents())]
    assert all(math.dist(place, (last.robot.x, last.robot.y)) < 1.0 for place in places)
    assert "arm" in on.legend
    assert "arm" not in bare.legend


def lines(on: Sheet, colour: str) -> list[Line2D]:
    """Ways in a colour, marks aside."""
    return [li for li in on.axes.lines if li.get_color() == colour and li.get_marker() == "None"]


def marks(on: Sheet, marker: str) -> list[Line2D]:
    return [line for line in on.axes.lines if line.get_marker() == marker]


def bars(on: Sheet, row: str, drawn: Course) -> list[tuple[float, float]]:
    """From when to when there are bars in a row of the lanes."""
    (axes,) = (a for a in on.figure.axes if a.get_xlabel() == "time, s")
    y = rows(drawn).index(row)
    found = []
    for patch in axes.patches:
        assert isinstance(patch, PathPatch)
        corners = np.asarray(patch.get_path().vertices).reshape(-1, 5, 2)
        found += [(b[0, 0], b[1, 0]) for b in corners if abs(b[:, 1].mean() - y) < 0.5]
    return sorted(found)


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
@pytest.mark.few(1)
def test_the_same_run_gives_the_same_file(tmp_path: Path, form: str) -> None:
    first, second = tmp_path / f"a.{form}", tmp_path / f"b.{form}"
    save(run_picture(course()), first)
    save(run_picture(course()), second)

    assert first.read_bytes() == second.read_bytes()


def test_the_ways_of_both_have_the_colour_of_the_behaviour_of_the_time() -> None:
    on = run_picture(course())

    for path, start, end in (("chase", 0, 20), ("escape", 20, 25), ("haptic", 30, 60)):
        person, robot = lines(on, BEHAVIOURS[path])
        for line, who in ((person, "person"), (robot, "robot")):
            points = [(x, y) for x, y in np.asarray(line.get_xydata()) if not math.isnan(x)]
            ends = [getattr(_instant(float(t)), who) for t in (start, end)]
            assert points[0] == (ends[0].x, ends[0].y)
            assert points[-1] == (ends[1].x, ends[1].y)
    assert len({*BEHAVIOURS.values()}) == len(BEHAVIOURS)


def test_a_thinned_way_is_nowhere_farther_off_than_a_centimetre() -> None:
    way = [(i.robot.x, i.robot.y) for i in walk(120.0)]

    few = np.array(thinned_way(way))

    assert len(few) < len(way) / 10
    start, step = few[:-1], np.diff(few, axis=0)
    for x, y in way:
        share = (((x, y) - start) * step).sum(axis=1) / (step * step).sum(axis=1)
        nearest = start + np.clip(share, 0.0, 1.0)[:, None] * step
        assert np.hypot(*(nearest - (x, y)).T).min() < 0.01


def test_a_thinned_curve_keeps_each_least_and_greatest_value() -> None:
    times = np.arange(20_000.0)
    values = np.sin(times)
    values[[777, 12_345]] = -3.0, 5.0
    values[6_000:9_000] = np.nan

    few_times, few = thinned(times, values)

    assert len(few) < 5_000
    assert (few_times[np.nanargmin(few)], few_times[np.nanargmax(few)]) == (777.0, 12_345.0)


@pytest.mark.slow
def test_no_contact_of_a_long_run_is_thinned_away(tmp_path: Path) -> None:
    times = [3600.0 * k / 400 for k in range(400)]
    instants = walk(3600.0)
    spans = [NodeSpan("chase", 4.0 * k, 4.0 * k + 3.9, "failed") for k in range(900)]
    spans += [NodeSpan("inform", 4.0 * k + 3.9, 4.0 * k + 4.0, "restarted") for k in range(900)]
    spans.sort(key=lambda span: span.start_s)
    contacts = tuple(map(contact, times))
    whole = replace(course(3600.0, *spans), instants=instants, contacts=contacts)

    on = run_picture(whole)
    save(on, tmp_path / "long.svg")

    (marked,) = marks(on, "X")
    assert [*map(tuple, marked.get_xydata())] == [(touch.x, touch.y) for touch in contacts]
    assert (tmp_path / "long.svg").stat().st_size < 1_500_000


@pytest.mark.slow
def test_however_often_all_that_is_said_beside_the_lanes_is_on_the_sheet() -> None:
    ends = [NodeSpan(name, 2.0 * k, 2.0 * k + 1.9, "failed") for k in range(999) for name in CHARTS]
    contacts = tuple(contact(2.0 * k) for k in range(999))
    on = run_picture(replace(course(2000.0, *ends), contacts=contacts))
    renderer = FigureCanvasAgg(on.figure).get_renderer()

    (axes,) = (a for a in on.figure.axes if a.get_xlabel() == "time, s")
    beside = {text.get_text(): text.get_window_extent(renderer).x1 for text in axes.texts}
    assert "999×, 1898 s, 999 failed" in beside
    assert "999×, 999 by the robot" in beside
    assert max(beside.values()) < on.figure.bbox.width


def test_no_label_on_the_map_is_written_over_another_or_over_a_mark() -> None:
    on = run_picture(course(300.0))
    renderer = FigureCanvasAgg(on.figure).get_renderer()

    boxes = [text.get_window_extent(renderer) for text in on.axes.texts]

    assert len(boxes) > 15
    assert not [1 for a, b in itertools.combinations(boxes, 2) if a.overlaps(b)]
    places = [place for kind in "so*X^8" for mark in marks(on, kind) for place in mark.get_xydata()]
    assert len(places) > 20
    for x, y in on.axes.transData.transform(places):
        assert not [box for box in boxes if box.contains(x, y)]


def test_marks_of_time_stand_where_robot_and_person_were_then() -> None:
    run = course()
    on = run_picture(run)

    assert time_step(run) == 5.0
    for marker, who in (("s", "robot"), ("o", "person")):
        places = {(li.get_xdata()[0], li.get_ydata()[0]) for li in marks(on, marker)}
        poses = [getattr(_instant(5.0 * k), who) for k in range(13)]
        assert {(pose.x, pose.y) for pose in poses} >= places
        assert len(places) > 8
    assert {"10 s", "30 s"} <= {text.get_text() for text in on.axes.texts}


def test_what_stays_about_where_it_is_shares_a_mark_with_from_and_to() -> None:
    still = tuple(Instant(float(t), Pose2(3.0, 3.0)) for t in range(61))
    on = run_picture(replace(course(), instants=still, contacts=None, requests=()))

    assert [text.get_text() for text in on.axes.texts if " s" in text.get_text()] == ["0–60 s"]


def test_a_contact_is_filled_by_whose_it_was() -> None:
    found = marks(run_picture(course()), "X")
    at = {line.get_xdata()[0]: line.get_markerfacecolor() for line in found}

    for touch in course().contacts or ():
        assert at[touch.x] == CONTACT[touch.by]["mfc"]
    assert len(set(at.values())) == 3


def test_requests_are_marked_where_the_person_reached_served_or_not() -> None:
    stars = marks(run_picture(course()), "*")

    assert [(s.get_xdata()[0], to_hex(s.get_markerfacecolor())) for s in stars] == [
        (2.0, BEHAVIOURS["haptic"]),
        (3.0, "#ffffff"),
    ]


def test_requests_at_one_place_share_a_mark() -> None:
    asked = tuple(replace(reached(1, 10.0 * n, 10.0 * n + 1.0), number=n) for n in (1, 2, 3, 5))
    on = run_picture(replace(course(), requests=asked))

    assert "requests 1–3, 5" in {text.get_text() for text in on.axes.texts}


def test_a_request_has_a_bar_until_it_is_served_and_another_until_it_ends() -> None:
    run = course()

    assert bars(run_picture(run), "requests", run) == [(28.0, 33.0), (33.0, 38.0), (45.0, 55.0)]


@pytest.mark.slow
def test_what_repeats_fifty_times_in_an_hour_has_fifty_bars() -> None:
    spans = [NodeSpan("inform", 72.0 * k, 72.0 * k + 0.5, "restarted") for k in range(50)]
    run = course(3600.0, *spans)

    assert bars(run_picture(run), "inform", run) == [(s.start_s, s.end_s) for s in spans]


@pytest.mark.slow
def test_bars_that_all_but_touch_are_one_and_cover_the_same_time() -> None:
    spans = [NodeSpan("inform", 0.5 * k, 0.5 * k + 0.4, "restarted") for k in range(200)]
    run = course(3600.0, *spans)

    assert bars(run_picture(run), "inform", run) == [(0.0, spans[-1].end_s)]


def test_escapes_and_informs_are_marked_where_they_began_once_for_each_place() -> None:
    spans = [NodeSpan("escape", float(t), t + 0.5, "failed") for t in (5, 20, 5 + 30)]
    still = replace(walk(60.0)[0], at_s=0.0)
    on = run_picture(replace(course(60.0, *spans), instants=(still, replace(still, at_s=60.0))))

    (mark,) = marks(on, "^")
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == (still.robot.x, still.robot.y)
    assert "3×" in {text.get_text() for text in on.axes.texts}


BARE = Course(
    "nothing but a chart", (), None, None, {}, 0.0, 5.0, (), (NodeSpan("rest", 0.0, 5.0),)
)
ALONE = tuple(replace(instant, person=None, gap=None) for instant in walk(20.0))
LOST = tuple(replace(i, person=None, gap=None) if 5 < i.at_s < 9 else i for i in walk(20.0))


@pytest.mark.parametrize(
    "run",
    [
        replace(course(), room=None),
        replace(course(20.0), room=None, instants=ALONE, contacts=None, requests=(), charts={}),
        replace(course(20.0), instants=LOST),
        replace(course(), spans=()),
        replace(course(), footprint=None),
        replace(course(), instants=walk(60.0)[:1]),
        course(2.0).between(0.5, 0.6),
        course().between(22.0, 31.0),
        BARE,
    ],
)
@pytest.mark.few(4)
def test_whatever_is_missing_the_rest_is_drawn(tmp_path: Path, run: Course) -> None:
    on = run_picture(run)
    save(on, tmp_path / "a.svg")

    (axes,) = (a for a in on.figure.axes if a.get_xlabel() == "time, s")
    assert axes.get_xlim() == (run.start_s, run.end_s)
    assert [label.get_text() for label in axes.get_yticklabels()] == rows(run)


def test_the_picture_grows_with_its_lanes_and_nothing_lies_on_anything_else() -> None:
    many = {f"node{n}": f"chart{n}" for n in range(12)}
    few, more = run_picture(course()), run_picture(replace(course(), charts=many, spans=()))

    assert more.figure.get_figheight() > few.figure.get_figheight()
    boxes = [axes.get_position() for axes in more.figure.axes]
    assert not [1 for a, b in itertools.combinations(boxes, 2) if a.overlaps(b)]
