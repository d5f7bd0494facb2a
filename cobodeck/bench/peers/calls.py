"""Counts the steps that a peer makes, and wraps its ticks for the harness."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cobodeck.bench.harness import Work

LEAVES = 1000


class Calls:
    """Step functions for a peer, which count their calls."""

    def __init__(self) -> None:
        self.count = 0

    def busy(self, *_: Any) -> bool:
        """A step after which nothing changes."""
        self.count += 1
        return False

    def ends(self, *_: Any) -> bool:
        """A step that ends its state."""
        self.count += 1
        return True


def work(tick: Callable[[], Any], calls: Calls) -> Work:
    """Ticks of a peer as work; `calls` is attached for the test that compares counts."""

    def run(count: int) -> None:
        for _ in range(count):
            tick()

    run.calls = calls  # type: ignore[attr-defined]
    return Work(run)
