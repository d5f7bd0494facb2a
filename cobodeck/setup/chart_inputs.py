"""Inputs of charts from outside: as a command line gives them, and what is missing."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from cobodeck.terminal import Problem
from engine import Type, description_of
from engine.files import FileError, assignment, plain
from engine.machine import Machine

OPTION, EXAMPLE = "--in", "'goal={x: 2 m, y: 1 m}'"


def read_inputs(texts: Iterable[str]) -> dict[str, Any]:
    """The values of `--in`, as written, by the names of the inputs.

    Raises:
        Problem: one is not KEY=VALUE, is not YAML, or is given twice.
    """
    found: dict[str, Any] = {}
    for text in texts:
        try:
            name, source = assignment(text, OPTION, EXAMPLE)
        except FileError as error:
            raise Problem(str(error)) from None
        if name in found:
            raise Problem(f"{OPTION} {text}: {name!r} is given twice; keep one of them")
        found[name] = plain(source.value)
    return found


def wanted_inputs(machine: Machine) -> str:
    """The inputs without a value, in words with their types; empty if there are none.

    `chart go needs input 'goal' (a Pose2, {x: …, y: …, yaw: …} or {place: …})`
    """
    inputs, types = machine.chart.inputs, machine.types
    wanted = [
        f"{name!r} ({description_of(types.get(inputs[name].type, Type('any')))})"
        for name in machine.missing
    ]
    if not wanted:
        return ""
    return f"chart {machine.chart.name} needs input{'s' if wanted[1:] else ''} {', '.join(wanted)}"
