"""Arguments of states: which class they ask for, and their values as charts write them."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from typing import Any

from cobodeck.flexbe.behaviour import Json
from cobodeck.flexbe.converting.ready_states import FUNCTION, ready_state
from cobodeck.flexbe.converting.state_classes import StateClass, StateClasses, lists_outcomes
from cobodeck.flexbe.converting.told import ChartFindings
from cobodeck.flexbe.converting.values import ExpressionValues, NotKnown
from cobodeck.flexbe.names import bare, identifier, key_name, outcome_names


def is_expression(value: Any) -> bool:
    """Whether a value is Python code that is no literal."""
    return isinstance(value, dict) and set(value) == {"expr"}


class Arguments:
    """Arguments of the states of one behaviour.

    `parameters`: the chart's name of each parameter of the behaviour.
    """

    def __init__(
        self,
        values: ExpressionValues,
        parameters: Mapping[str, str],
        classes: StateClasses,
        told: ChartFindings,
    ) -> None:
        self.values, self.parameters, self.classes, self.told = values, parameters, classes, told

    def class_of(self, state: Json, path: str) -> tuple[StateClass, dict[str, Any]]:
        """The class of a state, and the parameters that it is given."""
        arguments = self.named_arguments(state)
        function = FUNCTION.get(bare(state["class"]))
        code = {
            key: value["expr"]
            for key, value in arguments.items()
            if self.is_code(value) or (key == function and is_expression(value))
        }
        ends = list(outcome_names(state.get("transitions", ())))
        if not code:
            cls = self.classes.of(state)
            plain = {key: v for key, v in arguments.items() if key != "outcomes"}
            given = self.written(
                path, plain if cls.by_argument or lists_outcomes(state) else arguments
            )
            return cls, {"outcomes": ends, **given} if cls.by_argument else given
        return self._own_class(state, path, arguments, code)

    def _own_class(
        self, state: Json, path: str, arguments: Mapping[str, Any], code: Mapping[str, str]
    ) -> tuple[StateClass, dict[str, Any]]:
        """The class of a state with code among its arguments."""
        ends = list(outcome_names(state.get("transitions", ())))
        ready = ready_state(bare(state["class"]), arguments, ends, self.values)
        if ready is not None:
            cls = self.classes.own(state, ready, tuple(code.values()))
            return cls, {identifier(n): f"${self.parameters[n]}" for n in ready.parameters}
        rest = {k: v for k, v in arguments.items() if k not in code and k != "outcomes"}
        given = self.written(path, rest)
        for expression in code.values():
            used = re.findall(r"\bself\.(\w+)(?!\w*\()", expression)
            given |= {
                identifier(key): f"${self.parameters[key]}"
                for key in used
                if key in self.parameters
            }
        cls = self.classes.own(state, None, tuple(code.values()))
        for expression in code.values():
            self.told.left(path, f"write {cls.name}, which is to do what this did", expression)
        return cls, given

    def named_arguments(self, state: Json) -> dict[str, Any]:
        """The arguments by name, also those that were given without one."""
        known = self.classes.known.get(bare(state.get("class", "")))
        names = [parameter.name for parameter in known.parameters] if known else []
        found = dict(state.get("args", {}))
        for number, value in enumerate(state.get("pos", ())):
            name = names[number] if number < len(names) else f"argument_{number + 1}"
            found.setdefault(name, value)
        return found

    def is_code(self, value: Any) -> bool:
        """Whether an argument is a function: a lambda, or a method of the behaviour."""
        if not is_expression(value):
            return False
        expression = value["expr"]
        is_method = re.fullmatch(r"self\.\w+", expression) and not self.values.parameter(expression)
        return bool(expression.startswith("lambda") or is_method)

    def written(self, path: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
        """Arguments as values of a chart."""
        return {key_name(key): self.value(path, value) for key, value in arguments.items()}

    def value(self, path: str, value: Any) -> Any:
        """An argument; parameters of the behaviour become those of the chart."""
        if is_expression(value):
            name = self.values.parameter(value["expr"])
            if name is not None:
                return f"${self.parameters[name]}"
        return self.plain(path, value)

    def plain(self, path: str, value: Any) -> Any:
        """A value without references."""
        if not is_expression(value):
            return self.plain_value(path, value)
        expression = value["expr"]
        try:
            found = self.values.of(expression)
        except NotKnown:
            self.told.left(path, "give the value of", expression)
            return expression.replace("$", "")
        if self.values.used:
            names = ", ".join(self.values.used)
            what = f"this value depends on {names}; it has their defaults"
            self.told.left(path, what, expression)
        return self.plain_value(path, found)

    def plain_value(self, path: str, value: Any) -> Any:
        """A value that charts can write; a mapping becomes text."""
        if isinstance(value, dict):
            if value:
                self.told.left(
                    path, "a mapping is no value of a chart; it is text now", repr(value)
                )
            return repr(value).replace("$", "")
        if isinstance(value, list | tuple):
            return [self.plain_value(path, item) for item in value]
        if isinstance(value, str) and value.startswith("$"):
            self.told.left(path, "`$` begins a reference in a chart; it is left out", value)
            return value.lstrip("$")
        is_finite = not isinstance(value, float) or value - value == 0
        return (
            value
            if (isinstance(value, str | int | float) and is_finite) or value is None
            else str(value)
        )

    def given_parameters(self, state: Json, path: str) -> Mapping[str, Any]:
        """The parameters that an embedded behaviour is given, also where code says them."""
        given = state.get("args", {}).get("parameters", {})
        if not is_expression(given):
            return given if isinstance(given, dict) else {}
        written = ast.parse(given["expr"], mode="eval").body
        if not isinstance(written, ast.Dict):
            self.told.left(path, "give its parameters, which code makes", given["expr"])
            return {}
        return {
            str(ast.literal_eval(key)): {"expr": ast.unparse(value)}
            for key, value in zip(written.keys, written.values, strict=True)
            if isinstance(key, ast.Constant)
        }
