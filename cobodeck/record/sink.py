"""The file of a record while it is written: never in the way of a run, never over an older file."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import suppress
from errno import ENOTDIR
from itertools import count
from pathlib import Path

ENDING = ".mcap"
PART = ".part"
"""The ending of a file that is still being written."""
_PERSON = re.compile(rf".+?{re.escape(ENDING)}({re.escape(PART)})?(?P<behind>[#@].*)?")


def behind_record(source: str) -> str | None:
    """What follows the name of a record where a person is named by one; None: they are not."""
    found = _PERSON.fullmatch(source)
    return None if found is None else found["behind"] or ""


def is_record(path: Path | str) -> bool:
    """Is this the name of a record, or of one that is not finished?"""
    return str(path).endswith((ENDING, ENDING + PART))


class Taken(Exception):
    """There is such a file already."""


def require_free(path: Path) -> None:
    """Look that there is no such file, and no link either.

    Raises:
        Taken: there is.
    """
    if path.exists() or path.is_symlink():
        raise Taken(f"{path} exists; it is not written over")


class Sink:
    """A file that is written under a temporary name, and named when it is whole.

    What goes wrong while writing stands in `error`; from then on it only counts positions, so that
    whoever writes goes on. The temporary file stays: `cobodeck recover` reads what is in it.

    Raises:
        Taken: the file is there, or it is being written, or was not finished; OSError: it cannot
            be made.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.part = path.with_name(path.name + PART)
        self.error: OSError | None = None
        self._position = self._end = 0
        require_free(path)
        _make_folder(path.parent)
        try:
            self._file = self.part.open("xb", buffering=0)
        except FileExistsError:
            told = "a run is writing it, or was broken off; see `cobodeck recover`, or remove it"
            raise Taken(f"{self.part} exists: {told}") from None

    def write(self, data: bytes | bytearray) -> int:
        """Write all of it, as far as anybody can tell."""
        size = len(data)
        try:
            left = memoryview(data)
            while self.error is None and left:
                left = left[self._file.write(left) or 0 :]
        except OSError as error:
            self.error = error
        self._position += size
        self._end = max(self._end, self._position)
        return size

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a position."""
        start = (0, self._position, self._end)[whence]
        self._position = start + offset
        if self.error is None:
            self._file.seek(self._position)
        return self._position

    def tell(self) -> int:
        """Where it is."""
        return self._position

    def flush(self) -> None:
        """Nothing is kept back."""

    def finish(self) -> Path | None:
        """Give the whole file its name, the next one that is free; None if it is not whole."""
        try:
            if self.error is None:
                os.fsync(self._file.fileno())
        except OSError as error:
            self.error = error
        self.close()
        if self.error is not None:
            return None
        try:
            return self._named()
        except OSError as error:
            self.error = error
            return None

    def close(self) -> None:
        """Write no more; what there is keeps its temporary name."""
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or error

    def remove(self) -> None:
        """Leave nothing behind."""
        self.close()
        with suppress(OSError):
            self.part.unlink()

    def _named(self) -> Path:
        for path in numbered(self.path):
            try:
                os.link(self.part, path)  # unlike a renaming, never over another file
            except FileExistsError:
                continue
            except OSError:  # a file system without links
                if path.exists():
                    continue
                self.part.rename(path)
                return path
            self.part.unlink()
            return path
        raise AssertionError("numbers do not end")


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:  # by a file
        raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR), str(folder)) from None


def numbered(path: Path, ending: str | None = None) -> Iterator[Path]:
    """A path, and others for when it is taken: `run.mcap`, `run-2.mcap` and so on.

    `ending`: what comes after the number, by default the last ending of the name.
    """
    yield path
    ending = path.suffix if ending is None else ending
    for number in count(2):
        yield path.with_name(f"{path.name.removesuffix(ending)}-{number}{ending}")


def open_free(path: Path, ending: str | None = None) -> Sink:
    """A sink of the first name that is free; see `numbered`.

    Raises:
        OSError: it cannot be made.
    """
    for candidate in numbered(path, ending):
        try:
            return Sink(candidate)
        except Taken:
            continue
    raise AssertionError("numbers do not end")
