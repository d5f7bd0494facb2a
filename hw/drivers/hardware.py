"""The interface of the hardware that the chain's process drives: wheels and bumper.

It is opened in that process and polled in its single thread: no call waits, and none raises because
a device has failed. A lost device, or one that misbehaves, is a fault.
"""

from __future__ import annotations

from typing import Protocol

from hw.geometry import Twist2
from hw.samples import BumperHit, Odometry


class Hardware(Protocol):
    """Wheels, with a bumper if there is one.

    Constructed with the values of its entry (`hardware` of the chain) and with `model`, the
    `BaseModel` of the robot. Stamps are those of `time.monotonic_ns`.
    """

    odometry: tuple[int, Odometry] | None
    """Stamp, ns, and value of the newest odometry; None before the first."""

    fault: str | None
    """Why nothing may move, such as `drive 3: no heartbeat` or `bumper: front`; else None.

    It stays until `acknowledge`.
    """

    @property
    def ready(self) -> bool:
        """True if the wheels would turn now: not stopped, and all drives enabled."""
        ...

    def poll(self, now_ns: int) -> None:
        """Take all that has arrived, and check ages; called in each cycle, before `drive`."""
        ...

    def hits(self) -> list[BumperHit]:
        """Touches of the foam since the last call."""
        ...

    def remarks(self) -> list[str]:
        """What the operator should know and nothing stops for, since the last call."""
        ...

    def drive(self, velocity: Twist2, now_ns: int) -> None:
        """Set the next velocity, base frame; called in each cycle, 0 included.

        The drives follow it without ramps of their own except the brakes
        (`brake_deceleration`).
        """
        ...

    def stop(self) -> None:
        """Brake by the drives' own quick stop, and stay stopped until `acknowledge`."""
        ...

    def acknowledge(self) -> bool:
        """Clear faults on the operator's order and enable the wheels; nothing moves.

        False while a cause persists. What takes longer than a cycle goes on in `poll`; until then
        the fault stays, and it is not `ready`.
        """
        ...

    def close(self) -> None:
        """Stop, switch the drives off, and close the bus."""
        ...
