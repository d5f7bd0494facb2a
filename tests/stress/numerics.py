"""Which modules of the product compute: they call roots, angles, logarithms, or are compiled."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
TOPS = ("engine", "hw", "states", "behaviors", "cobodeck")
BESIDE = ("cobodeck/template", "cobodeck/bench", "cobodeck/pictures", "hw/fakes")
"""What new projects copy, measures, draws, or stands for devices."""
FUNCTIONS = frozenset(
    ("acos", "asin", "atan2", "arccos", "arcsin", "arctan2", "cos", "dist", "exp", "fmod", "hypot",
     "log", "sin", "sqrt", "tan", "tanh", "inv", "norm", "solve", "eigh", "lstsq", "einsum")
)  # fmt: skip
LIBRARIES = frozenset(("math", "np", "linalg", "numpy"))


def computes(node: ast.AST) -> bool:
    """True for a call of a numeric function, and for a compiled function."""
    if isinstance(node, ast.FunctionDef):
        names = {d.id for d in node.decorator_list if isinstance(d, ast.Name)}
        return bool(names & {"compiled", "compiled_like_numpy"})
    if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute)):
        return False
    owner = node.func.value
    name = owner.id if isinstance(owner, ast.Name) else getattr(owner, "attr", "")
    return node.func.attr in FUNCTIONS and name in LIBRARIES


def sources() -> Iterator[Path]:
    for top in TOPS:
        for file in sorted((ROOT / top).rglob("*.py")):
            if not file.relative_to(ROOT).as_posix().startswith(BESIDE):
                yield file


@cache
def numeric_modules() -> frozenset[str]:
    """The paths of all modules that compute, from the root."""
    return frozenset(
        file.relative_to(ROOT).as_posix()
        for file in sources()
        if any(map(computes, ast.walk(ast.parse(file.read_text(encoding="utf-8")))))
    )
