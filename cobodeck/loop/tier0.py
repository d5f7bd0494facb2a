"""Tier 0: the logic of a chart alone, without robot, room, user or signals.

Every leaf ends after a random time with a random outcome, drawn from its own stream of the seed, so
that a run quickly takes many paths through a chart, and the same paths for the same seed.
"""

from __future__ import annotations

import random
from functools import partial
from typing import Any

from cobodeck.loop.sample_router import Inlet
from cobodeck.loop.wiring import Wired
from cobodeck.setup import Setup
from engine import NEVER_NS, Context, Run as Steps, State, Until
from engine.machine import Leaf, Substitute, perhaps
from engine.run import ChartRun
from engine.signals import Board

DWELL_S = 5.0
"""Mean of the exponentially distributed time for which a leaf runs, s."""


class Wandering(State):
    """Stands in for a leaf's state."""

    def __init__(self, leaf: Leaf, chance: random.Random, **_parameters: Any) -> None:
        self.leaf = leaf
        self.chance = chance

    def run(self, ctx: Context, **_inputs: Any) -> Steps:
        """Wait, then end with any outcome; without outcomes, wait forever."""
        interface = self.leaf.interface
        if not interface.outcomes:
            yield Until(NEVER_NS)
        yield Until(ctx.after(self.chance.expovariate(1.0 / DWELL_S)))
        outcome = self.chance.choice(interface.outcomes)
        outputs = dict.fromkeys(interface.outputs.get(outcome, ()))
        return (outcome, outputs) if outputs else outcome


class _Idle:
    """A part that does nothing."""

    def stop(self) -> None:
        """Do nothing; it never moves."""


def wander(setup: Setup, seed: int) -> Wired:
    """A run of the setup's chart in which every leaf ends at random."""
    machine = setup.machine()
    stand_ins = {}
    for leaf in machine.leaves:
        chance = random.Random(f"{seed}/{leaf.path}")
        make = partial(Wandering, leaf, chance)
        stand_ins[leaf.path] = Substitute(make, perhaps(leaf.interface.outputs))
    parts = {name: _Idle() for leaf in machine.leaves for name in leaf.interface.commands}
    board = Board(setup.signals, ())
    return Wired(ChartRun(machine, board, parts, stand_ins=stand_ins), board, Inlet(board))
