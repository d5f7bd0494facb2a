"""Reads results of `bench --json`, and says what is wrong with a file that is none."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from cobodeck.bench.harness import BenchRow
from cobodeck.terminal import Problem

LARGEST_NUMBER = 1e100
"""Numbers beyond this measure nothing."""
_TEXTS = {field.name for field in fields(BenchRow) if "str" in str(field.type)}
_NUMBERS = {field.name for field in fields(BenchRow) if "float" in str(field.type)}
_FLAGS = {field.name for field in fields(BenchRow) if "bool" in str(field.type)}
_ALWAYS = {"bench", "name", "variant"}
_LATER = {"spread", "calls_per_tick"} | _FLAGS
"""What older results lack."""


def read_result(file: Path) -> dict[str, Any]:
    """A result.

    Raises:
        Problem: it is not the output of `bench --json`; OSError: it cannot be read.
    """
    told = f"{file}: not the output of `cobodeck bench --json`"
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise Problem(f"{told}: {error}") from None
    wrong = _fault(found)
    if wrong is not None:
        raise Problem(f"{told}: {wrong}")
    assert isinstance(found, dict)
    return found


def _fault(found: object) -> str | None:
    if not isinstance(found, dict) or not isinstance(found.get("rows"), list):
        return "it has no list of `rows`"
    machine = found.get("machine")
    if not isinstance(machine, dict) or not {"name", "cores", "system", "python"} <= machine.keys():
        return "`machine` does not say name, cores, system and python"
    if not _is_number(machine.get("load", 0)):
        return "the load of `machine` is no number"
    for number, row in enumerate(found["rows"]):
        wrong = _fault_of_row(row) if isinstance(row, dict) else "is no object"
        if wrong is not None:
            return f"row {number} {wrong}"
    return None


def _fault_of_row(row: Mapping[str, Any]) -> str | None:
    for name in _TEXTS | _NUMBERS | _FLAGS:
        value = row.get(name)
        if name not in row and name not in _LATER:
            return f"has no {name!r}"
        if value is None and name not in _ALWAYS:
            continue
        if name in _TEXTS and not isinstance(value, str):
            return f"has {name!r}: {value!r:.40}, which is no text"
        if name in _NUMBERS and not _is_number(value):
            return f"has {name!r}: {value!r:.40}, which is no number"
        if name in _FLAGS and not isinstance(value, bool):
            return f"has {name!r}: {value!r:.40}, which is neither true nor false"
    if (row["knob"] is None) != (row["value"] is None):
        return "has a 'knob' without a 'value', or the other way about"
    return None


def _is_number(value: object) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < LARGEST_NUMBER  # NaN is not
