"""Drivers by name: one of ours by its class, a project's own by `module:Class`.

Ours are those that `hw.drivers` and `hw.fakes` offer. A file that says in which module one of ours
is stays valid wherever the class is now.
"""

from __future__ import annotations

import re
from typing import Any

from engine.faces import homes

OURS = ("hw.drivers", "hw.fakes")
PATTERN = r"^([A-Za-z_][\w.]*:)?[A-Za-z_]\w*$"
"""How a driver is written."""
_FULL = re.compile(r"(?P<module>[A-Za-z_][\w.]*):(?P<driver>[A-Za-z_]\w*)\Z")


def our_drivers() -> dict[str, str]:
    """The module of each of our drivers and fakes, by class."""
    return {
        name: module
        for package in OURS
        for name, module in homes(package).items()
        if name[0].isupper()
    }


def located(name: Any) -> str | None:
    """A driver as `module:Class`, whichever way it is written; None if it names none."""
    if not isinstance(name, str):
        return None
    full = _FULL.match(name)
    if full is None:
        module = our_drivers().get(name)
        return module and f"{module}:{name}"
    if not full["module"].startswith(OURS):
        return name
    return f"{our_drivers().get(full['driver'], full['module'])}:{full['driver']}"


def with_located(value: Any) -> Any:
    """The arguments of an entry, with the drivers nested in them as `module:Class`."""
    if not isinstance(value, dict):
        return value
    return {
        key: located(inner) or inner if key == "driver" else with_located(inner)
        for key, inner in value.items()
    }
