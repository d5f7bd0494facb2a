"""The process that draws: DOT texts come on a socket, pictures go back, as lines of JSON."""

from __future__ import annotations

import json
import socket
from collections.abc import Mapping

from engine.draw import render
from hw.ipc import Parent, Ready, serve


def main(settings: Mapping[str, int], ready: Ready, _parent: Parent) -> None:
    """Draw until the socket is closed."""
    with socket.socket(fileno=settings["texts"]) as texts, texts.makefile("rwb") as lines:
        ready({})
        for line in lines:
            lines.write(json.dumps(_drawn(json.loads(line))).encode() + b"\n")
            lines.flush()


def _drawn(text: str) -> dict[str, str]:
    try:
        return {"svg": render(text).decode()}
    except Exception as error:  # noqa: BLE001  the next text may be drawn
        return {"trouble": str(error) or type(error).__name__}


if __name__ == "__main__":
    serve(main)
