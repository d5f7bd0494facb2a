"""Mounting and scaling of four drives: the entry `wheels` of a connection.

wheels:
  nodes: [1, 2, 3, 4]      # front left, front right, rear left, rear right
  signs: [1, -1, 1, -1]    # -1: the motor turns the other way
  gear: 12.52              # turns of the motor per turn of the wheel
  unit: increments/s       # of the drives' velocities; or rpm, 0.1 rpm, mrpm
  increments: 4096         # per turn of the motor, for increments/s
  silence: 0.08            # s without our heartbeat, then the drives brake by themselves
  without: [0x6007]        # objects that the drives lack, after doing what the refusal says
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from hw.drivers.can.ds402 import REMEDIES, UNITS, Setting
from hw.drivers.can.mecanum import Rates

MASTER = 127
SILENCE = 0.08
"""Default time without a heartbeat after which a drive brakes by itself, s."""
COARSEST = 0.02
"""Greatest step of a velocity, m/s at the rim."""
MOST = 2**31 - 1
"""The greatest velocity or ramp that an object holds, units/s, units/s2."""
PER_TURN: Mapping[str, float] = {"rpm": 60.0, "0.1 rpm": 600.0, "mrpm": 60_000.0}
"""Units of a motor that turns once a second."""


@dataclass(frozen=True, slots=True)
class DriveNodes:
    """Drives front left, front right, rear left, rear right.

    `signs` are -1 for motors that turn the other way, `gear` is the motor revolutions per wheel
    revolution. Velocities are in `unit`, ramps in `unit` per second, with `increments` per motor
    revolution. `silence` is the time without a heartbeat of node `master` after which a drive
    brakes by itself, s. `without` are objects that the drives lack.
    """

    nodes: tuple[int, int, int, int]
    signs: tuple[int, int, int, int] = (1, 1, 1, 1)
    gear: float = 1.0
    increments: float = 4096.0
    master: int = MASTER
    silence: float = SILENCE
    unit: str = "increments/s"
    without: tuple[int, ...] = ()

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
        if isinstance(values.get("without"), tuple):  # these files have no hexadecimal numbers
            values["without"] = tuple(map(_number, values["without"]))
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
        if self.unit not in UNITS:
            return [f"unit {self.unit!r}: there are {', '.join(UNITS)}"]
        if not isinstance(self.without, tuple) or not set(self.without) <= set(REMEDIES):
            there = ", ".join(f"0x{index:04X}" for index in REMEDIES)
            return [f"without {self.without}: a list; what may be lacking: {there}"]
        return []

    def faults_at(self, radius: float, fastest: float, ramp: float) -> list[str]:
        """What a wheel cannot have with this unit: radius, m; fastest rate, rad/s; ramp, rad/s2."""
        step = radius / self.scale
        if step > COARSEST:
            return [
                f"unit {self.unit!r}, gear {self.gear:g}: one step is {step:.3f} m/s at the rim, "
                f"{COARSEST:g} m/s is most; choose a finer unit at the drives"
            ]
        if max(fastest, ramp) * self.scale > MOST:
            return [f"unit {self.unit!r}, gear {self.gear:g}: no object holds numbers as large"]
        return []

    def setting(self, brakes: float) -> Setting:
        """The initial settings of the drives; `brakes` is the wheels' ramp, rad/s2."""
        ramp = max(1, round(brakes * self.scale))
        silence_ms = round(1e3 * self.silence)
        return Setting(self.master, silence_ms, ramp, self.unit, frozenset(self.without))

    @property
    def scale(self) -> float:
        """Drive units per rad of the wheel."""
        return self.gear * PER_TURN.get(self.unit, self.increments) / (2.0 * math.pi)

    def counts(self, rates: Rates) -> list[int]:
        """Wheel rates, rad/s, in units/s of their drives."""
        return [
            sign * round(self.scale * rate) for sign, rate in zip(self.signs, rates, strict=True)
        ]

    def rate(self, number: int, count: int) -> float:
        """The wheel rate, rad/s, of a drive's velocity."""
        return self.signs[number] * count / self.scale


def _number(found: object) -> object:
    """A number such as `0x6007`, if that is what a text says."""
    try:
        return int(found, 0) if isinstance(found, str) else found
    except ValueError:
        return found


def _whole(found: object, most: int, length: int = 4) -> bool:
    return (
        isinstance(found, tuple)
        and len(found) == length
        and all(type(one) is int and 1 <= one <= most for one in found)
    )
