"""State classes as far as their use in behaviours, and their own text, tells."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cobodeck.flexbe.behaviour import Behaviour, Json
from cobodeck.flexbe.converting.guessed_outputs import WRITES, guessed_outputs
from cobodeck.flexbe.converting.ready_states import ReadyState
from cobodeck.flexbe.names import (
    bare,
    camel,
    class_name,
    key_name,
    outcome_name,
    outcome_names,
    unique,
)
from cobodeck.flexbe_states import FlexbeClass
from engine import ANY, Argument, Interface, Type
from engine.files import quantity

_IMPORTABLE = re.compile(r"flexbe_core|rospy|rclpy|\w+_(msgs|srvs)")
"""Modules that FlexBE states find here."""
LONGEST = 60
"""Letters of a class's name that is made of outcomes."""


@dataclass(frozen=True, slots=True)
class Use:
    """One state of a class: what is given, read and written, and how it can end."""

    outcomes: tuple[str, ...]
    parameters: Mapping[str, Any]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


@dataclass(slots=True)
class StateClass:
    """A class that the charts name.

    Attributes:
        name: in charts.
        flexbe: its name in FlexBE.
        known: what its own text says, if that is here.
        by_argument: whether its outcomes are the value of its parameter `outcomes`.
        ready: the translation of its code.
        code: Python code that it has to do the same as.
        state: chart and path of the first state of the class.
        adapted: whether the project has its module, and runs it as it is.
    """

    name: str
    flexbe: str
    known: FlexbeClass | None = None
    by_argument: bool = False
    ready: ReadyState | None = None
    code: tuple[str, ...] = ()
    state: str = ""
    adapted: bool = False
    uses: list[Use] = field(default_factory=list)

    @property
    def is_original(self) -> bool:
        """Whether the class written for FlexBE is used as it is."""
        return self.known is not None and not self.code

    @property
    def may_be_adapted(self) -> bool:
        """Whether its module, alone and without topics, could run as it is."""
        known = self.known
        if known is None or not self.is_original or known.outcomes is None:
            return False
        foreign = [name for name in known.imports if not _IMPORTABLE.fullmatch(name)]
        return (
            known.name == self.name
            and not known.topics
            and not known.only_python_2
            and set(foreign) <= sys.stdlib_module_names
        )

    def writes(self, key: str, guess: bool) -> bool:
        """Whether it writes a key; the code of a translated state tells."""
        return key_name(key) in self.ready.outputs if self.ready is not None else guess

    def interface(self) -> Interface:
        """What is known of it."""
        outcomes = self.outcomes()
        written = dict.fromkeys(self.outputs(), ANY)
        return Interface(
            name=self.name,
            monitor=False,
            outcomes=outcomes,
            parameters=self.parameters(),
            inputs={key: Argument(ANY, None) for key in self.inputs()},
            outputs=dict.fromkeys(outcomes, written) if written else {},
            reads={},
            commands=(),
            instant=self.ready is not None,
            about=f"{self.flexbe} of FlexBE.",
            make=_unknown(self.name),
        )

    def outcomes(self) -> tuple[str, ...]:
        """In the order of the class, or of its first use."""
        if self.by_argument:
            return ("$outcomes",)
        if self.is_original and self.known is not None and self.known.outcomes is not None:
            return outcome_names(self.known.outcomes)
        return self.uses[0].outcomes

    def inputs(self) -> list[str]:
        """The keys that it reads."""
        known = self.known.input_keys if self.known is not None else None
        given = self.ready.inputs if self.ready is not None else ()
        used = (key for use in self.uses for key in use.inputs)
        return list(dict.fromkeys([*given, *map(key_name, known or ()), *used]))

    def outputs(self) -> list[str]:
        """The keys that it writes."""
        known = self.known.output_keys if self.known is not None else None
        given = self.ready.outputs if self.ready is not None else ()
        used = (key for use in self.uses for key in use.outputs)
        return list(dict.fromkeys([*given, *map(key_name, known or ()), *used]))

    def parameters(self) -> dict[str, Argument]:
        """Its parameters; what not every state gives has the default none."""
        found = {}
        for key, values in _by_name(use.parameters for use in self.uses).items():
            default = () if len(values) == len(self.uses) else (None,)
            found[key] = Argument(_common_type(values), *default)
        if self.by_argument:
            found["outcomes"] = Argument(Type("list", item=Type("text")))
        if self.known is not None:
            for parameter in self.known.parameters:
                if not parameter.required and key_name(parameter.name) not in found:
                    found[key_name(parameter.name)] = Argument(ANY, None)
        return found


