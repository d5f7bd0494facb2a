"""The ready states show in their docstrings how a chart names them, and list what it may write."""

from __future__ import annotations

import inspect
import re
from typing import Any

import pytest
import yaml

from cobodeck.project.state_catalogue import catalogue
from engine.interfaces import Interface

READY = (
    "Above", "Below", "Within", "Changed", "WaitFor", "Silent", "Wait", "Read", "Compare",
    "Switch", "Index", "Sum", "Format", "Log", "DriveTo", "DriveThrough", "MoveArmTo",
    "MoveArmJoints", "ParkArm", "OpenGripper", "CloseGripper", "WaitForForce",
)  # fmt: skip


def example(of: Interface) -> dict[str, Any]:
    """The node in a docstring."""
    form = "watch" if of.monitor else "do"
    text = inspect.cleandoc(of.about).replace("\n", " ")
    shown = re.search(rf"`(\{{{form}: {of.name}\b[^`]*\}})`", text)
    assert shown is not None, of.about
    node: dict[str, Any] = yaml.safe_load(shown[1])
    return node


@pytest.mark.parametrize("name", READY)
def test_a_ready_state_has_an_example_with_its_own_words(name: str) -> None:
    of = catalogue(own=False).interfaces[name]

    node = example(of)

    given = {*node.get("with", {}), *node.get("in", {})}
    known = {**of.parameters, **of.inputs}
    assert given <= known.keys()
    assert {name for name, argument in known.items() if argument.required} <= given
    assert {*node.get("out", {})} <= {key for named in of.outputs.values() for key in named}
    if isinstance(node["next"], dict):
        cases = node.get("with", {}).get("cases", [])
        outcomes = {*of.outcomes, *cases} - {"$cases"}
        assert {*node["next"]} - {"timeout"} == outcomes
