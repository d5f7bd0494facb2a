"""Reads what the `run` of a state yields and returns, and finds what can never be right.

Only what is wrong whatever happens in a run is a mistake here: a number that is yielded, an outcome
that is written out and not declared. A `run` that declares outcomes and returns none is a doubt: it
can run. Code that cannot be read, because it was made without a file, has no mistakes.
"""

from __future__ import annotations

import ast
import inspect
import textwrap
from collections.abc import Callable, Iterable, Iterator
from functools import cache
from typing import Any

from engine.files import did_you_mean
from engine.interfaces import Interface
from engine.state_class import WAITS

Mistake = tuple[str, int, str]
"""File, line, what is wrong and what would be right."""
Told = tuple[int, str]
"""The same, with the line in the function."""
_NESTED = (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda, ast.ClassDef)


def mistakes_in_code(state: Interface) -> list[Mistake]:
    """The mistakes in the `run` of a state class, by line; an inherited `run` is not looked at."""
    return _found(state, lambda body: sorted([*_yields(body, state), *_returns(body, state)]))


def doubts_in_code(state: Interface) -> list[Mistake]:
    """As `mistakes_in_code`, of what can run and is hardly meant."""
    return _found(state, lambda body: _never_returns(body, state))


def outcomes_at_once(state: Interface) -> frozenset[str]:
    """The outcomes, written out, with which `run` can return before it has yielded.

    A `yield from` may yield nothing. Code that cannot be read has none.
    """
    body = _body(state.make)
    return frozenset() if body is None else frozenset(_Beginning(state.outcomes).found(body.body))


class _Beginning:
    """Follows the statements of a function up to its first `yield`."""

    def __init__(self, outcomes: Iterable[str]) -> None:
        self._outcomes = frozenset(outcomes)
        self._found: set[str] = set()

    def found(self, body: list[ast.stmt]) -> set[str]:
        """The outcomes that these statements can return."""
        self._goes_on(body)
        return self._found

    def _goes_on(self, body: Iterable[ast.stmt]) -> bool:
        """Whether what follows these statements can be reached without a `yield`."""
        return all(map(self._passes, body))

    def _passes(self, statement: ast.stmt) -> bool:
        if isinstance(statement, ast.Return):
            self._note(statement.value)
            return False
        if isinstance(statement, ast.If):
            branches = [self._goes_on(statement.body), self._goes_on(statement.orelse)]
            return any(branches)
        if isinstance(statement, ast.While | ast.For):
            self._goes_on(statement.body)
            endless = isinstance(statement, ast.While) and _is_true(statement.test)
            return not endless or any(isinstance(node, ast.Break) for node in _inside(statement))
        if isinstance(statement, ast.With):
            return self._goes_on(statement.body)
        if isinstance(statement, ast.Try):
            tried = [self._goes_on(statement.body)]
            tried += [self._goes_on(handler.body) for handler in statement.handlers]
            return any(tried)
        return not any(isinstance(node, ast.Yield) for node in ast.walk(statement)) and not (
            isinstance(statement, ast.Raise | ast.Break | ast.Continue)
        )

    def _note(self, value: ast.expr | None) -> None:
        for found in _alternatives(value):
            is_pair = isinstance(found, ast.Tuple) and found.elts
            outcome = found.elts[0] if is_pair else found  # type: ignore[union-attr]
            if isinstance(outcome, ast.Constant) and outcome.value in self._outcomes:
                self._found.add(str(outcome.value))


def _is_true(test: ast.expr) -> bool:
    return isinstance(test, ast.Constant) and bool(test.value)


def _found(state: Interface, look: Callable[[ast.FunctionDef], Iterable[Told]]) -> list[Mistake]:
    body = _body(state.make)
    if body is None:
        return []
    function: Any = vars(state.make)["run"]
    file, (_, first) = inspect.getsourcefile(inspect.unwrap(function)), _lines(function)
    told = look(body)
    return [(str(file), first + line - 1, f"{state.name}.run {what}") for line, what in told]


def _lines(function: Any) -> tuple[list[str], int]:
    return inspect.getsourcelines(function)


@cache
def _body(cls: Any) -> ast.FunctionDef | None:
    """The `run` of a class itself, as a tree; None if it is inherited, or has no text."""
    try:
        lines, _ = _lines(vars(cls).get("run"))
        (body,) = ast.parse(textwrap.dedent("".join(lines))).body
    except (OSError, SyntaxError, TypeError, ValueError):
        return None
    return body if isinstance(body, ast.FunctionDef) else None


def _inside(node: ast.AST) -> Iterator[ast.AST]:
    """All nodes that belong to a function itself, not to functions in it."""
    for child in ast.iter_child_nodes(node):
        yield child
        if not isinstance(child, _NESTED):
            yield from _inside(child)


