"""Finds the numbers in the code of the behaviours that decide what the robot does.

A number that decides is a named constant of a module, the default of a parameter, or a literal
inside a function. The parameters of states are told apart (`left_to_code`): their defaults decide
only where a chart does not give them. Not counted: 0, 1, 2 and 0.5 inside functions, indices and
sizes of arrays, numbers up to ROUNDING, ns per s, and the examples of compiled functions. Settings
of the profile are not looked at: they are values with units there.

    python -m tests.behaviors.deciding [FOLDER]     # prints them, and how many there are
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

BEHAVIOURS = Path(__file__).parents[2] / "behaviors"
ROUNDING = 1e-6
"""Smaller numbers keep divisions from 0 and comparisons from rounding."""
PLAIN = (0, 1, 2, 0.5, 1e9)
SIZED = ("empty", "zeros", "ones", "full", "reshape", "range")
"""Functions that take sizes of arrays."""


def deciding(folder: Path = BEHAVIOURS) -> list[str]:
    """`file.py:NAME`, `file.py:function:parameter` or `file.py:function:3.0`, sorted."""
    files = (file for file in folder.rglob("*.py") if "profile" not in file.parts)  # settings
    return sorted(
        f"{file.relative_to(folder).as_posix()}:{name}"
        for file in files
        for name in numbers_of(file.read_text("utf-8"))
    )


def left_to_code(charts: Path = BEHAVIOURS.parent / "charts") -> list[str]:
    """`chart.yaml State parameter` where a shipped chart leaves a number to the state's default."""
    defaults = dict(_parameters_of_states())
    found = set()
    for file in sorted((*charts.glob("*.yaml"), *charts.glob("paper/*.yaml"))):
        for node in _nodes(yaml.safe_load(file.read_text("utf-8"))):
            name = node.get("do") or node.get("watch")
            for parameter in defaults.get(name, ()):
                if parameter not in node.get("with", {}):
                    found.add(f"{file.name} {name} {parameter}")
    return sorted(found)


def _nodes(item: Any) -> Iterator[Mapping[str, Any]]:
    """Every mapping in a chart."""
    if isinstance(item, Mapping):
        yield item
        item = list(item.values())
    for below in item if isinstance(item, list) else ():
        yield from _nodes(below)


def _parameters_of_states() -> Iterator[tuple[str, list[str]]]:
    """The states of the behaviours, and their parameters with numbers as defaults."""
    for file in sorted(BEHAVIOURS.rglob("*.py")):
        for node in ast.parse(file.read_text("utf-8")).body:
            if isinstance(node, ast.ClassDef) and _is_state(node):
                for made in node.body:
                    if isinstance(made, ast.FunctionDef) and made.name == "__init__":
                        yield node.name, [name.rpartition(":")[2] for name in _defaults(made, ())]


def _is_state(node: ast.ClassDef) -> bool:
    return any(ast.unparse(base) in ("Action", "Monitor") for base in node.bases)


def numbers_of(source: str) -> Iterator[str]:
    """The numbers that decide in the text of one module."""
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign | ast.AnnAssign):
            yield from _named(node)
        else:
            yield from _inside(node, ())


def _named(node: ast.Assign | ast.AnnAssign) -> Iterator[str]:
    """The names to which numbers are given, each once."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    for target in targets:
        pairs = [(target, node.value)]
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            pairs = list(zip(target.elts, node.value.elts, strict=True))
        for name, value in pairs:
            if value is not None and any(map(_is_number, ast.walk(value))):
                yield ast.unparse(name)


def _inside(node: ast.AST, where: tuple[str, ...], in_state: bool = False) -> Iterator[str]:
    if isinstance(node, ast.FunctionDef):
        if any("example" in ast.unparse(decorator) for decorator in node.decorator_list):
            return
        where = (*where, node.name)
        if not in_state or node.name != "__init__":
            yield from _defaults(node, where)
        children: list[ast.AST] = list(node.body)
    elif isinstance(node, ast.ClassDef):
        where, children = (*where, node.name), list(node.body)
        in_state = _is_state(node)
    elif isinstance(node, ast.Subscript):
        children = [node.value]
    elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in SIZED:
        children = [node.func]
    else:
        children = list(ast.iter_child_nodes(node))
    if _is_number(node) and not _is_plain(node):
        yield ":".join((".".join(where), ast.unparse(node)))
    for child in children:
        yield from _inside(child, where, in_state)


def _defaults(node: ast.FunctionDef, where: tuple[str, ...]) -> Iterator[str]:
    given = node.args
    positional = given.posonlyargs + given.args
    first = len(positional) - len(given.defaults)
    pairs = [
        *zip(positional[first:], given.defaults, strict=True),
        *zip(given.kwonlyargs, given.kw_defaults, strict=True),
    ]
    for argument, value in pairs:
        if value is not None and any(_is_number(n) and n.value != 0 for n in ast.walk(value)):
            yield ":".join((".".join(where), argument.arg))


def _is_number(node: ast.AST) -> bool:
    value = node.value if isinstance(node, ast.Constant) else None
    return isinstance(value, int | float) and not isinstance(value, bool)


def _is_plain(node: ast.AST) -> bool:
    return node.value in PLAIN or abs(node.value) <= ROUNDING


if __name__ == "__main__":
    found = deciding(*map(Path, sys.argv[1:]))
    sys.stdout.write("".join(f"{name}\n" for name in (*found, len(found), *left_to_code())))
