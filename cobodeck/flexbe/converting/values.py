"""What Python expressions in behaviours stand for, worked out without running them.

Numbers, text, lists and arithmetic of these, names of private variables, parameters of the
behaviour, a few functions. Everything else is not known.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

MOST = 10_000
"""Items of a list, or characters of text, that an expression may make."""
_SUMS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.In: lambda a, b: a in b,
    ast.NotIn: lambda a, b: a not in b,
}
_ONES: dict[type, Callable[[Any], Any]] = {
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Not: operator.not_,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{f.__name__: f for f in (abs, bool, dict, float, int, len, list, max, min, round, str, sum)},
    **{f"math.{f.__name__}": f for f in (math.radians, math.degrees, math.sqrt)},
    "range": lambda *given: list(range(*given))[:MOST] if max(map(abs, given)) <= MOST else None,
    "tuple": list,
}
_NAMED = {
    "math.pi": math.pi,
    **{f"Logger.REPORT_{w}": w.lower() for w in ("HINT", "INFO", "WARN", "ERROR", "DEBUG")},
}


class NotKnown(Exception):
    """An expression whose value only a run of the behaviour's code would tell."""


class ExpressionValues:
    """Values of expressions in one behaviour.

    `used`: the parameters whose defaults went into the last value.
    """

    def __init__(self, variables: Mapping[str, str], parameters: Mapping[str, Any]) -> None:
        self.variables, self.parameters = variables, parameters
        self.used: dict[str, None] = {}
        self._within: list[str] = []

    def of(self, expression: str) -> Any:
        """The value of an expression.

        Raises:
            NotKnown: it cannot be told.
        """
        self.used, self._within = {}, []
        try:
            return self._value(ast.parse(expression, mode="eval").body, {})
        except NotKnown:
            raise
        except Exception as error:  # noqa: BLE001  whatever Python says of 1 + "a"
            raise NotKnown(str(error)) from None

    def parameter(self, expression: str) -> str | None:
        """The name of the parameter, if the expression is one: `self.name`."""
        name = expression.removeprefix("self.")
        return name if name != expression and name in self.parameters else None

    def _value(self, node: ast.expr, local: Mapping[str, Any]) -> Any:
        found = self._compound(node, local)
        if isinstance(found, str | list) and len(found) > MOST:
            raise NotKnown("too long")
        return found

    def _compound(self, node: ast.expr, local: Mapping[str, Any]) -> Any:
        match node:
            case ast.Constant():
                return node.value
            case ast.Name() | ast.Attribute():
                return self._named(ast.unparse(node), local)
            case ast.List() | ast.Tuple():
                return [self._value(item, local) for item in node.elts]
            case ast.Dict(keys=keys, values=values):
                items = zip(filter(None, keys), values, strict=True)
                return {self._value(k, local): self._value(v, local) for k, v in items}
            case ast.UnaryOp() | ast.BinOp() | ast.Compare():
                return self._computed(node, local)
            case ast.IfExp(test=test, body=body, orelse=orelse):
                return self._value(body if self._value(test, local) else orelse, local)
            case ast.Subscript(value=value, slice=index):
                return self._value(value, local)[self._index(index, local)]
            case ast.ListComp(elt=item, generators=[ast.comprehension() as over]):
                return self._listed(item, over, local)
            case ast.Call(func=function, args=given, keywords=[]):
                return _FUNCTIONS[ast.unparse(function)](*(self._value(g, local) for g in given))
        raise NotKnown(type(node).__name__)

    def _computed(self, node: ast.expr, local: Mapping[str, Any]) -> Any:
        match node:
            case ast.UnaryOp(op=sign, operand=operand):
                return _ONES[type(sign)](self._value(operand, local))
            case ast.BinOp(left=left, op=op, right=right):
                return _SUMS[type(op)](*_small(self._value(left, local), self._value(right, local)))
            case ast.Compare(left=left, ops=[compared], comparators=[right]):
                return _SUMS[type(compared)](self._value(left, local), self._value(right, local))
        raise NotKnown(type(node).__name__)

    def _named(self, name: str, local: Mapping[str, Any]) -> Any:
        if name in local:
            return local[name]
        if name in _NAMED:
            return _NAMED[name]
        if (parameter := self.parameter(name)) is not None:
            self.used[parameter] = None
            return self._text(self.parameters[parameter], local)
        if name not in self.variables or name in self._within:
            raise NotKnown(name)
        self._within.append(name)
        found = self._value(ast.parse(self.variables[name], mode="eval").body, {})
        self._within.pop()
        return found

    def _text(self, value: Any, local: Mapping[str, Any]) -> Any:
        if isinstance(value, dict) and set(value) == {"expr"}:
            return self._value(ast.parse(value["expr"], mode="eval").body, local)
        return value

    def _index(self, node: ast.expr, local: Mapping[str, Any]) -> Any:
        if not isinstance(node, ast.Slice):
            return self._value(node, local)
        ends = (node.lower, node.upper, node.step)
        return slice(*(None if end is None else self._value(end, local) for end in ends))

    def _listed(self, item: ast.expr, over: ast.comprehension, local: Mapping[str, Any]) -> Any:
        if not isinstance(over.target, ast.Name) or over.ifs:
            raise NotKnown("a comprehension")
        name, items = over.target.id, self._value(over.iter, local)[:MOST]
        return [self._value(item, {**local, name: one}) for one in items]


def _small(left: Any, right: Any) -> tuple[Any, Any]:
    """Both sides, unless repeating or formatting one would make a long text or list."""
    if isinstance(left, str) and re.search(r"%[^%a-z]*\d{4}", left):
        raise NotKnown("too long")
    for sequence, times in ((left, right), (right, left)):
        repeats = isinstance(sequence, str | list) and isinstance(times, int)
        if repeats and len(sequence) * times > MOST:
            raise NotKnown("too long")
    return left, right
