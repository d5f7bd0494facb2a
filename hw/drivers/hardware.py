"""What the chain process drives: wheels and bumper behind one bus or one socket.

A hardware is a class that is opened in the chain's process, and polled in its one thread: nothing
of it waits, and nothing raises because a device has failed. A lost or strange device is a fault.
"""

from __future__ import annotations

from typing import Protocol

from hw.geometry import Twist2
from hw.samples import BumperHit, Odometry


class Hardware(Protocol):
    """Wheels, and a bumper where there is one.

    Called with the values of its entry (`hardware` of the chain) and with `model`, the `BaseModel`
    of the robot. Stamps are those of `time.monotonic_ns`.
    """

    odometry: tuple[int, Odometry] | None
    """When the wheels last told their way, ns, and what; None: not yet."""

    fault: str | None
    """Why nothing may move, such as `drive 3: no heartbeat` or `bumper: front`; None: it may.

    It stays until `acknowledge`.
    """

    @property
    def ready(self) -> bool:
        """Would the wheels turn now? Not while they are stopped, or drives are being enabled."""
        ...

    def poll(self, now_ns: int) -> None:
        """Take all that has arrived, and look at ages; called in each cycle, before `drive`."""
        ...

    def hits(self) -> list[BumperHit]:
        """Touches of the foam since the last call."""
        ...

    def drive(self, velocity: Twist2, now_ns: int) -> None:
        """Have this velocity next, base frame; called in each cycle, 0 included.

        The drives follow it with no ramp of their own but their brakes (`brake_deceleration`).
        """
        ...

    def stop(self) -> None:
        """Brake by the drives' own quick stop, and stay so until `acknowledge`."""
        ...

    def acknowledge(self) -> bool:
        """Clear faults by the operator's order and let the wheels turn again; it moves nothing.

        False while a cause holds. What takes longer than a cycle goes on in `poll`; until it is
        done the fault stays, and it is not `ready`.
        """
        ...

    def close(self) -> None:
        """Stand, switch the drives off, and let go of the bus."""
        ...
