"""What the header of a record holds; it may come from anybody."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

NAMED = {"name": str, "sha256": str}
NUMBER = (int, float)
TEXT = (None, str)
TEXTS = {str: str}
HEADER: Mapping[str, Any] = {
    "began": str,
    "command": [str],
    "plant": str,
    "real_time": bool,
    "chart": str,
    "charts": TEXTS,
    "scene": (None, NAMED),
    "robot": str,
    "profile": NAMED,
    "given": {"scene": TEXT, "profile": TEXT, "robot": TEXT},
    "tick_hz": int,
    "options": {
        "user": TEXT,
        "requests": (None, int),
        "stretch_m": (None, *NUMBER),
        "tier": int,
        "seed": int,
        "duration_s": NUMBER,
        "eager": bool,
        "frozen_base": bool,
        "mock": bool,
        "unwatched": bool,
    },
    "user": TEXT,
    "latency_ns": int,
    "parts": {str: [str]},
    "signals": [str],
    "flowing": [str],
    "guard": (None, {"governor": bool, "watched": bool}),
    "versions": TEXTS,
    "machine": TEXTS,
    "files": TEXTS,
    "code": TEXTS,
}
"""Its entries: a class, `[of items]`, `{str: of values}`, `{entry: of it}`, or one of several."""


def misfit(header: Mapping[str, Any]) -> str | None:
    """The first entry that is missing or not of its kind, by its name; None: all fit."""
    for name, shape in HEADER.items():
        if name not in header or not _fits(header[name], shape):
            return name
    if header["tick_hz"] < 1:
        return "tick_hz"
    return None if header["chart"] in header["charts"] else "chart"


def _fits(value: Any, shape: Any) -> bool:
    if isinstance(shape, tuple):
        return any(_fits(value, one) for one in shape)
    if isinstance(shape, list):
        return isinstance(value, list) and all(_fits(item, shape[0]) for item in value)
    if not isinstance(shape, dict):
        return value is None if shape is None else type(value) is shape
    if not isinstance(value, dict):
        return False
    if str in shape:
        return all(_fits(held, shape[str]) for held in value.values())
    return value.keys() == shape.keys() and all(_fits(value[k], shape[k]) for k in shape)
