"""CPU of whole runs: how much of it, beside other simulators, and by part of a tick.

What other programs do disturbs a measurement one way only, so that the least of several counts.
"""

from __future__ import annotations

import math
import signal
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from inspect import CO_GENERATOR
from types import FrameType
from typing import Any

from cobodeck.loop import Loop
from cobodeck.run import simulate
from cobodeck.setup import Options, Setup

HZ = 30
"""CPU is told per 1/30 s of simulated time, which is a tick of the shipped robots."""
INTERVAL_S = 0.001
"""CPU between two samples, s, where the system's clock allows for it; often 4 ms."""
PHASES = {
    "cobodeck.loop.sample_router.": "samples",
    "cobodeck.evaluate.": "observers",
    "hw.": "plant",
    "engine.": "engine",
}
"""The parts of a tick by the outermost module that the loop has called."""
OWNERS = {"safety chain": "plant", "signals": "engine", "states": "engine"}
"""Parts within a part, told apart from it; the innermost of them counts."""
PARTS = ("loop", *PHASES.values(), *OWNERS)


def run_cpu(setup: Setup, options: Options) -> float:
    """Run once; returns the CPU of the loop, µs per 33 ms of simulated time."""
    return cpu_us(simulate(setup, options).figures)


def cpu_us(figures: Mapping[str, Any]) -> float:
    """The CPU of a run's loop from its figures, µs per 33 ms of simulated time."""
    return float(figures["cpu_us_per_tick"] * figures["ticks"] / (HZ * figures["sim_s"]))


def least_cpu(
    measures: Mapping[str, Callable[[], float]], unit: str, rounds: int
) -> dict[str, float]:
    """The least of several rounds of each measure, taking turns.

    `unit` is measured before each of the others, so that it meets the machine as they do.
    """
    found = dict.fromkeys(measures, math.inf)
    others = [name for name in measures if name != unit]
    turns = [turn for name in others for turn in (unit, name) if turn in measures]
    for name in turns * rounds:
        found[name] = min(found[name], measures[name]())
    return found


def shares(setup: Setup, options: Options) -> dict[str, float]:
    """Run once; the share of the loop's CPU by part, sampled: of N samples good to 1 / sqrt(N)."""
    sampler = Sampler()
    simulate(setup, options, around=sampler.sampling)
    total = sampler.counts.total()
    return {part: sampler.counts[part] / max(total, 1) for part in PARTS}


@dataclass(slots=True)
class Sampler:
    """Counts which part of a tick runs whenever some CPU has been spent."""

    counts: Counter[str] = field(default_factory=Counter)

    @contextmanager
    def sampling(self, _loop: Loop) -> Iterator[None]:
        """Sample meanwhile; in the main thread only, as Python's signals are."""
        before = signal.signal(signal.SIGPROF, self._sample)
        signal.setitimer(signal.ITIMER_PROF, INTERVAL_S, INTERVAL_S)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            signal.signal(signal.SIGPROF, before)

    def _sample(self, _signal: int, frame: FrameType | None) -> None:
        self.counts[part_of(frame)] += 1


def part_of(frame: FrameType | None) -> str:
    """The part of a tick to which a frame belongs, by what has called it.

    What a state computes is the state's, and a signal that it asks for is the signal's.
    """
    part, owners = "loop", []
    while frame is not None:
        module = f"{frame.f_globals.get('__name__', '')}."
        owners.append(_owner(module, frame))
        part = next((p for name, p in PHASES.items() if module.startswith(name)), part)
        frame = frame.f_back
    return next((owner for owner in owners if OWNERS.get(owner) == part), part)


def _owner(module: str, frame: FrameType) -> str:
    if module.startswith("hw.safety."):
        return "safety chain"
    if module.startswith("engine.signals."):
        return "signals"
    code = frame.f_code
    is_state = code.co_name == "run" and code.co_flags & CO_GENERATOR
    return "states" if is_state and module.startswith(("states.", "behaviors.")) else ""
