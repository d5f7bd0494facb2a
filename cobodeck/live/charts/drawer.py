"""Draws in a process of its own.

As a library, Graphviz holds the interpreter for as long as it draws, which can be minutes, and may
crash. Here, threads that wait for it let others run, and it can be ended.
"""

from __future__ import annotations

import atexit
import json
import socket
from contextlib import suppress
from threading import Lock
from typing import TYPE_CHECKING, Any

from engine.draw import CannotRender
from hw.ipc import Child

if TYPE_CHECKING:
    from io import BufferedRWPair

    Lines = BufferedRWPair[Any, Any]

PATIENCE_S = 20.0
"""Longest time for a picture, s of wall time."""
PROCESS = "cobodeck.live.charts.drawing_process"


class Drawer:
    """Draws one text at a time; its process starts with the first one.

    Args:
        patience_s: the longest time for a picture, s of wall time.
    """

    def __init__(self, patience_s: float = PATIENCE_S) -> None:
        self._patience_s = patience_s
        self._lock = Lock()
        self._child: Child | None = None
        self._lines: Lines | None = None
        atexit.register(self.close)

    def svg(self, text: str) -> str:
        """The picture of a DOT text as SVG.

        Raises:
            CannotRender: there is no Graphviz, it has failed, or it has taken too long.
        """
        with self._lock:
            try:
                told = self._told(text)
            except TimeoutError:
                self.close()
                late = f"the picture is not ready after {self._patience_s:g} s; fold or split it"
                raise CannotRender(late) from None
            except (OSError, ValueError) as error:
                self.close()
                raise CannotRender(f"Graphviz has ended: {error}") from None
        if "svg" not in told:
            raise CannotRender(told["trouble"])
        return told["svg"]

    def stop(self) -> None:
        """Let a picture that is being drawn fail; from any thread."""
        child = self._child
        if child is not None:
            child.kill()

    def close(self) -> None:
        """End the process; the next text starts another one."""
        child, lines, self._child, self._lines = self._child, self._lines, None, None
        if lines is not None:
            with suppress(OSError):
                lines.close()
        if child is not None:
            child.kill()

    def _told(self, text: str) -> dict[str, str]:
        lines = self._lines or self._started()
        lines.write(json.dumps(text).encode() + b"\n")
        lines.flush()
        line = lines.readline()
        if not line:
            raise OSError("its process is gone")
        found: dict[str, str] = json.loads(line)
        return found

    def _started(self) -> Lines:
        ours, theirs = socket.socketpair()
        with ours, theirs:
            fd = theirs.fileno()
            self._child = Child(PROCESS, {"texts": fd}, "the process that draws", [fd])
            self._child.wait()
            ours.settimeout(self._patience_s)
            self._lines = ours.makefile("rwb")
        return self._lines
