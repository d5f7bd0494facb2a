"""Two behaviours stand written out; they say the same as the converted ones, and they run."""

from __future__ import annotations

import pytest

from engine.chart.chart import AUTONOMY
from engine.check.all_checks import check
from engine.machine.exploration import explore
from engine.machine.vertices import Box, Leaf
from tests.cobodeck.flexbe.conftest import HZ, Play, written_library, written_machine
from tests.cobodeck.flexbe.states import INTERFACES, TYPES, Pose, Trajectory

written = pytest.mark.parametrize("name", ["detect_pipes", "example_3"])

OR, AND = "Concurrent_OR", "Container_AND"
OUT, BACK = "EEF_To_Detected/Move_To_Out_Pose", "EEF_To_Detected/Move_Back_Out"
GRIPPER = "EEF_To_Detected/Gripper_Action"


def shape(machine):
    """All that a machine does, apart from the order in which sequences are written down."""
    found = {}
    for path, vertex in machine.vertices.items():
        said = {
            "autonomy": vertex.autonomy,
            "go": {outcome: target.path for outcome, target in vertex.go.items()},
            "leave": vertex.leave,
        }
        if isinstance(vertex, Leaf):
            said["class"] = vertex.interface.name
            said["with"] = vertex.parameters
            said["in"] = {name: (cell.key, cell.initial) for name, cell in vertex.inputs}
            said["out"] = {
                name: cell.key for keys in vertex.outputs.values() for name, cell in keys
            }
        elif isinstance(vertex, Box):
            children = [child.path for child in vertex.children]
            said["form"] = vertex.form
            said["children"] = children if vertex.form == "any" else (children[0], set(children))
            said["rules"] = [(o, list(ends.items())) for o, ends in vertex.rules]
        found[path] = said
    return found


@written
def test_it_says_the_same_as_the_converted_one(machine, name):
    assert shape(written_machine(name)) == shape(machine(name))


@written
def test_its_outcomes_and_parameters_are_those_of_the_converted_one(library, name):
    ours, theirs = written_library()[name], library[name]
    assert ours.outcomes == theirs.outcomes
    assert ours.keys.keys() == theirs.keys.keys()
    assert ours.parameters.keys() == theirs.parameters.keys()


@written
def test_it_is_checked_without_a_warning(name):
    library = written_library()
    findings = check(library, INTERFACES, types=TYPES)
    assert [f.message for f in findings if f.place.file.endswith(f"{name}.yaml")] == []


@written
def test_every_outcome_of_every_state_is_walked(name):
    machine = written_machine(name)
    found = explore(machine)
    outcomes = {(leaf.path, end) for leaf in machine.leaves for end in leaf.interface.outcomes}
    assert found.complete
    assert outcomes <= found.moves.keys()
    assert found.outcomes.keys() == {"finished", "failed"}


# -- conditions ------------------------------------------------------------------------------------


def in_or() -> Play:
    """A run of example 3 that waits in the container that ends with its first child."""
    play = Play(written_machine("example_3"))
    assert play.end(("Start", "done")) == [f"{OR}/A", f"{OR}/B"]
    play.tick()
    return play


def in_and() -> Play:
    """A run of example 3 that waits in the container that ends with both children."""
    play = in_or()
    play.end((f"{OR}/A", "done"))
    play.end(("Delay", "done"))
    assert play.end(("EnterAnd", "done")) == [f"{AND}/C", f"{AND}/D"]
    play.tick()
    return play


@pytest.mark.parametrize(
    ("ends", "then"),
    [
        ({"A": "done"}, "Delay"),
        ({"B": "done"}, "Delay"),
        ({"A": "failed"}, "Failed"),
        ({"B": "failed"}, "Failed"),
        ({"A": "failed", "B": "done"}, "Delay"),  # the second item stands before the third
        ({"A": "done", "B": "failed"}, "Delay"),
        ({"A": "failed", "B": "failed"}, "Failed"),
    ],
)
def test_the_first_item_that_matches_ends_the_container(ends, then):
    play = in_or()
    assert play.end(*((f"{OR}/{child}", end) for child, end in ends.items())) == [then]


def test_all_children_are_stepped_before_the_conditions_are_looked_at():
    play = in_or()
    play.end((f"{OR}/A", "done"))
    assert play.steps[:2] == [f"{OR}/A", f"{OR}/B"]
    assert play.stops == [f"{OR}/A", f"{OR}/B"]


def test_and_waits_for_the_other_child():
    play = in_and()
    assert play.end((f"{AND}/C", "done")) == [f"{AND}/D"]
    play.tick(20)
    assert play.end((f"{AND}/D", "done")) == ["Done"]


