"""Where subjects are run: by theme, a few places that are always tried, and many more by chance."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from dataclasses import replace

from tests.stress.elsewhere import Elsewhere
from tests.stress.subjects import ALL_NS, DAY_NS, EVER_NS, SUBJECTS, Subject

WALL_CLOCK_NS = 1_700_000_000_123_456_789
"""A stamp of November 2023: float64 counts it in steps of 256 ns."""
TURNS = (math.pi, -0.5 * math.pi, math.pi - 3.1, 2.0)
"""The third takes the yaws that most subjects begin with onto the seam."""

ALWAYS = {
    "moved": [
        Elsewhere(1e3, -7e2), Elsewhere(-9.1e3, 8.3e3), Elsewhere(1e6, -7e5), Elsewhere(3e6, 1e7),
    ],
    "turned": [Elsewhere(turn=turn) for turn in TURNS],
    "wound": [Elsewhere(windings=turns) for turns in (1, -3, 1000)],
    "later": [
        Elsewhere(since_ns=ns)
        for ns in (DAY_NS, WALL_CLOCK_NS, EVER_NS - DAY_NS, ALL_NS - DAY_NS)
    ],
    "rounded": [Elsewhere(single=True)],
}  # fmt: skip


def everywhere(subject: Subject) -> Elsewhere:
    """As much as the subject takes, at once."""
    turn = {"any": 2.7, "quarter": -0.5 * math.pi, "never": 0.0}[subject.turns]
    return Elsewhere(313.7, -77.1, turn, WALL_CLOCK_NS, min(1, subject.wound))


def _moved(chance: random.Random) -> Elsewhere:
    far, way = 10.0 ** chance.uniform(0.0, 7.0), chance.uniform(-math.pi, math.pi)
    return Elsewhere(far * math.cos(way), far * math.sin(way))


def _turned(chance: random.Random) -> Elsewhere:
    near = chance.choice((0.0, math.pi, -math.pi, 0.5 * math.pi))
    off = chance.choice((-1.0, 1.0)) * 10.0 ** chance.uniform(-300.0, 0.5)
    return Elsewhere(turn=math.remainder(near + off, math.tau))


def _wound(chance: random.Random) -> Elsewhere:
    return Elsewhere(windings=chance.randint(-1000, 1000))


def _later(chance: random.Random) -> Elsewhere:
    return Elsewhere(since_ns=chance.randint(0, ALL_NS - DAY_NS))


def _both(chance: random.Random) -> Elsewhere:
    return replace(_moved(chance), turn=_turned(chance).turn, since_ns=_later(chance).since_ns)


CHANCES: dict[str, Callable[[random.Random], Elsewhere]] = {
    "moved": _moved, "turned": _turned, "wound": _wound, "later": _later, "rounded": _both,
}  # fmt: skip
"""What else is tried in full, by theme."""


def cases(theme: str, count: int) -> list[tuple[Subject, Elsewhere]]:
    """Subjects with the places of a theme that they take, and `count` more by chance."""
    chance = random.Random(theme)
    more = [CHANCES[theme](chance) for _ in range(count)]
    return [(s, at) for s in SUBJECTS for at in (*ALWAYS[theme], *more) if s.takes(at)]
