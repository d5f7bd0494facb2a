"""Where in the code an exception was raised: in a line, or with all calls (`--traceback`)."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Iterator
from contextlib import AbstractContextManager

from engine.files import visible


def place_of(error: BaseException) -> str:
    """`file:line: Kind: text`, of the innermost call."""
    frames = traceback.extract_tb(error.__traceback__)
    where = f"{frames[-1].filename}:{frames[-1].lineno}: " if frames else ""
    return f"{where}{type(error).__name__}: {error}".removesuffix(": ")


def show_traceback(error: BaseException) -> None:
    """Print the calls that led to an exception and to those that it was made of."""
    for one in _chain(error):
        one.__suppress_context__ = False
    told = "".join(traceback.format_exception(error))
    print(visible(told, "\n\t"), end="", file=sys.stderr)


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__


def traced() -> AbstractContextManager[None]:
    """A context in which the tracebacks of what states and parts raise are printed, too."""
    from engine.run import seeing_exceptions

    return seeing_exceptions(show_traceback)
