"""Modules of other people that have the name of one of cobodeck's packages, and hide it.

`states.py` in the folder that Python looks into first, as `python -m` and pytest do, is imported in
place of the package `states`. Nothing but the standard library is imported here, so that it can be
reported whichever package is hidden.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from importlib.machinery import PathFinder
from pathlib import Path

PACKAGES = ("engine", "states", "behaviors", "hw", "cobodeck")
ROOT = Path(__file__).parent.parent


def shadows(names: Iterable[str] = PACKAGES, path: Sequence[str] | None = None) -> dict[str, Path]:
    """What a first import would find in place of cobodeck's packages, by their names.

    A folder without `__init__.py` hides nothing: Python takes a package that has one before it.
    """
    found = {}
    for name in names:
        spec = PathFinder.find_spec(name, list(sys.path if path is None else path))
        origin = None if spec is None or spec.origin is None else Path(spec.origin)
        if origin is not None and origin.parent.resolve() != (ROOT / name).resolve():
            found[name] = origin.parent if origin.name == "__init__.py" else origin
    return found


def explained(found: dict[str, Path]) -> str:
    """What that means, and what to do; empty if nothing is hidden."""
    return "\n".join(
        f"{file}: it hides cobodeck's own package {name!r}, {ROOT / name}; rename it"
        for name, file in found.items()
    )
