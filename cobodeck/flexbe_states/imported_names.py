"""What a module imports, read from its text; nothing is run."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import lru_cache
from importlib.util import resolve_name
from pathlib import Path

from cobodeck.flexbe_states.old_syntax import python_tree
from engine.files import FileError, read_text

LARGEST = 10_000_000  # bytes of a module


def imported_names(file: str, package: str) -> tuple[str, ...]:
    """The dotted names, of modules or in them, that a file of a package imports anywhere.

    A file that is no Python imports `flexbe_core` if its text says so, and nothing else.
    """
    try:
        state = Path(file).stat()
    except OSError:
        return ()
    return _names(file, package, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=1000)
def _names(file: str, package: str, _changed_ns: int, _size: int) -> tuple[str, ...]:
    try:
        text = read_text(Path(file), LARGEST)
    except FileError:
        return ()
    if "import" not in text:
        return ()
    try:
        tree, _ = python_tree(text, file)
    except FileError:
        return ("flexbe_core",) if "flexbe_core" in text else ()
    return tuple(dict.fromkeys(_imported(tree, package)))


def _imported(tree: ast.Module, package: str) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            name = "." * node.level + (node.module or "")
            try:
                full = resolve_name(name, package) if node.level else name
            except ImportError:  # beyond the top
                continue
            yield full
            yield from (f"{full}.{alias.name}" for alias in node.names if alias.name != "*")
