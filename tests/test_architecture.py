"""One home for each thing of the frame: the grid, the inlet, the loop."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from pathlib import Path

import networkx as nx

from engine.faces import homes

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("engine", "states", "behaviors", "hw", "cobodeck")


def modules() -> Iterator[tuple[str, str]]:
    for top in PRODUCT:
        for file in sorted((ROOT / top).rglob("*.py")):
            name = file.relative_to(ROOT).as_posix()
            if not name.startswith("cobodeck/template"):
                yield name, file.read_text(encoding="utf-8")


@cache
def trees() -> dict[str, ast.Module]:
    return {name: ast.parse(text) for name, text in modules()}


def homes_of(is_it: Callable[[ast.AST], bool]) -> set[str]:
    return {name for name, tree in trees().items() if any(map(is_it, ast.walk(tree)))}


def test_the_grid_of_ticks_has_one_home() -> None:
    found = {
        name for name, text in modules() if re.search(r"//\s*(\w+\.)*(tick_)?hz\b", text, re.I)
    }

    assert found == {"engine/clock.py"}


def test_one_module_puts_samples_on_a_board() -> None:
    def puts(node: ast.AST) -> bool:
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            return False
        if node.func.attr not in ("put", "append"):  # to unparse all would take seconds
            return False
        target = ast.unparse(node.func)
        return target.endswith(("board.put", "inbox.append", "board.inbox.append"))

    outside = {
        name for name in homes_of(puts) if not name.startswith(("engine/", "cobodeck/bench/"))
    }

    assert outside == {"cobodeck/loop/sample_router.py"}


def test_one_module_loops_over_ticks() -> None:
    def loops(node: ast.AST) -> bool:
        if not isinstance(node, ast.While | ast.For):
            return False
        called = [n.func for n in ast.walk(node) if isinstance(n, ast.Call)]
        ticks = ("run.tick", "wired.tick", "loop.tick", "self._next")
        return any(
            isinstance(f, ast.Attribute)
            and f.attr in ("tick", "_next")
            and ast.unparse(f).endswith(ticks)
            for f in called
        )

    found = {name for name in homes_of(loops) if not name.startswith("cobodeck/bench/")}
    by_hand = {"cobodeck/testing/testing.py"}  # the author of a test ticks

    assert found == {"cobodeck/loop/loop.py"} | by_hand


def named_types(tree: ast.Module) -> Iterator[tuple[str, bool]]:
    """Public classes of a module and the types that it gives a name; True for a class."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            yield node.name, True
        elif isinstance(node, ast.Assign):
            names = [n.id for n in node.targets if isinstance(n, ast.Name)]
            yield from ((n, False) for n in names if re.fullmatch(r"[A-Z]\w*[a-z]\w*", n))


def test_no_public_class_has_the_name_of_another_type() -> None:
    homes: dict[str, list[tuple[str, bool]]] = {}
    for module, tree in trees().items():
        for name, is_class in named_types(tree):
            if not name.startswith("_"):
                homes.setdefault(name, []).append((module, is_class))

    twice = {
        name: [module for module, _ in where]
        for name, where in homes.items()
        if len(where) > 1 and any(is_class for _, is_class in where)
    }
    assert not twice


def imported(node: ast.AST) -> Iterator[str]:
    """What a module imports, for type checkers too; a name of a face counts as its module."""
    for child in ast.walk(node):
        if isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names)
        elif isinstance(child, ast.ImportFrom) and child.module:
            for alias in child.names:
                offered = face_of(child.module).get(alias.name, child.module)
                yield f"{offered}.{alias.name}" if offered == child.module else offered
                yield offered


@cache
def face_of(package: str) -> Mapping[str, str]:
    stub = ROOT / package.replace(".", "/") / "__init__.pyi"
    return homes(package) if stub.exists() else {}


def test_modules_do_not_import_each_other_in_a_circle() -> None:
    found = {
        file.removesuffix(".py").removesuffix("/__init__").replace("/", "."): tree
        for file, tree in trees().items()
    }
    packages = {file.removesuffix("/__init__.py").replace("/", ".") for file in trees()}
    graph = nx.DiGraph(
        (name, other)
        for name, tree in found.items()
        for other in imported(tree)
        if other in found and other not in packages and other != name
    )

    circles = [sorted(c) for c in nx.strongly_connected_components(graph) if len(c) > 1]

    assert graph.number_of_edges() > 1000
    assert not circles
