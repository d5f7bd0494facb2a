"""Behaviours kept as neutral JSON: the same structure that `python_reading` finds in Python."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from cobodeck.flexbe.behaviour import ROOT, Behaviour
from engine.files import mistake

_LISTS = ("outcomes", "input_keys", "output_keys")
_MAPPINGS = ("transitions", "autonomy", "remapping", "args")
_IS = ("class", "container", "behavior")


def is_neutral(text: str) -> bool:
    """Whether text could be such JSON, and is worth an error if it is wrong."""
    return '"containers"' in text and ROOT in text


def read_json(text: str, file: str, name: str) -> Behaviour:
    """The behaviour in a JSON file.

    Raises:
        FileError: it is not JSON, or of another shape; the message names the first place.
    """
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        line = getattr(error, "lineno", 1)
        raise mistake(file, f"this is not JSON: {error}", line) from None
    wrong = next(_wrong(found), None)
    if wrong is not None:
        hint = f"wanted: an object with `containers`, and in it `{ROOT}`"
        raise mistake(file, f"no FlexBE behaviour: {wrong}", 1, hint)
    empty: dict[str, Any] = {"behaviors": [], "parameters": {}, "root": None}
    return Behaviour(name=name, json={**empty, **found}, file=file)


def _wrong(found: Any) -> Iterator[str]:
    """What is wrong with the shape, by place."""
    if not isinstance(found, dict):
        yield "it is not an object"
        return
    containers = found.get("containers")
    if not isinstance(containers, dict) or ROOT not in containers:
        yield f"it has no `containers` with `{ROOT}`"
        return
    if not isinstance(found.get("parameters", {}), dict):
        yield "`parameters` is not an object"
    for name, container in containers.items():
        yield from (f"{name}: {what}" for what in _wrong_container(container, containers))


def _wrong_container(container: Any, containers: Any) -> Iterator[str]:
    if not isinstance(container, dict) or not isinstance(container.get("states"), list):
        yield "it has no list `states`"
        return
    for key in _LISTS:
        if not _are_names(container.get(key, [])):
            yield f"`{key}` is no list of names"
    for state in container["states"]:
        wrong = next(_wrong_state(state, containers), None)
        if wrong is not None:
            name = state.get("name") if isinstance(state, dict) else state
            yield f"state {name!r}: {wrong}"
    yield from _wrong_conditions(container.get("conditions", []))


def _wrong_state(state: Any, containers: Any) -> Iterator[str]:
    if not isinstance(state, dict) or not isinstance(state.get("name"), str):
        yield "it has no `name`"
        return
    given = [key for key in _IS if isinstance(state.get(key), str)]
    if len(given) != 1:
        yield "it needs one of `class`, `container` and `behavior`"
    elif given == ["container"] and state["container"] not in containers:
        yield f"there is no container {state['container']!r}"
    for key in _MAPPINGS:
        value = state.get(key, {})
        if not isinstance(value, dict):
            yield f"`{key}` is not an object"
        elif key != "args" and not _are_names(list(value.values())):
            yield f"`{key}` has values that are no names"


def _wrong_conditions(conditions: Any) -> Iterator[str]:
    try:
        pairs = [pair for _, several in conditions for pair in several]
        good = all(_are_names([child, end]) for child, end in pairs)
        good = good and _are_names([outcome for outcome, _ in conditions])
    except (TypeError, ValueError):
        good = False
    if not good:
        yield "`conditions` are not [[outcome, [[state, outcome], …]], …]"


def _are_names(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)
