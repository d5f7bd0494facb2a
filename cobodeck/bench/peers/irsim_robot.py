"""A rectangle that drives, a disc that walks and four walls in ir-sim. Frozen."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

SCENE = Path(__file__).with_name("irsim_robot.yaml")
STEPS = 1500
SEED = 5
"""Of the walk: the first with which the two do not collide. Once they do, both stand, at a fifth of
the CPU, and what is measured is when."""


def prepare() -> Callable[[], float]:
    """Load the package; returns what simulates the first 50 s and tells the CPU, µs per 33 ms."""
    with redirect_stdout(StringIO()), redirect_stderr(StringIO()):  # it tells of missing windows
        import irsim

    def measure() -> float:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
            env = irsim.make(str(SCENE), display=False, log_level="ERROR", seed=SEED)
        begin = time.process_time()
        for _ in range(STEPS):
            env.step()
        return (time.process_time() - begin) / STEPS * 1e6

    return measure