def test_and_ends_when_both_end_in_one_tick():
    assert in_and().end((f"{AND}/C", "done"), (f"{AND}/D", "done")) == ["Done"]


@pytest.mark.parametrize(("first", "second"), [("C", "D"), ("D", "C")])
def test_a_failure_ends_and_though_the_other_is_done_or_runs(first, second):
    assert in_and().end((f"{AND}/{first}", "failed")) == ["Failed"]
    play = in_and()
    play.end((f"{AND}/{first}", "done"))
    assert play.end((f"{AND}/{second}", "failed")) == ["Failed"]


# -- parameters ------------------------------------------------------------------------------------


def test_it_runs_in_real_states_for_as_long_as_it_says():
    play = Play(written_machine("example_3"), scripted=False)
    play.until(lambda: play.run.outcome)
    assert play.run.outcome == "finished"
    # B after 2 s, the delay of 1 s, C after 4 s, and one tick for each of the three messages
    assert play.seconds == pytest.approx(2 + 1 + 4 + 3 / HZ)


def test_parameters_that_are_given_override_those_of_the_chart():
    given = {"waiting_time_a": "500 ms", "waiting_time_c": 1.5, "waiting_time_d": "3 s"}
    machine = written_machine("example_3", given)
    assert machine.vertices[f"{OR}/A"].parameters == {"target_time": 0.5}
    assert machine.vertices[f"{OR}/B"].parameters == {"target_time": 2.0}
    play = Play(machine, scripted=False)
    play.until(lambda: play.run.outcome)
    assert play.seconds == pytest.approx(0.5 + 1 + 3 + 3 / HZ)


# -- data ------------------------------------------------------------------------------------------


def pick_first_pipe(play: Play) -> None:
    """Script a run of detect_pipes up to where the first pipe is picked."""
    play.end(("Get_Pipes/Get_Observation_Arm_Config", "retrieved"), joint_values=(1.0, 2.0))
    play.end(("Get_Pipes/Move_To_Observation_Pose", "reached"))
    play.end(("Get_Pipes/Detect_Pipes", "found"))
    seen = {"object_id": "p", "object_pose": Pose(3.0), "object_data": (0.0, 0.1, 0.2)}
    play.end(("Get_Pipes/Get_Pipes_Pose", "detected"), **seen)
    play.end(("Get_Pipes/Visualize_Pipes_Pose", "done"))
    play.end(("Select_Pipe/Increment_Index", "done"), output_value=0)
    play.end(("Select_Pipe/Select_Pipe", "selected"), pipe_pose=Pose(3.0, 0.1, 0.2))


def test_remapped_data_arrives():
    play = Play(written_machine("detect_pipes"))
    play.tick()
    pick_first_pipe(play)
    inputs = play.script.inputs
    assert inputs["Get_Pipes/Move_To_Observation_Pose"] == {"joint_config": (1.0, 2.0)}
    assert inputs["Get_Pipes/Visualize_Pipes_Pose"] == {"pose": Pose(3.0)}
    assert inputs["Select_Pipe/Increment_Index"] == {"input_value": -1}
    assert inputs["Select_Pipe/Select_Pipe"] == {
        "object_pose": Pose(3.0),
        "object_data": (0.0, 0.1, 0.2),
        "pose_choice": 0,
    }
    play.end(("Decide_Look_At", "focus"))
    # `pipe_pose` inside Select_Pipe is `pipes_pose` outside, and `waypoint` for the state
    assert inputs["Look_At_Target"] == {"waypoint": Pose(3.0, 0.1, 0.2)}
    play.end(("Look_At_Target", "reached"))
    assert inputs["Move_To_Pregrasp"] == {"joint_config": (0.0, 1.57, 0.77, 0.38, 0.0)}
    play.end(("Move_To_Pregrasp", "reached"))
    assert inputs[f"{OUT}/Move_Pose_Out"] == {"input_value": Pose(3.0, 0.1, 0.2)}


def test_containers_that_name_a_key_alike_do_not_share_it():
    play = Play(written_machine("detect_pipes"), scripted=False)
    play.until(lambda: f"{BACK}/Execute_Cartesian_Path_Back" in play.run.active)
    data = {r.detail[0]: r.detail[1] for r in play.run.trace if r.kind == "data"}
    assert data["joint_trajectory"] == Trajectory(((0.9, 0.2, 0.0),))
    assert data["Move_Back_Out_joint_trajectory"] == Trajectory(((0.7, 0.2, 0.0),))
    notes = play.run.notes
    assert (
        notes["EEF_To_Detected/Move_To_Close_Pose/Execute_Cartesian_Path"] == "((0.9, 0.2, 0.0),)"
    )
    assert notes[f"{BACK}/Execute_Cartesian_Path_Back"] == "((0.7, 0.2, 0.0),)"


