"""Signals that a test holds, and signals that it lets change as time passes."""

from __future__ import annotations

import re
from typing import Any

import pytest

from cobodeck.testing.testing import ChartTester
from hw.geometry import Pose2
from hw.samples import UserPose

WATCH = """
chart: watch
about: Ends when the person is lost, or when danger is told.
outcomes: [lost, told]
any:
  person: {watch: UserLost, next: {lost: .lost}}
  danger: {watch: EscapeRequired, next: {required: .told}}
"""
HERE, THERE = UserPose(Pose2(1.0, 2.0), 0.0), UserPose(Pose2(3.0, 2.0), 0.0)


@pytest.fixture
def watching(sim: ChartTester) -> ChartTester:
    return sim.start(WATCH, real=["UserLost", "EscapeRequired"], signals={"escape.required": False})


def seen(sim: ChartTester, name: str) -> Any:
    newest = sim.run.board.slots[name].read()
    return None if newest is None else newest.value


def test_a_single_sample_grows_too_old(watching: ChartTester) -> None:
    watching.signal("user.pose", HERE)

    watching.until("lost", timeout=0.3)

    assert watching.now == pytest.approx(0.2, abs=0.04)


def test_a_signal_that_is_held_never_grows_too_old(watching: ChartTester) -> None:
    watching.signal("user.pose", HERE, hold=True)

    watching.wait(60)

    assert watching.outcome is None


def test_a_held_signal_is_news_once(watching: ChartTester) -> None:
    watching.signal("user.pose", HERE, hold=True)
    watching.tick(1)
    before = watching.loop.left_out

    watching.tick(100)

    assert watching.loop.left_out - before >= 95


def test_a_signal_is_held_for_as_long_as_is_said(watching: ChartTester) -> None:
    watching.signal("user.pose", HERE, hold=2.0)

    watching.until("lost", timeout=3)

    assert watching.now == pytest.approx(2.0 + 0.15, abs=0.05)


def test_what_is_held_is_replaced_by_what_comes_next(watching: ChartTester) -> None:
    watching.signal("user.pose", HERE, hold=True)
    watching.wait(1)
    watching.signal("user.pose", THERE, hold=True)
    watching.wait(1)
    assert seen(watching, "user.pose") == THERE

    watching.signal("user.pose", HERE)
    watching.until("lost", timeout=0.3)

    assert seen(watching, "user.pose") == HERE


def test_a_series_holds_each_value_until_the_next(watching: ChartTester) -> None:
    watching.wait(0.1)
    watching.signal("escape.required", False, hold=True)
    watching.series("user.pose", {1.0: THERE, 0: HERE})

    watching.wait(1.0)
    assert seen(watching, "user.pose") == HERE
    watching.tick()
    assert seen(watching, "user.pose") == THERE
    watching.wait(30)

    assert watching.outcome is None
    assert seen(watching, "user.pose") == THERE


def test_before_the_first_instant_of_a_series_nothing_comes(watching: ChartTester) -> None:
    watching.series("user.pose", {1.0: HERE})

    watching.until("lost", timeout=0.3)


def test_a_series_wakes_a_state_that_waits_for_news(watching: ChartTester) -> None:
    watching.signal("user.pose", HERE, hold=True)
    watching.series("escape.required", {0: False, 0.5: True})

    watching.until("told", timeout=1)

    assert watching.now == pytest.approx(0.5, abs=0.001)


def test_several_samples_of_an_event_may_come_with_one_tick(sim: ChartTester) -> None:
    deep = {"x": "1 m", "y": "2 m", "z": "1 m"}
    sim.start("haptic", real=["Released"], inputs={"since": 0, "deep": deep})
    before = sim.run.board.inlets["vr.release"].evaluated

    sim.signal("vr.release", True)
    sim.signal("vr.release", True)
    sim.tick()

    assert sim.run.board.inlets["vr.release"].evaluated - before == 2


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (
            lambda sim: sim.signal("escape.required", 1, hold=True),
            "signal 'escape.required': its value is 1 (int); wanted: bool",
        ),
        (
            lambda sim: sim.series("user.pose", {0: HERE, 1: "there"}),
            "signal 'user.pose': its value is 'there' (str); wanted: UserPose",
        ),
        (lambda sim: sim.series("user.pos", {0: HERE}), "did you mean 'user.pose'"),
        (lambda sim: sim.signal("user.pose", HERE, hold=-1), "held for -1; wanted: s, more than 0"),
        (lambda sim: sim.series("user.pose", {-0.5: HERE}), "at -0.5; wanted: seconds as a number"),
        (lambda sim: sim.series("user.pose", {"1 s": HERE}), "at '1 s'; wanted: seconds as a numb"),
        (
            lambda sim: sim.signal("user.pose", HERE, hold="2 s"),
            "hold='2 s'; wanted: seconds as a number, as in hold=2.5",
        ),
        (lambda sim: sim.until("told", timeout="2 s"), "timeout='2 s'; wanted: seconds as a numb"),
        (lambda sim: sim.wait("2 s"), "seconds='2 s'; wanted: seconds as a number"),
    ],
)
def test_what_cannot_be_fed_is_refused_at_once(
    watching: ChartTester, wrong: Any, message: str
) -> None:
    with pytest.raises(AssertionError, match=re.escape(message)):
        wrong(watching)


def test_what_a_part_measures_cannot_be_fed_but_events_can_be_added(sim: ChartTester) -> None:
    sim.start("cobodeck", scene="study")

    with pytest.raises(AssertionError, match="measured by a part here"):
        sim.signal("user.pose", HERE, hold=True)
    sim.signal("operator.acknowledge", True)
    sim.tick()


def test_a_constant_is_given_once(sim: ChartTester) -> None:
    sim.start("chase")

    with pytest.raises(AssertionError, match="'settings' is a constant, and never too old"):
        sim.signal("settings", object(), hold=True)
