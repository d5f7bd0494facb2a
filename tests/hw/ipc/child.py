"""A child for the tests: does what its settings say."""

import os
import select
from pathlib import Path

from hw.ipc.priority import SENSES
from hw.ipc.processes import serve


def main(settings, ready, parent):
    if settings == "refuse":
        raise OSError("no such device: can7")
    if settings == "die":
        os._exit(3)
    os.write(1, b"this goes to stderr")
    ready({"pid": os.getpid(), "settings": settings})
    if settings == "run away":
        while os.sched_getscheduler(0) != os.SCHED_OTHER | os.SCHED_RESET_ON_FORK:
            pass
    select.select([parent], [], [])
    if isinstance(settings, dict) and "leave" in settings:
        Path(settings["leave"]).write_text("stood still")


if __name__ == "__main__":
    serve(main, SENSES, locked=True)
