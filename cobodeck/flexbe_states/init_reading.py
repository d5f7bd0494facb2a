"""What the `__init__` of a FlexBE state says, as expressions: names, lists, and its parameters.

A name is text, or `$parameter` where it is what that parameter gives.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

Names = tuple[str, ...]
Link = Literal["hears", "publishes", "calls", "acts"]
KINDS = ("outcomes", "input_keys", "output_keys")
_UNKNOWN = object()
_MAKERS: Mapping[str, Link] = {
    "ProxySubscriberCached": "hears",
    "ProxyPublisher": "publishes",
    "ProxyServiceCaller": "calls",
    "ProxyActionClient": "acts",
    "Subscriber": "hears",
    "Publisher": "publishes",
    "ServiceProxy": "calls",
    "SimpleActionClient": "acts",
}
_METHODS: Mapping[str, Link] = {
    "subscribe": "hears",
    "has_msg": "hears",
    "createPublisher": "publishes",
    "create_publisher": "publishes",
    "publish": "publishes",
    "setupService": "calls",
    "call": "calls",
    "call_async": "calls",
    "setupClient": "acts",
    "send_goal": "acts",
}


class TopicUse(NamedTuple):
    """A topic, service or action that a state uses; None: its name is computed."""

    link: Link
    topic: str | None


@dataclass(frozen=True, slots=True)
class Given:
    """The value of a parameter of `__init__`."""

    parameter: str


class Scope:
    """What is written out for names in a class: constants, attributes of `self`, parameters."""

    def __init__(
        self, module: Mapping[str, Any], node: ast.ClassDef, init: ast.FunctionDef | None
    ) -> None:
        self._known = {**module, **constants(node.body)}
        if init is not None:
            arguments = [*init.args.posonlyargs, *init.args.args][1:] + init.args.kwonlyargs
            self._known |= {argument.arg: Given(argument.arg) for argument in arguments}
            self._known |= constants(init.body, self._known)

    def value(self, node: ast.expr) -> Any:
        """A text, a list, a `Given`, or `_UNKNOWN`."""
        return _value(node, self._known)

    def names(self, node: ast.expr) -> Names | None:
        """The names that an expression stands for; None if that is not known."""
        return as_names(self.value(node))


def as_names(value: Any) -> Names | None:
    """A list of names, some of which parameters may give; None if it is anything else."""
    if isinstance(value, Given):
        return (f"${value.parameter}",)
    if not isinstance(value, list | tuple):
        return None
    found = [f"${item.parameter}" if isinstance(item, Given) else item for item in value]
    return tuple(found) if all(isinstance(name, str) for name in found) else None


def base_call(init: ast.FunctionDef) -> ast.Call | None:
    """The call of a base class's `__init__`: by `super()`, `super(Cls, self)` or its name."""
    for node in ast.walk(init):
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "__init__":
            return node
    return None


def arguments_of(call: ast.Call, names: Names, scope: Scope) -> dict[str, Any] | None:
    """What a call gives for these parameters, by name; None if that cannot be seen (`**`)."""
    first = call.args[:1]
    has_self = bool(first) and isinstance(first[0], ast.Name) and first[0].id == "self"
    positional = call.args[1:] if has_self else call.args
    if any(isinstance(argument, ast.Starred) for argument in positional):
        return None
    given = dict(zip(names, positional, strict=False))
    for keyword in call.keywords:
        if keyword.arg is None:
            return None
        given[keyword.arg] = keyword.value
    return {name: scope.value(value) for name, value in given.items()}


def put_in(
    names: Names | None, given: Mapping[str, Any], defaults: Mapping[str, Any]
) -> Names | None:
    """Names with what a derived class gives for the parameters among them."""
    found: list[str] = []
    for name in names or ():
        if name[:1] != "$":
            found.append(name)
            continue
        value = given.get(name[1:], defaults.get(name[1:], _UNKNOWN))
        inner = (value,) if isinstance(value, str) else as_names(value)
        if inner is None:
            return None
        found += inner
    return None if names is None else tuple(found)


def topic_uses(node: ast.ClassDef, scope: Scope) -> Iterator[TopicUse]:
    """The topics, services and actions that calls in a class name."""
    for call in ast.walk(node):
        if not isinstance(call, ast.Call) or not call.args:
            continue
        name, first = last_name(call.func), call.args[0]
        if (link := _MAKERS.get(name)) is not None:
            keys = first.keys if isinstance(first, ast.Dict) else [first]
            yield from (TopicUse(link, _topic(key, scope)) for key in keys if key is not None)
        elif (link := _METHODS.get(name)) is not None and (topic := _topic(first, scope)):
            yield TopicUse(link, topic)


def _topic(node: ast.expr, scope: Scope) -> str | None:
    value = scope.value(node)
    if isinstance(value, Given):
        return f"${value.parameter}"
    return value if isinstance(value, str) else None


def _value(node: ast.expr, known: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Name | ast.Attribute):
        return known.get(last_name(node), _UNKNOWN)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return _sum(_value(node.left, known), _value(node.right, known))
    if isinstance(node, ast.List | ast.Tuple):
        return [_value(item, known) for item in node.elts]
    if isinstance(node, ast.Call) and last_name(node.func) in ("list", "tuple", "str"):
        return _value(node.args[0], known) if len(node.args) == 1 else _UNKNOWN
    return node.value if isinstance(node, ast.Constant) else _UNKNOWN


def _sum(left: Any, right: Any) -> Any:
    if isinstance(left, str) and isinstance(right, str):
        return left + right
    sides = [[side] if isinstance(side, Given) else side for side in (left, right)]
    if all(isinstance(side, list) for side in sides):
        return sides[0] + sides[1]
    return _UNKNOWN


def constants(body: Iterable[ast.stmt], around: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """What is written out for names that are set once among these statements, also `self.x`."""
    found: dict[str, Any] = {}
    for statement in body:
        if isinstance(statement, ast.Assign):
            for target in statement.targets:
                name = last_name(target)
                value = _value(statement.value, {**(around or {}), **found})
                found[name] = _UNKNOWN if name in found else value
        elif isinstance(statement, ast.AugAssign | ast.For | ast.If | ast.While | ast.Try):
            for node in ast.walk(statement):
                if isinstance(node, ast.Name | ast.Attribute) and isinstance(node.ctx, ast.Store):
                    found[last_name(node)] = _UNKNOWN
    return {name: value for name, value in found.items() if name}


def last_name(node: ast.expr) -> str:
    """The last name of `a.b.c`; empty for any other expression."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""