class StateClasses:
    """The state classes of all behaviours."""

    def __init__(
        self,
        behaviours: Iterable[Behaviour],
        known: Mapping[str, FlexbeClass],
        taken: Iterable[str],
    ) -> None:
        self.known = known
        self.all: dict[str, StateClass] = {}
        self._taken = set(taken)
        self._named: dict[tuple[Any, ...], str] = {}
        self._outcomes: dict[str, dict[frozenset[str], None]] = {}
        self._listed: dict[str, bool] = {}
        self._arguments: dict[str, set[str]] = {}
        behaviours = list(behaviours)
        for state in _leaves(behaviours):
            name, ends = bare(state["class"]), tuple(state.get("transitions", {}))
            self._outcomes.setdefault(name, {})[frozenset(ends)] = None
            listed = lists_outcomes(state)
            self._listed[name] = self._listed.get(name, True) and listed
            self._arguments.setdefault(name, set()).update(map(key_name, state.get("args", ())))
        self._guessed = guessed_outputs(behaviours)

    def of(self, state: Json) -> StateClass:
        """The class of a state that has no code among its arguments.

        One that is used with several sets of outcomes is several, unless it has these as argument.
        """
        name, ends = bare(state["class"]), frozenset(state.get("transitions", {}))
        known = self.original(name, ends)
        variant: frozenset[str] | None = None
        wanted = class_name(name)
        by_argument = known is None and self._listed.get(name, False)
        if known is None and name not in self._outcomes:
            variant = ends  # a state that stands in for something else
        elif known is None and len(self._outcomes[name]) > 1 and not by_argument:
            variant = ends
            ending = "Or".join(camel(outcome_name(end)) for end in state.get("transitions", {}))
            wanted = f"{wanted}{ending or 'Endless'}"[:LONGEST]
        return self._add(
            (name, variant, known is None), wanted, StateClass("", name, known, by_argument)
        )

    def own(self, state: Json, ready: ReadyState | None, code: tuple[str, ...]) -> StateClass:
        """A class of its own for a state that is given code; equal ones share it."""
        name = bare(state["class"])
        ends = tuple(state.get("transitions", {}))
        key = ("code", name, ready, ends if ready is None else (), code)
        wanted = class_name(camel(key_name(state["name"])))
        return self._add(key, wanted, StateClass("", name, None, False, ready, code))

    def _add(self, key: tuple[Any, ...], wanted: str, made: StateClass) -> StateClass:
        if key not in self._named:
            taken = self.all.keys() | self._taken
            name = wanted if made.is_original else unique(wanted, taken)
            made.name = self._named[key] = name
            self.all[name] = made
        return self.all[self._named[key]]

    def original(self, name: str, ends: frozenset[str]) -> FlexbeClass | None:
        """The class written for FlexBE, if it is here and has these outcomes."""
        found = self.known.get(name)
        if found is None or found.outcomes is None or not ends <= set(found.outcomes):
            return None
        return found

    def writes(self, name: str, key: str) -> bool:
        """Whether states of a class write the key, by their text or, else, by a guess."""
        found = self.known.get(name)
        if found is not None and found.output_keys is not None:
            return key in found.output_keys
        return key in WRITES[name] if name in WRITES else (name, key) in self._guessed

    def input_name(self, name: str, key: str) -> str:
        """The input that is a key of a class; one that is named like a parameter gets an ending."""
        found = key_name(key)
        return f"{found}_key" if found in self._arguments.get(name, ()) else found

    def guessed(self) -> list[tuple[str, str]]:
        """Classes and keys that they are taken to write, as nothing else gives the key a value."""
        told = {name for name, cls in self.known.items() if cls.output_keys is not None}
        return sorted(pair for pair in self._guessed if pair[0] not in WRITES.keys() | told)


def lists_outcomes(state: Json) -> bool:
    """Whether the outcomes of a state are among its arguments."""
    given = state.get("args", {}).get("outcomes")
    return isinstance(given, list) and given == list(state.get("transitions", {}))


def _leaves(behaviours: Iterable[Behaviour]) -> Iterator[Json]:
    for behaviour in behaviours:
        for container in behaviour.json["containers"].values():
            yield from (state for state in container["states"] if "class" in state)


def _by_name(givens: Iterable[Mapping[str, Any]]) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for given in givens:
        for key, value in given.items():
            found.setdefault(key, []).append(value)
    return found


def _common_type(values: list[Any]) -> Type:
    names = {type_name(value) for value in values}
    return Type(names.pop()) if len(names) == 1 and "any" not in names else ANY


def type_name(value: Any) -> str:
    """The name of the type of a value; references, and text that reads as `5 s`, stay open."""
    if isinstance(value, bool):
        return "boolean"
    if isinstance(value, int | float):
        return "number"
    is_text = isinstance(value, str) and not value.startswith("$")
    return "text" if is_text and value != "none" and not quantity(value) else "any"


def _unknown(name: str) -> Callable[..., Any]:
    def make(**_parameters: Any) -> Any:
        raise NotImplementedError(f"{name} is known by its use only; give it a class")

    return make
