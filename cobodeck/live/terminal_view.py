"""What a page shows, as lines of a terminal: active nodes, last transitions, health, findings.

`WatchedPage` keeps what a server or a source says; `view` makes lines of it.
"""

from __future__ import annotations

import unicodedata
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from engine.files import visible

LEAST_COLUMNS, LEAST_ROWS = 20, 5
KEPT = 200
"""Transitions and lines that are kept."""
PLAIN, HEAD, GOOD, BAD, FAINT = "", "7", "32", "31", "2"
"""Kinds of lines: the number of their style in ANSI's sequences."""
KEYS = {
    "record": "q: end · space: play or pause · ← →: 1 s back or on · ↑ ↓: faster or slower",
    "live": "q: end (the run goes on)",
    "charts": "q: end",
}
Line = tuple[str, str]
"""A kind of line and its text."""


@dataclass(slots=True)
class WatchedPage:
    """What was told so far; times in s of the run."""

    hello: dict[str, Any] = field(default_factory=dict)
    state: dict[str, Any] = field(default_factory=dict)
    health: dict[str, Any] = field(default_factory=dict)
    chart: dict[str, Any] = field(default_factory=dict)
    charts: list[dict[str, Any]] = field(default_factory=list)
    last: deque[dict[str, Any]] = field(default_factory=lambda: deque(maxlen=KEPT))
    said: deque[str] = field(default_factory=lambda: deque(maxlen=KEPT))
    at: float = 0.0

    @property
    def mode(self) -> str:
        """What is watched: `live`, `record` or `charts`."""
        return str(self.hello.get("mode", ""))

    @property
    def is_there(self) -> bool:
        """Whether there is something to show."""
        return bool(self.charts and self.chart if self.mode == "charts" else self.state)

    def take(self, message: Mapping[str, Any]) -> None:
        """Take a message; of kinds and places that are not shown nothing is kept."""
        kind, content = message.get("t"), {**message}
        if message.get("slot"):
            return
        if kind == "hello":
            self.hello, self.state = content, {}
            self.last.clear()
        elif kind in ("state", "ev"):
            self._take_state(content, whole=kind == "state")
        elif kind == "chart":
            self.chart = content
        elif kind == "charts":
            self.charts = list(content.get("charts") or ())
        elif kind == "health":
            self.health = content
        elif kind == "say":
            self.said.append(str(content.get("text")))
        if kind in ("frame", "state", "ev") and isinstance(at := content.get("at"), int | float):
            self.at = float(at)

    def _take_state(self, content: dict[str, Any], *, whole: bool) -> None:
        new = [entry for entry in content.pop("last", None) or () if isinstance(entry, dict)]
        if whole:
            self.state = {}
            self.last.clear()
        self.state |= content
        self.last.extend(new)


def view(page: WatchedPage, columns: int, rows: int, *, colour: bool = False) -> list[str]:
    """At most `rows` lines of at most `columns` columns."""
    columns, rows = max(columns, LEAST_COLUMNS), max(rows, LEAST_ROWS)
    charts = page.mode == "charts"
    lines = _charts(page, columns) if charts else _run(page, columns, rows - 1)
    lines = lines[: rows - 1]
    lines += [(PLAIN, "")] * (rows - 1 - len(lines))
    lines.append((FAINT, KEYS.get(page.mode, "q: end")))
    return [_shown(kind, text, columns, colour) for kind, text in lines]


def _run(page: WatchedPage, columns: int, rows: int) -> list[Line]:
    state = page.state
    lines: list[Line] = [(HEAD, _across(_title(page), _clock(page), columns))]
    if about := " · ".join(map(str, page.hello.get("about") or ())):
        lines.append((FAINT, about))
    lines += [(BAD, f"fault: {fault}") for fault in state.get("faults") or ()]
    waits = (state.get("waiting") or {}).items()
    lines += [(BAD, f"asks: {path or page.chart.get('name')}: {what}?") for path, what in waits]
    tail = [*_operator(state), *_health(page.health)]
    nodes = list(_active(page, columns))
    least = min(len(page.last), 4)
    room = max(1, rows - len(lines) - len(tail) - least - 1)
    if len(nodes) > room:
        nodes = [*nodes[: room - 1], (FAINT, f"… and {len(nodes) - room + 1} more active nodes")]
    lines += [*nodes, *tail]
    left = rows - len(lines)
    newest = list(page.last)[-max(0, left) :] if left > 0 else []
    return lines + [(PLAIN, _transition(entry)) for entry in newest]


def _title(page: WatchedPage) -> str:
    state, name = page.state, page.hello.get("title") or page.chart.get("name") or "cobodeck"
    marks = [
        f"ended: {state['ended']}" if state.get("ended") else "",
        "STOPPED (software stop)" if state.get("stop") else "",
        "paused" if state.get("paused") else "",
        "real robot" if page.hello.get("real") else "",
    ]
    return " · ".join(filter(None, (str(name), page.mode, *marks)))


def _clock(page: WatchedPage) -> str:
    until, speed = page.hello.get("until"), page.state.get("speed")
    whole = f" of {until:.1f} s" if isinstance(until, int | float) else " s"
    return f"{page.at:.1f}{whole}" + (f" ×{speed:g}" if speed not in (None, 0, 1) else "")


