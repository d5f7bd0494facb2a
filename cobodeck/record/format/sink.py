"""The file of a record being written; it never stops a run and never overwrites a file."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import suppress
from errno import ENOTDIR
from io import BytesIO, FileIO
from itertools import count
from pathlib import Path

from cobodeck.terminal import PART


class Taken(Exception):
    """A file exists already under the requested name."""


def require_free(path: Path) -> None:
    """Check that a path is free: neither file nor link.

    Raises:
        Taken: it is not.
    """
    if path.exists() or path.is_symlink():
        raise Taken(f"{path} exists; it is not written over")


class Sink:
    """A file that is written under a temporary name and renamed when it is complete.

    The first failure to write is kept in `error`; from then on it only counts positions, so that
    the caller need not stop. The temporary file stays: `cobodeck recover` reads what is in it.
    It is empty until `keep`: one that is left empty by a run that was killed is taken over.

    Raises:
        Taken: the file exists, is being written, or was not finished; OSError: it cannot be
            created.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.part = path.with_name(path.name + PART)
        self.error: OSError | None = None
        self._position = self._end = 0
        require_free(path)
        _make_folder(path.parent)
        self._disk = _claimed(self.part)
        self._file: BytesIO | FileIO = BytesIO()

    def keep(self) -> None:
        """Write what was held back until now; from now on everything is written at once."""
        if isinstance(self._file, BytesIO):
            held, at, self._file = self._file.getvalue(), self._position, self._disk
            self._position = 0
            self.write(held)
            self.seek(at)

    def write(self, data: bytes | bytearray) -> int:
        """Write all of it; failures are noted in `error`, not raised."""
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
        """Seek to a position."""
        start = (0, self._position, self._end)[whence]
        self._position = start + offset
        if self.error is None:
            self._file.seek(self._position)
        return self._position

    def tell(self) -> int:
        """The current position."""
        return self._position

    def flush(self) -> None:
        """Do nothing; nothing is buffered."""

    def finish(self) -> Path | None:
        """Rename the complete file to the next free name; returns it, None on failure."""
        self.keep()
        try:
            if self.error is None:
                os.fsync(self._disk.fileno())
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
        """Stop writing; the file keeps its temporary name."""
        try:
            self._disk.close()
        except OSError as error:
            self.error = self.error or error

    def remove(self) -> None:
        """Remove the temporary file."""
        self.close()
        with suppress(OSError):
            self.part.unlink()

    def _named(self) -> Path:
        for path in numbered(self.path):
            try:
                os.link(self.part, path)  # unlike a rename this never replaces a file
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


def _claimed(part: Path) -> FileIO:
    """A temporary file that this process alone writes: a new one, or an empty one that was left.

    Raises:
        Taken: another process writes it, or it holds something; OSError: it cannot be created.
    """
    try:
        file = part.open("xb", buffering=0)
    except FileExistsError:
        if not part.is_file():
            raise Taken(f"{part} exists, and is no file") from None
        file = part.open("r+b", buffering=0)
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        file.close()
        raise Taken(f"{part} exists: a run is writing it") from None
    except OSError:  # a file system without locks
        pass
    mine = os.fstat(file.fileno())
    if mine.st_size == 0 and os.path.samestat(mine, part.stat()):
        return file
    file.close()
    told = "a run was broken off; see `cobodeck recover`, or remove it"
    raise Taken(f"{part} exists: {told}")


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:  # there is a file of this name
        raise NotADirectoryError(ENOTDIR, os.strerror(ENOTDIR), str(folder)) from None


def numbered(path: Path, ending: str | None = None) -> Iterator[Path]:
    """A path, then alternatives if it is taken: `run.mcap`, `run-2.mcap` and so on.

    `ending`: what comes after the number, by default the last ending of the name.
    """
    yield path
    ending = path.suffix if ending is None else ending
    for number in count(2):
        yield path.with_name(f"{path.name.removesuffix(ending)}-{number}{ending}")


def open_free(path: Path, ending: str | None = None) -> Sink:
    """A sink for the first free name; see `numbered`.

    Raises:
        OSError: it cannot be created.
    """
    for candidate in numbered(path, ending):
        try:
            return Sink(candidate)
        except Taken:
            continue
    raise AssertionError("numbers do not end")
