"""Children: processes of our own that open a device each, and end with us.

A child is a module with `serve(main)` at its end. It gets its settings through a pipe that stays
open for as long as the parent lives, and says once whether it is ready:

    def main(settings, ready, parent):     # settings: any picklable value
        device = open_it(settings)         # an OSError or ValueError here refuses the start
        ready({"port": device.port})
        while parent.lives():              # or wait with select on [parent, …]
            …
        device.stand_still()

    if __name__ == "__main__":
        serve(main)

What a child prints goes to the parent's stderr.
"""

from __future__ import annotations

import json
import os
import pickle
import select
import signal
import struct
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import IO, Any

READY_S = 30.0
"""A child that is not ready after so long, s, does not get ready."""
CLOSING_S = 2.0
"""A child has so long to come to its end, s, before it is killed."""
FIRST = -15
"""The niceness of what goes first."""
_SIZE = struct.Struct("<Q")

Ready = Callable[[Mapping[str, Any]], None]


class Child:
    """A process that runs `python -m module`; it starts at once, and `wait` says when it is ready.

    Several children can start side by side: make all of them, then wait for each.
    """

    def __init__(self, module: str, settings: Any) -> None:
        self.module = module
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module],  # the folder we are in is no place for modules
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C at the terminal is the parent's business
        )
        assert self._process.stdin is not None
        data = pickle.dumps(settings)
        with suppress(BrokenPipeError):  # it has died already; `wait` says so
            self._process.stdin.write(_SIZE.pack(len(data)) + data)
            self._process.stdin.flush()

    def wait(self, timeout_s: float = READY_S) -> dict[str, Any]:
        """What the child says of itself once it is ready.

        Raises:
            OSError: it cannot start, and why; or it says nothing within timeout_s.
        """
        out = self._process.stdout
        assert out is not None
        readable, _, _ = select.select([out], [], [], timeout_s)
        line = out.readline() if readable else b""
        if not line:
            self.kill()
            late = "is silent" if not readable else "has ended"
            raise OSError(f"{self.module} {late} before it was ready")
        found: dict[str, Any] = json.loads(line)
        if "error" in found:
            self.close()
            raise OSError(found["error"])
        return found

    @property
    def pid(self) -> int:
        """Its number."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Does it run?"""
        return self._process.poll() is None

    def kill(self) -> None:
        """End it at once, whatever it does."""
        with suppress(ProcessLookupError):
            self._process.kill()
        self._reap()

    def close(self, timeout_s: float = CLOSING_S) -> None:
        """Let it come to its end, or else end it."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(timeout_s)
        except subprocess.TimeoutExpired:
            self.kill()
        self._reap()

    def _reap(self) -> None:
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()


class Parent:
    """The pipe from the parent: readable once the parent has closed it, or is gone."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe = pipe

    def fileno(self) -> int:
        """For `select`."""
        return self._pipe.fileno()

    def lives(self, wait_s: float = 0.0) -> bool:
        """Is the parent still there after wait_s?"""
        return not select.select([self._pipe], [], [], wait_s)[0]


def go_first() -> None:
    """Ask for the processor before others, if that is permitted; for what has a cycle to keep."""
    with suppress(OSError, AttributeError):
        os.setpriority(os.PRIO_PROCESS, 0, FIRST)


def serve(main: Callable[[Any, Ready, Parent], None]) -> None:
    """Run a child's `main` with the settings that its parent gives it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    pipe, out = os.fdopen(os.dup(0), "rb", buffering=0), os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever is printed from now on
    size = _read(pipe, _SIZE.size)
    settings = pickle.loads(_read(pipe, *_SIZE.unpack(size)))  # from our own parent

    def ready(told: Mapping[str, Any]) -> None:
        out.write(json.dumps(dict(told)).encode() + b"\n")
        out.close()

    try:
        main(settings, ready, Parent(pipe))
    except (OSError, ValueError) as error:
        if out.closed:
            raise
        ready({"error": str(error) or type(error).__name__})


def _read(pipe: IO[bytes], size: int) -> bytes:
    data = b""
    while len(data) < size:
        piece = pipe.read(size - len(data))
        if not piece:
            raise EOFError("the parent has gone before it told what to do")
        data += piece
    return data
