"""The three conditions: charts that differ in one node, and the same person in all of them."""

from dataclasses import replace

import pytest
import yaml

from behaviors.profile import load_profile
from cobodeck.paper import CONDITIONS, EvaluationPlan
from cobodeck.paper.conditions import PARKED, PARTS, SCENE, varied_values
from cobodeck.project import CHARTS
from cobodeck.setup import profile_with
from hw.scene import load_scene

PLAN = EvaluationPlan(requests=7, seeds=3, parts_requests=2)


def chart(name):
    own = CHARTS / f"{name}.yaml"
    file = own if own.exists() else CHARTS / "paper" / own.name
    return yaml.safe_load(file.read_text())


def renamed(value):
    """The same with the node `chase` called `parked`."""
    if isinstance(value, dict):
        return {name: renamed(child) for name, child in value.items()}
    return "parked" if value == "chase" else value


@pytest.mark.requirement(127)
@pytest.mark.parametrize("policy", PARKED)
def test_the_parked_machine_differs_from_its_policy_s_in_one_node(policy):
    ours, theirs = chart(PARKED[policy])["states"], chart(load_profile(policy).chart)["states"]
    assert set(theirs) - set(ours) <= {"chase", "ask"}
    assert set(ours) - set(theirs) == {"parked"}
    for name in ours.keys() & theirs.keys():
        shown = renamed(theirs[name])
        if name == "inform":
            shown.pop("out", None)  # what only Chase reads
        assert ours[name] == shown
    swapped = renamed(theirs["chase"]["next"])
    swapped.pop("cornered", None)
    assert ours["parked"]["next"] == swapped


@pytest.mark.parametrize(("policy", "behaviour"), [("paper", "paper_chase"), ("tuned", "chase")])
def test_while_parked_the_robot_watches_for_what_it_does_in_chase(policy, behaviour):
    guards = {name: node for name, node in chart(behaviour)["any"].items() if "watch" in node}
    guards.pop("cornered", None)
    parked = chart(PARKED[policy])["states"]["parked"]["any"]
    assert {name: node for name, node in parked.items() if "watch" in node} == guards


@pytest.mark.requirement(127)
def test_each_condition_is_its_policy_s_machine_with_the_scene_s_parking_place():
    places = load_scene(SCENE).places
    for policy, parked in PARKED.items():
        plan = EvaluationPlan(profile=policy)
        assert plan.cell("chase").chart is None
        for name in ("corner", "center"):
            assert plan.cell(name).chart == parked
            assert plan.cell(name).inputs == (f"parking={{place: {name}}}",)
            assert name in places


def test_all_conditions_meet_the_same_people():
    seeds = {PLAN.cell(name).seed for name in CONDITIONS}
    routes = [{PLAN.route(name, number).seed for name in CONDITIONS} for number in range(3)]
    assert len(seeds) == 1
    assert all(len(found) == 1 for found in routes)
    assert len(set().union(*routes)) == 3


@pytest.mark.parametrize("profile", ["paper", "tuned"])
def test_the_cells_are_all_that_is_compared_each_once_and_its_values_are_valid(profile):
    varied = varied_values(profile)
    cells = list(replace(PLAN, profile=profile).cells(varied))
    assert len(set(cells)) == len(cells) - 3  # the profile itself, with as many requests
    assert len(cells) == 3 * (len(PARTS) + 1 + 3 + len(varied))
    for sets in dict.fromkeys(cell.sets for cell in cells):
        assert profile_with(profile, sets).sets == sets
