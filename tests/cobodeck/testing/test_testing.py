"""The tools for authors of charts: scripted outcomes, scripted signals, virtual time."""

import math
import re
from pathlib import Path

import pytest

from cobodeck.terminal.console import Problem
from cobodeck.testing.stub_parts import Parts
from cobodeck.testing.testing import ChartTester
from engine.machine.vertices import Leaf
from hw.geometry import Pose2
from hw.samples import UserPose

FETCH = """
chart: fetch
about: Drives somewhere, and gives way to faults.
outcomes: [there, failed]
inputs: {goal: Pose2}
any:
  fault: {watch: FaultRaised, next: {raised: .failed}}
  go:
    states:
      park: {do: ParkArm, next: {parked: drive, failed: .failed}}
      drive:
        do: DriveTo
        in: {goal: goal}
        retry: {times: 1, on: stuck, wait: 1 s}
        timeout: 20 s
        next: {arrived: .there, stuck: .failed, timeout: .failed, no_path: rest, lost: .failed}
      rest: {do: HoldProp}
    next: {there: .there, failed: .failed}
"""
GOAL = {"goal": Pose2(1.0, 2.0, 0.5)}


def test_leaves_do_as_the_script_says_one_outcome_after_the_other(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"park": "parked", "drive": ["stuck", "arrived"]})

    sim.until("there", timeout=3)

    sim.assert_path("park", "drive", "drive")
    assert sim.path() == ["fault", "go/park", "go/drive", "go/drive"]
    assert sim.now == pytest.approx(1.0, abs=0.04)


def test_scripts_name_leaves_by_path_or_class(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"ParkArm": "parked", "go/drive": "arrived"})

    sim.until("there", timeout=1)


def test_what_the_script_leaves_out_stays_busy(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"park": "parked"})

    sim.wait(10)

    assert sim.active == ["fault", "go/drive"]
    sim.end("fault", "raised")
    sim.until("failed", timeout=0.1)


def test_virtual_time_passes_timeouts_at_once(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"park": "parked"})

    sim.until("failed", timeout=21)

    assert sim.now == pytest.approx(20.0, abs=0.04)


def test_a_scripted_leaf_may_raise(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"park": RuntimeError("broken")})

    sim.until("error", timeout=1)


def test_outputs_come_with_outcomes_and_results_out_of_the_chart(sim: ChartTester) -> None:
    text = (
        "chart: ask\noutcomes: [asked]\noutputs: {asked: {since: integer}}\n"
        "data: {since: {type: integer, initial: none}}\nstates:\n"
        "  listen: {watch: HapticRequest, out: {since: since}, next: {requested: .asked}}\n"
    )

    sim.start(text, script={"listen": ("requested", {"since": 5})})
    sim.until("asked", timeout=1)

    assert sim.results == {"since": 5}


def test_a_real_monitor_sees_scripted_signals(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"park": "parked"}, real=["FaultRaised"])
    sim.signal("stop.engaged", None)
    sim.until("drive", timeout=1)

    sim.signal("stop.engaged", "bumper: person")

    sim.until("failed", timeout=0.1)


@pytest.mark.parametrize(
    ("name", "value", "wrong"),
    [
        ("stop.engaged", 5, "its value is 5 (int); wanted: str"),
        ("user.pose", (1.0, 2.0), "its value is a tuple; wanted: UserPose"),
        ("user.pose", UserPose("here", 0.0), "its value's body is 'here' (str); wanted: Pose2"),  # type: ignore[arg-type]
        ("user.pose", UserPose(Pose2(0.0, math.nan), 0.0), "a number in it is not finite"),
    ],
)
def test_a_signal_of_another_type_fails_the_test(
    sim: ChartTester, name: str, value: object, wrong: str
) -> None:
    sim.start(FETCH, inputs=GOAL, real=["fault"])

    with pytest.raises(AssertionError, match=re.escape(f"signal {name!r}: {wrong}")):
        sim.signal(name, value)


def test_a_real_action_gets_stand_ins_for_its_parts(sim: ChartTester, parts: Parts) -> None:
    text = (
        "chart: hold\noutcomes: [done]\nany:\n"
        "  lost: {watch: UserLost, next: {lost: .done}}\n"
        "  hold: {do: WarnUser, next: {error: .done}}\n"
    )
    sim.start(text, script={"lost": []}, real=["hold"])
    sim.wait(1)
    assert parts["vr"].commands[-1] == ("inform", True, 0.0)

    sim.end("lost", "lost")
    sim.until("done", timeout=0.1)

    assert ("inform", False) in parts["vr"].commands


def test_until_takes_a_condition(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"park": "parked"})

    sim.until(lambda: sim.now > 2.0, timeout=3)

    assert 2.0 < sim.now < 2.1


