"""Files known by name: those in a shipped folder and, with precedence, a project's own."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

YAML = (".yaml", ".yml")
"""The endings of YAML files; either is as good as the other."""
OwnFiles = Callable[[str], Mapping[str, Path]]
"""The files of one kind (`scene`, `robot`, `profile`, …) that a project brings, by name."""


def no_files(_kind: str) -> Mapping[str, Path]:
    """The `OwnFiles` of no project: none."""
    return {}


_own: ContextVar[OwnFiles] = ContextVar("own", default=no_files)


@contextmanager
def with_own_files(own: OwnFiles) -> Iterator[None]:
    """Within the block, names also refer to these files, before shipped ones of the same name."""
    token = _own.set(own)
    try:
        yield
    finally:
        _own.reset(token)


def own_files(kind: str) -> Mapping[str, Path]:
    """The project's own files of a kind, by name."""
    return _own.get()(kind)


def known_files(folder: Path, kind: str) -> dict[str, Path]:
    """All files of a kind by name, sorted: those in the shipped folder, and a project's own."""
    shipped = {path.stem: path for path in folder.glob("*.yaml")}
    found = {**shipped, **own_files(kind)}
    return {name: found[name] for name in sorted(found)}
