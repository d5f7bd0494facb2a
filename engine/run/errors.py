"""Exceptions that states and parts have raised, with their places in the source."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from types import GeneratorType
from typing import Any, NamedTuple, TypeVar

ENGINE = str(Path(__file__).parent.parent)


MOST = 10_000
T = TypeVar("T")


class Newest(list[T]):
    """The newest `MOST` of what was appended; `total` is the number of all."""

    total = 0

    def append(self, item: T) -> None:
        """Add one; the oldest goes if there are too many."""
        super().append(item)
        self.total += 1
        if len(self) > MOST:
            del self[0]

    def since(self, number: int) -> list[T]:
        """Those appended after the first `number`, as far as they are still there."""
        return self[max(0, len(self) - (self.total - number)) :]


class Raised(NamedTuple):
    """An exception: run time, ns; path of the node (for a part, the root); class, text, place."""

    time: int
    path: str
    kind: str
    text: str
    file: str
    line: int

    def __str__(self) -> str:
        where = f"{self.file}:{self.line}: " if self.file else ""
        return f"{where}{self.kind}: {self.text}" if self.text else f"{where}{self.kind}"


def raised(
    time: int,
    path: str,
    error: BaseException,
    cls: type | None = None,
    waits: Generator[Any, Any, Any] | None = None,
) -> Raised:
    """`error` as a record; `cls` is the class of the state or part that raised it, if one did.

    The place is that of the innermost frame in the folder of the class's own file, because that is
    where its author will look; without such a frame the line where its generator `waits`, the
    innermost frame outside the engine, else the class.
    """
    if (see := _seen_by.get()) is not None:
        see(error)
    file, line = _place(error, cls, waits)
    return Raised(time, path, type(error).__name__, text_of(error), file, line)


@contextmanager
def seeing_exceptions(see: Callable[[BaseException], None]) -> Iterator[None]:
    """A context in which `see` gets each exception of states and parts before it is a record."""
    before = _seen_by.set(see)
    try:
        yield
    finally:
        _seen_by.reset(before)


_seen_by: ContextVar[Callable[[BaseException], None] | None] = ContextVar("_seen_by", default=None)


def text_of(error: BaseException) -> str:
    """The text of an exception; empty if asking for it raises, too."""
    try:
        return escaped(str.__str__(str(error)))
    except BaseException:  # noqa: BLE001  whatever its class is, telling of it must not raise
        return ""


def escaped(text: str) -> str:
    """Text that can be written to any file: lone surrogates become escapes, as in JSON."""
    return text if text.isascii() else text.encode(errors="backslashreplace").decode()


def _place(
    error: BaseException, cls: type | None, waits: Generator[Any, Any, Any] | None
) -> tuple[str, int]:
    file = None if cls is None else _file_of(cls)
    home = None if file is None else str(Path(file).parent)
    own, outside = _innermost(error, home)
    cause = error.__cause__
    if not own and cause is not None:  # Python turns a StopIteration into another error
        own, beyond = _innermost(cause, home)
        outside = beyond or outside
    if found := own or _line_of_yield(waits) or outside:
        return found
    if cls is None or file is None:
        return "", 0
    return file, _line_of(cls)


def _innermost(
    error: BaseException, home: str | None
) -> tuple[tuple[str, int] | None, tuple[str, int] | None]:
    """File and line of the innermost frame in the folder `home`, and of that outside the engine."""
    own = outside = None
    for frame, line in traceback.walk_tb(error.__traceback__):
        file = frame.f_code.co_filename
        if not file.startswith(ENGINE):
            outside = file, line
            if home is not None and file.startswith(home):
                own = outside
    return own, outside


def _line_of_yield(generator: Any) -> tuple[str, int] | None:
    """File and line of the `yield` at which a generator, or the innermost it steps, waits."""
    while isinstance(getattr(generator, "gi_yieldfrom", None), GeneratorType):
        generator = generator.gi_yieldfrom
    frame = getattr(generator, "gi_frame", None)
    return None if frame is None else (frame.f_code.co_filename, frame.f_lineno)


def _file_of(cls: type) -> str | None:
    try:
        return inspect.getsourcefile(cls)
    except TypeError:  # a class made without a file
        return None


def _line_of(cls: type) -> int:
    try:
        return inspect.getsourcelines(cls)[1]
    except (OSError, SyntaxError, TypeError):  # the file has changed meanwhile, or there is none
        return 0
