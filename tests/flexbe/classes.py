"""State classes as far as their use in behaviours tells."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from engine.interfaces import Argument, Interface
from engine.types import ANY, Type
from tests.flexbe.names import camel, identifier, outcome_name

Json = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Use:
    """One state of a class: what is given, read and written, and how it can end."""

    outcomes: tuple[str, ...]
    parameters: Mapping[str, Any]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


class Classes:
    """The state classes of all behaviours, as far as their use tells."""

    def __init__(self, behaviours: Mapping[str, Json]) -> None:
        self.uses: dict[str, list[Use]] = {}
        self.outcomes: dict[str, set[frozenset[str]]] = {}
        for behaviour in behaviours.values():
            for container in behaviour["containers"].values():
                for state in container["states"]:
                    if "class" in state:
                        ends = frozenset(state["transitions"])
                        self.outcomes.setdefault(state["class"], set()).add(ends)

    def name(self, state: Json) -> str:
        """What the class is called: one that is used with several sets of outcomes is several."""
        if len(self.outcomes[state["class"]]) > 1:
            return "Or".join(camel(outcome_name(outcome)) for outcome in state["transitions"])
        return identifier(state["class"].rpartition("__")[2])

    def add(self, name: str, use: Use) -> None:
        """Note that a state is of the class `name`."""
        self.uses.setdefault(name, []).append(use)

    def interfaces(self) -> dict[str, Interface]:
        """What is known of each class."""
        return {name: _interface(name, uses) for name, uses in self.uses.items()}


def _interface(name: str, uses: list[Use]) -> Interface:
    outcomes = uses[0].outcomes
    written = dict.fromkeys(key for use in uses for key in use.outputs)
    outputs = {outcome: dict.fromkeys(written, ANY) for outcome in outcomes} if written else {}
    return Interface(
        name=name,
        monitor=False,
        outcomes=outcomes,
        parameters={
            key: Argument(_common_type(values), *_default(values, uses))
            for key, values in _by_name(use.parameters for use in uses).items()
        },
        inputs={
            key: Argument(ANY, *_default(values, uses))
            for key, values in _by_name(dict.fromkeys(use.inputs) for use in uses).items()
        },
        outputs=outputs,
        reads={},
        commands=(),
        instant=False,
        about="Known by its use only.",
        make=_unknown(name),
    )


def _by_name(givens: Iterable[Mapping[str, Any]]) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for given in givens:
        for key, value in given.items():
            found.setdefault(key, []).append(value)
    return found


def _default(values: list[Any], uses: list[Use]) -> tuple[()] | tuple[None]:
    """What not every use gives need not be given."""
    return () if len(values) == len(uses) else (None,)


def _common_type(values: list[Any]) -> Type:
    names = {type_name(value) for value in values}
    return Type(names.pop()) if len(names) == 1 and "any" not in names else ANY


def type_name(value: Any) -> str:
    """The name of the type of a value; references stay open."""
    if isinstance(value, bool):
        return "boolean"
    if isinstance(value, int | float):
        return "number"
    return "text" if isinstance(value, str) and not value.startswith("$") else "any"


def _unknown(name: str) -> Callable[..., Any]:
    def make(**_parameters: Any) -> Any:
        raise NotImplementedError(f"{name} is known by its use only; give it a class")

    return make
