"""Opens a log of any known kind, recognised by content, not by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cobodeck.logs.formats import (
    SensorLog,
    head,
    is_bag,
    is_carmen,
    is_record,
    read_bag,
    read_carmen,
    read_record,
)
from cobodeck.logs.mrpt import is_rawlog, read_rawlog
from engine.files import mistake

KINDS: tuple[tuple[Callable[[Path], bool], Callable[[Path], SensorLog]], ...] = (
    (is_record, read_record),
    (is_bag, read_bag),
    (is_rawlog, read_rawlog),
    (is_carmen, read_carmen),
)
NAMES = "a record (MCAP), an MRPT rawlog or simplemap, a CARMEN log or a ROS bag, also compressed"


def open_log(path: Path) -> SensorLog:
    """Read a whole log.

    Raises:
        FileError: it cannot be read, is of no known kind, or holds nothing usable.
    """
    if path.is_dir():
        if not is_bag(path):
            raise mistake(path, "is a folder", hint=f"a log is {NAMES}")
        return read_bag(path)
    if not head(path, 1):
        why = "is empty" if not path.stat().st_size else "holds nothing that can be unpacked"
        raise mistake(path, why, hint=f"a log is {NAMES}")
    for is_kind, read in KINDS:
        if is_kind(path):
            return read(path)
    raise mistake(path, "is not a known kind of log", hint=f"a log is {NAMES}")