CHAIN = """
chart: chain
about: Three short steps and a long one.
outcomes: [over]
any:
  fault: {watch: FaultRaised, next: {raised: .over}}
  steps:
    states:
      a: {do: ParkArm, next: {parked: b, failed: .over}}
      b: {do: ParkArm, next: {parked: c, failed: .over}}
      c: {do: ParkArm, next: {parked: rest, failed: .over}}
      rest: {do: HoldProp}
"""
JOINED = """
chart: joined
about: Two things at once; it is over when both have ended.
outcomes: [done]
all:
  short: {do: ParkArm}
  long: {watch: FaultRaised}
"""


def test_until_a_node_that_was_left_before_is_not_reached(sim: ChartTester) -> None:
    sim.start(CHAIN, script=dict.fromkeys(("a", "b", "c"), "parked"))
    sim.until("rest", timeout=1)
    sim.tick(8)

    for over in ("a", "b", "c"):
        with pytest.raises(AssertionError, match=f"'{over}' was not reached within 0.2 s"):
            sim.until(over, timeout=0.2)
    sim.until("rest", timeout=0.1)
    sim.until("steps", timeout=0.1)


def test_until_a_node_that_has_ended_beside_others_is_not_reached(sim: ChartTester) -> None:
    sim.start(JOINED, script={"short": "parked"})
    sim.tick(3)

    with pytest.raises(AssertionError, match="'short' was not reached"):
        sim.until("short", timeout=0.2)
    sim.until("long", timeout=0.1)


def test_until_a_node_is_entered_once_more(sim: ChartTester) -> None:
    again = CHAIN.replace(
        "c: {do: ParkArm, next: {parked: rest", "c: {do: ParkArm, next: {parked: a"
    )
    sim.start(again, script={"a": ["parked"], "b": "parked", "c": "parked"})
    sim.until("c", timeout=1)

    sim.until("a", timeout=1)

    sim.assert_path("a", "b", "c", "a")


def test_a_chart_runs_on_the_simulated_robot_too(sim: ChartTester) -> None:
    sim.start("cobodeck", scene="lab_a", user="cornering")

    sim.until("haptic", timeout=60)
    sim.until("escape", timeout=120)

    assert sim.path("chase", "haptic")[:2] == ["chase", "haptic"]
    assert sim.metrics is not None
    assert sim.metrics()["requests"] == len(sim.metrics()["request_list"]) >= 1
    assert sim.metrics()["escapes"] == len(sim.metrics()["escape_list"])


def test_on_the_robot_the_script_takes_over_single_leaves(sim: ChartTester) -> None:
    sim.start("cobodeck", script={"danger": "required"}, scene="lab_a", user="cornering")

    sim.until("escape", timeout=1)


MISTAKES = [
    (
        lambda sim: sim.start(FETCH, inputs=GOAL, script={"drve": "arrived"}),
        "no leaf 'drve'.*'go/drive'|'drive'",
    ),
    (
        lambda sim: sim.start(FETCH, inputs=GOAL, script={"go": "there"}),
        "no leaf 'go' .* 'go' is a container; script its leaves: 'go/park', 'go/drive', 'go/rest'",
    ),
    (
        lambda sim: sim.start("cobodeck", script={"inform": "restarted"}),
        "'inform' uses chart inform; script its leaves: 'inform/",
    ),
    (
        lambda sim: sim.start(FETCH, inputs=GOAL, script={"drive": "arived"}),
        "did you mean 'arrived'",
    ),
    (lambda sim: sim.start(FETCH, inputs=GOAL, real=["Parkarm"]), "did you mean 'ParkArm'"),
    (lambda sim: sim.start(FETCH, inputs=GOAL).until("drve"), "no node 'drve'.*'drive'"),
    (
        lambda sim: sim.start(FETCH, inputs=GOAL).until("there", timeout=1),
        "not reached within 1 s, .*active:  f",
    ),
    (lambda sim: sim.start(FETCH, inputs=GOAL).signal("user.pos", 1), "no signal 'user.pos'"),
    (
        lambda sim: sim.start(FETCH, inputs=GOAL).assert_path("drive"),
        "expected drive\n.*got nothing",
    ),
    (lambda sim: sim.start(FETCH.replace("ParkArm", "Park")), "no state class 'Park'"),
    (lambda sim: sim.tick(), "start a chart first"),
    (lambda sim: sim.signal("stop.engaged", None), "start a chart first"),
    (
        lambda sim: sim.start(FETCH, inputs=GOAL, signals={"stop.engaged": 5}),
        "'stop.engaged': its value is 5 .int.; wanted: str",
    ),
    (
        lambda sim: sim.start("chase", scene="study", signals={"stop.engaged": "x"}),
        "signals= is for charts without a robot",
    ),
]


