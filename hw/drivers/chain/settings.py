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

    @classmethod
    def of(cls, given: Mapping[str, Any], chain: Address) -> ObserverSettings:
        """From the entry `observer` of a connection; by default at the chain's own address.

        Raises:
            ValueError: an unknown key.
        """
        strange = given.keys() - {"host", "port", "timeout"}
        if strange:
            raise ValueError(
                f"chain: observer: {', '.join(sorted(strange))}; known: host, port, timeout"
            )
        address = str(given.get("host", chain[0])), int(given.get("port", chain[1]))
        return cls(address, float(given.get("timeout", OBSERVER_S)))


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


def hardware_of(given: Mapping[str, Any]) -> tuple[str, str, dict[str, Any]]:
    """Module, class and arguments of the entry `hardware` of a connection.

    Raises:
        ValueError: it names no driver.
    """
    values = dict(given)
    module, _, name = str(values.pop("driver", "")).partition(":")
    if not module or not name:
        raise ValueError('chain: hardware: write driver: "module:Class"')
    return module, name, values
