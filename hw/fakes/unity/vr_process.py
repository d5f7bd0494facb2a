"""The process of a fake VR application whose user is hosted by a world; see `peers.VrClient`."""

from __future__ import annotations

import select
import time
from collections.abc import Mapping
from typing import Any

from hw.fakes.unity.vr_application import FAULTS, FRAME_NS, Application
from hw.fakes.unity.vr_plays import HostedPerson
from hw.ipc import DEVICES, Intake, Parent, Ready, serve


def main(settings: Mapping[str, Any], ready: Ready, parent: Parent) -> None:
    """Run the process; faults come by name to `control`."""
    given = dict(settings)
    control, play = Intake(("fault",)), HostedPerson(given.pop("tells")["vr_client"])
    faults = sorted(given.pop("faults"))
    application = Application(play=play, **given)
    begun_ns: int | None = None
    ready({"control": control.door("fault")})
    due_ns = time.monotonic_ns()
    try:
        while not select.select([parent], [], [], max(0, due_ns - time.monotonic_ns()) * 1e-9)[0]:
            now_ns = time.monotonic_ns()
            for datagram in control.poll():
                application.fault = datagram.name if datagram.name in FAULTS else application.fault
            if begun_ns is None and application.robot is not None:
                begun_ns = now_ns
            while faults and begun_ns is not None and now_ns - begun_ns >= faults[0][0] * 1e9:
                application.fault = faults.pop(0)[1]
            application.step(now_ns)
            application.changes.clear()
            due_ns = max(due_ns + FRAME_NS, now_ns)
    finally:
        application.client.close()
        play.close()
        control.close()


if __name__ == "__main__":
    serve(main, DEVICES)
