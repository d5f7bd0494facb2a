"""One home for each thing of the frame: the grid, the inlet, the loop."""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("engine", "states", "behaviors", "hw", "cobodeck")


def modules() -> Iterator[tuple[str, str]]:
    for top in PRODUCT:
        for file in sorted((ROOT / top).rglob("*.py")):
            name = file.relative_to(ROOT).as_posix()
            if not name.startswith("cobodeck/template"):
                yield name, file.read_text(encoding="utf-8")


def homes_of(is_it: Callable[[ast.AST], bool]) -> set[str]:
    return {name for name, text in modules() if any(map(is_it, ast.walk(ast.parse(text))))}


def test_the_grid_of_ticks_has_one_home() -> None:
    found = {
        name for name, text in modules() if re.search(r"//\s*(\w+\.)*(tick_)?hz\b", text, re.I)
    }

    assert found == {"engine/clock.py"}


def test_one_module_puts_samples_on_a_board() -> None:
    def puts(node: ast.AST) -> bool:
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            return False
        target = ast.unparse(node.func)
        return target.endswith(("board.put", "inbox.append", "board.inbox.append"))

    outside = {
        name for name in homes_of(puts) if not name.startswith(("engine/", "cobodeck/bench/"))
    }

    assert outside == {"cobodeck/inlet.py"}


def test_one_module_loops_over_ticks() -> None:
    def loops(node: ast.AST) -> bool:
        if not isinstance(node, ast.While | ast.For):
            return False
        calls = [n for n in ast.walk(node) if isinstance(n, ast.Call)]
        ticks = ("run.tick", "wired.tick", "loop.tick", "self._next")
        return any(ast.unparse(c.func).endswith(ticks) for c in calls)

    found = {name for name in homes_of(loops) if not name.startswith("cobodeck/bench/")}
    by_hand = {"cobodeck/testing.py"}  # the author of a test ticks

    assert found == {"cobodeck/loop.py"} | by_hand
