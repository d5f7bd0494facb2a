"""The keys that drivers and fakes take in files of connections, from their source; none is run."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from cobodeck.manual.page import PageBlock, sentence, table_of
from cobodeck.manual.wording import REQUIRED
from engine import docstring_parts
from hw.connection import our_drivers

_GIVEN = {"self", "now", "opening", "model", "clock", "link", "chain"}
"""Arguments that no file gives by a value of its own."""
_NO_DRIVERS = ("hw.drivers.needs", "hw.drivers.observer")


def driver_blocks() -> Iterator[PageBlock]:
    """Each driver with what it is, and its keys."""
    for name, module in sorted(our_drivers().items()):
        if module not in _NO_DRIVERS:
            found = _class_in(module, name)
            if found is not None:
                yield from _driver(found)


def _class_in(module: str, name: str) -> ast.ClassDef | None:
    spec = find_spec(module)
    if spec is None or spec.origin is None:
        return None
    tree = ast.parse(Path(spec.origin).read_text(encoding="utf-8"))
    found = (node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == name)
    return next(found, None)


def _driver(of: ast.ClassDef) -> Iterator[PageBlock]:
    about, sections = docstring_parts(ast.get_docstring(of) or "")
    first, *others = about.split("\n\n")
    yield f"**`{of.name}`**: {first}"
    yield from (other for other in others if not other.startswith("Raises:"))
    meanings = sections.get("Args", {})
    made = (node for node in of.body if isinstance(node, ast.FunctionDef))
    init = next((node for node in made if node.name == "__init__"), None)
    if init is None:
        return
    rows = [
        (argument, default, sentence(meanings.get(argument, "")))
        for argument, default in _arguments(init.args)
        if argument not in _GIVEN
    ]
    yield from table_of(("key", "default", "meaning"), rows)


def _arguments(of: ast.arguments) -> Iterator[tuple[str, str]]:
    """Each argument with its default as a file would write it."""
    positional = [*of.posonlyargs, *of.args]
    lacking = len(positional) - len(of.defaults)
    defaults: list[ast.expr | None] = [*[None] * lacking, *of.defaults]
    given = [*zip(positional, defaults, strict=True)]
    given += [*zip(of.kwonlyargs, of.kw_defaults, strict=True)]
    for argument, default in given:
        yield argument.arg, _default(default)


def _default(value: ast.expr | None) -> str:
    if value is None:
        return REQUIRED
    if isinstance(value, ast.Constant):
        plain = value.value
        if isinstance(plain, bool):
            return str(plain).lower()
        return "none" if plain is None else str(plain)
    return "" if isinstance(value, ast.Name) else ast.unparse(value).replace("()", "[]")
