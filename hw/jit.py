"""How functions are compiled, and the one register of what must be compiled before the first tick.

Numba compiles a function when it is called with arguments of new types, and keeps that on disk:

    @compiled
    def length(points: Array) -> float: ...

    @example
    def _example() -> None:
        length(np.ones((1, 2)))

A module registers examples of all calls that a tick may make; `compile_examples` makes those of
some modules. An example may have parameters, such as an arm that only the caller knows.

Compiled or not, a function gives the same bits. Numba's `math.hypot` is that of the C library,
which rounds otherwise than CPython's in 0.6 % of cases and differs between machines; so the
algorithm of CPython (3.11 to 3.13) is compiled in its place.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Iterable
from functools import cache
from types import ModuleType
from typing import Any, TypeVar

import numpy as np
from numba import njit, types
from numba.core.imputils import lower_builtin
from numba.np import linalg

Function = TypeVar("Function")
Example = TypeVar("Example", bound=Callable[..., None])
_OPTIONS: Any = {"cache": True, "no_cfunc_wrapper": True}
"""Nobody calls the wrapper for callers written in C: a tenth of the time that compiling takes."""
_EXAMPLES: list[Callable[..., None]] = []
Struct = Any
"""One element of an array of `record_type`: its fields are attributes, compiled or not."""
Structs = np.ndarray[Any, Any]
"""An array of `record_type`, (n,): state that compiled functions read and change in place."""


def record_type(*fields: tuple[Any, ...]) -> np.dtype[Any]:
    """The type of records with these fields, each given as a name, a type and maybe a shape."""
    return np.dtype((np.record, list(fields)))


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


@compiled
def wrapped(angle: float) -> float:
    """`hw.geometry.wrap` for compiled functions: numba lacks `math.fmod`, numpy's is the same."""
    if -math.pi < angle <= math.pi:
        return angle
    found: float = np.fmod(angle, 2.0 * math.pi)
    if found > math.pi:
        return found - 2.0 * math.pi
    return found + 2.0 * math.pi if found <= -math.pi else found


_SPLIT = 134217729.0
"""2^27 + 1: times it, a float64 is split into two halves of 26 bits (Veltkamp)."""
_SMALLEST, _GREAT = 2.0**-1022, 2.0**1022
"""The smallest normal float64, and the inverse of it."""


def hypot(x: float, y: float) -> float:
    """The length of (x, y) as `math.hypot` of CPython computes it, to the last bit.

    Scaled by a power of two so that the greater one is in [0.5, 1), both are squared in halves, and
    the sum is kept with what rounding took from it. The root of that is corrected once by the
    difference of its square, which is computed alike (one step of Newton's method).
    """
    if math.isinf(x) or math.isinf(y):
        return math.inf
    if math.isnan(x) or math.isnan(y):
        return math.nan
    x, y = abs(x), abs(y)
    greatest = max(x, y)
    if greatest == 0.0:
        return 0.0
    unit = 1.0
    if not _SMALLEST <= greatest < _GREAT:  # the scale would not be a normal number
        unit = _SMALLEST if greatest < _GREAT else _GREAT
        x, y, greatest = x / unit, y / unit, greatest / unit
    bits = np.float64(greatest).view(np.int64) >> 52  # 2 ** (bits - 1022) is above it
    scale = float(np.int64((2045 - bits) << 52).view(np.float64))
    inverse = float(np.int64((bits + 1) << 52).view(np.float64))
    total, lost_high, lost_middle, low_squares = 1.0, 0.0, 0.0, 0.0
    for value in (x * scale, y * scale):
        high = value * _SPLIT - (value * _SPLIT - value)
        low = value - high
        before, total = total, total + high * high
        lost_high += (before - total) + high * high
        before, total = total, total + 2.0 * high * low
        lost_middle += (before - total) + 2.0 * high * low
        low_squares += low * low
    root = math.sqrt(total - 1.0 + (lost_high + lost_middle + low_squares))
    high = root * _SPLIT - (root * _SPLIT - root)
    low = root - high
    before, total = total, total - high * high
    lost_high += (before - total) - high * high
    before, total = total, total - 2.0 * high * low
    lost_middle += (before - total) - 2.0 * high * low
    before, total = total, total - low * low
    low_squares += (before - total) - low * low
    rest = total - 1.0 + (lost_high + lost_middle + low_squares)
    return unit * ((root + rest / (2.0 * root)) * inverse)


def _lower_hypot(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    return context.compile_internal(builder, hypot, signature, arguments)


_found: Any = linalg
_found.ensure_blas = lambda: None
"""Numba would import scipy.linalg, a tenth of a start, only to see that it is there."""
_instead: Any = lower_builtin
_instead(math.hypot, types.float64, types.float64)(_lower_hypot)
