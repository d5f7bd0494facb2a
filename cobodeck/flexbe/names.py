"""Names of FlexBE, as names that charts and Python allow."""

from __future__ import annotations

import keyword
import re
from collections.abc import Iterable

from cobodeck.flexbe_states import (
    identifier as identifier,
    key_name as key_name,
    outcome_name as outcome_name,
)


def outcome_names(names: Iterable[str]) -> tuple[str, ...]:
    """Several outcomes; two that come to the same name are one."""
    return tuple(dict.fromkeys(map(outcome_name, names)))


def parameter_names(names: Iterable[str], keys: Iterable[str]) -> dict[str, str]:
    """The names of a chart's parameters; inputs have `keys`, and each name is there once."""
    found: dict[str, str] = {}
    for name in names:
        wanted = identifier(name)
        wanted = f"{wanted}_parameter" if wanted in keys else wanted
        found[name] = unique(wanted, {*found.values(), *keys})
    return found


def bare(name: str) -> str:
    """The name of a class without that of its package: `pkg__Wait`, `pkg.Wait`."""
    return re.split(r"__(?=\w)|\.", name)[-1]


def class_name(name: str) -> str:
    """A name for a Python class."""
    found = identifier(name).lstrip("_") or "State"
    found = f"State{found}" if found[0].isdigit() else found
    return f"{found}State" if keyword.iskeyword(found) or found in _IMPORTED else found


_IMPORTED = frozenset(("Action", "Any", "Context", "Outcome", "Run"))
"""What the generated modules import."""


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
