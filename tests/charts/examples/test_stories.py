"""The examples alone, in virtual time."""

from __future__ import annotations

import pytest

from cobodeck.__main__ import main
from cobodeck.project.named_files import EXAMPLES
from cobodeck.terminal.console import FAILED, OK
from cobodeck.testing import ChartTester, EdgeCoverage
from tests.charts.examples.stories import LOW, SERVING, STORIES, Story, begin


def test_the_examples_pass_every_check(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(EXAMPLES)
    assert main(["validate", "--strict"]) == OK
    out, err = capsys.readouterr()
    assert f"no errors in {len(list(EXAMPLES.rglob('*.yaml')))} files" in out
    assert not err


def test_a_robot_without_an_arm_cannot_pick_anything_up(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(EXAMPLES)
    assert main(["simulate", "pick_and_place", "--scene", "yard"]) == FAILED
    assert "this robot lacks part 'arm', commanded by MoveArmTo" in capsys.readouterr().err


@pytest.mark.slow
def test_the_stories_end_as_told_and_take_every_edge(sim: ChartTester) -> None:
    edges, ended = EdgeCoverage(), {}
    for what, story in STORIES.items():
        begin(sim, story)
        sim.until(lambda: sim.outcome, timeout=1000.0)
        ended[what] = sim.outcome
        edges.add(sim.run)
    assert ended == {what: story.outcome for what, story in STORIES.items()}
    assert [line for line in edges.report(EXAMPLES) if line.startswith(" ")] == []


def test_after_charging_the_tea_goes_on_to_the_table_it_was_at(sim: ChartTester) -> None:
    begin(sim, STORIES["the battery gets low"])
    sim.until("served", timeout=200.0)
    sim.assert_path("offer", "offer", "charge", "offer", "offer", "offer")


def test_a_low_battery_goes_before_the_operators_call(sim: ChartTester) -> None:
    call = {"operator.acknowledge": {21.0: True}}  # the battery has been low for 1 s
    begin(sim, Story("tea", "served", {**SERVING, "charge/drive": "arrived"}, LOW | call))
    sim.until("charge", timeout=30.0)
    assert 21.0 <= sim.now < 21.1


def test_a_way_that_is_blocked_is_tried_again_after_five_seconds(sim: ChartTester) -> None:
    begin(sim, STORIES["a chair is in the way for a while"])
    sim.until("bring", timeout=5.0)
    first = sim.now
    sim.until("offer", timeout=60.0)
    assert 15.0 <= sim.now - first < 15.2


def test_the_watch_tells_how_near_somebody_came(sim: ChartTester) -> None:
    begin(sim, STORIES["somebody is at the door"])
    sim.until("seen", timeout=60.0)
    assert sim.results == {"distance": 2.0}
    assert any("somebody is 2.0 m away" in line for line in sim.run.trace.lines())
