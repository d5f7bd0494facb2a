"""Manners: how people treat a robot that is shown to them."""

from __future__ import annotations

import random
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Manner:
    """How a person behaves toward the robot; ranges of times in s, drawn from uniformly.

    `reaction_s`: how late they perceive the stop sign, drawn once per person. `leaves_s`: how long
    they stand before the shown robot until they walk away from it, None: as long as it is shown.
    `pause_s`: how long they stand after it is hidden.
    """

    name: str
    about: str
    reaction_s: tuple[float, float] = (0.3, 0.8)
    leaves_s: tuple[float, float] | None = (1.0, 3.0)
    pause_s: tuple[float, float] = (0.5, 3.0)

    def reaction(self, seed: int) -> float:
        """The reaction of the person with this seed, s."""
        return random.Random(f"reaction {seed}").uniform(*self.reaction_s)


ATTENTIVE = Manner("attentive", "stops at the sign after 0.3 to 0.8 s, and leaves the robot room")
INSTANT = Manner(
    "instant",
    "stops at the sign in the same instant, and stays there",
    reaction_s=(0.0, 0.0),
    leaves_s=None,
    pause_s=(3.0, 3.0),
)
