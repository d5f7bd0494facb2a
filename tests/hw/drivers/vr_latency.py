"""How long a pose takes through the server of the VR link; prints figures, asserts nothing.

    python -m tests.hw.drivers.vr_latency [SECONDS]

90 times a second a client writes a pose field by field, 15 writes, on a socket with Nagle's
algorithm on; from the first write until the datagram for engine and chain has arrived. Meanwhile
the robot is shown to it, 10 or 125 times a second, or not at all.
"""

from __future__ import annotations

import select
import sys
import time

from hw.fakes.unity.unity_client import ODOMETRY, POSE, Client, pose
from hw.geometry import Pose2, Twist2
from hw.ipc.datagrams import Intake
from hw.samples import RobotView
from tests.hw.drivers.unity.unity_rig import Rig

HZ = 90
UPRIGHT = (0.0, 0.0, 0.0, 1.0)


def measure(seconds: float, shown_hz: int) -> list[float]:
    """Times through the server, ms, sorted."""
    intake = Intake(("vr",))
    rig = Rig(tells=intake)
    published = {"vr/head": POSE, "vr/tailbone": POSE}
    client = Client(*rig.link.address, published, {"robot/pose": ODOMETRY})
    found, due = [], time.monotonic_ns()
    try:
        for frame in range(round(seconds * HZ)):
            client.poll()
            begun = time.monotonic_ns()
            for topic, height in (("vr/head", 1.7), ("vr/tailbone", 1.0)):
                begun = time.monotonic_ns()
                at = pose((1.0, 2.0, height + frame * 1e-6), UPRIGHT)
                client.send(topic, [*client.header(begun, "map"), *at])
            took = _arrival(intake, begun)
            if took is not None:
                found.append(took)
            if shown_hz and frame % max(1, HZ // shown_hz) == 0:
                view = RobotView(Pose2(0.0, 0.0), Twist2(0.0), (0.0,) * 6, True, False)
                for _ in range(max(1, shown_hz // HZ)):
                    rig.link.show(time.monotonic_ns(), view)
            due += 10**9 // HZ
            select.select([], [], [], max(0, due - time.monotonic_ns()) * 1e-9)
    finally:
        client.close()
        rig.close()
        intake.close()
    return sorted(found)


def _arrival(intake: Intake, begun_ns: int) -> float | None:
    """When the pose has come, ms after begun_ns; None: not within 100 ms."""
    while (left := 0.1 - (time.monotonic_ns() - begun_ns) * 1e-9) > 0.0:
        select.select([intake], [], [], left)
        came = time.monotonic_ns()
        if any(told.name == "user.pose" for told in intake.poll()):
            return (came - begun_ns) * 1e-6
    return None


def main() -> None:
    """Measure and print."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
    print("shown at    n     p50     p95     p99     max ms")  # noqa: T201
    for hz in (0, 10, 125):
        times = measure(seconds, hz)
        shares = [times[int(share * (len(times) - 1))] for share in (0.5, 0.95, 0.99, 1.0)]
        print(f"{hz:5} Hz {len(times):6}" + "".join(f"{value:8.2f}" for value in shares))  # noqa: T201


if __name__ == "__main__":
    main()
