"""One behaviour to a chart, container by container.

Containers stand inline: a state machine is a sequence (`states`), a concurrency container an `any`
whose conditions are `when`. Embedded behaviours are `use`. Userdata becomes `data`, a remapping
that renames keys `in` and `out` of the container.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from typing import Any, Protocol

from cobodeck.flexbe.behaviour import ROOT, Behaviour, Json
from cobodeck.flexbe.converting.arguments import Arguments
from cobodeck.flexbe.converting.conditions import NO_CONDITION, rules_of
from cobodeck.flexbe.converting.outcomes import levels_of, next_of
from cobodeck.flexbe.converting.scopes import ChartData, ContainerScope
from cobodeck.flexbe.converting.state_classes import StateClasses, Use, type_name
from cobodeck.flexbe.converting.told import Findings
from cobodeck.flexbe.converting.values import ExpressionValues
from cobodeck.flexbe.converting.writers import KeyWriters
from cobodeck.flexbe.names import (
    bare,
    identifier,
    key_name,
    outcome_name,
    outcome_names,
    parameter_names,
    unique,
)

Ends = dict[str, None]


class Shared(Protocol):
    """What the behaviours of one import share."""

    classes: StateClasses
    told: Findings
    outputs: dict[str, tuple[str, ...]]
    parameters: dict[str, dict[str, str]]

    def embedded(self, state: Json) -> tuple[str, dict[str, Any] | None]:
        """The name and the chart of the behaviour that a state embeds; None if it is under way."""


_NOTHING = {"type": "any", "default": "none"}


class OneBehaviour:
    """Converts one behaviour."""

    def __init__(self, behaviour: Behaviour, shared: Shared) -> None:
        self.behaviour, self.shared = behaviour, shared
        self.containers = behaviour.json["containers"]
        given = behaviour.json.get("parameters", {})
        keys = [identifier(key) for key in behaviour.keys("input_keys")]
        names = parameter_names(given, keys)
        shared.parameters[behaviour.name] = names
        self.parameters = {names[name]: value for name, value in given.items()}
        self.told = shared.told.of(behaviour.name)
        values = ExpressionValues(behaviour.variables, given)
        self.arguments = Arguments(values, names, shared.classes, self.told)
        self.data = ChartData()
        self.initial: dict[str, Any] = {}

    def chart(self) -> dict[str, Any]:
        """The chart."""
        root = self._root()
        scope = self.scope(ROOT, "", root, {}, None)
        written = [identifier(key) for key in self.behaviour.keys("output_keys")]
        self.data.read.update(scope.keys[key] for key in written)
        box, ends = self.box(scope)
        inputs = [identifier(key) for key in self.behaviour.keys("input_keys")]
        for key in (scope.keys[key] for key in written):
            if self.initial.get(key) in (None, "none"):
                self.initial[key] = ""
                self.told.note(
                    "", f"key {key!r} starts as empty text: an output of a chart has a value"
                )
        for key in self.data.forget_unread():
            self.told.note("", f"key {key!r} is never read; left out")
        declared = [outcome_name(outcome) for outcome in root.get("outcomes", ())]
        for outcome in (outcome for outcome in declared if outcome not in ends):
            self.told.note("", f"outcome {outcome!r} can never come")
        outcomes = list(dict.fromkeys([*declared, *ends]))
        for outcome in outcomes[len(declared) :]:
            self.told.note("", f"outcome {outcome!r} is new: {self.reason(outcome)}")
        chart = {
            "chart": self.behaviour.name,
            "about": _one_paragraph(self.behaviour.about),
            "parameters": {name: self.parameter(name) for name in self.parameters},
            "inputs": {key: {**_NOTHING, **self.start(key, "default")} for key in inputs},
            "outcomes": outcomes,
            "outputs": {end: dict.fromkeys(written, "any | none") for end in outcomes if written},
            "data": {
                key: {"type": "any", "initial": "none", **self.start(key, "initial")}
                for key in self.data.taken
                if key not in inputs
            },
            **box,
        }
        return _filled(chart)

    def _root(self) -> Json:
        """The outermost container; a state stands in where it is empty."""
        root = self.behaviour.root
        if root["states"]:
            return root
        self.told.left("", "the behaviour is empty; a state stands in for what it is to do")
        ends = {outcome: outcome for outcome in root.get("outcomes", ())}
        cls = f"{self.behaviour.name}Container"
        states = [{"name": "empty", "class": cls, "transitions": ends}]
        return {**root, "kind": "statemachine", "states": states}

    def reason(self, outcome: str) -> str:
        """Why a chart has an outcome that its behaviour has not."""
        if outcome == NO_CONDITION:
            return "FlexBE waits for ever where no condition matches"
        return "something leads to it, and nothing in FlexBE takes it"

    def parameter(self, name: str) -> dict[str, Any]:
        """A parameter of the chart."""
        value = self.arguments.plain("", self.parameters[name])
        if value is None:
            return {"type": "any", "default": "none"}
        return {"type": type_name(value), "default": value}

    def start(self, key: str, word: str) -> dict[str, Any]:
        """The first value of a key, if it has one."""
        found = self.initial.get(key)
        return {} if found is None else {word: found}

    def scope(
        self,
        name: str,
        path: str,
        container: Json,
        given: Mapping[str, str],
        at: ContainerScope | None,
    ) -> ContainerScope:
        """What names mean in a container, whose first values are noted."""
        scope = self.data.scope(path, container, given, at)
        for key, expression in self.behaviour.userdata.get(name, {}).items():
            real = scope.keys.get(identifier(key))
            if real is not None and real not in self.initial:
                self.initial[real] = self.arguments.plain(path, {"expr": expression})
        return scope

    def box(self, scope: ContainerScope) -> tuple[dict[str, Any], Ends]:
        """A container's form with its children, and the outcomes it can end with."""
        names = self.children(scope)
        keeps = scope.container["kind"] == "concurrency"
        if scope.container["kind"] == "priority":
            self.told.note(
                scope.path, "a priority container pauses all beside it; here they go on beside it"
            )
        writers = KeyWriters(self.containers, self.shared.classes, self.shared.outputs)
        children: dict[str, dict[str, Any]] = {}
        can_end: dict[str, Ends] = {}
        ends: Ends = {}
        for state in scope.container["states"]:
            name = names[state["name"]]
            if name in children:
                self.told.left(
                    scope.at(name), "there are two states of this name; the first is kept"
                )
                continue
            alone = writers.alone(state, scope) if keeps else frozenset[str]()
            for key in sorted(alone):
                self.told.left(
                    scope.at(name), f"{key!r} is written beside it, too; its own is lost"
                )
            node, possible = self.node(state, scope.at(name), scope, alone)
            if not keeps:
                node["next"] = next_of(state, scope.at(name), names, possible, self.told)
                ends |= {t[1:]: None for t in node["next"].values() if t.startswith(".")}
            children[name] = node
            can_end[name] = possible
        if not keeps:
            return {"states": children}, ends
        conditions = scope.container.get("conditions", ())
        when = rules_of(conditions, names, can_end, partial(self.told.note, scope.path))
        return {"any": children, "when": when}, {rule["outcome"]: None for rule in when}

    def children(self, scope: ContainerScope) -> dict[str, str]:
        """The names that the states of a container have in a chart."""
        names: dict[str, str] = {}
        for state in scope.container["states"]:
            if state["name"] not in names:
                names[state["name"]] = unique(identifier(state["name"]), names.values())
        return names

    def node(
        self, state: Json, path: str, scope: ContainerScope, alone: frozenset[str]
    ) -> tuple[dict[str, Any], Ends]:
        """A child of a container, and the outcomes it can end with.

        `alone`: keys that it may not write, as another child beside it does.
        """
        container = self.containers.get(state.get("container"))
        if container is not None and container["states"]:
            return self.inner(state, path, scope, alone)
        if container is not None:
            self.told.left(path, "the container is empty; a state stands in for it")
            state = {**state, "class": f"{identifier(state['name'])}Container"}
        make = self.embedded if "behavior" in state else self.leaf
        node, ends = make(state, path, scope, alone)
        node["autonomy"] = {
            outcome_name(outcome): level
            for outcome, level in levels_of(state).items()
            if outcome_name(outcome) in ends
        }
        return node, ends

    def inner(
        self, state: Json, path: str, scope: ContainerScope, alone: frozenset[str]
    ) -> tuple[dict[str, Any], Ends]:
        """A container inside another."""
        container = self.containers[state["container"]]
        given = {
            key: outer
            for key, outer in _remapping(state)
            if scope.keys.get(identifier(outer)) not in alone
        }
        inside = self.scope(state["container"], path, container, given, scope)
        if levels_of(state):
            self.told.note(path, "the autonomy of a container is left out; set that of its states")
        node: dict[str, Any] = {"in": {}, "out": {}}
        reading = set(map(identifier, container.get("input_keys", ())))
        reading -= set(map(identifier, container.get("output_keys", ())))
        for key, real in inside.keys.items():
            if scope.seen.get(key, key) != real:
                outer = next((k for k, v in scope.keys.items() if v == real), real)
                self.data.bind(node["in" if key in reading else "out"], key, outer, scope)
        box, ends = self.box(inside)
        return node | box, ends

    def embedded(
        self, state: Json, path: str, scope: ContainerScope, alone: frozenset[str]
    ) -> tuple[dict[str, Any], Ends]:
        """Another behaviour."""
        name, chart = self.shared.embedded(state)
        if chart is None:
            self.told.left(path, f"{name} embeds itself, which no chart can")
            return self.leaf({**state, "class": f"{name}_again"}, path, scope, alone)
        node: dict[str, Any] = {"use": name, "with": {}, "in": {}, "out": {}}
        for key, value in self.arguments.given_parameters(state, path).items():
            if key in self.shared.parameters[name]:
                node["with"][self.shared.parameters[name][key]] = self.arguments.value(path, value)
            else:
                self.told.note(path, f"{name} has no parameter {key!r}; left out")
        outputs: Mapping[str, Any] = next(iter(chart.get("outputs", {}).values()), {})
        for key, outer in ((identifier(k), identifier(o)) for k, o in _remapping(state)):
            if key in chart.get("inputs", ()):
                self.data.reads(node["in"], key, outer, scope)
            if key in outputs and scope.keys[outer] not in alone:
                self.data.bind(node["out"], key, outer, scope)
        return node, dict.fromkeys(chart["outcomes"])

    def leaf(
        self, state: Json, path: str, scope: ContainerScope, alone: frozenset[str]
    ) -> tuple[dict[str, Any], Ends]:
        """A state of a class."""
        cls, given = self.arguments.class_of(state, path)
        cls.state = cls.state or f"{self.behaviour.name}: {path}"
        node: dict[str, Any] = {"do": cls.name, "with": given, "in": {}, "out": {}}
        flexbe = bare(state["class"])
        ends = outcome_names(state.get("transitions", ()))
        ends = cls.outcomes() if cls.is_original else ends
        for key, outer in _remapping(state):
            if cls.ready is not None and not {key_name(key)} & {
                *cls.ready.inputs,
                *cls.ready.outputs,
            }:
                self.told.note(path, f"key {key!r} is not used by the code; left out")
            elif not cls.writes(key, self.shared.classes.writes(flexbe, key)):
                name = self.shared.classes.input_name(flexbe, key)
                name = f"{name}_key" if name in given else name
                self.data.reads(node["in"], name, identifier(outer), scope)
            elif ends and scope.keys[identifier(outer)] not in alone:
                self.data.bind(node["out"], key_name(key), identifier(outer), scope)
        plain = {key: value for key, value in given.items() if key != "outcomes"}
        shown = plain if cls.by_argument else given
        cls.uses.append(Use(ends, dict(shown), tuple(node["in"]), tuple(node["out"])))
        return node, dict.fromkeys(ends)


def _filled(node: dict[str, Any]) -> dict[str, Any]:
    """A node, and all below it, without sections that say nothing."""
    for form in node.keys() & {"states", "any"}:
        node[form] = {name: _filled(child) for name, child in node[form].items()}
    return {key: value for key, value in node.items() if value not in ({}, [], "")}


def _remapping(state: Json) -> Iterable[tuple[str, str]]:
    found: Mapping[str, str] = state.get("remapping", {})
    return found.items()


def _one_paragraph(text: str) -> str:
    return " ".join(text.split())
