"""The values of a profile that a chart picks by name, as `$profile.escape.ahead`."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from typing import Any

from engine import constants_in
from engine.chart import Chart, Node, mark_of
from engine.files import Finding, Mark, Place, did_you_mean

PREFIX = "profile."
"""Charts write it before a profile's keys."""


def missing_constants(chart: Chart, known: Collection[str], profile: str) -> Iterator[Finding]:
    """A finding where a chart picks a value that is not `known` in the profile of this name."""
    for value, at in _values(chart):
        for name in constants_in(value):
            if name not in known:
                message = f"there is no value ${name} in the profile {profile}"
                yield Finding("N09", message, chart.place(at), did_you_mean(name, known))


def place_of_constant(charts: Iterable[Chart], name: str) -> Place | None:
    """Where the first of these charts that picks the value of this name does so."""
    for chart in charts:
        for value, at in _values(chart):
            if name in constants_in(value):
                return chart.place(at)
    return None


def _values(chart: Chart) -> Iterator[tuple[Any, Mark]]:
    """All values that are written in a chart, with their places."""
    for parameter in chart.parameters.values():
        yield parameter.default, chart.declared_mark("parameters", parameter.name, "default")
    for key in chart.keys.values():
        section, entry = ("inputs", "default") if key.is_input else ("data", "initial")
        yield key.initial, chart.declared_mark(section, key.name, entry)
    for node in chart.root.walk():
        yield from _values_at(node)


def _values_at(node: Node) -> Iterator[tuple[Any, Mark]]:
    raw = node.raw
    yield from ((value, mark_of(raw, "with", name)) for name, value in node.parameters.items())
    yield from ((value, mark_of(raw, "in", name)) for name, value in node.given.items())
    yield node.timeout, mark_of(raw, "timeout")
    if node.retry is not None:
        yield node.retry.times, mark_of(raw, "retry", "times")
        yield node.retry.wait, mark_of(raw, "retry", "wait")
