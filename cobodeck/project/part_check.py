"""Makes a project's simulated parts, and checks that a part has what `hw.interfaces` asks of it."""

from __future__ import annotations

import inspect
import reprlib
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any

from cobodeck.terminal import FAILED, Problem
from engine.files import did_you_mean
from engine.run import raised
from hw import PARTS, missing

OURS = Path(__file__).parent.parent.parent
SAMPLES = "def samples(self, now_ns: int) -> list[Sample]"
ADVANCE = "def advance(self, to_ns: int) -> None"
HOOKS = {
    "samples": SAMPLES,
    "stop": "def stop(self) -> None",
    "hear": "def hear(self, sample: Sample, now_ns: int) -> None",
    "advance": ADVANCE,
    "show": "def show(self, stamp_ns: int) -> None",
    "acknowledge": "def acknowledge(self) -> bool",
    "close": "def close(self) -> None",
}
"""The methods that are called of any part that has them, and how they are written."""


def made(name: str, make: Callable[[], Any], declared: Collection[str]) -> Any:
    """A project's simulated part, made and checked; `declared`: the names of all signals.

    Raises:
        Problem: it cannot be made, or lacks something; the text begins with its place.
    """
    try:
        part = make()
    except Exception as error:  # noqa: BLE001  a part may raise anything
        why = error_text(error, make)
        raise Problem(f"{why} (while making part {name!r}, a simulated one)", FAILED) from None
    wrong = next(_wrong(name, part), None) or _undeclared(part, declared)
    if wrong is None and name == "base" and not hasattr(part, "advance"):
        wrong = f"{type(part).__name__} has no method advance, which moves it; write `{ADVANCE}`"
    if wrong is not None:
        raise Problem(f"{place_of(type(part))}part {name!r}: {wrong}", FAILED)
    return part


def wrong_parts(parts: Mapping[str, Callable[[], Any]], declared: Collection[str]) -> Iterator[str]:
    """Why some of a project's simulated parts cannot be used; each is made once, as in a run."""
    for name, make in parts.items():
        try:
            made(name, make, declared)
        except Problem as problem:
            yield str(problem)


def why_no_part(name: str, part: Any) -> str | None:
    """What an opened part lacks, and what would be right; None if it is one."""
    return next(_wrong(name, part), None)


def place_of(thing: Any) -> str:
    """`file:line: ` of a class or function; empty where it is not known."""
    try:
        return f"{inspect.getsourcefile(thing)}:{inspect.getsourcelines(thing)[1]}: "
    except (OSError, SyntaxError, TypeError):
        return ""


def error_text(error: BaseException, cls: Any = None) -> str:
    """An exception of somebody's code, with its place there; without one if it is in our own."""
    if (needed := missing(error)) is not None:
        return needed
    found = raised(0, "", error, cls if isinstance(cls, type) else None)
    if _is_ours(found.file):
        found = found._replace(file="", line=0)
        return str(found) if cls is None or _is_ours(cls) else f"{place_of(cls)}{found}"
    return str(found)


def _is_ours(code: Any) -> bool:
    """Whether a file, a class or a function is our own."""
    try:
        file = code if isinstance(code, str) else inspect.getsourcefile(code)
    except TypeError:
        return True
    return not file or Path(file).is_relative_to(OURS)


def binds(function: Callable[..., Any], *arguments: object) -> bool:
    """Whether a function can be called so; True if it does not tell."""
    try:
        inspect.signature(function).bind(*arguments)
    except TypeError:
        return False
    except ValueError:  # one written in C
        return True
    return True


def _wrong(name: str, part: Any) -> Iterator[str]:
    kind = type(part).__name__
    try:
        yield from _wrong_names(kind, "signals", part)
        if hasattr(part, "hears"):
            yield from _wrong_names(kind, "hears", part)
        yield from _wrong_methods(name, kind, part)
    except Exception as error:  # noqa: BLE001  a property may raise anything
        yield f"asked what it gives, {kind} raised {error_text(error, type(part))}"


def _wrong_names(kind: str, attribute: str, part: Any) -> Iterator[str]:
    right = f"`{attribute} = ('lamp.lit',)`, the names of the signals that it {_VERBS[attribute]}"
    if inspect.getattr_static(part, attribute, None) is None and not hasattr(part, attribute):
        yield f"{kind} has no {attribute}; give the class {right}"
        return
    given = getattr(part, attribute)
    if not isinstance(given, tuple) or not all(isinstance(name, str) for name in given):
        yield f"{kind}.{attribute} is {reprlib.repr(given)}; write {right}"


_VERBS = {"signals": "gives", "hears": "takes by `hear`"}


def _wrong_methods(name: str, kind: str, part: Any) -> Iterator[str]:
    required = ["samples", *(["hear"] if hasattr(part, "hears") else [])]
    for hook, right in HOOKS.items():
        found = getattr(part, hook, None)
        if found is None:
            if hook in required:
                yield f"{kind} has no method {hook}; write `{right}`"
        elif not callable(found):
            yield f"{kind}.{hook} is {reprlib.repr(found)}; write `{right}`"
        elif not binds(found, *range(right.count(":"))):
            given = ", ".join(inspect.signature(found).parameters)
            yield f"{kind}.{hook}({given}) does not take what it is given; write `{right}`"
    for attribute, asked in vars(PARTS.get(name, object)).items():
        if attribute.startswith("_") or hasattr(part, attribute):
            continue
        if inspect.isfunction(asked):
            right = f"`def {attribute}{inspect.signature(asked)}`".replace("'", "")
            yield f"{kind} has no method {attribute}, which every part {name!r} has: {right}"
        elif isinstance(asked, property):
            yield f"{kind} has no {attribute}, which every part {name!r} has: {asked.__doc__}"


def _undeclared(part: Any, declared: Collection[str]) -> str | None:
    """A signal that a part gives and nothing declares."""
    for name in part.signals:
        if name not in declared:
            near = did_you_mean(name, declared)
            return f"gives {name!r}, which no SIGNALS declares; {near}"
    return None
