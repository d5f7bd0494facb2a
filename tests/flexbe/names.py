"""Names of FlexBE, as names that charts allow."""

from __future__ import annotations

import re
from collections.abc import Iterable

from engine.state_class import RESERVED_OUTCOMES


def identifier(name: str) -> str:
    """`name` with all that no identifier may have replaced."""
    found = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "_"
    return f"_{found}" if found[0].isdigit() else found


def outcome_name(name: str) -> str:
    """An outcome; the engine's own ones get an underscore."""
    found = identifier(name)
    return f"{found}_" if found in RESERVED_OUTCOMES else found


def unique(name: str, taken: Iterable[str]) -> str:
    """`name`, with a number if it is taken."""
    found, number, taken = name, 1, set(taken)
    while found in taken:
        number += 1
        found = f"{name}_{number}"
    return found


def camel(words: str) -> str:
    """`some_words` as `SomeWords`."""
    return "".join(word[:1].upper() + word[1:] for word in words.split("_"))
