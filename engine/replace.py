"""Change of a running chart between two ticks (rule 11).

What runs goes on: generators, kept outcomes, deadlines and data move to the vertices of the new
machine that have the same path.
"""

from __future__ import annotations

from engine.machine import CHOSEN, PUT_OFF, RETRYING, WAITING, Box, Cell, Leaf, Machine, Vertex
from engine.run import ChartRun
from engine.state import NEVER_NS


def obstacles(run: ChartRun, new: Machine) -> list[str]:
    """Why `run` cannot go on with `new`; empty if it can."""
    if run.outcome is not None:
        return ["the run has ended"]
    if new.bound:
        return ["the new machine belongs to a run already"]
    found = [
        f"{vertex.path!r} waits; replace when it has gone on"
        for vertex in run.machine.vertices.values()
        if vertex.status in (WAITING, RETRYING, PUT_OFF)
        or (vertex.status == CHOSEN and isinstance(vertex, Leaf))
    ]
    for vertex in carried(run):
        other = new.vertices.get(vertex.path)
        if other is None:
            found.append(f"{vertex.path!r} is active and has no counterpart in the new chart")
        elif other.signature != vertex.signature:
            changed = [
                new
                for old, new in zip(vertex.signature, other.signature, strict=False)
                if old != new
            ]
            found.append(f"{vertex.path!r} is active and differs: it has {changed!r} now")
        elif isinstance(vertex, Box) and isinstance(other, Box):
            found += [
                f"{key!r} of {vertex.chart!r} is a {kind} and would be a {other.kinds[key]}"
                for key, kind in vertex.kinds.items()
                if other.kinds.get(key, kind) != kind
            ]
    for leaf in new.leaves:
        found += [
            f"{leaf.path!r} reads {name!r}, which this run does not have"
            for name in leaf.interface.reads
            if name not in run.board.slots
        ]
        found += [
            f"{leaf.path!r} commands {name!r}, which this run does not have"
            for name in leaf.commands
            if name not in run.parts
        ]
    return list(dict.fromkeys(found))


def carried(run: ChartRun) -> list[Vertex]:
    """The vertices whose state has to be carried over: entered, or with a kept outcome."""
    entered = list(run.entered)
    kept = [child for box in entered if isinstance(box, Box) for child in box.kept]
    return entered + kept


def take_over(run: ChartRun, new: Machine) -> None:
    """Let `run` go on with `new`; there must be no obstacles."""
    old_entered = list(run.entered)
    pairs = {old: new.vertices[old.path] for old in carried(run)}
    cells: dict[Cell, Cell] = {}
    for old, vertex in pairs.items():
        if isinstance(old, Box) and isinstance(vertex, Box):
            cells |= {
                cell: vertex.cells[key] for key, cell in old.cells.items() if key in vertex.cells
            }
    for old_cell, cell in cells.items():
        cell.value = old_cell.value
    for old, vertex in pairs.items():
        _carry(old, vertex, cells)
    added: list[Vertex] = []
    for old in old_entered:
        vertex = pairs[old]
        if isinstance(old, Box) and isinstance(vertex, Box):
            vertex.kept = {pairs[child]: outcome for child, outcome in old.kept.items()}
            vertex.news = vertex.keeps  # the rules may have changed
            if old.form != "states":
                known = {child.path for child in old.children}
                added += [child for child in vertex.children if child.path not in known]
    run.adopt(new, [pairs[old] for old in old_entered], added)
    for old in old_entered:
        _set_deadline(run, old, pairs[old])
        _keep_context(old, pairs[old])


def _carry(old: Vertex, vertex: Vertex, cells: dict[Cell, Cell]) -> None:
    for name in ("status", "entered", "wake", "mask", "asked", "silence", "tries", "put_off"):
        setattr(vertex, name, getattr(old, name))
    vertex.pending = tuple((cells[cell], value) for cell, value in old.pending if cell in cells)
    if isinstance(old, Leaf) and isinstance(vertex, Leaf):
        vertex.generator = old.generator
        vertex.step = old.step


def _keep_context(old: Vertex, vertex: Vertex) -> None:
    """A generator goes on with the context it was given, and with the events it has not had."""
    if isinstance(old, Leaf) and isinstance(vertex, Leaf):
        vertex.context = old.context
        vertex.context.leaf = vertex


def _set_deadline(run: ChartRun, old: Vertex, vertex: Vertex) -> None:
    """A timeout counts from the entry; where there was none before, the trace knows it."""
    if vertex.timeout_ns is None:
        return
    if old.timeout_ns is not None and old.deadline != NEVER_NS:
        entry = old.deadline - old.timeout_ns
    else:
        entry = run.chart_time(_entry(run, old))
    vertex.deadline = entry + vertex.timeout_ns
    run.watch_deadline(vertex)


def _entry(run: ChartRun, vertex: Vertex) -> int:
    """When the first of the tries began that `vertex` has made since it was chosen."""
    parent = vertex.parent.path if vertex.parent is not None else ""
    entry, chosen = 0, False
    for record in run.trace:
        if record.kind == "move":
            chosen = chosen or (record.subject == parent and record.detail[2] == vertex.name)
        elif record.kind == "enter":
            if record.subject == vertex.path and chosen:
                entry, chosen = record.time, False
            chosen = chosen or record.subject == parent
    return entry