def _yields(body: ast.FunctionDef, state: Interface) -> Iterator[Told]:
    for node in _inside(body):
        if not isinstance(node, ast.Yield) or node.value is None:
            continue
        value = node.value
        first = value.elts[0] if isinstance(value, ast.Tuple) and value.elts else value
        written = ast.unparse(value)
        if isinstance(first, ast.Constant) and first.value in state.outcomes:
            yield node.lineno, f"yields {written}, and that goes on; `return {written}` ends it"
        elif _is_instant(value):
            right = f"`yield Until({written})`"
            yield node.lineno, f"yields {written}, a number of ns; to wait until then: {right}"
        elif _is_number(value):
            right = f"`yield Until(ctx.after({written}))`"
            yield node.lineno, f"yields {written}, which means nothing; to wait so many s: {right}"
        elif isinstance(value, ast.Tuple | ast.List | ast.Set | ast.Dict) or _is_odd(value):
            yield node.lineno, f"yields {written}, which means nothing; {WAITS}"


def _is_odd(value: ast.expr) -> bool:
    """Whether it is a constant that is neither text nor None."""
    return isinstance(value, ast.Constant) and not isinstance(value.value, str | None)


def _is_number(value: ast.expr) -> bool:
    if isinstance(value, ast.UnaryOp):
        return _is_number(value.operand)
    return isinstance(value, ast.Constant) and type(value.value) in (int, float)


def _is_instant(value: ast.expr) -> bool:
    """Whether it is `ctx.after(…)`, or `ctx.now` with or without something added."""
    if isinstance(value, ast.BinOp):
        return _is_instant(value.left)
    named = value.func if isinstance(value, ast.Call) else value
    return (
        isinstance(named, ast.Attribute)
        and isinstance(named.value, ast.Name)
        and (named.value.id, named.attr) in (("ctx", "after"), ("ctx", "now"))
    )


def _returns(body: ast.FunctionDef, state: Interface) -> Iterator[Told]:
    for node in _inside(body):
        if isinstance(node, ast.Return):
            for value in _alternatives(node.value):
                wrong = _wrong_return(value, state)
                if wrong is not None:
                    yield node.lineno, wrong


def _alternatives(value: ast.expr | None) -> Iterator[ast.expr | None]:
    """The values that `a if condition else b` may have, or the one value."""
    if isinstance(value, ast.IfExp):
        yield from _alternatives(value.body)
        yield from _alternatives(value.orelse)
    else:
        yield value


def _wrong_return(value: ast.expr | None, state: Interface) -> str | None:
    """What is wrong with a returned expression; None if that depends on the run."""
    outputs: set[str] | None = set()
    outcome = value
    if isinstance(value, ast.Tuple) and len(value.elts) == 2:
        outcome, outputs = value.elts[0], _keys(value.elts[1])
    elif isinstance(value, ast.Tuple | ast.List | ast.Dict | ast.Set):
        return f"returns {ast.unparse(value)}, which is no outcome; {_wanted(state)}"
    if outcome is None:
        return f"returns nothing here; {_wanted(state)}"
    if not isinstance(outcome, ast.Constant):
        return None
    name = outcome.value
    if not isinstance(name, str) or name not in state.outcomes:
        near = did_you_mean(name, state.outcomes) if state.outcomes else _wanted(state)
        return f"returns {name!r}, which is not among its outcomes; {near}"
    produced = set(state.outputs.get(name, ()))
    if outputs is None or outputs == produced:
        return None
    if not produced:
        return f"returns outputs with {name!r}, which has none; declare them in `outputs`"
    right = ", ".join(f"{key!r}: …" for key in state.outputs[name])
    return f"returns {name!r} without its outputs; `return {name!r}, {{{right}}}`"


def _keys(value: ast.expr) -> set[str] | None:
    """The keys of a dict that is written out; None if they are not known."""
    if not isinstance(value, ast.Dict):
        return None
    keys = [key.value for key in value.keys if isinstance(key, ast.Constant)]
    return {str(key) for key in keys} if len(keys) == len(value.keys) else None


def _wanted(state: Interface) -> str:
    if not state.outcomes:
        return "it declares none; give the class `outcomes = ('name',)`"
    return f"return one of its outcomes: {', '.join(state.outcomes)}"


def _never_returns(body: ast.FunctionDef, state: Interface) -> Iterator[Told]:
    """A state that declares outcomes has to return one somewhere, unless it only raises."""
    ends = any(isinstance(node, ast.Return) for node in _inside(body))
    if state.outcomes and not ends and not isinstance(body.body[-1], ast.Raise):
        right = f"{_wanted(state)}; or declare none, if only something else is to end it"
        yield body.lineno, f"never returns; {right}"
