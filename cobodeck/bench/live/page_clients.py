"""Pages of a live run, as a process of their own: `URL READING STALLED`, how many of each.

Reading ones take all that comes; stalled ones take nothing once they have shaken hands. It says
`ready` when all are connected, and ends with its standard input.
"""

from __future__ import annotations

import asyncio
import sys
from contextlib import suppress

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed


async def _read(page: ClientConnection) -> None:
    with suppress(ConnectionClosed):
        async for _ in page:
            pass


async def main(url: str, reading: int, stalled: int) -> None:
    """Connect, and stay until standard input is closed."""
    pages = [await connect(url, max_size=None) for _ in range(reading + stalled)]
    tasks = [asyncio.create_task(_read(page)) for page in pages[:reading]]
    for page in pages[reading:]:
        page.transport.pause_reading()
    print("ready", flush=True)
    await asyncio.to_thread(sys.stdin.read)
    for task in tasks:
        task.cancel()
    for page in pages:
        page.transport.abort()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3])))
