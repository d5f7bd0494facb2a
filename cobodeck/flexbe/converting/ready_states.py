"""Lambdas of FlexBE's own calculating states, as state classes that need no FlexBE.

Only what can be translated safely is: names in the code are arguments of the lambda, parameters and
private variables of the behaviour, and harmless functions.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cobodeck.flexbe.converting.values import ExpressionValues, NotKnown
from cobodeck.flexbe.names import key_name, outcome_name
from engine import Action, python_name

FUNCTION = {
    "CalculationState": "calculation",
    "FlexibleCalculationState": "calculation",
    "CheckConditionState": "predicate",
    "FlexibleCheckConditionState": "predicate",
    "DecisionState": "conditions",
}
"""The state classes that are translated, and the argument that is their function."""
_SAFE = frozenset(
    (
        *("abs", "all", "any", "bool", "dict", "divmod", "enumerate", "filter", "float", "int"),
        *("isinstance", "len", "list", "map", "max", "min", "next", "range", "reversed", "round"),
        *("set", "sorted", "str", "sum", "tuple", "zip"),
    )
)
_USED = frozenset(("freeze", "self", "str"))
"""Names that the lines around an expression use: no argument in it may be one of them."""


@dataclass(frozen=True, slots=True)
class ReadyState:
    """A translated state: the body of its `run`, and what that needs."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: tuple[str, ...]
    outcomes: tuple[str, ...]
    body: str


def ready_state(
    kind: str, arguments: Mapping[str, Any], outcomes: Sequence[str], values: ExpressionValues
) -> ReadyState | None:
    """The translation of a state of the class `kind`; None if there is no safe one."""
    argument = FUNCTION.get(kind, "")
    given = arguments.get(argument)
    named = given.get("expr", "") if isinstance(given, dict) else ""
    expression = values.variables.get(named, named)
    if not expression.startswith("lambda"):
        return None
    function = ast.parse(expression, mode="eval").body
    inputs = _inputs(kind, arguments)
    if not isinstance(function, ast.Lambda) or inputs is None:
        return None
    translation = _Translation(values, set(_arguments(function)))
    body = translation.visit(function.body)
    if translation.unsafe or translation.bound & _USED:
        return None
    if function.args.defaults or function.args.kwonlyargs:
        return None
    lines = [_taken(function, inputs), *_ends(kind, ast.unparse(body), outcomes)]
    return ReadyState(
        inputs=tuple(inputs),
        outputs=("output_value",) if argument == "calculation" else (),
        parameters=tuple(translation.used),
        outcomes=tuple(outcomes),
        body="\n".join(line for line in lines if line),
    )


def _inputs(kind: str, arguments: Mapping[str, Any]) -> list[str] | None:
    if not kind.startswith("Flexible"):
        return ["input_value"]
    keys = arguments.get("input_keys")
    if isinstance(keys, list) and all(isinstance(key, str) for key in keys):
        return [key_name(key) for key in keys]
    return None


def _arguments(function: ast.Lambda) -> Iterator[str]:
    for argument in (*function.args.posonlyargs, *function.args.args, function.args.vararg):
        if argument is not None:
            yield argument.arg


def _taken(function: ast.Lambda, inputs: Sequence[str]) -> str:
    """The line that gives the lambda's arguments their values."""
    names = [python_name(name) for name in inputs]
    wanted = [argument.arg for argument in (*function.args.posonlyargs, *function.args.args)]
    if function.args.vararg is not None:
        return f"{function.args.vararg.arg} = ({', '.join(names)},)"
    if len(names) == len(wanted) == 1 and inputs == ["input_value"]:
        return "" if wanted == names else f"{wanted[0]} = {names[0]}"
    if len(wanted) == 1:
        return f"{wanted[0]} = [{', '.join(names)}]"
    return f"{', '.join(wanted)} = {', '.join(names)}" if wanted else ""


