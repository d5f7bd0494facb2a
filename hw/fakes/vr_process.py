"""The process of a fake VR application whose user is hosted by a world; see `hw.fakes.vr`."""

from __future__ import annotations

import select
import time
from dataclasses import dataclass

from hw.fakes.vr_application import FRAME_NS, Application
from hw.fakes.vr_plays import Hosted
from hw.geometry import Pose3
from hw.links.datagrams import Address, Intake
from hw.links.processes import Parent, Ready, serve


@dataclass(frozen=True, slots=True)
class Settings:
    """Where the robot's server is, and the world; see `Application`."""

    server: Address
    world: Address
    trackers: tuple[str, ...]
    map_from_vive: Pose3
    offset_ns: int
    answers: bool
    by_fields: bool


def main(settings: Settings, ready: Ready, parent: Parent) -> None:
    """The process."""
    intake = Intake()
    play = Hosted(settings.world, intake)
    application = Application(
        *settings.server,
        play,
        settings.trackers,
        settings.map_from_vive,
        settings.offset_ns,
        settings.answers,
        settings.by_fields,
    )
    ready({"intake": list(intake.address)})
    due_ns = time.monotonic_ns()
    try:
        while not select.select([parent], [], [], max(0, due_ns - time.monotonic_ns()) * 1e-9)[0]:
            now_ns = time.monotonic_ns()
            application.step(now_ns)
            for fault in play.faults:
                application.fault = fault
            play.faults.clear()
            due_ns = max(due_ns + FRAME_NS, now_ns)
    finally:
        application.client.close()
        play.close()
        intake.close()


if __name__ == "__main__":
    serve(main)
