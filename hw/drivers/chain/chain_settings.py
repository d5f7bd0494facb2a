"""The settings with which the engine starts the process of the safety chain."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from hw.drivers.observer_key import key_in
from hw.ipc import Address, Door, is_loopback
from hw.model import BaseModel, MotionLimits, Tracking
from hw.safety import SafetyLimits

LEAST_HZ, MOST_HZ = 100, 1000
OBSERVER_S = 0.5
OBSERVER_KEYS = ("host", "port", "timeout", "key")
KEYLESS = (
    "at {host} anybody could speak for the observer: name the file of a key, `key: FILE`; "
    "`cobodeck observe --new-key FILE` makes one, for both machines"
)
SOURCES = ("engine", "arm", "vr")
"""Who sends to the chain's own address."""


@dataclass(frozen=True, slots=True)
class ObserverSettings:
    """Address for the observer's program, its key, and its longest silence, s (R55)."""

    address: Address
    key: bytes = field(repr=False)
    timeout: float = OBSERVER_S

    @classmethod
    def of(cls, given: Mapping[str, Any], chain: Address) -> ObserverSettings:
        """From the entry `observer` of a connection; by default at the port after the chain's.

        Raises:
            ValueError: an unknown entry, or no key for an observer on another machine; OSError: the
                file of the key cannot be read.
        """
        strange = given.keys() - set(OBSERVER_KEYS)
        if strange:
            raise ValueError(
                f"chain: observer: {', '.join(sorted(strange))}; known: {', '.join(OBSERVER_KEYS)}"
            )
        host, port = observer_address(given, chain)
        if "key" not in given and not is_loopback(host):
            raise ValueError(f"chain: observer: {KEYLESS.format(host=host)}")
        key = key_in(given.get("key"))
        return cls((host, port), key, float(given.get("timeout", OBSERVER_S)))


def observer_address(given: Mapping[str, Any], chain: Address) -> Address:
    """The address of the observer's port, given the entry `observer` and the chain's address."""
    return str(given.get("host", chain[0])), int(given.get("port", chain[1] + 1))


@dataclass(frozen=True, slots=True)
class ChainSettings:
    """See the module.

    `address` is the chain's own, `secret` that of its doors, `engine` the door for
    its reports. `hardware` is module, class and arguments of the wheels. `arm`: an arm must report
    its link; `observer`: None if none is required.
    """

    address: Address
    secret: bytes = field(repr=False)
    engine: Door
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
