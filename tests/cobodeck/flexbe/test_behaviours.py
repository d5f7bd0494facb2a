"""Five real FlexBE behaviours are converted whole: nothing of the JSON is lost on the way.

What is expected is read from the JSON here once more, without the converter.
"""

from __future__ import annotations

import re

import pytest

from engine.chart.chart import AUTONOMY
from engine.check.all_checks import check
from engine.machine.exploration import explore
from engine.machine.vertices import Leaf
from tests.cobodeck.flexbe.conftest import NAMES, Play

SMALL = ("example_3", "example_4")
every_behaviour = pytest.mark.parametrize("name", NAMES)

# What the originals themselves cannot do: outcomes that nothing in their container leads to,
# and a state to which no transition leads.
IMPOSSIBLE = {
    "action_follow": {("Follow/Look_at/Find_back/Turn_head", "fail"), ("Follow/Follow", "failed")},
    "action_give": {
        ("give", "continue"),
        ("give/Follow", "finished"),
        ("give/LookAt", "failed"),
    },
}
UNREACHABLE = {"action_give": {("remove_gripper_content", "done")}}
WARNINGS = {"action_give": ["'remove_gripper_content' is never reached"]}


def plain(name):
    return re.sub("[^0-9A-Za-z]+", "_", name).strip("_")


def states_in(behaviours, name, prefix="", container="_state_machine"):
    """Each state with its path, its container and the container's path."""
    inside = behaviours[name]["containers"][container]
    for state in inside["states"]:
        path = prefix + plain(state["name"])
        yield state, path, inside, prefix
        if "container" in state:
            yield from states_in(behaviours, name, f"{path}/", state["container"])
        elif "behavior" in state:
            assert state["behavior"] == "Example3SM"
            yield from states_in(behaviours, "example_3", f"{path}/")


def edges_in(behaviours, name):
    """Each outcome of each state; where it leads in sequences, else nothing."""
    edges = {}
    for state, path, container, prefix in states_in(behaviours, name):
        siblings = {sibling["name"] for sibling in container["states"]}
        for outcome, target in state["transitions"].items():
            leads_to = prefix + plain(target) if target in siblings else f".{target}"
            drawn_only = container["kind"] == "concurrency"
            edges[path, outcome] = None if drawn_only else leads_to
    return edges


@every_behaviour
def test_it_loads_and_is_checked_without_errors(converted, library, name):
    assert not library.findings
    findings = [f for f in check(library, converted.interfaces()) if f.place.file == f"{name}.yaml"]
    assert [f.message for f in findings if f.severity == "error"] == []
    assert [f.message for f in findings if f.severity == "warning"] == WARNINGS.get(name, [])


@every_behaviour
def test_every_state_and_transition_is_in_the_chart(behaviours, machine, name):
    vertices = machine(name).vertices
    wanted = edges_in(behaviours, name)
    assert set(vertices) - {""} == {path for path, _ in wanted}
    for impossible in IMPOSSIBLE.get(name, ()):
        del wanted[impossible]
    found = {}
    for path, vertex in vertices.items():
        found |= {(path, outcome): target.path for outcome, target in vertex.go.items()}
        found |= {(path, outcome): f".{up}" for outcome, up in vertex.leave.items()}
    assert found == {edge: target for edge, target in wanted.items() if target is not None}


@every_behaviour
def test_conditions_keep_their_order(behaviours, machine, name):
    vertices = machine(name).vertices
    impossible = IMPOSSIBLE.get(name, set())
    for state, path, _, _ in states_in(behaviours, name):
        container = behaviours[name]["containers"].get(state.get("container"), {})
        if container.get("kind") != "concurrency":
            continue
        wanted = [
            (outcome, [(f"{path}/{plain(child)}", end) for child, end in conditions])
            for outcome, conditions in container["conditions"]
        ]
        wanted = [(o, conditions) for o, conditions in wanted if not impossible & set(conditions)]
        box = vertices[path]
        found = [(o, [(f"{path}/{c}", end) for c, end in ends.items()]) for o, ends in box.rules]
        assert found == wanted


@every_behaviour
def test_autonomy_is_kept_for_every_outcome(behaviours, machine, name):
    vertices = machine(name).vertices
    for state, path, _, _ in states_in(behaviours, name):
        wanted = {
            outcome: AUTONOMY[level.removeprefix("Autonomy.").lower()]
            for outcome, level in state["autonomy"].items()
            if level != "Autonomy.Inherit"
        }
        assert vertices[path].autonomy == wanted


@every_behaviour
def test_arguments_are_kept(behaviours, machine, name):
    vertices = machine(name).vertices
    for state, path, _, _ in states_in(behaviours, name):
        vertex = vertices[path]
        if not isinstance(vertex, Leaf):
            continue
        for key, value in state["args"].items():
            if not isinstance(value, dict | list):
                assert vertex.parameters[key] == value


@every_behaviour
def test_remapped_keys_meet_where_the_original_ones_did(behaviours, machine, name):
    """Two states share a key in the chart exactly if they share one in FlexBE."""
    vertices = machine(name).vertices
    cells = {}
    for state, path, _, prefix in states_in(behaviours, name):
        vertex = vertices[path]
        if not isinstance(vertex, Leaf):
            continue
        bound = dict(vertex.inputs)
        for outputs in vertex.outputs.values():
            bound |= dict(outputs)
        for key, outer in state.get("remapping", {}).items():
            if key in bound:
                owner = original_key(behaviours, name, prefix, outer)
                assert cells.setdefault(owner, bound[key]) is bound[key]
    assert len({id(cell) for cell in cells.values()}) == len(cells)


