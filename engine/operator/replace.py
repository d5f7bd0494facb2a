"""Replaces a running chart between two ticks (rule 11).

A node that runs is bound to the vertex of the new machine that has the same path: its generator,
the outcomes it keeps, its tries and what it waits for stay as they are.
"""

from __future__ import annotations

from engine.machine import (
    CHOSEN,
    IDLE,
    PUT_OFF,
    RETRYING,
    WAITING,
    Box,
    BoxNode,
    Cell,
    LeafNode,
    Machine,
    RunNode,
    nodes_of,
)
from engine.run import ChartRun
from engine.state import NEVER_NS


def obstacles(run: ChartRun, new: Machine) -> list[str]:
    """Why `run` cannot go on with `new`; empty if it can."""
    if run.over:
        return ["the run has ended"]
    found = [
        f"{node.path!r} waits; replace when it has gone on"
        for node in run.nodes.values()
        if node.status in (WAITING, RETRYING, PUT_OFF)
        or (node.status == CHOSEN and isinstance(node, LeafNode))
    ]
    found += _without_value(run, new)
    for node in carried(run):
        found += _differences(node, new)
    for leaf in new.leaves:
        found += [
            f"{leaf.path!r} reads {name!r}, which this run does not have"
            for name in leaf.interface.reads
            if name not in run.board.slots
        ]
        found += [
            f"{leaf.path!r} commands {name!r}, which this run does not have"
            for name in leaf.interface.commands
            if name not in run.parts
        ]
    return list(dict.fromkeys(found))


def _without_value(run: ChartRun, new: Machine) -> list[str]:
    """The inputs of the new chart that have no value; once begun, a run keeps those it has."""
    kept = run.machine.root.cells if run.life.root in run.entered else {}
    return [
        f"input {name!r} of {new.chart.name!r} has no value"
        for name in new.missing
        if name not in kept
    ]


def _differences(node: RunNode, new: Machine) -> list[str]:
    """Why an active node cannot continue in the new machine."""
    old, other = node.vertex, new.vertices.get(node.path)
    if other is None:
        return [f"{node.path!r} is active and has no counterpart in the new chart"]
    if other.signature != old.signature:
        pairs = zip(old.signature, other.signature, strict=False)
        changed = [now for before, now in pairs if before != now]
        return [f"{node.path!r} is active and differs: it has {changed!r} now"]
    if not isinstance(old, Box) or not isinstance(other, Box):
        return []
    return [
        f"{key!r} of {old.chart!r} is a {cell.kind} and would be a {other.cells[key].kind}"
        for key, cell in old.cells.items()
        if key in other.cells and other.cells[key].kind != cell.kind
    ]


def carried(run: ChartRun) -> list[RunNode]:
    """The nodes that are carried over: entered, or with a kept outcome."""
    boxes = [node for node in run.entered if isinstance(node, BoxNode)]
    return [*run.entered, *(box.children[name] for box in boxes for name in box.kept)]


def take_over(run: ChartRun, new: Machine) -> None:
    """Let `run` go on with `new`; there must be no obstacles."""
    before = {node: node.vertex for node in carried(run)}
    values = run.life.data
    nodes = nodes_of(new, {node.path: node for node in before})
    run.adopt(new, nodes)
    cells: dict[Cell, Cell] = {}  # old to new
    for node, old in before.items():
        if isinstance(node, BoxNode) and isinstance(old, Box):
            now = node.box.cells
            cells |= {cell: now[key] for key, cell in old.cells.items() if key in now}
    run.life.data |= {cell: values[old] for old, cell in cells.items()}
    run.queue.renew(run.entered)
    for node in before:
        node.pending = tuple((cells[cell], value) for cell, value in node.pending if cell in cells)
        if node in run.entered:
            _set_deadline(run, node)
            if isinstance(node, BoxNode):
                _open_up(run, node)
    if not before:
        run.queue.put_off.append(nodes[""])
    run.life.early = True


def _open_up(run: ChartRun, node: BoxNode) -> None:
    """Let the next tick evaluate the rules of a box again, and start those that do not run yet.

    These are its new children, and those of a replacement before this one, if no tick followed it.
    """
    node.news = node.box.keeps
    if node.box.form != "states":
        new = [child for child in node.children.values() if child.status == IDLE]
        run.queue.put_off += new


def _set_deadline(run: ChartRun, node: RunNode) -> None:
    """Set the deadline by the new timeout, counted from the original entry."""
    node.deadline = NEVER_NS
    if node.vertex.timeout_ns is not None and node.since is not None:
        run.life.set_deadline(node, node.since + node.vertex.timeout_ns)
