"""The child process that serves the pages of a run, from its feed, until that ends."""

from __future__ import annotations

import asyncio
import os
import socket
from typing import Any

from cobodeck.live.access import PageAddress
from cobodeck.live.server import PageServer, serve
from cobodeck.live.sources import LiveSource, SeenRun
from cobodeck.terminal import Problem
from engine.files import FileError
from hw.ipc import Parent, Ready, serve as serve_parent

NICE = 10
"""How far it stands back behind others of its session: no further, as a stop must not wait. The run
and its devices go before it by their real-time priorities."""
LIMIT = 1 << 20
"""Of the feed, so much is read ahead, bytes."""


def main(settings: Any, ready: Ready, parent: Parent) -> None:  # noqa: ARG001
    """Serve; see `hw.ipc`. Charts and room are made before the clock of the run begins.

    The feed ends with the parent.

    Raises:
        ValueError: the run cannot be shown.
        OSError: the address cannot be had.
    """
    try:
        run = SeenRun.written(settings["header"], settings["attachments"])
    except (Problem, FileError) as error:
        raise ValueError(f"the run cannot be shown: {error}") from None
    os.nice(NICE)
    asyncio.run(_serve_feed(settings, run, ready))


async def _serve_feed(settings: Any, run: SeenRun, ready: Ready) -> None:
    feed = socket.socket(fileno=settings["feed"])
    reader, writer = await asyncio.open_unix_connection(sock=feed, limit=LIMIT)
    source = LiveSource(run, reader, writer, settings["rules"])

    def announce(server: PageServer) -> None:
        ready({"url": server.url, "port": server.port})

    await serve(source, PageAddress(*settings["address"]), settings["token"], announce)


if __name__ == "__main__":
    serve_parent(main)
