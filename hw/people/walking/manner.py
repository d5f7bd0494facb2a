"""Manners: how people treat the robot, and what they do between two requests."""

from __future__ import annotations

import random
from dataclasses import dataclass, replace
from typing import Literal

from engine.files import did_you_mean, mistake

Attack = Literal["cut", "circle", "shadow", "lurk", "grab", "back"]
"""How a random person tries to be touched by the robot: see `Attacker`."""
Errand = Literal["wander", "pursue", "look"] | Attack
"""What a random person does between requests: walk about, approach the robot, look at things."""


@dataclass(frozen=True, slots=True)
class Manner:
    """How a person behaves toward the robot; ranges of times in s, drawn from uniformly.

    `reaction_s`: how late they perceive the stop sign, drawn once per person, None: they ignore it.
    `leaves_s`: how long they stand before the shown robot until they walk away from it, None: as
    long as it is shown. `pause_s`: how long they stand after it is hidden. `hurries`: they walk on
    the moment they have let go, without pauses. `errand` and `speeds`, a range in m/s: of random
    people.
    """

    name: str
    about: str
    reaction_s: tuple[float, float] | None = (0.3, 0.8)
    leaves_s: tuple[float, float] | None = (1.0, 3.0)
    pause_s: tuple[float, float] = (0.5, 3.0)
    hurries: bool = False
    errand: Errand = "wander"
    speeds: tuple[float, float] = (0.5, 1.5)

    def reaction(self, seed: int) -> float | None:
        """The reaction of the person with this seed, s; None: they ignore the sign."""
        if self.reaction_s is None:
            return None
        return random.Random(f"reaction {seed}").uniform(*self.reaction_s)


ATTENTIVE = Manner("attentive", "Stops at the sign 0.3 to 0.8 s late, and leaves the robot room.")
HASTY = Manner(
    "hasty",
    "As attentive, but without pauses, and walks off the moment they let go.",
    pause_s=(0.0, 0.0),
    hurries=True,
)
DEAF = Manner("deaf", "Ignores the sign.", reaction_s=None)
PURSUER = Manner("pursuer", "As attentive, but walks at the robot itself.", errand="pursue")
CURIOUS = Manner(
    "curious", "As attentive, but looks about, and walks up to things and the robot.", errand="look"
)
INSTANT = Manner(
    "instant",
    "Stops at the sign in the same instant, and stays while it is shown.",
    reaction_s=(0.0, 0.0),
    leaves_s=None,
    pause_s=(3.0, 3.0),
)


def _attacker(name: str, about: str, errand: Attack) -> Manner:
    """Somebody who tries to be touched; 1.6 m/s is the speed of walking of ISO 13855."""
    return Manner(
        name,
        f"Tries to be touched, the sign ignored: {about}.",
        reaction_s=None,
        hurries=True,
        errand=errand,
        speeds=(0.8, 1.6),
    )


ATTACKERS = (
    _attacker("cutter", "cuts across just ahead of the robot", "cut"),
    _attacker("circler", "walks around the robot, closer and closer", "circle"),
    _attacker("shadow", "follows close behind, then darts at the robot", "shadow"),
    _attacker("lurker", "waits at a wall until the robot is near, then darts at it", "lurk"),
    _attacker("grabber", "asks for a touch, and goes for the arm while it reaches", "grab"),
    _attacker("backer", "walks backwards into the robot", "back"),
)
_PEOPLE = (ATTENTIVE, HASTY, DEAF, PURSUER, CURIOUS, INSTANT, *ATTACKERS)
MANNERS = {manner.name: manner for manner in _PEOPLE}


def at_speed(manner: Manner, speed: float) -> Manner:
    """The manner of somebody who always walks at this speed, m/s."""
    return replace(manner, name=f"{manner.name} at {speed:g} m/s", speeds=(speed, speed))


def manner_named(name: str, source: str, *, wanders: bool) -> Manner:
    """The manner with this name; `wanders`: of a random person, the only ones with errands.

    Raises:
        FileError: of the source: there is no such kind of person.
    """
    known = {key: manner for key, manner in MANNERS.items() if wanders or manner.errand == "wander"}
    if name in known:
        return known[name]
    if name in MANNERS:
        raise mistake(source, f"only random people can be {name}; write random:{name}")
    raise mistake(source, f"'{name}' is no kind of person", hint=did_you_mean(name, known))
