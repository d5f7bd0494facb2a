"""The settings with which the engine starts the process of the safety chain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hw.links.datagrams import Address
from hw.robot import BaseModel, MotionLimits
from hw.safety.limits import SafetyLimits
from hw.tracking import Tracking

LEAST_HZ, MOST_HZ = 100, 1000
OBSERVER_S = 0.5


@dataclass(frozen=True, slots=True)
class ObserverSettings:
    """Address for the observer's program, and its longest silence, s (R55)."""

    address: Address
    timeout: float = OBSERVER_S


@dataclass(frozen=True, slots=True)
class ChainSettings:
    """See the module.

    `address` is the chain's own, `engine` that of its reports. `hardware` is module, class and
    arguments of the wheels. `arm`: an arm must report its link; `observer`: None if none is
    required.
    """

    address: Address
    engine: Address
    hardware: tuple[str, str, Mapping[str, Any]]
    model: BaseModel
    motion: MotionLimits
    safety: SafetyLimits
    tracking: Tracking
    rate: int = LEAST_HZ
    arm: bool = True
    observer: ObserverSettings | None = None

    def __post_init__(self) -> None:
        if not LEAST_HZ <= self.rate <= MOST_HZ:
            raise ValueError(f"chain: a rate of {self.rate} Hz; {LEAST_HZ} to {MOST_HZ}")
        if self.observer is not None and not 0.2 <= self.observer.timeout <= OBSERVER_S:
            raise ValueError(
                f"chain: observer: a timeout of {self.observer.timeout:g} s; 0.2 to {OBSERVER_S}"
            )
