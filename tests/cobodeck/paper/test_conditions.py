"""The three conditions: charts that differ in one node, and the same person in all of them."""

import pytest
import yaml

from cobodeck.paper import CONDITIONS, EvaluationPlan
from cobodeck.paper.conditions import PARTS, SCENE, VARIED
from cobodeck.project import CHARTS
from cobodeck.setup import profile_with
from hw.scene import load_scene

PLAN = EvaluationPlan(requests=7, seeds=3, parts_requests=2)


def chart(name):
    folder = CHARTS if name == "cobodeck" else CHARTS / "paper"
    return yaml.safe_load((folder / f"{name}.yaml").read_text())


def renamed(value):
    """The same with the node `chase` called `parked`."""
    if isinstance(value, dict):
        return {name: renamed(child) for name, child in value.items()}
    return "parked" if value == "chase" else value


@pytest.mark.requirement(127)
def test_the_parked_machine_differs_from_the_paper_s_in_one_node():
    ours, theirs = chart("paper_parked")["states"], chart("cobodeck")["states"]
    assert set(theirs) - set(ours) == {"chase", "ask"}
    assert set(ours) - set(theirs) == {"parked"}
    for name in ours.keys() & theirs.keys():
        shown = renamed(theirs[name])
        if name == "inform":
            assert shown.pop("out") == {"user": "shown"}  # what only Chase reads
        assert ours[name] == shown
    swapped = renamed(theirs["chase"]["next"])
    assert swapped.pop("cornered") == "ask"
    assert ours["parked"]["next"] == swapped


@pytest.mark.requirement(127)
def test_each_condition_s_chart_is_its_machine_with_the_scene_s_parking_place():
    places = load_scene(SCENE).places
    assert chart("paper_chase")["states"] == {"machine": {"use": "cobodeck"}}
    for name in ("corner", "center"):
        parking = {"use": "paper_parked", "in": {"parking": {"place": name}}}
        assert chart(f"paper_{name}")["states"] == {"machine": parking}
        assert name in places


def test_all_conditions_meet_the_same_people():
    seeds = {PLAN.cell(name).seed for name in CONDITIONS}
    routes = [{PLAN.route(name, number).seed for name in CONDITIONS} for number in range(3)]
    assert len(seeds) == 1
    assert all(len(found) == 1 for found in routes)
    assert len(set().union(*routes)) == 3


def test_the_cells_are_all_that_is_compared_each_once_and_its_values_are_valid():
    cells = list(PLAN.cells(VARIED))
    assert len(set(cells)) == len(cells) - 3  # the profile itself, with as many requests
    assert len(cells) == 3 * (len(PARTS) + 1 + 3 + len(VARIED))
    for sets in dict.fromkeys(cell.sets for cell in cells):
        assert profile_with("paper", sets).sets == sets
