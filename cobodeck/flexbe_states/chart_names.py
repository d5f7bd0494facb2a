"""Names of FlexBE as charts write them."""

from __future__ import annotations

import keyword
import re

from engine import RESERVED_OUTCOMES

_TAKEN_KEYS = frozenset(("self", "ctx"))
"""Names of arguments that every state has."""


def identifier(name: str) -> str:
    """`name` with all that no identifier may have replaced."""
    found = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "_"
    return f"_{found}" if found[0].isdigit() else found


def outcome_name(name: str) -> str:
    """An outcome; the engine's own ones get an underscore."""
    found = identifier(name)
    return f"{found}_" if found in RESERVED_OUTCOMES else found


def key_name(name: str) -> str:
    """The name of an argument or a key; charts write `for` where Python has `for_`."""
    found = identifier(name)
    if keyword.iskeyword(found.removesuffix("_")):
        return found.removesuffix("_")
    return f"{found}_key" if found in _TAKEN_KEYS else found