def _ends(kind: str, code: str, outcomes: Sequence[str]) -> list[str]:
    """The lines that return."""
    if "Calculation" in kind:
        end = outcomes[0] if outcomes else "done"
        return [f'return "{end}", {{"output_value": freeze({code})}}']
    if "Check" in kind:
        yes, no = outcome_name("true"), outcome_name("false")
        chooses = isinstance(ast.parse(code, mode="eval").body, ast.IfExp | ast.Lambda)
        code = f"({code})" if chooses else code
        return [f'return "{yes}" if {code} else "{no}"']
    return [f"outcome = str({code})", f"return {_renamed(outcomes)}"]


def _renamed(outcomes: Sequence[str]) -> str:
    changed = {name.removesuffix("_"): name for name in outcomes if name.endswith("_")}
    return f"{changed!r}.get(outcome, outcome)" if changed else "outcome"


class _Translation(ast.NodeTransformer):
    """Puts `self.x` of parameters and known values into an expression, and finds what is unsafe."""

    def __init__(self, values: ExpressionValues, bound: set[str]) -> None:
        self.values, self.bound = values, bound
        self.used: dict[str, None] = {}
        self.unsafe: list[str] = []

    def visit_Lambda(self, node: ast.Lambda) -> ast.AST:
        """Arguments of a lambda inside are names, too."""
        self.bound |= set(_arguments(node))
        return self.generic_visit(node)

    def visit_comprehension(self, node: ast.comprehension) -> ast.AST:
        """So are those of comprehensions; `_comprehended` visits these first."""
        return self.generic_visit(node)

    def _comprehended(self, node: Any) -> ast.AST:
        for over in node.generators:
            self.bound |= {n.id for n in ast.walk(over.target) if isinstance(n, ast.Name)}
        return self.generic_visit(node)

    visit_ListComp = visit_SetComp = visit_DictComp = visit_GeneratorExp = _comprehended

    def visit_Attribute(self, node: ast.Attribute) -> ast.AST:
        """`self.x` of a parameter stays; of anything else, it is unsafe."""
        if node.attr.startswith("_"):
            self.unsafe.append(node.attr)
        if isinstance(node.value, ast.Name) and node.value.id == "self":
            known = self.values.parameter(f"self.{node.attr}") is not None
            if not known or hasattr(Action, node.attr):
                self.unsafe.append(f"self.{node.attr}")
                return node
            self.used[node.attr] = None
            return ast.Attribute(node.value, key_name(node.attr), node.ctx)
        return self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        """A private variable becomes its value."""
        if node.id in self.bound or node.id in _SAFE:
            return node
        try:
            return ast.parse(repr(self.values.of(node.id)), mode="eval").body
        except NotKnown:
            self.unsafe.append(node.id)
            return node

    def visit_NamedExpr(self, node: ast.NamedExpr) -> ast.AST:
        """What stores anything is left alone."""
        self.unsafe.append(":=")
        return node

    visit_Await = visit_Yield = visit_YieldFrom = visit_NamedExpr  # type: ignore[assignment]


def code_of(name: str, state: ReadyState, about: str) -> str:
    """The text of the class."""
    arguments = "".join(f", {python_name(key)}: Any = None" for key in state.inputs)
    parameters = "".join(f", {python_name(p)}: Any = None" for p in state.parameters)
    outcomes = "".join(f'"{outcome}", ' for outcome in state.outcomes)
    lines = [
        f"class {name}(Action):",
        textwrap.indent(about, "    "),
        "",
        f"    outcomes = ({outcomes.rstrip()})" if outcomes else "    outcomes = ()",
    ]
    if state.outputs:
        keys = ", ".join(f'"{key}": Any' for key in state.outputs)
        lines.append(f"    outputs = {{outcome: {{{keys}}} for outcome in outcomes}}")
    if state.parameters:
        lines += ["", f"    def __init__(self{parameters}) -> None:"]
        lines += [f"        self.{p} = {python_name(p)}" for p in state.parameters]
    lines += ["", f"    def run(self, ctx: Context{arguments}) -> Outcome:"]
    return "\n".join([*lines, textwrap.indent(state.body, "        ")])
