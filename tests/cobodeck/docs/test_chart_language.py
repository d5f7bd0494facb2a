"""The page of the chart language: every key has an example, what it says of them is so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cobodeck.project import Catalogue
from cobodeck.testing import ChartTester
from engine import convert
from engine.chart import CHART, DATA, INPUT, NODE, PARAMETER, RETRY, RULE, chart_value
from engine.types import known_types
from hw import Pose2
from tests.cobodeck.docs.author_pages import DOCS, blocks

PAGE = "chart-language.md"
TEXT = (DOCS / PAGE).read_text(encoding="utf-8")
CHARTS = {str(b.file).split("/")[-1][:-5]: b.text for b in blocks(PAGE) if b.language == "yaml"}


@pytest.mark.parametrize("key", sorted({*CHART, *NODE, *RULE, *RETRY, *PARAMETER, *INPUT, *DATA}))
def test_every_key_of_the_language_is_in_an_example(key: str) -> None:
    pattern = re.compile(rf"(?:^|[{{,]|- )\s*{key}:", flags=re.MULTILINE)

    assert [name for name, text in CHARTS.items() if pattern.search(text)]


def test_every_key_of_a_node_is_explained() -> None:
    assert [key for key in NODE if f"`{key}" not in TEXT] == []


@pytest.mark.parametrize(
    ("written", "type_name", "value"),
    [
        ("200 ms", "duration", 0.2),
        ("1 min", "duration", 60.0),
        ("20 cm", "length", 0.2),
        ("90 deg", "angle", 1.5707963267948966),
        ("2 km/h", "speed", 2 / 3.6),
        ("30 deg/s", "angular_speed", 0.5235987755982988),
        ("0.5 m/s2", "acceleration", 0.5),
        ("12 N", "force", 12.0),
        ("3 kg", "mass", 3.0),
        ("50 %", "ratio", 0.5),
    ],
)
def test_values_are_what_the_table_says(written: str, type_name: str, value: float) -> None:
    assert f"`{written}`" in TEXT
    assert f"`{type_name}`" in TEXT
    assert convert(chart_value(written), known_types({})[type_name]) == pytest.approx(value)


def test_a_sequence_goes_from_node_to_node(page_sim: ChartTester) -> None:
    page_sim.start("knock", real=["Log", "Wait"])
    page_sim.until("done", timeout=2.2)
    page_sim.assert_path("hello", "pause", "bye")


def test_of_guards_that_trip_at_once_the_higher_priority_wins(page_sim: ChartTester) -> None:
    page_sim.start("keep_watch", script={"button": "there", "near": ("below", {"value": 0.5})})
    page_sim.tick()
    assert page_sim.outcome == "near"


def test_all_ends_with_done_whatever_the_outcomes(page_sim: ChartTester) -> None:
    page_sim.start("both", script={"user": ("there", {"value": 1.0}), "pause": "over"})
    page_sim.wait(5)
    assert page_sim.active == ["robot"]
    page_sim.end("robot", "there", value=Pose2(1, 1))
    page_sim.until("done", timeout=0.1)


def test_when_takes_the_first_item_that_matches(page_sim: ChartTester) -> None:
    page_sim.start("offer", real=["Wait"], script={"somebody": ("below", {"value": 1.0})})
    page_sim.until("taken", timeout=3.1)
    assert page_sim.now > 2.9


def test_an_item_of_when_ends_what_still_runs(page_sim: ChartTester) -> None:
    page_sim.start("offer", script={})
    page_sim.until("left", timeout=10.1)
    assert page_sim.active == []


@pytest.mark.slow
@pytest.mark.parametrize("left_out", ["", "        next: {finished: .finished}\n"])
def test_an_outcome_that_no_next_maps_ends_the_container_around_it(
    page_sim: ChartTester, left_out: str
) -> None:
    text = CHARTS["guarded_round"]
    assert left_out in text
    page_sim.start(text.replace(left_out, "") if left_out else text, real=["Wait", "Log"])
    page_sim.until("done", timeout=2.3)
    page_sim.assert_path("first", "second", "report")


def test_a_guard_ends_all_beside_it(page_sim: ChartTester) -> None:
    page_sim.start("guarded_round", script={"fault": ("there", {"value": "bumper"})})
    page_sim.tick()
    assert page_sim.outcome == "fault"


@pytest.mark.slow
def test_an_outcome_that_next_maps_ends_a_container_with_when_at_once(
    page_sim: ChartTester,
) -> None:
    text = CHARTS["offer"].replace("timeout: 10 s}", "timeout: 10 s, next: {below: .taken}}")
    text = text.replace("  - {outcome: taken, if: {pause: over, somebody: below}}\n", "")
    page_sim.start(text, script={"somebody": ("below", {"value": 1.0})})
    page_sim.tick()
    assert page_sim.outcome == "taken"


def test_a_timeout_leads_where_next_says(page_sim: ChartTester) -> None:
    page_sim.start("patient", real=["Log"])
    page_sim.until("alone", timeout=60.1)
    page_sim.assert_path("wait", "tell")


def test_three_further_tries_five_seconds_apart(page_sim: ChartTester) -> None:
    page_sim.start("persistent", script={"drive": ["no_path", "stuck", "no_path", "stuck"]})
    page_sim.until("failed", timeout=16)
    assert page_sim.path("drive") == ["drive"] * 4
    assert page_sim.now >= 15


def test_an_error_goes_out_to_the_container_that_maps_it(page_sim: ChartTester) -> None:
    page_sim.start("safe_park", script={"first": RuntimeError("broken")}, real=["Log"])
    page_sim.until("failed", timeout=1)
    page_sim.assert_path("first", "tell")


def test_an_error_that_nothing_maps_ends_the_chart(page_sim: ChartTester) -> None:
    page_sim.start("patient", script={"wait": RuntimeError("broken")})
    page_sim.until("error", timeout=1)


def test_parameters_reach_timeouts(page_sim: ChartTester) -> None:
    page_sim.start("linger", script={}, parameters={"limit": 5.0})
    page_sim.until("stayed", timeout=5.1)


def test_it_counts_to_three(page_sim: ChartTester) -> None:
    page_sim.start("count_to_three", real=["Log", "Wait", "Sum", "Compare"])
    page_sim.until("done", timeout=4)
    assert page_sim.path("say") == ["say"] * 3


def test_a_used_chart_hands_on_its_outputs(page_sim: ChartTester) -> None:
    page_sim.start("two_places", script={"DriveTo": ["arrived"]}, real=["Format", "Log"])
    page_sim.until("two/drive", timeout=1)
    page_sim.end("two/drive", "arrived")
    page_sim.until("done", timeout=1)
    notes = [str(record.detail) for record in page_sim.run.trace if record.kind == "note"]
    assert any("there at" in note for note in notes)


@pytest.mark.parametrize(("order", "outcome"), [("coffee", "done"), ("beer", "unknown")])
def test_switch_goes_by_a_text(page_sim: ChartTester, order: str, outcome: str) -> None:
    page_sim.start("serve", real=["Switch", "Log"], inputs={"order": order})
    page_sim.until(outcome, timeout=1)


@pytest.mark.parametrize(("level", "asks"), [(None, False), ("high", True), ("full", False)])
def test_an_outcome_asks_unless_its_level_is_below_the_operators(
    page_sim: ChartTester, level: str | None, asks: bool
) -> None:
    page_sim.start("ask_first", script={})
    page_sim.operator.set_level(level)
    page_sim.tick()
    page_sim.end("park", "failed")
    page_sim.tick(2)
    assert bool(page_sim.operator.waiting()) is asks
    assert page_sim.outcome == (None if asks else "failed")


def test_break_pauses_an_attended_run(page_sim: ChartTester) -> None:
    page_sim.start("ask_first", script={"park": "parked"})
    page_sim.operator.attend()
    page_sim.wait(1)
    assert page_sim.run.paused
    assert page_sim.active == ["check"]


def test_types_of_the_page_are_known(author_catalogue: Catalogue, author_project: Path) -> None:
    assert author_project.is_dir()
    named = set(re.findall(r"type: ([A-Z]\w+|signal of \w+|list of \w+)", TEXT))
    assert named <= set(known_types(author_catalogue.types))
    assert named
