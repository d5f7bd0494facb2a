"""What a module defines, read from its text: nothing of it is imported."""

from __future__ import annotations

import ast
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from cobodeck.project.project import MAX_BYTES
from engine.files import FileError, read_bytes

MAKERS = ("__init__", "__new__")


class CallArguments(NamedTuple):
    """The arguments by which a class is called, without `self`."""

    known: tuple[str, ...]
    needed: tuple[str, ...]
    """Those without a default."""
    takes_others: bool
    """It has `**others`."""


def names_in(module: str) -> set[str] | None:
    """The names that a module defines, by its text; None if these do not say it all.

    Raises:
        SyntaxError: its text is not Python.
    """
    tree = _tree_of(module)
    if tree is None:
        return None
    found = set()
    for node in ast.walk(tree):  # definitions may stand under a condition, too
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            found.add(node.name)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            found |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
    return None if {"*", "__getattr__"} & found else found


def arguments_of(module: str, name: str) -> CallArguments | None:
    """What a class of a module is called with, by its text; None where that does not tell it.

    Told are classes with a constructor of their own, or with that of a base in the same module.

    Raises:
        SyntaxError: its text is not Python.
    """
    tree = _tree_of(module)
    classes = (
        {node.name: node for node in tree.body if isinstance(node, ast.ClassDef)} if tree else {}
    )
    found = classes.pop(name, None)
    while found is not None and not found.decorator_list and not found.keywords:
        makers = [
            node for node in found.body if isinstance(node, ast.FunctionDef) and node.name in MAKERS
        ]
        if makers:
            plain = len(makers) == 1 and not makers[0].decorator_list
            return _arguments(makers[0].args) if plain else None
        base = found.bases[0] if len(found.bases) == 1 else None
        found = classes.pop(base.id, None) if isinstance(base, ast.Name) else None
    return None


def _arguments(written: ast.arguments) -> CallArguments:
    places = [one.arg for one in (*written.posonlyargs, *written.args)]
    first = len(places) - len(written.defaults)
    named = {
        one.arg: default
        for one, default in zip(written.kwonlyargs, written.kw_defaults, strict=True)
    }
    needed = [*places[1:first], *(name for name, default in named.items() if default is None)]
    return CallArguments((*places[1:], *named), tuple(needed), written.kwarg is not None)


def _tree_of(module: str) -> ast.Module | None:
    spec = find_spec(module)
    file = str(spec and spec.origin)
    try:
        return ast.parse(read_bytes(Path(file), MAX_BYTES), file)
    except (FileError, ValueError):  # it has no text
        return None
