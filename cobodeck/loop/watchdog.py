"""Supervises a loop from outside: names what blocks a tick, and ends the run on a signal."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from cobodeck.loop.loop import Loop
from engine.machine import LeafNode

ROOT = Path(__file__).parent.parent.parent
ENGINE = str(ROOT / "engine")


@contextmanager
def ending_on_signals(loop: Loop) -> Iterator[None]:
    """Ctrl-C, TERM and HUP end the run in order; a second one interrupts a state that hangs."""
    signals = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    asked = False

    def end(number: int, _frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True
        loop.stop(signal.Signals(number).name)
        if loop.busy:  # os.write: the signal may have interrupted a print
            os.write(2, b"cobodeck: ending; once more breaks off a state that does not end\n")

    before = {number: signal.signal(number, end) for number in signals}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def naming_what_blocks(loop: Loop, after_s: float, tell: Callable[[str], None]) -> Iterator[None]:
    """Report each tick longer than `after_s`, once, with the node that blocks it and the line.

    A second thread looks whether the loop is still within the same tick, and inspects the stack of
    the thread that runs it, at no cost to the tick.
    """
    over, runner = threading.Event(), threading.get_ident()

    def watch() -> None:
        seen, since, told = None, 0, False
        while not over.wait(0.25 * after_s):
            tick = loop.now_ns if loop.busy else None
            if tick is None or tick != seen:
                seen, since, told = tick, time.perf_counter_ns(), False
                continue
            if not told and time.perf_counter_ns() - since > after_s * 1e9:
                frame = sys._current_frames().get(runner)
                if frame is not None and loop.busy and loop.now_ns == seen:
                    told = True
                    tell(f"tick at {loop.now_ns / 1e9:.2f} s is blocked by {blocker(frame)}")

    thread = threading.Thread(target=watch, name="watchdog", daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def blocker(frame: FrameType) -> str:
    """The node whose state is being stepped, its class, and the current line of its own code."""
    inner: FrameType | None = None
    outer: FrameType | None = frame
    while outer is not None:
        node: Any = outer.f_locals.get("node")
        if outer.f_code.co_filename.startswith(ENGINE) and isinstance(node, LeafNode):
            place = _place(inner) if inner is not None else "engine"
            return f"{node.path} ({node.leaf.interface.name}) at {place}"
        if not outer.f_code.co_filename.startswith(ENGINE):
            inner = outer
        outer = outer.f_back
    return _place(frame)


def _place(frame: FrameType) -> str:
    return f"{frame.f_code.co_filename}:{frame.f_lineno}"
