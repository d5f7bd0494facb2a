"""What the modules of projects provide, checked: state classes, `SIGNALS`, `TYPES` and `PARTS`.

Modules are imported for it; nothing else of them is run. What only a run can show is reported when
it happens: by `cobodeck.project.part_check`, `cobodeck.loop.sample_router`, and rule 8 of the
engine.
"""

from __future__ import annotations

import ast
import inspect
import reprlib
import types
from collections.abc import Callable, Iterator
from functools import cache
from types import ModuleType
from typing import Any, get_origin

from cobodeck.project.part_check import binds, place_of
from engine import (
    Action,
    Monitor,
    State,
    StateError,
    Type,
    builtin_types,
    doubts_in_code,
    from_annotation,
    interface,
    mistakes_in_code,
)
from engine.signals import Derived, Measured, Signal

A_SIGNAL = "Measured('lamp.lit', bool)"


def state_classes(module: ModuleType) -> Iterator[type[State]]:
    """The state classes defined in a module."""
    for value in vars(module).values():
        if not isinstance(value, type) or value.__module__ != module.__name__:
            continue
        if issubclass(value, Action | Monitor) and not value.__name__.startswith("_"):
            yield value


def mistakes_in(module: ModuleType) -> Iterator[str]:
    """The mistakes in what a module provides, each with its place and what would be right."""
    if not is_adapted(module):
        yield from _defined_twice(module)
    for cls in state_classes(module):
        wrong = wrong_class(cls)
        if wrong is not None:
            yield wrong
        else:
            found = mistakes_in_code(interface(cls))  # type: ignore[arg-type]  # classes can be hashed
            yield from (f"{file}:{line}: {what}" for file, line, what in found)
    yield from _in_signals(module)
    yield from _in_table(module, "TYPES", "{'place': Pose2}", _wrong_type)
    yield from _in_table(module, "PARTS", "{'lamp': Lamp}", _wrong_maker)


def doubts_in(module: ModuleType) -> Iterator[str]:
    """What can run in a module without mistakes and is hardly meant, each with its place."""
    yield from getattr(module, "DOUBTS", ())
    if is_adapted(module):
        yield from _defined_twice(module)
    for cls in state_classes(module):
        found = doubts_in_code(interface(cls))  # type: ignore[arg-type]  # classes can be hashed
        yield from (f"{file}:{line}: {what}" for file, line, what in found)


def is_adapted(module: ModuleType) -> bool:
    """Whether its states were written for FlexBE; what is wrong with one stops no other."""
    return hasattr(module, "STRANGERS")


def wrong_class(cls: type[State]) -> str | None:
    """Why a state class cannot be used, with its place; None if it can."""
    try:
        interface(cls)  # type: ignore[arg-type]  # classes can be hashed
    except StateError as error:
        return f"{place_of(cls)}{error}"
    except Exception as error:  # noqa: BLE001  annotations may raise anything
        return f"{place_of(cls)}{cls.__name__}: {type(error).__name__}: {error}"
    return None


def strangers(module: ModuleType) -> dict[str, str]:
    """What a module has under names that a chart may take for those of states, and why not."""
    found = {}
    for name, value in vars(module).items():
        if inspect.isfunction(value) and value.__module__ == module.__name__:
            found[name] = (
                f"{place_of(value)}a function; write a class derived from Action or Monitor"
            )
        elif isinstance(value, type) and not name.startswith("_"):
            if not issubclass(value, Action | Monitor):
                found[name] = f"{place_of(value)}derive it from Action or Monitor"
            elif value.__module__ != module.__name__:
                found[name] = (
                    f"it is in {value.__module__}; name that module in pyproject.toml, too"
                )
    return found | getattr(module, "STRANGERS", {})


def line_of(module: ModuleType, table: str, name: str = "") -> str:
    """`file:line: ` of a table such as `SIGNALS` in a module, or of a text in it."""
    for node in _tree(module).body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        if any(isinstance(target, ast.Name) and target.id == table for target in targets):
            texts = (inner for inner in ast.walk(node) if isinstance(inner, ast.Constant))
            line = next((text.lineno for text in texts if text.value == name), node.lineno)
            return f"{module.__file__}:{line}: "
    return f"{module.__file__}: "