def _active(page: WatchedPage, columns: int) -> Iterator[Line]:
    """The tree of active nodes, in the order of the chart, each with its time in state."""
    since: dict[str, Any] = page.state.get("active") or {}
    known = page.chart.get("nodes") or {}
    order = {path: number for number, path in enumerate(known)}
    shown = {above for path in since for above in _with_above(path)} - {""}
    yield GOOD if since else FAINT, str(page.chart.get("name") or "nothing is active")
    for path in sorted(shown, key=lambda path: (order.get(path, len(order)), path)):
        depth, name = path.count("/") + 1, path.rpartition("/")[2]
        node = known.get(path, {})
        target = f" {node.get('target')}" if node.get("target") else ""
        locked = " (locked)" if path in (page.state.get("locks") or ()) else ""
        left = f"{'  ' * depth}{name}{target}{locked}"
        began = since.get(path)
        time = f"{max(0.0, page.at - began):.1f} s" if isinstance(began, int | float) else ""
        yield GOOD if path in since else PLAIN, _across(left, time, columns)


def _with_above(path: str) -> Iterator[str]:
    while path:
        yield path
        path = path.rpartition("/")[0]


def _operator(state: Mapping[str, Any]) -> Iterator[Line]:
    told = {"operator": (state.get("operator") or {}).get("name"), "level": state.get("level")}
    shown = [f"{name}: {value}" for name, value in told.items() if value]
    shown += [f"breakpoint: {path}" for path in state.get("breaks") or ()]
    if shown:
        yield PLAIN, " · ".join(shown)


def _health(health: Mapping[str, Any]) -> Iterator[Line]:
    if not health:
        return
    p99 = health.get("tick_p99_ms")
    told = [f"{name} {health[key]}" for key, name in _COUNTS.items() if health.get(key) is not None]
    told += [f"tick p99 {p99:.1f} ms"] if isinstance(p99, int | float) else []
    children = health.get("children") or ()
    told += [f"{child.get('name')} {child.get('state')}" for child in children]
    if told:
        yield FAINT, "health: " + " · ".join(told)
    ages = {name: age for name, age in (health.get("ages") or {}).items() if age is not None}
    oldest = sorted(ages.items(), key=lambda item: -item[1])
    if oldest:
        yield FAINT, "oldest: " + " · ".join(f"{name} {age:.1f} s" for name, age in oldest[:6])


_COUNTS = {"late": "late", "missed": "missed", "dropped": "dropped", "pages": "pages"}


def _transition(entry: Mapping[str, Any]) -> str:
    at = entry.get("at")
    time = f"{at:9.2f} s" if isinstance(at, int | float) else " " * 11
    words = (entry.get("kind"), entry.get("path"), entry.get("text"))
    return f"{time}  {'  '.join(str(word) for word in words if word)}"


def _charts(page: WatchedPage, columns: int) -> list[Line]:
    chart = page.chart
    state = "the text is broken" if chart.get("stale") else ""
    title = " · ".join(filter(None, (str(page.hello.get("title", "")), state)))
    lines: list[Line] = [(HEAD, _across(title, str(chart.get("profile", "")), columns))]
    for one in page.charts:
        errors, warnings = one.get("errors", 0), one.get("warnings", 0)
        told = ", ".join(
            f"{n} {what}{'s' * (n != 1)}"
            for n, what in ((errors, "error"), (warnings, "warning"))
            if n
        )
        mark = "> " if one.get("file") == chart.get("file") else "  "
        kind = BAD if errors else PLAIN
        lines.append((kind, _across(f"{mark}{one.get('name')}", told or "fine", columns)))
    for found in chart.get("findings") or ():
        place = f"{found.get('file')}:{found.get('line')}:{found.get('column')}"
        kind = BAD if found.get("severity") == "error" else PLAIN
        told = visible(f"{place}: {found.get('severity')}[{found.get('code')}]")
        lines.append((kind, _cut(told[::-1], columns)[::-1]))  # the file's name and line stay
        lines += [
            (PLAIN, f"    {text}") for text in (found.get("message"), found.get("hint")) if text
        ]
    return lines


def _across(left: str, right: str, columns: int) -> str:
    """Text on the left and on the right of a line; the right one stays whole."""
    right = _cut(visible(right), columns - 2)
    left = _cut(visible(left), columns - _width(right) - 2)
    return left + " " * (columns - _width(left) - _width(right)) + right


def _shown(kind: str, text: str, columns: int, colour: bool) -> str:
    shown = _cut(visible(text), columns)
    return f"\x1b[{kind}m{shown}\x1b[0m" if colour and kind else shown.rstrip()


def _cut(text: str, columns: int) -> str:
    if _width(text) <= columns:
        return text
    found, used = "", 1
    for character in text:
        used += _width(character)
        if used > columns:
            break
        found += character
    return f"{found}…"


def _width(text: Iterable[str]) -> int:
    """Columns of a terminal: two for wide characters, none for accents."""
    if isinstance(text, str) and text.isascii():
        return len(text)
    return sum(
        0 if unicodedata.combining(c) else 2 if unicodedata.east_asian_width(c) in "WF" else 1
        for c in text
    )
