"""Checks that a state class is declared as the engine needs it; nothing of it is run."""

from __future__ import annotations

import inspect
import reprlib
from collections.abc import Callable, Iterable, Mapping
from typing import Any, cast

HOOK = "def run(self, ctx: Context) -> Run"
WAITS = "yield None for the next tick, Until(t), On(signal, …), or text as a note"
RESERVED_OUTCOMES = ("error", "timeout", "stopped", "preempted")


class StateError(TypeError):
    """A state class that no chart could use; the message says what to fix."""


def require_declarations(cls: Any) -> None:
    """Check the class attributes and the method `run` of a state class.

    Raises:
        StateError: one is missing, or is of another type than `engine.state.State` says.
    """
    name = cls.__name__
    if not cls.__doc__:
        raise StateError(f"{name}: give it a docstring; it is shown in editors and lists")
    _require_outcomes(name, cls.outcomes)
    require_tuple_of_names(f"{name}.commands", cls.commands)
    require_tuple_of_names(f"{name}.optional", cls.optional)
    _require_mapping(f"{name}.inputs", cls.inputs, "{'place': Pose2}")
    _require_outputs(name, cls)
    _require_mapping(f"{name}.reads", cls.reads, "{'base.pose': 0.2}, with the greatest age in s")
    if unread := [signal for signal in cls.optional if signal not in cls.reads]:
        raise StateError(f"{name}.optional: {unread[0]!r} is not among its reads; add it there")
    _require_run(cls)
    if missing := sorted(getattr(cls, "__abstractmethods__", ())):
        raise StateError(f"{name} lacks {', '.join(missing)}: {_IF_BASE}")


_IF_BASE = "write it; or, for a base class of states, begin its name with _"


def require_tuple_of_names(what: str, value: object) -> None:
    """Check that a class attribute is a tuple of names.

    Raises:
        StateError: it is not; a single name without a comma is a frequent case.
    """
    if isinstance(value, tuple) and all(isinstance(name, str) for name in value):
        return
    names = [value] if isinstance(value, str) else value
    given = isinstance(names, list | set) and all(isinstance(name, str) for name in names)
    right = tuple(sorted(map(str, cast("Iterable[str]", names)))) if given else ("name",)
    raise StateError(f"{what}: a tuple of names, not {reprlib.repr(value)}; write {right!r}")


def _require_outcomes(name: str, outcomes: Any) -> None:
    require_tuple_of_names(f"{name}.outcomes", outcomes)
    for outcome in outcomes:
        if outcome in RESERVED_OUTCOMES or not outcome.removeprefix("$").isidentifier():
            raise StateError(f"{name}.outcomes: {outcome!r} is reserved or not a name")
        if outcomes.count(outcome) > 1:
            raise StateError(f"{name}.outcomes: {outcome!r} is there twice; keep one")


def _require_outputs(name: str, cls: Any) -> None:
    example = "{'found': {'place': Pose2}}"
    _require_mapping(f"{name}.outputs", cls.outputs, example)
    for outcome, named in cls.outputs.items():
        if outcome not in cls.outcomes:
            raise StateError(f"{name}.outputs: {outcome!r} is not among its outcomes")
        _require_mapping(f"{name}.outputs[{outcome!r}]", named, "{'place': Pose2}")


def _require_mapping(what: str, value: object, example: str) -> None:
    if not isinstance(value, Mapping):
        raise StateError(f"{what}: a dict by name, not {reprlib.repr(value)}; write {example}")
    for key in value:
        if not isinstance(key, str):
            raise StateError(f"{what}: {reprlib.repr(key)} is no name; write {example}")


def _require_run(cls: Any) -> None:
    name, held = cls.__name__, inspect.getattr_static(cls, "run", None)
    if getattr(held, "__qualname__", "") == "State.run":
        raise StateError(f"{name} lacks run: {_IF_BASE}")
    if isinstance(held, staticmethod | classmethod | property) or not callable(held):
        raise StateError(f"{name}.run is a {type(held).__name__}; write {HOOK}")
    if inspect.iscoroutinefunction(held) or inspect.isasyncgenfunction(held):
        raise StateError(f"{name}.run is async; write {HOOK}, and `yield` to wait")
    if not takes(held, None, None):
        given = ", ".join(inspect.signature(held).parameters)
        raise StateError(f"{name}.run({given}): write {HOOK}, and inputs after ctx")


def takes(function: Callable[..., Any], *arguments: object) -> bool:
    """Whether a function takes these arguments first; it may need further ones."""
    try:
        inspect.signature(function).bind_partial(*arguments)
    except TypeError:
        return False
    return True
