"""Where a run is in its chart, and how another run is set to that place.

A shadow follows the chart that runs, and a test begins in the middle of a run. Nodes are found by
their paths. What runs in both since the same instant goes on; what is entered so is recorded in no
trace, begins its work anew, and keeps the time of its entry, so that timeouts stay due when they
were. What the operator has set is taken over as well: a pause, the level of autonomy, locks.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Any

from engine.machine import (
    CHOSEN,
    ENDED,
    IDLE,
    NEVER_ENTERED,
    PUT_OFF,
    RETRYING,
    RUNNING,
    WAITING,
    BoxNode,
    LeafNode,
    RunNode,
)
from engine.run import ChartRun
from engine.state import NEVER_NS

ACTIVE = (CHOSEN, RUNNING, WAITING, RETRYING, PUT_OFF)


@dataclass(frozen=True, slots=True)
class ChartPlace:
    """Where a run is.

    Attributes:
        active: the active nodes, outer ones first, each with the chart time of its entry, ns, None
            before it.
        tries: the further tries made by these, other than none.
        kept: the outcomes kept by boxes, by name of the child.
        data: the values of the charts around active nodes, by path of the node and by key.
        paused_ns: for how long the run has been paused so far; `paused`: whether it is now, and
            `stepping` if that was but for one tick.
        level, locks: of autonomy; the paths that are locked.
    """

    active: Mapping[str, int | None]
    tries: Mapping[str, int] = field(default_factory=dict)
    kept: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    data: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    paused_ns: int = 0
    paused: bool = False
    stepping: bool = False
    level: int | None = None
    locks: tuple[str, ...] = ()


def place_of(run: ChartRun) -> ChartPlace:
    """Where a run is between two ticks."""
    active = [node for node in run.nodes.values() if node.status in ACTIVE]
    nodes = dict.fromkeys(n for node in active for n in (*reversed(_around(node)), node))
    boxes = [node for node in nodes if isinstance(node, BoxNode)]
    return ChartPlace(
        {node.path: node.since for node in nodes},
        {node.path: node.tries for node in nodes if node.tries},
        {box.path: dict(box.kept) for box in boxes if box.kept},
        {
            box.path: {key: run.life.data[cell] for key, cell in box.box.cells.items()}
            for box in boxes
            if box.box.cells
        },
        run.board.paused_ns,
        run.paused,
        run.stepping,
        run.judge.level,
        tuple(sorted(run.judge.locks)),
    )


def set_place(run: ChartRun, place: ChartPlace) -> None:
    """Let `run` go on from `place` with its next tick, as far as its chart has the same nodes.

    Its board has to be at the instant of the place. Of an active node that it lacks, the innermost
    node around it counts that it has. The outputs of kept outcomes are not taken over.
    """
    _set_operated(run, place)
    targets = _targets(run, place)
    around = dict.fromkeys(box for node in targets for box in reversed(_around(node)))
    same = [node for node in targets if node.since == place.active[node.path]]
    _leave(run, same, around)
    for box in around:
        if box.status != RUNNING:
            box.status, box.entered = RUNNING, run.board.ticks
            run.entered[box] = None
            if box.box.keeps:
                run.queue.insert(box)
        _set_entry(run, box, place)
        _set_content(run, box, place)
    for node in targets:
        if node.status not in ACTIVE:
            run.queue.choose(node)
        _set_entry(run, node, place)
    run.outcome, run.over = None, False
    run.life.early = True


def _set_operated(run: ChartRun, place: ChartPlace) -> None:
    """What the operator has set; commands that wait count for another place."""
    run.commands.clear()
    run.resume()
    run.board.paused_ns = place.paused_ns
    if place.paused:
        run.pause()
    run.stepping = place.stepping
    run.judge.level, run.judge.locks = place.level, set(place.locks)
    run.forget_routes()


def _around(node: RunNode) -> list[BoxNode]:
    """The boxes around a node, inner ones first."""
    found = []
    while node.parent is not None:
        node = node.parent
        assert isinstance(node, BoxNode)
        found.append(node)
    return found


def _targets(run: ChartRun, place: ChartPlace) -> list[RunNode]:
    """The innermost nodes of the place that the run's chart has."""
    known = [run.nodes[path] for path in place.active if path in run.nodes]
    outer = {box for node in known for box in _around(node)}
    return sorted((node for node in known if node not in outer), key=lambda node: node.order)


def _leave(run: ChartRun, same: list[RunNode], around: Collection[RunNode]) -> None:
    """Let all end, without a record, but what is around a target, and what stays and is below."""
    queue = run.queue
    queue.put_off = [node for node in queue.put_off if any(stays.spans(node) for stays in same)]
    for node in reversed(run.nodes.values()):
        kept = node in around or any(stays.spans(node) for stays in same)
        if kept or node.status == IDLE:
            continue
        if isinstance(node, LeafNode):
            run.life.close_leaf(node)
        queue.drop(node)
        run.entered.pop(node, None)
        node.status, node.step, node.deadline, node.entered = IDLE, None, NEVER_NS, NEVER_ENTERED


def _set_entry(run: ChartRun, node: RunNode, place: ChartPlace) -> None:
    """Let a node have been entered when it was, with the tries that it had."""
    node.since = place.active.get(node.path)
    node.tries = place.tries.get(node.path, 0)
    timeout = node.vertex.timeout_ns
    node.deadline = NEVER_NS
    if timeout is not None and node.since is not None:
        run.life.set_deadline(node, node.since + timeout)


def _set_content(run: ChartRun, box: BoxNode, place: ChartPlace) -> None:
    """The values and the kept outcomes of a box."""
    values = place.data.get(box.path, {})
    run.life.data |= {c: values[key] for key, c in box.box.cells.items() if key in values}
    kept = {n: o for n, o in place.kept.get(box.path, {}).items() if n in box.children}
    if kept == box.kept or not box.box.keeps:
        return
    for name in {*kept, *box.kept}:
        box.children[name].status = ENDED if name in kept else IDLE
    box.kept, box.news = kept, True
