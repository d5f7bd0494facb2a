"""Classes by the names that records give them.

A public class of ours has its own name, `UserPose`: no two have the same, so that a record stays
readable when a class moves to another module. Any other has its module's, too: `lamp.Brightness`.
Older records name the modules of ours, too, `hw.samples.UserPose`: whichever that was, the class
is found by its own name.

Classes are looked up among the modules that are loaded already: reading a record imports nothing.
"""

from __future__ import annotations

import sys
from typing import Any

from cobodeck.shadowed import PACKAGES


class Unknown(Exception):
    """A value that cannot be restored: its class is missing, or it was written as opaque."""


def name_of(kind: type) -> str:
    """The name of a class."""
    return renamed(f"{kind.__module__}.{kind.__qualname__}")


def renamed(name: str) -> str:
    """Today's name of a class, given that of an older record."""
    package, _, inside = name.partition(".")
    last = inside.rpartition(".")[2]
    is_ours = package in PACKAGES and not last.startswith("_") and "<locals>" not in inside
    return last if is_ours and inside else name


def class_of(name: str) -> type:
    """The class of this name, today's or an older one, in a loaded module.

    Raises:
        Unknown: there is no such class.
    """
    today = renamed(name)
    found = _foreign(today) if "." in today else _OWN.get(today) or _own(today)
    if not isinstance(found, type) or name_of(found) != today:
        raise Unknown(f"no class {name}")
    return found


_OWN: dict[str, type] = {}


def _own(name: str) -> Any:
    """Our class of this name, wherever it is now."""
    for where, module in list(sys.modules.items()):
        if where.partition(".")[0] in PACKAGES:
            found = vars(module).get(name)
            if isinstance(found, type) and name_of(found) == name:
                return _OWN.setdefault(name, found)
    return None


def _foreign(name: str) -> Any:
    module = name.rpartition(".")[0]
    while module and module not in sys.modules:  # a nested class
        module = module.rpartition(".")[0]
    found: Any = sys.modules.get(module)
    for part in name[len(module) + 1 :].split(".") if module else ():
        found = getattr(found, part, None)
    return found
