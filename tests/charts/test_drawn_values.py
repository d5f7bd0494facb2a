"""What the drawing of a shipped chart says is what a run by the same profile uses."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import pytest
import yaml

from cobodeck.setup.setup import Setup, open_setup
from engine.draw.chart_shapes import BoxShape, LeafShape, OutcomeLabel, Picture, Shape
from engine.draw.picture import picture
from engine.interfaces import python_name
from engine.literals import convert
from engine.machine.machine import Machine, to_ns
from engine.machine.vertices import Box, Leaf
from engine.types import Type

CHARTS = ("cobodeck", "chase", "haptic", "escape", "inform")
SETS = ("chase.room=2.5 m", "charts.chase.still_for=0.7 s", "charts.inform.patience=33 s")
VALUE = re.compile(r"(\w+): (.*?)(?: \(((?:\w+: |--set )[^()]*)\))?$")
DURATION = Type("duration")


def setup_of(name: str, profile: str, sets: tuple[str, ...]) -> Setup:
    """A behaviour's chart of the profile's policy."""
    chart = f"paper_{name}" if profile == "paper" else name
    return open_setup(chart, profile=profile, sets=sets)


def drawn(setup: Setup) -> Picture:
    return picture(setup.chart, setup.library, None, setup.profile.constants)


def shapes(shape: Shape) -> Iterator[Shape]:
    """A shape and all inside it."""
    yield shape
    if not isinstance(shape, LeafShape):
        inside = (*shape.rows, *shape.members) if isinstance(shape, BoxShape) else shape.rows
        for inner in inside:
            yield from shapes(inner)


def labels_of(shape: Shape) -> Iterator[OutcomeLabel]:
    for pin in shape.pins:
        yield from pin.labels
    for ending in () if isinstance(shape, BoxShape) else shape.endings:
        yield from ending.labels


def values_in(notes: tuple[str, ...]) -> dict[str, tuple[Any, str]]:
    """The values that notes say, as a chart would have them, and where they come from.

    Without those of which a note shows the beginning alone.
    """
    found = (match for note in notes if (match := VALUE.fullmatch(note)) and "…" not in match[2])
    return {
        name: (yaml.safe_load(value), origin or "") for name, value, origin in map(groups, found)
    }


def groups(match: re.Match[str]) -> tuple[str, str, str]:
    return match[1], match[2], match[3]


def used_by(machine: Machine, box: Box) -> Mapping[str, Any]:
    """The values of the parameters of the chart that begins at a box."""
    return dict(box.signature[3])


def require_equal(leaf: Leaf, shown: Mapping[str, tuple[Any, str]]) -> int:
    used = {**leaf.parameters, **leaf.given}
    types = {**leaf.interface.parameters, **leaf.interface.inputs}
    said = {
        python_name(name): convert(shown[name][0], types[name].type)
        for name in shown
        if name in types
    }
    long = {name for name, value in used.items() if isinstance(value, tuple)} - said.keys()
    assert said == {name: value for name, value in used.items() if name not in long}, leaf.path
    return len(said)


@pytest.mark.parametrize("name", CHARTS)
@pytest.mark.parametrize(("profile", "sets"), [("tuned", ()), ("paper", ()), ("tuned", SETS)])
def test_every_value_in_a_drawing_is_what_a_run_uses(
    name: str, profile: str, sets: tuple[str, ...]
) -> None:
    setup = setup_of(name, profile, sets)
    machine, shown = setup.machine(), drawn(setup)
    compared = 0
    found = {shape.path: shape for shape in shapes(shown.root)}
    assert set(found) == set(machine.vertices)
    for path, shape in found.items():
        vertex, notes = machine.vertices[path], values_in(shape.notes)
        if isinstance(vertex, Leaf):
            compared += require_equal(vertex, notes)
        elif isinstance(vertex, Box) and vertex.chart and path:
            parameters = setup.library[vertex.chart].parameters
            used = used_by(machine, vertex)
            for key in notes.keys() & parameters.keys():
                value = convert(notes[key][0], machine.types[parameters[key].type])
                assert value == used[key], f"{path}: {key}"
                compared += 1
        limits = [label.text for label in labels_of(shape) if label.cause == "timeout"]
        if path and vertex.timeout_ns is not None:
            (limit,) = {text.removeprefix("timeout ").partition(" (")[0] for text in limits}
            assert to_ns(convert(limit, DURATION)) == vertex.timeout_ns, path
            compared += 1
    assert compared >= 1


@pytest.mark.parametrize("name", CHARTS)
@pytest.mark.parametrize(("profile", "sets"), [("tuned", ()), ("paper", ()), ("tuned", SETS)])
def test_the_head_of_a_drawing_says_what_a_run_uses_and_where_it_comes_from(
    name: str, profile: str, sets: tuple[str, ...]
) -> None:
    setup = setup_of(name, profile, sets)
    machine, head = setup.machine(), values_in(dict(drawn(setup).declared)["parameters"])
    parameters = setup.chart.parameters
    used = used_by(machine, machine.root)
    assert head.keys() == used.keys() == parameters.keys()
    for key, (value, origin) in head.items():
        assert convert(value, machine.types[parameters[key].type]) == used[key], key
        assert origin == parameters[key].origin


def test_a_drawing_says_where_values_come_from() -> None:
    setup = open_setup("cobodeck", profile="tuned", sets=SETS)
    notes = {s.path: values_in(s.notes) for s in shapes(drawn(setup).root)}

    assert notes["chase"]["room"] == ("2.5 m", "--set chase.room=2.5 m")
    assert notes["chase"]["still_for"] == ("0.7 s", "--set charts.chase.still_for=0.7 s")
    assert notes["chase"]["near"] == ("3.4 m", "tuned: chase.near")
    assert notes["inform"]["patience"] == ("33 s", "--set charts.inform.patience=33 s")
    assert notes["ask"]["patience"] == ("0 s", "")  # `with` goes before the profile
    assert notes["ask"]["least"] == ("6 s", "base: inform.cornered")
    assert notes["ask/ready"]["cornered"] == ("6 s", "base: inform.cornered")
