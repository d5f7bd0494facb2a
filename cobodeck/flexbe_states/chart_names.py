"""Names of FlexBE as charts write them."""

from __future__ import annotations

import re

from engine import RESERVED_OUTCOMES


def identifier(name: str) -> str:
    """`name` with all that no identifier may have replaced."""
    found = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_") or "_"
    return f"_{found}" if found[0].isdigit() else found


def outcome_name(name: str) -> str:
    """An outcome; the engine's own ones get an underscore."""
    found = identifier(name)
    return f"{found}_" if found in RESERVED_OUTCOMES else found
