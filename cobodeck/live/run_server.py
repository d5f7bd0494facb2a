"""The child process that serves the pages of a run, from its feed, until that ends."""

from __future__ import annotations

import asyncio
import os
import socket
from contextlib import suppress
from typing import Any

from cobodeck.live.access import PageAddress
from cobodeck.live.server import PageServer, serve
from cobodeck.live.sources import LiveSource
from cobodeck.project import catalogue
from cobodeck.terminal import Problem
from hw.ipc import Parent, Ready, serve as serve_parent

NICE = 10
"""How far it stands back behind others of its session: no further, as a stop must not wait. The run
and its devices go before it by their real-time priorities."""
LIMIT = 1 << 20
"""Of the feed, so much is read ahead, bytes."""


def main(settings: Any, ready: Ready, parent: Parent) -> None:  # noqa: ARG001
    """Serve; see `hw.ipc`. The feed ends with the parent."""
    os.nice(NICE)
    with suppress(Problem):  # as told when the run is shown
        catalogue()  # imported now, before the clock of the run
    asyncio.run(_serve_feed(settings, ready))


async def _serve_feed(settings: Any, ready: Ready) -> None:
    feed = socket.socket(fileno=settings["feed"])
    reader, writer = await asyncio.open_unix_connection(sock=feed, limit=LIMIT)
    source = LiveSource(reader, writer, settings["rules"])

    def announce(server: PageServer) -> None:
        ready({"url": server.url, "port": server.port})

    await serve(source, PageAddress(*settings["address"]), settings["token"], announce)


if __name__ == "__main__":
    serve_parent(main)
