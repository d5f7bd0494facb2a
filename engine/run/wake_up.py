"""When a state that has yielded is stepped next: at an instant, on news, or on silence (rule 2)."""

from __future__ import annotations

from typing import Any

from engine.machine import AT_ONCE, EVERY_TICK, LeafNode, RunNode, shown
from engine.run.errors import escaped
from engine.run.life import Life
from engine.signals import Board
from engine.state import NEVER_NS, On, Until
from engine.state_class import WAITS


def wait(node: RunNode, yielded: Any, life: Life) -> None:
    """Apply what a state has yielded: `Until`, `On` or a note.

    Raises:
        TypeError: it is none of these.
        LookupError: it names a signal that is not among the state's `reads`.
    """
    kind, board = type(yielded), life.board
    if kind is str:
        life.notes[node.path] = escaped(yielded)
        return
    node.silence = None
    if kind is Until:
        later = yielded.ns > board.chart_now
        node.wake, node.mask = (yielded.ns, 0) if later else (EVERY_TICK, 0)
        return
    if kind is not On:
        raise TypeError(f"yielded {shown(yielded)}, which means nothing; {_right_for(yielded)}")
    assert isinstance(node, LeafNode)
    node.wake, node.mask = max(yielded.until, AT_ONCE), node.context.bits(yielded.signals)
    node.asked = board.ticks
    if yielded.older != NEVER_NS:
        for name in yielded.signals:
            board.accept(name, yielded.older)
        node.silence = yielded, board.now
        still_heard(node, board)


def _right_for(yielded: Any) -> str:
    """What a state should have yielded instead."""
    if type(yielded) is float:
        return f"to wait so many s, yield Until(ctx.after({yielded}))"
    if type(yielded) is int:
        return "to wait until an instant in ns, yield Until(…); for some s, Until(ctx.after(…))"
    return WAITS


def still_heard(node: RunNode, board: Board) -> bool:
    """Whether a leaf that waits for silence has to go on waiting; sets its next wake-up.

    That is when one of the signals will have been silent for too long if nothing arrives; whatever
    has arrived since postpones it. The `until` of its `On` is the latest.
    """
    if node.silence is None:
        return False
    node.wake = wakes_at(node, board)
    return node.wake > board.chart_now


def wakes_at(node: RunNode, board: Board, steady: int = 0) -> int:
    """The chart time, ns, of the end of a wait for silence, if nothing but `steady` arrives.

    `steady` has the bits of signals that are going to be repeated, and thus never silent.
    """
    assert node.silence is not None
    on, since = node.silence
    silent_at = board.silent_at(node.mask & ~steady, on.older, since) - board.paused_ns
    return max(AT_ONCE, min(on.until, silent_at))
