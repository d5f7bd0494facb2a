"""A stand-alone VR application to try the link: a simulated user, by network, in real time.

    python -m hw.fakes.unity.vr_demo --host 192.168.0.5 --user brief --scene lab_a --requests 3

It sends the user's poses at 90 Hz, requests touches, lets go, and prints what it is shown.
"""

from __future__ import annotations

import argparse
import select
import sys
import time

from hw.fakes.unity.vr_application import FRAME_NS, Application
from hw.fakes.unity.vr_plays import Alone
from hw.people import open_user
from hw.scene import load_scene


def main(arguments: list[str] | None = None) -> int:
    """Run until the user has finished."""
    parser = argparse.ArgumentParser(prog="vr_demo", description=__doc__.partition("\n")[0])
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=10000)
    parser.add_argument("--user", default="brief")
    parser.add_argument("--scene", default="lab_a")
    parser.add_argument("--requests", type=int)
    given = parser.parse_args(arguments)
    scene = load_scene(given.scene)
    play = Alone(open_user(given.user, scene, given.requests))
    application = Application(given.host, given.port, play)
    due_ns = begun_ns = time.monotonic_ns()
    try:
        while not play.finished:
            now_ns = time.monotonic_ns()
            application.step(now_ns)
            for change in application.changes:
                sys.stdout.write(f"{(now_ns - begun_ns) * 1e-9:7.2f} s  {change}\n")
                sys.stdout.flush()
            application.changes.clear()
            due_ns = max(due_ns + FRAME_NS, now_ns)
            select.select([], [], [], max(0, due_ns - time.monotonic_ns()) * 1e-9)
    except KeyboardInterrupt:
        return 130
    finally:
        application.client.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
