"""What a failed expectation tells, in one message."""

from __future__ import annotations

import pytest

from cobodeck.testing.story import story
from cobodeck.testing.testing import ChartTester
from engine import Context, Derived, Measured, Monitor, On, Run, interface
from engine.chart import load_text
from engine.machine import Machine
from engine.run import ChartRun
from engine.signals import Board, declare
from hw.geometry import Pose2
from hw.samples import UserPose

WATCH = """
chart: watch
about: Ends when the person stands, or when the arm cannot be parked.
outcomes: [settled, failed]
any:
  person: {watch: UserSettled, next: {settled: .settled}}
  work:
    states:
      park:
        do: ParkArm
        retry: {times: 2, on: failed, wait: 2 s}
        next: {parked: rest, failed: .failed}
      rest: {do: HoldProp}
"""


def told(sim: ChartTester, where: object, timeout: float) -> list[str]:
    """The lines of the message of a failed `until`."""
    with pytest.raises(AssertionError) as raised:
        sim.until(where, timeout)  # type: ignore[arg-type]
    return str(raised.value).splitlines()


def test_it_tells_where_the_run_is_and_since_when(sim: ChartTester) -> None:
    sim.start(WATCH, script={"park": "parked"})
    sim.wait(1)

    assert told(sim, "settled", 0.5) == [
        "'settled' was not reached within 0.5 s, from 0.97 s to 1.47 s",
        "  active:  person (UserSettled, scripted) for 1.47 s",
        "           work/rest (HoldProp, scripted) for 1.47 s",
        "  entered: person -> work/park -> work/rest",
    ]


def test_a_node_between_two_tries_is_told(sim: ChartTester) -> None:
    sim.start(WATCH, script={"park": ["failed"]})

    assert "           work/park waits for a further try for 0.97 s" in told(sim, "settled", 1)


def test_it_tells_what_is_stale_and_since_when(sim: ChartTester) -> None:
    sim.start(WATCH, script={"park": "parked"}, real=["person"])
    sim.wait(0.5)
    assert told(sim, "settled", 0.5)[3:5] == [
        "  stale:   person reads user.still_since: never seen",
        "           person reads user.pose: never seen",
    ]

    sim.signal("user.pose", UserPose(Pose2(1.0, 2.0), 0.0))
    assert told(sim, "settled", 0.5)[4].endswith(
        "user.pose, at most 0.15 s old: stale since 1.15 s, its last value is of 1.00 s"
    )


def test_what_is_held_is_not_stale(sim: ChartTester) -> None:
    sim.start(WATCH, script={"park": "parked"}, real=["person"])
    sim.signal("user.pose", UserPose(Pose2(1.0, 2.0), 0.0), hold=True)

    assert not any("reads user.pose" in line for line in told(sim, lambda: False, 0.3))


class Full(Monitor):
    """Waits for the tank."""

    outcomes = ("full",)
    reads = {"share": 0.5, "square": None}

    def run(self, ctx: Context) -> Run:
        yield On("share")
        return "full"


def _square(litres: float) -> float:
    raise ValueError(f"{litres:g} is too much")


def test_a_computed_signal_names_what_it_lacks_and_what_it_raises() -> None:
    library = load_text(
        "chart: fill\noutcomes: [full]\nany:\n  w: {watch: Full, next: {full: .full}}\n"
    )
    signals = declare(
        [
            Measured("litres", float),
            Measured("size", float),
            Derived("share", ("litres", "size"), lambda litres, size: litres / size, float),
            Derived("square", ("litres",), _square, float),
        ]
    )
    board = Board(signals)
    run = ChartRun(Machine(library["fill"], library, {"Full": interface(Full)}), board)
    board.put("litres", 4.0, 0)
    run.tick(0)

    assert story(run).splitlines()[1:3] == [
        "  stale:   w reads share: no value, since size was never seen",
        "           w reads square: computing it raises ValueError: 4 is too much",
    ]


def test_it_tells_how_the_chart_ended_and_what_was_raised(sim: ChartTester) -> None:
    sim.start(WATCH, script={"park": RuntimeError("broken")})

    lines = told(sim, "settled", 0.1)

    assert (
        "  active:  nothing; the chart ended with 'error' at 0.00 s,"
        " because work/park ended with 'error'" in lines
    )
    raised = next(line for line in lines if "raised:" in line)
    assert raised.startswith("  raised:  work/park at 0.00 s: ")
    assert raised.endswith("RuntimeError: broken")


def test_a_condition_and_a_path_fail_with_the_same_story(sim: ChartTester) -> None:
    sim.start(WATCH, script={"park": "parked"})
    assert told(sim, lambda: False, 0.1)[0].startswith("the condition was not reached within 0.1 s")

    with pytest.raises(AssertionError) as raised:
        sim.assert_path("rest", "park")

    assert str(raised.value).splitlines()[:4] == [
        "expected rest -> park",
        "     got park -> rest",
        "at 0.07 s:",
        "  active:  person (UserSettled, scripted) for 0.07 s",
    ]


def test_a_pause_is_told(sim: ChartTester) -> None:
    sim.start(WATCH, script={"park": "parked"})
    sim.tick()
    sim.operator.pause()

    assert "  active:  paused by the operator" in told(sim, "settled", 0.2)


def test_a_tester_shows_as_what_it_runs(sim: ChartTester) -> None:
    assert repr(sim) == "<sim, not started>"

    sim.start(WATCH, script={"park": "parked"})
    sim.tick()

    assert repr(sim) == "<sim of watch at 0.00 s: person, work/rest>"
