"""How types, defaults and ranges are told."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from cobodeck.manual.page import PageTable, sentence, table_of
from engine import Argument, Type
from engine.files import quantity_text, si_unit, written_text
from engine.files.declared import Range

REQUIRED = "required"


def type_text(kind: Type) -> str:
    """A type with its unit: `length, m`; `one of omni, differential`."""
    if kind.choices:
        return f"one of {', '.join(map(str, kind.choices))}"
    if kind.variable and kind.is_number:
        return "number, in the unit of the signal or of the other numbers"
    if kind.name == "list" and kind.item is not None:
        return f"list of {type_text(kind.item)}"
    unit = si_unit(kind.name)
    return f"{kind.name.replace('_', ' ')}, {unit}" if unit else str(kind).removesuffix(" | none")


def default_text(argument: Argument) -> str:
    """The default as a chart would write it, or that there is none."""
    return REQUIRED if argument.required else value_text(argument.default, argument.type)


def value_text(value: Any, kind: Type) -> str:
    """A value as a chart would write it, a number with its unit."""
    if value is None:
        return "none"
    if isinstance(value, int | float) and not isinstance(value, bool):
        return quantity_text(value, kind.name)
    return written_text(value)


def range_text(within: Range | None, dimension: str) -> str:
    """The numbers that are allowed: `above 0 s`, `0.01 to 1 m`; empty if any is."""
    if within is None:
        return ""
    unit, per = ("deg", math.radians(1.0)) if dimension == "angle" else (si_unit(dimension), 1.0)
    low, high = f"{within.low / per:.6g}", f"{within.high / per:.6g} {unit}".rstrip()
    if within.high < math.inf:
        return f"above {low}, to {high}" if within.above else f"{low} to {high}"
    start = f"{low} {unit}".rstrip()
    return f"above {start}" if within.above else f"from {start}"


def arguments_table(head: str, arguments: Mapping[str, Argument]) -> tuple[PageTable, ...]:
    """Parameters or inputs with type, range, default and meaning."""
    rows = [
        (
            name,
            type_text(argument.type),
            range_text(argument.type.within, argument.type.name),
            default_text(argument),
            sentence(argument.about),
        )
        for name, argument in arguments.items()
    ]
    return table_of((head, "type", "range", "default", "meaning"), rows)