def test_it_visits_one_pipe_after_the_other_in_real_states():
    play = Play(written_machine("detect_pipes"), scripted=False)
    play.until(lambda: play.run.outcome)
    assert play.run.outcome == "finished"
    seen = [r.detail[1] for r in play.run.trace if r.kind == "data" and r.detail[0] == "pipes_pose"]
    assert seen == [Pose(1.0, 0.2), Pose(1.0, -0.2)]
    assert play.run.trace.path().count(f"{GRIPPER}/Close_Gripper") == 2


# -- autonomy --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("level", "waits"),
    [("off", True), ("low", True), ("high", False), ("full", False), (None, False)],
)
def test_an_outcome_waits_unless_the_level_is_above_the_required_one(level, waits):
    play = Play(written_machine("example_3"), level=None if level is None else AUTONOMY[level])
    play.tick()
    play.end(("Start", "done"))  # requires low
    assert play.operator.waiting() == ({"Start": "done"} if waits else {})
    assert play.run.active == ([] if waits else [f"{OR}/A", f"{OR}/B"])


def test_consent_lets_an_outcome_go():
    play = Play(written_machine("example_3"), level=AUTONOMY["low"])
    play.tick()
    play.end(("Start", "done"))
    play.tick(10)
    assert play.operator.waiting() == {"Start": "done"}
    assert play.operator.consent("Start") is None
    assert play.tick() == [f"{OR}/A", f"{OR}/B"]
    assert not play.operator.waiting()


def test_refusal_is_a_further_try():
    play = Play(written_machine("example_3"), level=AUTONOMY["low"])
    play.tick()
    play.end(("Start", "done"))
    assert play.operator.refuse("Start") is None
    play.tick(2)
    assert play.run.active == ["Start"]
    assert not play.operator.waiting()
    assert [r.kind for r in play.run.trace if r.subject == "Start" and r.kind == "enter"] == [
        "enter",
        "enter",
    ]


def test_a_higher_level_lets_go_what_waited():
    play = Play(written_machine("example_3"), level=AUTONOMY["low"])
    play.tick()
    play.end(("Start", "done"))
    assert play.operator.set_level("high") is None
    assert play.tick() == [f"{OR}/A", f"{OR}/B"]


def test_a_child_of_a_condition_waits_and_the_others_go_on():
    """At level off even `off` asks: the child has not ended before the operator consents."""
    play = Play(written_machine("example_3"), level=AUTONOMY["off"])
    play.tick()
    play.end(("Start", "done"))
    play.operator.consent("Start")
    play.tick(2)
    play.end((f"{OR}/A", "done"))
    assert play.operator.waiting() == {f"{OR}/A": "done"}
    play.tick()
    assert play.steps == [f"{OR}/B"]
    play.end((f"{OR}/B", "failed"))
    assert play.operator.waiting() == {f"{OR}/A": "done", f"{OR}/B": "failed"}
    assert play.operator.consent(f"{OR}/B") is None
    assert play.tick() == ["Failed"]
    assert not play.operator.waiting()


def test_a_decision_waits_for_the_operator_even_at_full_autonomy():
    """`full` is required: nobody but the operator says whether to grasp, or to go back instead."""
    play = Play(written_machine("detect_pipes"), level=AUTONOMY["full"], scripted=False)
    decision = f"{GRIPPER}/Decide_Close_Gripper"
    play.until(play.operator.waiting)
    assert play.operator.waiting() == {decision: "close_gripper"}
    play.tick(20)
    assert play.operator.waiting() == {decision: "close_gripper"}
    assert play.operator.force(decision, "move_back") is None
    play.tick()
    assert play.run.active == [f"{BACK}/Execute_Cartesian_Path_Back"]


def test_at_low_autonomy_the_operator_consents_to_every_careful_step():
    play = Play(written_machine("detect_pipes"), level=AUTONOMY["low"], scripted=False)
    asked = []
    while play.run.outcome is None:
        play.tick()
        for path in play.operator.waiting():
            asked.append(path.rpartition("/")[2])
            play.operator.consent(path)
    assert play.run.outcome == "finished"
    assert asked[:5] == [
        "Move_To_Observation_Pose",
        "Detect_Pipes",
        "Visualize_Pipes_Pose",
        "Decide_Look_At",
        "Move_To_Pregrasp",
    ]
    assert not {"Get_Pipes_Pose", "Increment_Index", "Select_Pipe", "Move_Pose_Out"} & set(asked)
