"""Progress while numba compiles, which takes minutes at the first start only."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from cobodeck.terminal import ProgressLine

WHAT = "compiling, at the first start only"
A_MINUTE = 80
"""About so many functions are compiled in a minute, by one processor."""


@contextmanager
def compiling(functions: int, line: ProgressLine | None = None) -> Iterator[None]:
    """Show which function is being compiled within the block; loading from the cache shows nothing.

    Where there is no terminal it is told by a few lines on standard error, but not to tests.

    Args:
        functions: approximate number compiled inside the block if nothing is cached.
        line: where to show it; by default a line on standard error.
    """
    from numba.core import event

    about = f"about {max(1, round(functions / A_MINUTE))} min for {functions} functions"
    plainly = "" if "PYTEST_CURRENT_TEST" in os.environ else about
    shown = line or ProgressLine(WHAT, every_s=0.0, plainly=plainly)

    class Counter(event.Listener):
        done = 0

        def on_start(self, _event: Any) -> None:
            share = min(self.done / functions, 0.99)  # callees count too, a few more or less
            shown.at(f"function {self.done + 1} of about {functions}", share)

        def on_end(self, _event: Any) -> None:
            self.done += 1

    with event.install_listener("numba:compile", Counter()):
        try:
            yield
        finally:
            shown.done()
