"""Other modules that have the name of one of cobodeck's packages, and hide it.

With `python -m` and pytest, Python searches the user's folder first: a `states.py` there is
imported in place of the package `states`. Only the standard library is imported here, so that a
hidden package can be reported, whichever it is.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from importlib.machinery import PathFinder
from pathlib import Path

PACKAGES = ("engine", "states", "behaviors", "hw", "cobodeck")
ROOT = Path(__file__).parent.parent


def shadows(names: Iterable[str] = PACKAGES, path: Sequence[str] | None = None) -> dict[str, Path]:
    """The files that an import would find in place of cobodeck's packages, by package name.

    A folder without `__init__.py` hides nothing: Python prefers a package that has one.
    """
    found = {}
    for name in names:
        spec = PathFinder.find_spec(name, list(sys.path if path is None else path))
        origin = None if spec is None or spec.origin is None else Path(spec.origin)
        if origin is not None and origin.parent.resolve() != (ROOT / name).resolve():
            found[name] = origin.parent if origin.name == "__init__.py" else origin
    return found


def explained(found: dict[str, Path]) -> str:
    """A message that explains what hides which package, and what to do; empty if nothing does."""
    return "\n".join(
        f"{file}: it hides cobodeck's own package {name!r}, {ROOT / name}; rename it"
        for name, file in found.items()
    )