@cache
def _tree(module: ModuleType) -> ast.Module:
    try:
        return ast.parse(inspect.getsource(module))
    except (OSError, SyntaxError, TypeError):
        return ast.Module([], [])


def _defined_twice(module: ModuleType) -> Iterator[str]:
    known: dict[str, int] = {}
    for node in _tree(module).body:
        if isinstance(node, ast.ClassDef):
            if node.name in known:
                lost = f"the class of line {known[node.name]} is lost; name one of them otherwise"
                yield f"{module.__file__}:{node.lineno}: {node.name} is defined again; {lost}"
            known[node.name] = node.lineno


def _in_signals(module: ModuleType) -> Iterator[str]:
    given = getattr(module, "SIGNALS", ())
    if not isinstance(given, tuple | list):
        comma = "; a comma is missing" if isinstance(given, Signal) else ""
        right = f"a tuple of signals, not {reprlib.repr(given)}{comma}; ({A_SIGNAL},)"
        yield f"{line_of(module, 'SIGNALS')}SIGNALS: {right}"
        return
    for signal in given:
        at = line_of(module, "SIGNALS", str(getattr(signal, "name", signal)))
        if not isinstance(signal, Signal):
            yield f"{at}SIGNALS: {reprlib.repr(signal)} is no signal; write {A_SIGNAL}"
        else:
            yield from (f"{at}signal {signal.name!r}: {wrong}" for wrong in _wrong_signal(signal))


def _wrong_signal(signal: Signal) -> Iterator[str]:
    if not isinstance(signal.name, str) or not signal.name:
        yield "its name is a text, like 'lamp.lit'"
    if not _is_type(signal.type):
        yield f"its type is {reprlib.repr(signal.type)}; give a class, like bool"
    if isinstance(signal, Measured):
        return
    if not isinstance(signal.of, tuple) or not all(isinstance(name, str) for name in signal.of):
        yield f"`of` is a tuple of names, not {reprlib.repr(signal.of)}; ('lamp.lit',)"
    elif isinstance(signal, Derived):
        yield from _wrong_call("function", signal.function, signal.of)
    else:
        yield from _wrong_call("make", signal.make, ())
        lacking = [m for m in ("update", "value") if not hasattr(signal.make, m)]
        if isinstance(signal.make, type) and lacking:
            yield f"{signal.make.__name__} has no {lacking[0]}; see engine.signals.Estimator"


def _wrong_call(what: str, function: Any, arguments: tuple[str, ...]) -> Iterator[str]:
    if not callable(function):
        yield f"{what} is {reprlib.repr(function)}, and is called; give a function or class"
    elif not binds(function, *arguments):
        taken = f"takes {', '.join(arguments)}" if arguments else "takes nothing"
        yield f"{what} is called with {len(arguments)} values; write one that {taken}"


def _is_type(kind: Any) -> bool:
    return (
        kind in (Any, None)
        or isinstance(kind, type | types.UnionType)
        or get_origin(kind) is not None
    )


def _in_table(
    module: ModuleType, table: str, example: str, wrong: Callable[[str, Any], str | None]
) -> Iterator[str]:
    given = getattr(module, table, {})
    if not isinstance(given, dict):
        right = f"a dict by name, not {reprlib.repr(given)}; {example}"
        yield f"{line_of(module, table)}{table}: {right}"
        return
    for name, value in given.items():
        why = wrong(name, value) if isinstance(name, str) else "is no name; write a text"
        if why is not None:
            yield f"{line_of(module, table, name)}{table}: {name!r} {why}"


def _wrong_type(name: str, kind: Any) -> str | None:
    if name in builtin_types():
        return "is a type of all charts; name yours otherwise"
    try:
        kind if isinstance(kind, Type) else from_annotation(kind)
    except TypeError as error:
        return f"is no type: {error}"
    return None


def _wrong_maker(_name: str, make: Any) -> str | None:
    if not callable(make):
        return f"is {reprlib.repr(make)}; name the class, not a part that is made already"
    if inspect.isabstract(make):
        return f"is abstract; {make.__name__} lacks {', '.join(sorted(make.__abstractmethods__))}"
    if not binds(make):
        return f"is made by {make.__name__}(), without arguments, and it needs some"
    return None
