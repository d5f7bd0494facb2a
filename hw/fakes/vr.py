"""The VR application beside a run on fakes: `{driver: "hw.fakes.vr:VrClient", tells: world, …}`."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from hw.connection import Opening
from hw.fakes.vr_application import FAULTS
from hw.fakes.vr_process import Settings
from hw.links.datagrams import Outlet
from hw.links.processes import Child


class VrClient:
    """A process that connects to the VR link at host:port, as soon as it can.

    Args:
        host: of the link's server.
        port: of it.
        tells: the world that hosts the person.
        opening: of the run; gives the tracking frame and the trackers.
        now: of the run; not needed.
        clock_offset: its clock less ours, s.
        answers: whether it answers questions for its clock.
        by_fields: whether it writes each field by itself, as Unity does.
    """

    def __init__(  # noqa: PLR0913
        self,
        host: str,
        port: int,
        tells: Any,
        opening: Opening,
        now: Callable[[], int] | None = None,  # noqa: ARG002
        clock_offset: float = 0.0,
        answers: bool = True,
        by_fields: bool = True,
    ) -> None:
        tracking = opening.tracking
        self._outlet = Outlet("test")
        settings = Settings(
            (host, port),
            tells.address,
            tuple(tracking.mounts),
            tracking.map_from_vive,
            round(clock_offset * 1e9),
            answers,
            by_fields,
        )
        self._child = Child("hw.fakes.vr_process", settings)

    def wait(self) -> None:
        """Until it runs; it connects when the server is there."""
        host, port = self._child.wait()["intake"]
        self._outlet.addresses = [(host, port)]

    def fault(self, name: str) -> None:
        """Have something go wrong; see `hw.fakes.vr_application`.

        Raises:
            ValueError: there is no such fault.
        """
        if name not in FAULTS:
            raise ValueError(f"fault: {name!r} is none of {', '.join(FAULTS)}")
        self._outlet.send("fault", time.monotonic_ns(), name)

    @property
    def pid(self) -> int:
        """Its number."""
        return self._child.pid

    def close(self) -> None:
        """End it."""
        self._child.close()
        self._outlet.close()
