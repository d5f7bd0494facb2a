"""Exceptions that states and parts have raised, with their places in the source."""

from __future__ import annotations

import inspect
import traceback
from pathlib import Path
from typing import NamedTuple

ENGINE = str(Path(__file__).parent)


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


def raised(time: int, path: str, error: BaseException, cls: type | None = None) -> Raised:
    """`error` as a record; `cls` is the class of the state that raised it, if one did.

    The place is that of the innermost frame in the folder of the state's own file, because that is
    where its author will look; without such a frame, the innermost one outside the engine, else
    the class.
    """
    file, line = _place(error, cls)
    return Raised(time, path, type(error).__name__, text_of(error), file, line)


def text_of(error: BaseException) -> str:
    """The text of an exception; empty if asking for it raises, too."""
    try:
        return str(error)
    except Exception:  # noqa: BLE001
        return ""


def _place(error: BaseException, cls: type | None) -> tuple[str, int]:
    frames = traceback.extract_tb(error.__traceback__)
    outside = [frame for frame in frames if not frame.filename.startswith(ENGINE)]
    file = None if cls is None else _file_of(cls)
    home = None if file is None else str(Path(file).parent)
    own = [frame for frame in outside if home is not None and frame.filename.startswith(home)]
    if not own and error.__cause__ is not None:  # Python turns a StopIteration into another error
        return _place(error.__cause__, cls)
    for found in (own, outside):
        if found:
            return found[-1].filename, found[-1].lineno or 0
    if cls is None or file is None:
        return "", 0
    return file, _line_of(cls)


def _file_of(cls: type) -> str | None:
    try:
        return inspect.getsourcefile(cls)
    except TypeError:  # a class made without a file
        return None


def _line_of(cls: type) -> int:
    try:
        return inspect.getsourcelines(cls)[1]
    except OSError:
        return 0
