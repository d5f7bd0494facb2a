"""Writes behaviours as FlexBE generates them: tabs in FlexBE 1, spaces and a node from 2 on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

MAKERS = {
    "statemachine": "OperatableStateMachine",
    "concurrency": "ConcurrencyContainer",
    "priority": "PriorityContainer",
}


def generated(
    behaviour: Mapping[str, Any],
    cls: str,
    *,
    version: int = 1,
    create: str = "",
    manual: Mapping[str, str] | None = None,
    comments: str = "",
) -> str:
    """The text of a module; `create` are the lines after the root is made."""
    lines = ["#!/usr/bin/env python", "# -*- coding: utf-8 -*-", ""]
    lines += ["from flexbe_core import Behavior, Autonomy, OperatableStateMachine, Logger"]
    lines += [*_manual("IMPORT", manual), "", "", f"class {cls}(Behavior):"]
    lines += ["\t'''", "\tDoes what it does.", "\t'''", ""]
    lines += ["\tdef __init__(self):" if version == 1 else "\tdef __init__(self, node):"]
    lines += [f"\t\tsuper({cls}, self).__init__()", f"\t\tself.name = {cls!r}", ""]
    node = "" if version == 1 else ", node"
    for name, value in behaviour["parameters"].items():
        lines.append(f"\t\tself.add_parameter({name!r}, {code(value)})")
    for embedded, name in behaviour["behaviors"]:
        lines.append(f"\t\tself.add_behavior({embedded}, {name!r}{node})")
    lines += [*_manual("INIT", manual), "", "\t\t# Behavior comments:", ""]
    lines += [f"\t\t{line}" for line in comments.splitlines()] + ["", "", "\tdef create(self):"]
    (root, outermost), *inner = behaviour["containers"].items()
    lines += [*_made(root, outermost), *(f"\t\t{line}" for line in create.splitlines())]
    lines += [*_manual("CREATE", manual), ""]
    for name, container in inner:
        lines += [*_made(name, container), "", *_filled(name, container)]
    lines += [*_filled(root, outermost), "", "\t\treturn _state_machine", ""]
    lines += [*_manual("FUNC", manual), ""]
    text = "\n".join(lines)
    return text if version == 1 else text.replace("\t", "    ")


def code(value: Any) -> str:
    """A value as Python."""
    is_code = isinstance(value, dict) and set(value) == {"expr"}
    return value["expr"] if is_code else repr(value)


def _manual(tag: str, blocks: Mapping[str, str] | None) -> list[str]:
    return [f"\t# [MANUAL_{tag}]", (blocks or {}).get(tag, ""), f"\t# [/MANUAL_{tag}]"]


def _made(name: str, container: Mapping[str, Any]) -> list[str]:
    keys = ("outcomes", "input_keys", "output_keys")
    given = [f"{key}={container[key]!r}" for key in keys if key in container]
    if "conditions" in container:
        rules = [(end, [tuple(pair) for pair in pairs]) for end, pairs in container["conditions"]]
        given.append(f"conditions=[\n\t\t\t{', '.join(map(repr, rules))}\n\t\t\t]")
    call = f"{MAKERS[container['kind']]}({', '.join(given)})"
    return ["\t\t# x:30 y:365, x:130 y:365", f"\t\t{name} = {call}"]


def _filled(name: str, container: Mapping[str, Any]) -> Iterator[str]:
    yield f"\t\twith {name}:"
    for state in container["states"]:
        yield "\t\t\t# x:77 y:29"
        parts = [repr(state["name"]), _of(state), f"transitions={state['transitions']!r}"]
        levels = ", ".join(f"{end!r}: {level}" for end, level in state["autonomy"].items())
        parts.append(f"autonomy={{{levels}}}")
        if "remapping" in state:
            parts.append(f"remapping={state['remapping']!r}")
        joined = ",\n\t\t\t\t\t\t".join(parts)
        yield f"\t\t\tOperatableStateMachine.add({joined})\n"
    if not container["states"]:
        yield "\t\t\tpass"


def _of(state: Mapping[str, Any]) -> str:
    if "container" in state:
        return str(state["container"])
    given = [*map(code, state["pos"])] + [f"{k}={code(v)}" for k, v in state["args"].items()]
    if "behavior" in state:
        path = f"somewhere/{state['name']}"
        return f"self.use_behavior({', '.join([state['behavior'], repr(path), *given])})"
    return f"{state['class']}({', '.join(given)})"
