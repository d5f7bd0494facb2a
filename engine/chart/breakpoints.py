"""A chart's text without its breakpoints, which are no part of what the chart does."""

from __future__ import annotations

import re

from engine.chart.chart import Chart

KEY = "break"
_LINE_END = re.compile("\r\n|[\n\r\x85\u2028\u2029]")
_COMMA = re.compile(r"[ \t]*,[ \t]*")
_CLOSES = re.compile(r"\s*\}")
_REST = re.compile(r"[ \t]*(#[^\r\n]*)?(\r?\n|$)")


def text_without_breaks(chart: Chart) -> str:
    """The text as it would be without `break`; a text that has none, as it is.

    Equal for two charts that differ in breakpoints alone, if these were put in as one writes them:
    on lines of their own, or as `break: true, ` or `, break: true` in braces.
    """
    text = chart.source.text
    raws = [node.raw for node in chart.root.walk() if node.name and KEY in node.raw]
    starts = [0, *(end.end() for end in _LINE_END.finditer(text))] if raws else []
    for raw in sorted(raws, key=lambda raw: raw.keys_at[KEY], reverse=True):
        first, last = raw.keys_at[KEY], raw.values_at[KEY]
        text = _cut(text, starts[first[0] - 1] + first[1] - 1, starts[last[0] - 1] + last[2] - 1)
    return text


def _cut(text: str, start: int, end: int) -> str:
    """Take out an entry with its comma, and with its line if nothing else is on it."""
    before, after = text[:start], text[end:]
    if comma := _COMMA.match(after):
        after = after[comma.end() :]
    elif _CLOSES.match(after):
        return before.rstrip().removesuffix(",") + after
    line = before.rstrip(" \t")
    rest = _REST.match(after)
    if rest is None or not line.endswith("\n"):
        return before + after
    return line + after[rest.end() :] if rest[2] else line.removesuffix("\n").removesuffix("\r")
