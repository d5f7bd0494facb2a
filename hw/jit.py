"""How functions are compiled, and the one register of what must be compiled before the first tick.

Numba compiles a function when it is called with arguments of new types, and keeps that on disk:

    @compiled
    def length(points: Array) -> float: ...

    @example
    def _example() -> None:
        length(np.ones((1, 2)))

A module registers examples of all calls that a tick may make; `compile_examples` makes those of
some modules. An example may have parameters, such as an arm that only the caller knows.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from functools import cache
from types import ModuleType
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function")
Example = TypeVar("Example", bound=Callable[..., None])
_OPTIONS: Any = {"cache": True, "no_cfunc_wrapper": True}
"""Nobody calls the wrapper for callers written in C: a tenth of the time that compiling takes."""
_EXAMPLES: list[Callable[..., None]] = []


def compiled(function: Function) -> Function:
    """The decorator."""
    found: Function = njit(**_OPTIONS)(function)
    return found


def compiled_like_numpy(function: Function) -> Function:
    """The same, but a division by zero gives infinity or NaN."""
    found: Function = njit(**_OPTIONS, error_model="numpy")(function)
    return found


def example(call: Example) -> Example:
    """Register a call, or several, that a tick may make; one without parameters is made once."""
    _EXAMPLES.append(call if inspect.signature(call).parameters else cache(call))
    return call


def compile_examples(modules: Iterable[ModuleType], **given: Any) -> None:
    """Compile, or load from disk, what the examples of these modules call.

    Args:
        modules: a package stands for all its modules that are loaded.
        given: values for the parameters of examples, by name.
    """
    names = [module.__name__ for module in modules]
    for call in _EXAMPLES:
        if any(f"{call.__module__}.".startswith(f"{name}.") for name in names):
            call(**{name: given[name] for name in inspect.signature(call).parameters})
