"""FlexBE behaviours, as neutral JSON, to charts.

Containers stand inline: a state machine is a sequence (`states`), a concurrency container an `any`
whose conditions are `when`. Embedded behaviours are `use`. Userdata becomes `data`, a remapping
that renames keys `in` and `out` of the container. What the JSON does not say, because only the
Python code does, is given as `Known`; what a chart cannot say is told in the notes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from engine.interfaces import Interface
from tests.flexbe.classes import Classes, Json, Use, type_name
from tests.flexbe.names import camel, identifier, outcome_name, unique

ROOT = "_state_machine"


@dataclass(frozen=True, slots=True)
class Known:
    """What the Python code of behaviours and states says beyond the JSON.

    Attributes:
        outputs: the keys that a state class writes; it reads all others that it is given.
        values: the values of Python expressions among the arguments.
        userdata: the first values of keys, by behaviour.
    """

    outputs: Mapping[str, Iterable[str]] = field(default_factory=dict)
    values: Mapping[str, Any] = field(default_factory=dict)
    userdata: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Conversion:
    """Charts by name, the state classes they need, and what is left to do by hand."""

    charts: Mapping[str, dict[str, Any]]
    interfaces: Mapping[str, Interface]
    notes: tuple[str, ...]


def convert(behaviours: Mapping[str, Json], known: Known | None = None) -> Conversion:
    """Convert behaviours that may embed each other, by the names their charts are to have."""
    known = known or Known()
    classes = Classes(behaviours)
    notes: list[str] = []
    charts = {
        name: _Behaviour(name, behaviours, known, classes, notes).chart() for name in behaviours
    }
    return Conversion(charts, classes.interfaces(), tuple(notes))


def children_names(container: Json) -> dict[str, str]:
    """The names that the states of a container have in a chart."""
    names: dict[str, str] = {}
    for state in container["states"]:
        names[state["name"]] = unique(identifier(state["name"]), names.values())
    return names


@dataclass(frozen=True, slots=True)
class _Scope:
    """A container in its place: its path and what the names of data mean in it.

    In a chart a name means the key of that name, unless a container around says otherwise:
    `seen` has those that do. `keys` has what FlexBE means.
    """

    path: str
    container: Json
    keys: dict[str, str]
    seen: Mapping[str, str]

    def at(self, name: str) -> str:
        """The path of a child."""
        return f"{self.path}/{name}" if self.path else name


class _Behaviour:
    """Converts one behaviour."""

    def __init__(
        self,
        name: str,
        behaviours: Mapping[str, Json],
        known: Known,
        classes: Classes,
        notes: list[str],
    ) -> None:
        self.name = name
        self.behaviours = behaviours
        self.json = behaviours[name]
        self.known = known
        self.classes = classes
        self.notes = notes
        self.parameters = {identifier(n): v for n, v in self.json["parameters"].items()}
        self.taken: dict[str, None] = {}
        self.bindings: list[tuple[dict[str, str], str, str]] = []
        self.read: set[str] = set()

    def note(self, path: str, what: str) -> None:
        """Tell what is left to do."""
        self.notes.append(f"{self.name}: {path}: {what}" if path else f"{self.name}: {what}")

    def chart(self) -> dict[str, Any]:
        """The chart."""
        root = self.json["containers"][ROOT]
        box, ends = self.box(self.scope("", root, {}, None))
        self.forget_unread()
        inputs = [identifier(key) for key in root.get("input_keys", ())]
        chart = {
            "chart": self.name,
            "parameters": {
                name: {"type": type_name(value), "default": value}
                for name, value in self.parameters.items()
            },
            "inputs": dict.fromkeys(inputs, "any"),
            "outcomes": [outcome_name(outcome) for outcome in root["outcomes"]],
            "data": {key: self.declared(key) for key in self.taken if key not in inputs},
            **box,
        }
        for outcome in chart["outcomes"]:
            if outcome not in ends:
                self.note("", f"outcome {outcome!r} can never come")
        return _filled(chart)

    def declared(self, key: str) -> Any:
        """A key of the chart's data."""
        first = self.known.userdata.get(self.name, {})
        return {"type": "any", "initial": first[key]} if key in first else "any"

    def scope(self, path: str, container: Json, given: Json, around: _Scope | None) -> _Scope:
        """What names mean in a container; `given` is what it is remapped to around it."""
        outer, seen = (around.keys, around.seen) if around else ({}, {})
        keys = {identifier(key): outer[identifier(name)] for key, name in given.items()}
        for key in self.mentioned(container):
            if key not in keys:
                free = key not in self.taken and key not in seen
                own = key if free else unique(f"{path.rpartition('/')[2]}_{key}", self.taken)
                self.taken[own] = None
                keys[key] = own
        renamed = {key: real for key, real in keys.items() if seen.get(key, key) != real}
        return _Scope(path, container, keys, {**seen, **renamed})

    def mentioned(self, container: Json) -> dict[str, None]:
        """The keys that a container and its states name."""
        named = [*container.get("input_keys", ()), *container.get("output_keys", ())]
        for state in container["states"]:
            named += state.get("remapping", {}).values()
        return dict.fromkeys(identifier(key) for key in named)

    def box(self, scope: _Scope) -> tuple[dict[str, Any], dict[str, None]]:
        """A container's form with its children, and the outcomes it can end with."""
        names = children_names(scope.container)
        keeps = scope.container["kind"] == "concurrency"
        if scope.container["kind"] not in ("statemachine", "concurrency"):
            self.note(
                scope.path, f"a {scope.container['kind']} container; taken as a state machine"
            )
        children: dict[str, dict[str, Any]] = {}
        can_end: dict[str, dict[str, None]] = {}
        ends: dict[str, None] = {}
        for state in scope.container["states"]:
            name = names[state["name"]]
            node, possible = self.node(state, scope.at(name), scope)
            if not keeps:
                node["next"] = self.next(state, scope.at(name), names, possible)
                ends |= {t[1:]: None for t in node["next"].values() if t.startswith(".")}
            children[name] = node
            can_end[name] = possible
        if not keeps:
            return {"states": children}, ends
        when = self.when(scope, names, can_end)
        return {"any": children, "when": when}, {rule["outcome"]: None for rule in when}

    def next(
        self, state: Json, path: str, names: Mapping[str, str], possible: Iterable[str]
    ) -> dict[str, str]:
        """Where the outcomes of a child of a sequence lead."""
        found = {}
        for outcome, target in state["transitions"].items():
            if outcome_name(outcome) not in possible:
                self.note(path, f"outcome {outcome!r} can never come; left out")
                continue
            leads_on = names.get(target)
            found[outcome_name(outcome)] = leads_on or f".{outcome_name(target)}"
        return found

    def when(
        self, scope: _Scope, names: Mapping[str, str], can_end: Mapping[str, Iterable[str]]
    ) -> list[dict[str, Any]]:
        """The conditions of a concurrency container that can come true, in order."""
        rules = []
        for outcome, conditions in scope.container["conditions"]:
            wanted = {names[child]: outcome_name(end) for child, end in conditions}
            never = [name for name, end in wanted.items() if end not in can_end[name]]
            if never:
                what = f"{never[0]} can never end with {wanted[never[0]]!r}"
                self.note(scope.path, f"a condition for {outcome!r} is left out: {what}")
            else:
                rules.append({"outcome": outcome_name(outcome), "if": wanted})
        return rules

    def node(self, state: Json, path: str, scope: _Scope) -> tuple[dict[str, Any], dict[str, None]]:
        """A child of a container, and the outcomes it can end with."""
        if "container" in state:
            return self.inner(state, path, scope)
        node = self.embedded(state, scope) if "behavior" in state else self.leaf(state, path, scope)
        node["autonomy"] = {
            outcome_name(outcome): level
            for outcome, level in _levels(state).items()
            if level != "inherit"
        }
        return node, dict.fromkeys(outcome_name(outcome) for outcome in state["transitions"])

    def inner(
        self, state: Json, path: str, scope: _Scope
    ) -> tuple[dict[str, Any], dict[str, None]]:
        """A container inside another."""
        container = self.json["containers"][state["container"]]
        inside = self.scope(path, container, state.get("remapping", {}), scope)
        if set(_levels(state).values()) - {"inherit"}:
            self.note(path, "the autonomy of a container is left out; set that of its states")
        node: dict[str, Any] = {"in": {}, "out": {}}
        reading = set(container.get("input_keys", ())) - set(container.get("output_keys", ()))
        for key, real in inside.keys.items():
            if scope.seen.get(key, key) != real:
                outer = next((k for k, v in scope.keys.items() if v == real), real)
                self.bind(node["in" if key in reading else "out"], key, outer, scope)
        box, ends = self.box(inside)
        return node | box, ends

    def embedded(self, state: Json, scope: _Scope) -> dict[str, Any]:
        """Another behaviour."""
        wanted = _letters(state["behavior"].removesuffix("SM"))
        name = next((n for n in self.behaviours if _letters(n) == wanted), None)
        if name is None:
            name = identifier(state["behavior"])
            self.note("", f"the embedded behaviour {state['behavior']} is not here")
        node: dict[str, Any] = {"use": name, "in": {}}
        given = state.get("args", {}).get("parameters", {})
        node["with"] = {identifier(n): self.value("", value) for n, value in given.items()}
        for key, outer in state.get("remapping", {}).items():
            self.reads(node["in"], identifier(key), identifier(outer), scope)
        return node

    def leaf(self, state: Json, path: str, scope: _Scope) -> dict[str, Any]:
        """A state of a class."""
        arguments = {k: v for k, v in state["args"].items() if not _lists_outcomes(k, v, state)}
        code = {k: v["expr"] for k, v in arguments.items() if _is_code(v)}
        name = camel(identifier(state["name"])) if code else self.classes.name(state)
        if state["pos"]:
            self.note(path, f"arguments without a name are left out: {state['pos']}")
        given = {identifier(k): self.value(path, v) for k, v in arguments.items() if k not in code}
        for expression in code.values():
            self.note(path, f"write a class {name} that does what this did: {expression}")
            used = re.findall(r"\bself\.(\w+)(?!\w*\()", expression)
            given |= {key: f"${key}" for key in used if key in self.parameters}
        node: dict[str, Any] = {"do": name, "with": given, "in": {}, "out": {}}
        writes = set(self.known.outputs.get(state["class"], ()))
        for key, outer in state.get("remapping", {}).items():
            if key in writes:
                self.bind(node["out"], identifier(key), identifier(outer), scope)
            else:
                self.reads(node["in"], identifier(key), identifier(outer), scope)
        outcomes = tuple(outcome_name(outcome) for outcome in state["transitions"])
        self.classes.add(name, Use(outcomes, given, tuple(node["in"]), tuple(node["out"])))
        return node

    def value(self, path: str, value: Any) -> Any:
        """An argument; parameters of the behaviour become those of the chart."""
        if not isinstance(value, dict):
            return value
        if "expr" not in value:
            self.note(path, f"a mapping is no argument; give its parts, not {value}")
            return str(value)
        expression = value["expr"]
        if expression.removeprefix("self.") in self.parameters and expression.startswith("self."):
            return f"${expression.removeprefix('self.')}"
        if expression not in self.known.values:
            self.note(path, f"the value of {expression} is not known")
        return self.known.values.get(expression, expression)

    def reads(self, inputs: dict[str, str], key: str, outer: str, scope: _Scope) -> None:
        """Give the key `outer` to the input `key`."""
        self.read.add(scope.keys[outer])
        self.bind(inputs, key, outer, scope)

    def bind(self, entries: dict[str, str], key: str, outer: str, scope: _Scope) -> None:
        """Add an entry to `in` or `out`; it goes again if nobody reads what it means."""
        entries[key] = outer
        self.bindings.append((entries, key, scope.keys.get(outer, outer)))

    def forget_unread(self) -> None:
        """Leave out what is written and never read."""
        for entries, key, real in self.bindings:
            if real not in self.read:
                del entries[key]
        for key in [key for key in self.taken if key not in self.read]:
            del self.taken[key]
            self.note("", f"key {key!r} is never read; left out")


def _filled(node: dict[str, Any]) -> dict[str, Any]:
    """A node, and all below it, without sections that say nothing."""
    for form in node.keys() & {"states", "any"}:
        node[form] = {name: _filled(child) for name, child in node[form].items()}
    return {key: value for key, value in node.items() if value not in ({}, [])}


def _levels(state: Json) -> dict[str, str]:
    return {o: level.rpartition(".")[2].lower() for o, level in state.get("autonomy", {}).items()}


def _letters(name: str) -> str:
    return re.sub(r"[\W_]+", "", name).lower()


def _is_code(value: Any) -> bool:
    return isinstance(value, dict) and value.get("expr", "").startswith("lambda")


def _lists_outcomes(key: str, value: Any, state: Json) -> bool:
    return key == "outcomes" and value == list(state["transitions"])
