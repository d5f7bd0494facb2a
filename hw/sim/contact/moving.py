"""The interfaces of bases and arms whose motion the world computes."""

from __future__ import annotations

from typing import Protocol

from hw.geometry import Pose2, Twist2
from hw.interfaces import Arm, Base
from hw.safety import LocalChain
from hw.samples import ArmState


class MovingBase(Base, Protocol):
    """A base whose motion the world computes."""

    pose: Pose2
    twist: Twist2
    distance_m: float
    energy_j: float
    braked: bool
    chain: LocalChain | None

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        ...

    def block(self, pose: Pose2) -> None:
        """A solid obstacle stops the base at once, at this pose."""
        ...


class MovingArm(Arm, Protocol):
    """An arm whose motion the world computes."""

    state: ArmState
    braked: bool

    def advance(self, until_ns: int) -> None:
        """Move on to until_ns."""
        ...
