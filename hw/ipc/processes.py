"""Child processes that each open one device, and end with their parent.

A child is a module with `serve(main)` at its end. It gets its settings through a pipe that stays
open as long as the parent lives, and reports once that it is ready:

    def main(settings, ready, parent):     # settings: any picklable value
        device = open_it(settings)         # an OSError or ValueError here refuses the start
        ready({"port": device.port})
        while parent.lives():              # or wait with select on [parent, …]
            …                          # parent.receive(): what `Child.send` has sent
        device.stand_still()

    if __name__ == "__main__":
        serve(main)          # with a priority of `hw.ipc.priority`, if it must not wait

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
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from typing import IO, Any

from hw.ipc.priority import hurry, lock_memory

READY_S = 30.0
"""Time limit for a child to be ready, s."""
CLOSING_S = 2.0
"""Time for a child to end by itself before it is killed, s."""
TOLD = 1 << 16
"""Most that is read at once of what a parent tells, bytes."""
AGAIN = "no reset helps, start the run again"
"""What an operator does about a process that has ended for good."""
_SIZE = struct.Struct("<Q")

Ready = Callable[[Mapping[str, Any]], None]


class Child:
    """A process that runs `python -m module`; it starts at once, `wait` until it is ready.

    To start several children in parallel, make all of them, then wait for each. `name` is what an
    operator calls it, such as "the VR server". `fds`: open files that it has, too.
    """

    def __init__(
        self, module: str, settings: Any, name: str | None = None, fds: Collection[int] = ()
    ) -> None:
        self.name = name or module
        data = pickle.dumps(settings)
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", module],  # -P: do not import from the working directory
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            pass_fds=fds,
            start_new_session=True,  # Ctrl-C at the terminal is handled by the parent
        )
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):  # it has ended already; `wait` reports that
            self._process.stdin.write(_SIZE.pack(len(data)) + data)
            self._process.stdin.flush()
        os.set_blocking(self._process.stdin.fileno(), False)

    def wait(self, timeout_s: float = READY_S) -> dict[str, Any]:
        """Wait until the child is ready; returns what it reports of itself.

        Raises:
            OSError: it cannot start, with the cause; or it is silent for timeout_s.
        """
        out = self._process.stdout
        assert out is not None
        readable, _, _ = select.select([out], [], [], timeout_s)
        line = out.readline() if readable else b""
        if not line:
            late = f"{self.name} is silent"
            if readable:
                with suppress(subprocess.TimeoutExpired):  # it goes on, but closed its output
                    self._process.wait(CLOSING_S)
                late = self.fault or late
            self.kill()
            raise OSError(f"{late} before it was ready")
        found: dict[str, Any] = json.loads(line)
        if "error" in found:
            self.close()
            raise OSError(found["error"])
        return found

    def send(self, *words: str | int) -> None:
        """Send it something that only its parent may, without waiting; from any thread.

        What a child does not read is lost, once its pipe is full.
        """
        assert self._process.stdin is not None
        with suppress(OSError, ValueError):  # it has ended, or reads nothing
            os.write(self._process.stdin.fileno(), json.dumps(words).encode() + b"\n")

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """True while it runs."""
        return self._process.poll() is None

    @property
    def fault(self) -> str | None:
        """Why it does nothing any more: how it has ended, or that it is halted; None if it runs."""
        code = self._process.poll()
        if code is None:
            return f"{self.name} is halted by a signal" if self._halted() else None
        how = f"exit code {code}" if code >= 0 else f"killed by {_signal(-code)}"
        return f"{self.name} has ended ({how})"

    def _halted(self) -> bool:
        if not hasattr(os, "waitid"):
            return False
        with suppress(ChildProcessError):  # it has ended meanwhile
            asked = os.WSTOPPED | os.WNOHANG | os.WNOWAIT
            return os.waitid(os.P_PID, self.pid, asked) is not None
        return False

    def kill(self) -> None:
        """Kill it at once."""
        with suppress(ProcessLookupError):
            self._process.kill()
        self._reap()

    def close(self, timeout_s: float = CLOSING_S) -> None:
        """Let it end by itself, or kill it after timeout_s."""
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
    """The pipe from the parent; readable once it has told something, or is gone."""

    def __init__(self, pipe: IO[bytes]) -> None:
        self._pipe, self._begun = pipe, b""

    def fileno(self) -> int:
        """For `select`."""
        return self._pipe.fileno()

    def lives(self, wait_s: float = 0.0) -> bool:
        """True if the parent is still there after wait_s; of children that are told nothing."""
        return not select.select([self._pipe], [], [], wait_s)[0]

    def receive(self) -> list[Any] | None:
        """The words that it has sent since the last call, once readable; None if it is gone."""
        data = os.read(self._pipe.fileno(), TOLD)
        *lines, self._begun = (self._begun + data).split(b"\n")
        return [json.loads(line) for line in lines] if data else None


def serve(
    main: Callable[[Any, Ready, Parent], None], priority: int | None = None, locked: bool = False
) -> None:
    """Run a child's `main` with the settings from its parent.

    Once it is ready it has this real-time priority, and its memory `locked`, where permitted.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    pipe, out = os.fdopen(os.dup(0), "rb", buffering=0), os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # anything printed from now on goes to stderr
    size = _read(pipe, _SIZE.size)
    settings = pickle.loads(_read(pipe, *_SIZE.unpack(size)))  # from our own parent

    def ready(told: Mapping[str, Any]) -> None:
        if locked:
            lock_memory()
        if priority is not None:
            hurry(priority)
        out.write(json.dumps(dict(told)).encode() + b"\n")
        out.close()

    try:
        main(settings, ready, Parent(pipe))
    except (OSError, ValueError) as error:
        if out.closed:
            raise
        with suppress(BrokenPipeError):  # the parent has gone meanwhile
            out.write(json.dumps({"error": str(error) or type(error).__name__}).encode() + b"\n")


def _signal(number: int) -> str:
    """A signal by number and name."""
    try:
        return f"signal {number}, {signal.Signals(number).name}"
    except ValueError:  # a real-time signal
        return f"signal {number}"


def _read(pipe: IO[bytes], size: int) -> bytes:
    data = b""
    while len(data) < size:
        piece = pipe.read(size - len(data))
        if not piece:
            raise EOFError("the parent has ended before it sent the settings")
        data += piece
    return data
