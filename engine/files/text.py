"""The bytes and the text of files; only regular files up to a limit are read."""

from __future__ import annotations

import stat
from pathlib import Path

from engine.files.finding import FileError, mistake


def is_file(path: Path) -> bool:
    """Is there a regular file; names that no file can have count as those of none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def read_bytes(path: Path, limit: int) -> bytes:
    """What a file holds.

    Raises:
        FileError: it cannot be read, is a folder, a pipe or a device, or is larger than `limit`.
    """
    if "\0" in str(path):
        raise _unreadable(path, "no file has such a name")
    try:
        status = path.stat()
        kind = stat.S_IFMT(status.st_mode)
        if kind not in (stat.S_IFREG, stat.S_IFDIR):  # a pipe would be waited for
            raise _unreadable(path, "it is no regular file")
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except OSError as failure:
        raise _unreadable(path, failure.strerror or str(failure)) from None
    if len(data) > limit:
        size = max(status.st_size, len(data))
        raise mistake(path, f"the file has {size} bytes", hint=f"at most {limit}", code="Y06")
    return data


def read_text(path: Path, limit: int) -> str:
    """The text of a file in UTF-8, with or without a byte order mark.

    Raises:
        FileError: as of `read_bytes`, or a byte is not UTF-8.
    """
    data = read_bytes(path, limit)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = data.count(b"\n", 0, failure.start) + 1
        message = f"byte 0x{data[failure.start]:02x} is not UTF-8"
        raise mistake(path, message, line, code="Y01") from None


def _unreadable(path: Path, reason: str) -> FileError:
    return mistake(path, f"cannot be read: {reason}", code="Y01")
