"""What a failed expectation tells of a run: where it is and since when, and what it lacks."""

from __future__ import annotations

import math
from collections.abc import Iterator

from engine.machine import CHOSEN, PUT_OFF, RETRYING, WAITING, LeafNode, RunNode
from engine.run import ChartRun
from engine.signals import Board, roots

LAST = 12
"""So many of the leaves last entered are told."""


def story(run: ChartRun) -> str:
    """What runs for how long, which signals it waits for in vain, what was raised, in lines."""
    found = [
        _listed("active", list(_active(run)) or [_end(run)]),
        _listed("stale", list(_stale(run))),
        _listed("raised", [f"{e.path or 'chart'} at {_s(e.time)}: {e}" for e in run.errors[-3:]]),
        _listed("entered", [" -> ".join(run.trace.path()[-LAST:]) or "nothing"]),
    ]
    return "\n".join(filter(None, found))


def _listed(title: str, items: list[str]) -> str:
    """The items below each other, behind a title; nothing without items."""
    beside = f"  {title}:".ljust(11)
    return beside + f"\n{'':11}".join(items) if items else ""


def _s(ns: int) -> str:
    return f"{ns / 1e9:.2f} s"


def _active(run: ChartRun) -> Iterator[str]:
    if run.paused:
        yield "paused by the operator"
    for node in sorted(run.nodes.values(), key=lambda node: node.order):
        doing = _doing(run, node)
        if doing is not None and node.since is not None:
            yield f"{node.path}{doing} for {_s(run.board.chart_now - node.since)}"


def _doing(run: ChartRun, node: RunNode) -> str | None:
    """What a node does, beside its path; None for one that is not active."""
    waits = {
        CHOSEN: " begins with the next tick",
        PUT_OFF: " begins with the next tick",
        RETRYING: " waits for a further try",
        WAITING: f" waits for consent to {node.waiting[0]!r}",
    }
    if node.status in waits:
        return waits[node.status]
    if not isinstance(node, LeafNode) or node not in run.entered:
        return None
    note = run.notes.get(node.path)
    said = f", says {note!r}" if note else ""
    return f" ({_class(run, node)}{said})"


def _class(run: ChartRun, node: LeafNode) -> str:
    name = node.interface.name
    return f"{name}, scripted" if node.path in run.stand_ins else name


def _end(run: ChartRun) -> str:
    """How the chart ended, and by which node."""
    ends = [r.time for r in run.trace if r.kind == "outcome" and not r.subject]
    at = f" at {_s(ends[-1])}" if ends else ""
    by, came = run.ended_by or ("", "")
    cause = f", because {by} ended with {came!r}" if by else ""
    return f"nothing; the chart ended with {run.outcome!r}{at}{cause}" if run.outcome else "nothing"


def _stale(run: ChartRun) -> Iterator[str]:
    """The signals that have no value for a running state that reads them."""
    for node in run.running:
        if node.path in run.stand_ins:
            continue
        for name, age in node.interface.reads.items():
            why = _why_stale(run.board, name, math.inf if age is None else age)
            if why is not None:
                yield f"{node.path} reads {name}{why}"


def _why_stale(board: Board, name: str, age: float) -> str | None:
    """Why a signal has no value for a reader that accepts ages up to `age`, s; None if it has."""
    try:
        newest = board.slots[name].read()
    except Exception as error:  # noqa: BLE001  a project's function may raise anything
        return f": computing it raises {type(error).__name__}: {error}"
    if newest is None:
        return f": {_missing(board, name)}"
    if (board.now - newest.stamp) / 1e9 <= age:
        return None
    since = newest.stamp + round(age * 1e9)
    return (
        f", at most {age:g} s old: stale since {_s(since)}, its last value is of {_s(newest.stamp)}"
    )


def _missing(board: Board, name: str) -> str:
    needed = sorted(roots(board.declared, [name]))
    unseen = [n for n in needed if n in board.inlets and board.inlets[n].newest is None]
    if unseen == [name]:
        return "never seen"
    return f"no value, since {', '.join(unseen)} was never seen" if unseen else "no value so far"
