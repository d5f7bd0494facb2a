"""The keys by which states read have the types that their signals are declared with."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, get_args, get_type_hints

import pytest

import behaviors.situation.keys
import states.environment.signal_names
from behaviors.escape.escape_states import ESCAPE_CANDIDATES
from behaviors.profile.profile import Profile
from behaviors.profile.settings import Settings
from behaviors.signal_table import signals
from cobodeck.project.state_catalogue import catalogue
from engine.interfaces import Interface
from engine.signals.signal_kinds import Signal, declare
from states.environment.environment import Environment
from states.navigation.planner_interfaces import GlobalPlanner
from states.subsystems import SUBSYSTEMS

NAMES = {
    "Environment": Environment,
    "Settings": Settings,
    "GlobalPlanner": GlobalPlanner,
}


@pytest.fixture
def declared(tuned: Profile, environment_of: Callable[..., Environment]) -> dict[str, Signal]:
    return declare(signals(environment_of(tuned), tuned.settings))


def keys() -> dict[str, Any]:
    """The type of each key's values, by the name of the signal.

    The Escape candidates are declared as any object: their type would bring in numpy.
    """
    found = {}
    for module in (states.environment.signal_names, behaviors.situation.keys):
        for name, hint in get_type_hints(module, localns=NAMES).items():
            found[getattr(module, name)] = get_args(hint)[0]
    return {**found, ESCAPE_CANDIDATES: object}


def test_every_key_has_the_type_of_its_signal(declared: dict[str, Signal]) -> None:
    expected = {name: declared[name].type for name in keys()}

    assert expected.pop("base.mode") is str  # a project's base may have modes of its own
    assert {name: kind for name, kind in keys().items() if name in expected} == expected


def test_all_that_states_read_has_a_key() -> None:
    planners = {states.environment.signal_names.planner_key(name) for name in SUBSYSTEMS}

    read = {name for of in catalogue(own=False).interfaces.values() for name in read_by(of)}

    assert read == keys().keys() | planners


def read_by(of: Interface) -> Iterator[str]:
    """The signals that a class reads, by default where a parameter names them."""
    for name in of.reads:
        if name[0] != "$":
            yield name
        elif isinstance(default := of.parameters[name[1:]].default, str):
            yield default
