"""Tells when files have changed, by looking at them again and again.

A file counts as changed when its bytes are others. Those of a file that was written just now are
compared even if its time and size are as before: the clocks of file systems are coarse. Of files
that are too large to be read as charts, time and size count.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from engine.files import MAX_BYTES

YOUNG_NS = 100_000_000
"""A file written within this time may be written again without a later time of change."""

FileStamp = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class _Look:
    """What a file was: its stamp, None if there is none; its bytes' hash; whether it was young."""

    stamp: FileStamp | None = None
    digest: bytes = b""
    young: bool = False


class FileWatch:
    """Compares files and the contents of folders with how they were at the last look.

    Args:
        now_ns: the time of the system's clock, by which files are stamped.
    """

    def __init__(self, now_ns: Callable[[], int] = time.time_ns) -> None:
        self._now_ns = now_ns
        self._looks: dict[Path, _Look] = {}

    def changed(self, paths: Iterable[Path]) -> set[Path]:
        """Those of these files and folders that are not as at the last look; at the first, none."""
        before = self._looks
        self._looks = {path: self._look(path, before.get(path)) for path in dict.fromkeys(paths)}
        return {
            path
            for path, look in self._looks.items()
            if path in before
            and (look.stamp is None, look.digest)
            != (before[path].stamp is None, before[path].digest)
        }

    def _look(self, path: Path, before: _Look | None) -> _Look:
        begun = self._now_ns()
        stamp = stamp_of(path)
        if stamp is None:
            return _Look()
        if before is not None and before.stamp == stamp and not before.young:
            return before
        return _Look(stamp, _digest(path, stamp), begun - stamp[0] < YOUNG_NS)


def stamp_of(path: Path) -> FileStamp | None:
    """Time of change, ns, size and number of a file; None if there is none."""
    with suppress(OSError, ValueError):
        found = path.stat()
        return found.st_mtime_ns, found.st_size, found.st_ino
    return None


def _digest(path: Path, stamp: FileStamp) -> bytes:
    """A hash of a file's bytes; of folders, large files, and what cannot be read, its stamp."""
    try:
        if stamp[1] <= MAX_BYTES and path.is_file():  # reading a pipe would block
            return hashlib.sha256(path.read_bytes()).digest()
    except OSError:
        pass
    return repr(stamp).encode()
