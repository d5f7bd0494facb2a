"""How functions are compiled: by numba, kept on disk, without the wrapper for callers written in C.

That wrapper, which nobody calls, is a tenth of the time that compiling takes.
"""

from __future__ import annotations

from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function")
_OPTIONS: Any = {"cache": True, "no_cfunc_wrapper": True}


def compiled(function: Function) -> Function:
    """The decorator."""
    found: Function = njit(**_OPTIONS)(function)
    return found


def compiled_like_numpy(function: Function) -> Function:
    """The same, but a division by zero gives infinity or NaN."""
    found: Function = njit(**_OPTIONS, error_model="numpy")(function)
    return found
