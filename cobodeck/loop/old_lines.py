"""The older records of a run, in a temporary file that goes with the run."""

from __future__ import annotations

import os
import tempfile
import weakref
from collections.abc import Iterator
from typing import IO

CHUNK = 1 << 16  # bytes


class OldLines:
    """An `engine.run.trace.Archive`; the file is made with the first line."""

    __slots__ = ("__weakref__", "_file")

    def __init__(self) -> None:
        self._file: IO[bytes] | None = None

    def append(self, line: str) -> None:
        """Add a line.

        Raises:
            OSError: there is no room.
        """
        if self._file is None:
            self._file = tempfile.TemporaryFile()  # noqa: SIM115  open as long as the run is there
            weakref.finalize(self, self._file.close)
        self._file.write(f"{line}\n".encode())

    def __iter__(self) -> Iterator[str]:
        """All lines so far."""
        if self._file is None:
            return
        self._file.flush()
        begun, at = b"", 0
        while chunk := os.pread(self._file.fileno(), CHUNK, at):
            at += len(chunk)
            *lines, begun = (begun + chunk).split(b"\n")
            for line in lines:
                yield line.decode()
