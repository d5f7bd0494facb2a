"""Mounting and scaling of four drives: the entry `wheels` of a connection."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from hw.drivers.can.mecanum import Rates

MASTER = 127
SILENCE = 0.08
"""Default time without a heartbeat after which a drive brakes by itself, s."""


@dataclass(frozen=True, slots=True)
class DriveNodes:
    """Drives front left, front right, rear left, rear right.

    `signs` are -1 for motors that turn the other way, `gear` is the motor revolutions per wheel
    revolution, `increments` drive units per motor revolution (velocities are in units/s). `silence`
    is the time without a heartbeat of node `master` after which a drive brakes by itself, s.
    """

    nodes: tuple[int, int, int, int]
    signs: tuple[int, int, int, int] = (1, 1, 1, 1)
    gear: float = 1.0
    increments: float = 4096.0
    master: int = MASTER
    silence: float = SILENCE

    @classmethod
    def of(cls, entry: Mapping[str, Any]) -> DriveNodes:
        """From a connection file.

        Raises:
            ValueError: an invalid entry, with a suggestion.
        """
        names = {field.name for field in fields(cls)}
        strange = sorted(set(entry) - names)
        if strange:
            raise ValueError(f"wheels: {strange[0]!r} is not known; there are {sorted(names)}")
        if "nodes" not in entry:
            raise ValueError("wheels: the key 'nodes' is missing, such as nodes: [1, 2, 3, 4]")
        values: dict[str, Any] = {
            k: tuple(v) if isinstance(v, list) else v for k, v in entry.items()
        }
        made = cls(**values)
        for wrong in made.faults():
            raise ValueError(f"wheels: {wrong}")
        return made

    def faults(self) -> list[str]:
        """Invalid values."""
        nodes, signs = self.nodes, self.signs
        numbers = (self.gear, self.increments, self.silence)
        if not _whole(nodes, 126) or len(set(nodes)) != 4:
            return [f"nodes {nodes}: four different numbers from 1 to 126"]
        if not isinstance(signs, tuple) or len(signs) != 4 or any(s not in (1, -1) for s in signs):
            return [f"signs {signs}: four times 1 or -1"]
        if not _whole((self.master,), 127, 1) or self.master in nodes:
            return [f"master {self.master}: a number from 1 to 127 that no drive has"]
        if not all(isinstance(one, int | float) and 0.0 < one < math.inf for one in numbers):
            return ["gear, increments and silence are above 0"]
        if not 0.03 <= self.silence <= 0.1:
            return [f"silence {self.silence} s: 0.03 to 0.1 s"]
        return []

    @property
    def scale(self) -> float:
        """Drive units per rad of the wheel."""
        return self.gear * self.increments / (2.0 * math.pi)

    @property
    def silence_ms(self) -> int:
        """`silence` in whole ms."""
        return round(1e3 * self.silence)

    def counts(self, rates: Rates) -> list[int]:
        """Wheel rates, rad/s, in units/s of their drives."""
        return [
            sign * round(self.scale * rate) for sign, rate in zip(self.signs, rates, strict=True)
        ]

    def rate(self, number: int, count: int) -> float:
        """The wheel rate, rad/s, of a drive's velocity."""
        return self.signs[number] * count / self.scale


def _whole(found: object, most: int, length: int = 4) -> bool:
    return (
        isinstance(found, tuple)
        and len(found) == length
        and all(type(one) is int and 1 <= one <= most for one in found)
    )
