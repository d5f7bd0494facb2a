"""Bytes and text of files. Only regular files are read, and only up to a size limit."""

from __future__ import annotations

import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from engine.files.finding import FileError, mistake, not_found

_noted: ContextVar[dict[Path, bytes] | None] = ContextVar("noted", default=None)
_instead: ContextVar[Mapping[Path, bytes]] = ContextVar("instead", default={})  # noqa: B039  never changed


@contextmanager
def noting() -> Iterator[dict[Path, bytes]]:
    """Collects the contents of the files read within the block, by path as given."""
    found: dict[Path, bytes] = {}
    token = _noted.set(found)
    try:
        yield found
    finally:
        _noted.reset(token)


def noted() -> Mapping[Path, bytes]:
    """The contents read so far within `noting`; elsewhere empty."""
    return _noted.get() or {}


def note(path: Path, data: bytes) -> None:
    """Notes the content that counts for a file that was read, in place of what stands in it."""
    found = _noted.get()
    if found is not None:
        found[path] = data


@contextmanager
def instead(contents: Mapping[Path, bytes]) -> Iterator[None]:
    """Replaces the contents of files within the block, for example with those of a recorded run."""
    token = _instead.set(contents)
    try:
        yield
    finally:
        _instead.reset(token)


def is_file(path: Path) -> bool:
    """True if there is such a regular file; False also for impossible names."""
    try:
        return path in _instead.get() or path.is_file()
    except (OSError, ValueError):
        return False


def read_bytes(path: Path, limit: int) -> bytes:
    """The content of a file.

    Raises:
        NotFound: there is no such file.
        FileError: it cannot be read, is a folder, a pipe or a device, or exceeds `limit` bytes.
    """
    data = _instead.get().get(path)
    if data is None:
        data = _read(path, limit)
    note(path, data)
    return data


def _read(path: Path, limit: int) -> bytes:
    if "\0" in str(path):
        raise mistake(path, "cannot be read: no file has such a name", code="Y01")
    try:
        status = path.stat()
        kind = stat.S_IFMT(status.st_mode)
        if kind not in (stat.S_IFREG, stat.S_IFDIR):  # reading a pipe would block
            raise mistake(path, "cannot be read: it is no regular file", code="Y01")
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except OSError as failure:
        raise unreadable(path, failure) from None
    if len(data) > limit:
        size = max(status.st_size, len(data))
        raise mistake(path, f"the file has {size} bytes", hint=f"at most {limit}", code="Y06")
    return data


def read_text(path: Path, limit: int) -> str:
    """The text of a file in UTF-8, with or without a byte order mark.

    Raises:
        FileError: as for `read_bytes`, or a byte is not UTF-8.
    """
    data = read_bytes(path, limit)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = data.count(b"\n", 0, failure.start) + 1
        message = f"byte 0x{data[failure.start]:02x} is not UTF-8"
        raise mistake(path, message, line, code="Y01") from None


def unreadable(path: Path, failure: Exception) -> FileError:
    """The error for a file that the system cannot read; NotFound if it does not exist."""
    message = f"cannot be read: {getattr(failure, 'strerror', None) or failure}"
    if isinstance(failure, FileNotFoundError):
        return not_found(path, message, code="Y01")
    return mistake(path, message, code="Y01")
