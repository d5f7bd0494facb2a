"""The options with which a run was requested."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TextIO

from cobodeck.terminal import behind_record
from hw.connection import Connection
from hw.people.recorded import Heading, Up

FULL = 2
"""From this tier on there are all sensors: the base localizes itself."""
REFERENCE = 3
"""The tier that moves base and arm by physics."""
LONGEST_S = 3600.0
"""A run ends after this time if its user never finishes, s."""


def longest_s(requests: int | None) -> float:
    """The time after which a run ends for which none is given, s: three minutes per request."""
    return max(LONGEST_S, 180.0 * (requests or 0))


@dataclass(frozen=True, slots=True)
class Options:
    """How to run.

    `duration_s` limits the run, s; `stretch_m` enlarges a recorded walk to this size, m, `heading`
    is how its headings are computed, `up` its axis that is up; `eager` computes every signal in
    every tick and leaves no tick out; `mock` takes the mocked robot, `connection` the real parts
    that it names. `console` is the operator's input, None without an operator; `unwatched` accepts
    that no part tracks people, because nobody is near. `timed`: measure where computing time goes.
    """

    user: str | None = None
    requests: int | None = None
    stretch_m: float | None = None
    heading: Heading = "centred"
    up: Up | None = None
    tier: int = 1
    seed: int = 0
    duration_s: float = LONGEST_S
    eager: bool = False
    frozen_base: bool = False
    mock: bool = False
    connection: Connection | None = None
    console: TextIO | None = None
    unwatched: bool = False
    timed: bool = False

    @property
    def plays_dummy(self) -> bool:
        """True if the person is replayed from a record."""
        return self.user is not None and behind_record(self.user) is not None