def original_key(behaviours, name, prefix, key):
    """The container whose own key this is, and its name there."""
    while prefix:
        around = next(s for s, path, _, _ in states_in(behaviours, name) if f"{path}/" == prefix)
        if key not in around.get("remapping", {}):
            break
        key = around["remapping"][key]
        prefix = "/".join(prefix.split("/")[:-2])
        prefix = f"{prefix}/" if prefix else ""
    return prefix, key


@every_behaviour
def test_exploration_takes_every_transition_and_reaches_every_outcome(behaviours, machine, name):
    found = explore(machine(name))
    out_of_reach = IMPOSSIBLE.get(name, set()) | UNREACHABLE.get(name, set())
    assert found.complete
    assert not found.stuck
    assert found.moves.keys() == edges_in(behaviours, name).keys() - out_of_reach
    root = behaviours[name]["containers"]["_state_machine"]
    assert found.outcomes.keys() == set(root["outcomes"])


@pytest.mark.parametrize(
    "name",
    [n if n in SMALL else pytest.param(n, marks=pytest.mark.slow) for n in NAMES],
)
def test_the_runner_walks_every_transition(machine, name):
    for (path, outcome), script in explore(machine(name)).moves.items():
        play = Play(machine(name))
        play.tick()
        for step in script:
            play.end(*step)
            play.tick(2)  # what was left in this tick is entered again in the next
        ends = [r.subject for r in play.run.trace if r.kind == "outcome" and r.detail == (outcome,)]
        assert path in ends


def test_a_concurrency_container_is_entered_again_with_all_its_children(machine):
    play = Play(machine("action_follow"))
    play.tick()
    inside = "Follow/Look_at/Find_back"
    for _ in range(2):
        play.end(("Follow/Look_at/look", "failed"))
        play.tick()
        children = [
            f"{inside}/search/get_en",
            f"{inside}/Turn_head/turn_r",
            f"{inside}/Delai/say_lost",
        ]
        assert play.steps == ["Follow/Follow/follow", *children]
        play.end((f"{inside}/Turn_head/turn_r", "done"))
        play.end((f"{inside}/search/get_en", "found"))
        assert play.run.active == ["Follow/Follow/follow", "Follow/Look_at/Found_you"]
        play.end(("Follow/Look_at/Found_you", "done"))


def test_what_a_branch_writes_is_there_for_its_next_state(machine):
    """`target` is set inside give/Give and again after it; FlexBE keeps the two apart."""
    play = Play(machine("action_give"))
    play.tick()
    play.end(("Get_hand_content", "done"), Value="cup")
    play.end(("is_object_in_hand", "true"))
    play.end(("name", "done"), Key="person")
    play.end(("list_persons", "found"), entity_list=("p",), number=1)
    play.end(("get_id", "done"), output_value=7)
    play.end(("give/Give/SetPose", "done"), Key="ShowGripper")
    play.end(("give/Give/say_give", "done"))
    inputs = play.script.inputs
    assert inputs["give/Give/moveArm"] == {"target": "ShowGripper"}
    assert inputs["give/Follow/follow"] == inputs["give/LookAt/look"] == {"ID": 7}
    play.end(("give/Give/moveArm", "done"))
    play.end(("give/Give/say_pull", "done"))
    play.end(("give/Give/wait_1", "done"))
    play.end(("give/Give/read_torque", "threshold"))
    assert play.end(("give/Give/open_gripper", "object")) == ["set_idle_pose"]
    play.end(("set_idle_pose", "done"), Key="IdlePose")
    play.end(("say_good", "done"))
    assert inputs["moveArm2"] == {"target": "IdlePose"}


def test_states_begin_where_they_began(behaviours, machine):
    for name in NAMES:
        first = next(states_in(behaviours, name))[1]
        assert machine(name).root.children[0].path == first


def test_an_embedded_behaviour_gets_its_parameters(machine):
    inside = "Example_Concurrent_Behavior/"
    times = {
        leaf.name: leaf.parameters["target_time"]
        for leaf in machine("example_4").leaves
        if leaf.interface.name == "ExampleState" and leaf.path.startswith(inside)
    }
    assert times == {"A": 5.0, "B": 2.0, "C": 4.0, "D": 2.0}


def test_the_input_of_a_behaviour_is_that_of_its_chart(library):
    assert list(library["action_follow"].inputs) == ["ID"]


def test_what_is_left_to_do_is_told(converted):
    assert [note for note in converted.notes if note.startswith("action_give: give: ")] == [
        "action_give: give: a condition for 'given' is left out: "
        "Follow can never end with 'finished'",
        "action_give: give: a condition for 'failed' is left out: "
        "LookAt can never end with 'failed'",
        "action_give: give: outcome 'continue' can never come; left out",
    ]
    assert not [left for left in converted.left if left.what == "give the value of"]
    code = {left.code for left in converted.left}
    assert code == {
        "lambda p: self.update_pose(p, self.pose_offset)",
        "lambda p: self.update_pose(p, self.close_offset)",
        "lambda x: 'Good, enjoy your ' + str(x)",
        'lambda x: "Hi. I\'m giving you this " + str(x)',
    }


def test_safe_code_is_translated(converted):
    ready = {name: cls.ready.body for name, cls in converted.classes.items() if cls.ready}
    assert ready == {
        "IncrementIndex": 'x = input_value\nreturn "done", {"output_value": freeze(x + 1)}',
        "IsObjectInHand": 'x = input_value\nreturn "true" if x else "false"',
        "GetId": 'x = input_value\nreturn "done", {"output_value": freeze(x[0].ID)}',
    }