@pytest.mark.parametrize(("mistake", "message"), MISTAKES)
def test_mistakes_in_a_test_are_named(sim: ChartTester, mistake: object, message: str) -> None:
    with pytest.raises(AssertionError, match=f"(?s){message}"):
        mistake(sim)  # type: ignore[operator]


def test_a_chart_that_is_not_there_is_named(sim: ChartTester) -> None:
    with pytest.raises(Problem, match="did you mean 'chase'"):
        sim.start("chasse")


SERVE = """
chart: serve
outcomes: [there, failed]
inputs:
  goal: Pose2
  back: {type: Pose2, default: {place: west}}
  often: {type: integer, default: 2}
states:
  go:
    do: DriveTo
    in: {goal: goal}
    next: {arrived: home, no_path: home, stuck: home, lost: home}
  home:
    do: DriveTo
    in: {goal: back}
    next: {arrived: .there, no_path: .failed, stuck: .failed, lost: .failed}
"""


def given_to(sim: ChartTester, path: str) -> object:
    leaf = sim.run.machine.vertices[path]
    assert isinstance(leaf, Leaf)
    return sim.run.life.inputs_of(leaf)["goal"]


@pytest.mark.parametrize(
    "goal",
    [
        Pose2(2.5, 5.0),
        {"x": "2.5 m", "y": 5},
        {"place": "west"},
        {"x": 2.5, "y": 5, "yaw": "0 deg"},
    ],
)
def test_inputs_are_given_as_in_a_chart_or_as_values(sim: ChartTester, goal: object) -> None:
    sim.start(SERVE, inputs={"goal": goal})
    sim.tick()

    assert given_to(sim, "go") == given_to(sim, "home") == Pose2(2.5, 5.0)


def test_on_the_simulated_robot_places_are_those_of_the_scene(
    sim: ChartTester, tmp_path: Path
) -> None:
    file = tmp_path / "serve.yaml"
    file.write_text(SERVE)

    sim.start(str(file), scene="lab_a", inputs={"goal": {"place": "center"}})
    sim.tick()

    assert given_to(sim, "go") == Pose2(5.55, 5.05, 1.571)
    with pytest.raises(Problem, match="goal: there is no place 'north_east' here"):
        sim.start(str(file), scene="lab_a", inputs={"goal": {"place": "north_east"}})
    with pytest.raises(AssertionError, match=r"serve needs input 'goal' .*inputs={'goal': …}"):
        sim.start(str(file), scene="lab_a")


WRONG_INPUTS = {
    "goal: 3 is not a Pose2": {"goal": 3},
    "goal: nothing given": {"goal": None},
    "goal.x: '2 s' is a duration; wanted: a length": {"goal": {"x": "2 s", "y": 1}},
    "goal: there is no place 'moon' here; allowed: center": {"goal": {"place": "moon"}},
    "it has no input 'gaol'; did you mean 'goal'": {"gaol": 1},
    "often: 2.5 is not a whole number": {"goal": {"x": 1, "y": 2}, "often": 2.5},
    "serve needs input 'goal' (a Pose2, {x: …, y: …, yaw: …} or {place: …}); "
    "start it with inputs={'goal': …}": {},
}


@pytest.mark.parametrize("message", WRONG_INPUTS)
def test_inputs_that_are_wrong_or_missing_are_named(sim: ChartTester, message: str) -> None:
    with pytest.raises(AssertionError, match=re.escape(message)):
        sim.start(SERVE, inputs=WRONG_INPUTS[message])


LONELY = """
chart: lonely
outcomes: [met, alone]
states:
  wait:
    watch: Below
    with: {signal: user.distance, limit: 1.5 m}
    timeout: 20 s
    next: {below: .met, timeout: .alone}
"""


def test_a_timeout_is_over_when_the_test_says_so(sim: ChartTester) -> None:
    sim.start(FETCH, inputs=GOAL, script={"park": "parked"})
    sim.until("drive")
    with pytest.raises(AssertionError, match="no timeout of 'fault' runs"):
        sim.time_out("fault")
    sim.time_out("drive")
    sim.tick()
    assert sim.outcome == "failed"
    with pytest.raises(AssertionError, match="'rust'"):
        sim.time_out("rust")


def test_a_timeout_is_over_while_a_real_state_sleeps(sim: ChartTester) -> None:
    sim.start(LONELY, real=["wait"])
    sim.signal("user.distance", 4.0, hold=True)
    sim.wait(1)
    sim.time_out("wait")
    sim.tick()
    assert sim.outcome == "alone"
