"""FlexBE behaviours to charts: all of them, that may embed each other, and those not here."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from cobodeck.flexbe.behaviour import Behaviour, Json
from cobodeck.flexbe.converting.arguments import is_expression
from cobodeck.flexbe.converting.one_behaviour import OneBehaviour
from cobodeck.flexbe.converting.state_classes import StateClass, StateClasses, Use
from cobodeck.flexbe.converting.told import Findings, Left
from cobodeck.flexbe.names import bare, identifier, outcome_names, parameter_names, unique
from cobodeck.flexbe_states import FlexbeClass
from engine import Interface

_NOTHING = {"type": "any", "default": "none"}


@dataclass(frozen=True, slots=True)
class Conversion:
    """Charts by name, the state classes they need, what is left to do, and what is different."""

    charts: Mapping[str, dict[str, Any]]
    classes: Mapping[str, StateClass]
    left: tuple[Left, ...]
    notes: tuple[str, ...]

    def interfaces(self) -> dict[str, Interface]:
        """The interfaces of the state classes."""
        return {name: cls.interface() for name, cls in self.classes.items()}


def convert(
    behaviours: Iterable[Behaviour],
    known: Mapping[str, FlexbeClass] | None = None,
    taken: Iterable[str] = (),
) -> Conversion:
    """Convert behaviours that may embed each other.

    `known`: the state classes whose text is here, by name; `taken`: names that no class may have.
    """
    return _Conversion(list(behaviours), known or {}, taken).done()


class _Conversion:
    """What the behaviours share."""

    def __init__(
        self, behaviours: list[Behaviour], known: Mapping[str, FlexbeClass], taken: Iterable[str]
    ) -> None:
        self.behaviours = {behaviour.name: behaviour for behaviour in behaviours}
        self.classes = StateClasses(behaviours, known, taken)
        self.told = Findings()
        self.charts: dict[str, dict[str, Any]] = {}
        self.outputs: dict[str, tuple[str, ...]] = {}  # of embedded behaviours
        self.parameters: dict[str, dict[str, str]] = {}  # names in charts, by chart
        self._under_way: set[str] = set()
        for behaviour in behaviours:
            for container in behaviour.json["containers"].values():
                for state in container["states"]:
                    if "behavior" in state:
                        self._note_embedded(state, behaviour.name)

    def _note_embedded(self, state: Json, by: str) -> None:
        name = self._name_of(state)
        if name is None:
            self._stand_in(state, by)
        else:
            self.outputs[state["behavior"]] = self.behaviours[name].keys("output_keys")

    def done(self) -> Conversion:
        """All of it."""
        for name in self.behaviours:
            self.chart(name)
        for name, key in self.classes.guessed():
            self.told.notes.append(
                f"{name} is taken to write {key!r}: nothing else gives it a value"
            )
        charts = {name: self.charts[name] for name in (*self.behaviours, *self.charts)}
        return Conversion(charts, self.classes.all, tuple(self.told.left), tuple(self.told.notes))

    def chart(self, name: str) -> dict[str, Any] | None:
        """The chart of a behaviour; None if it is the one that is being converted."""
        if name not in self.charts and name not in self._under_way:
            self._under_way.add(name)
            self.charts[name] = OneBehaviour(self.behaviours[name], self).chart()
        return self.charts.get(name)

    def embedded(self, state: Json) -> tuple[str, dict[str, Any] | None]:
        """The name and the chart of the behaviour that a state embeds."""
        name = self._name_of(state)
        if name is not None:
            return name, self.chart(name)
        name = self._stand_in_name(state)
        return name, self.charts[name]

    def _name_of(self, state: Json) -> str | None:
        cls = bare(state["behavior"])
        wanted = _letters(cls.removesuffix("SM"))
        for name, behaviour in self.behaviours.items():
            if behaviour.class_name == cls or _letters(name) == wanted:
                return name
        return None

    def _stand_in_name(self, state: Json) -> str:
        return unique(identifier(bare(state["behavior"]).removesuffix("SM")), self.behaviours)

    def _stand_in(self, state: Json, by: str) -> None:
        """A chart in place of a behaviour that is not here, with all that is named of it."""
        name, cls = self._stand_in_name(state), bare(state["behavior"])
        if name not in self.charts:
            self.charts[name] = {"chart": name, "about": f"In place of {cls}, which was not there."}
            self.told.of(by).left("", f"the embedded behaviour {cls} is not here")
        self._extend(self.charts[name], state)

    def _extend(self, chart: dict[str, Any], state: Json) -> None:
        """Make a chart in place of a behaviour have what a state that embeds it names."""
        outcomes = outcome_names(state.get("transitions", ()))
        cls = self.classes.all.setdefault(
            f"{chart['chart']}_behaviour", StateClass("", f"the behaviour {state['behavior']}")
        )
        cls.name, cls.by_argument = f"{chart['chart']}_behaviour", False
        chart["outcomes"] = list(dict.fromkeys([*chart.get("outcomes", ()), *outcomes]))
        cls.uses[:] = [Use(tuple(chart["outcomes"]), {}, (), ())]
        cls.state = chart["chart"]
        keys = [identifier(key) for key in state.get("remapping", {})]
        chart.setdefault("inputs", {}).update(dict.fromkeys(keys, _NOTHING))
        given = [*self.parameters.get(chart["chart"], ()), *_parameters_of(state)]
        names = parameter_names(dict.fromkeys(given), chart["inputs"])
        self.parameters[chart["chart"]] = names
        chart["parameters"] = dict.fromkeys(names.values(), _NOTHING)
        chart["states"] = {
            "behaviour": {"do": cls.name, "next": {end: f".{end}" for end in chart["outcomes"]}}
        }


def _parameters_of(state: Json) -> Iterable[str]:
    given = state.get("args", {}).get("parameters", {})
    if is_expression(given):
        return re.findall(r"['\"](\w+)['\"]\s*:", given["expr"])
    return list(given) if isinstance(given, dict) else []


def _letters(name: str) -> str:
    return re.sub(r"[\W_]+", "", name).lower()
