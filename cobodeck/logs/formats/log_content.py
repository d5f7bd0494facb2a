"""The bytes of a log, compressed or not; a truncated file is read as far as it is intact."""

from __future__ import annotations

import bz2
import gzip
import lzma
import zlib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from engine.files import mistake, unreadable

LARGEST = 2 << 30
"""Largest log that is read into memory, bytes."""
_PIECE = 1 << 20


class _Zstd:
    """A file packed by zstd, read as those of the standard library: cut off, it is an EOFError."""

    def __init__(self, path: Path) -> None:
        import zstandard

        self._frame = zstandard.ZstdDecompressor().decompressobj
        self._damaged = zstandard.ZstdError
        self._file = path.open("rb")
        self._unpack = self._frame()
        self._rest = b""

    def __enter__(self) -> _Zstd:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read1(self, size: int) -> bytes:
        """The content of up to so many packed bytes, and of more if there is none in them."""
        while piece := self._rest or self._file.read(size):
            if self._unpack.eof:  # a file may have several frames
                self._unpack = self._frame()
            try:
                found: bytes = self._unpack.decompress(piece)
            except self._damaged as error:
                raise OSError(str(error)) from None
            self._rest = self._unpack.unused_data
            if found:
                return found
        if not self._unpack.eof:
            raise EOFError
        return b""


_PACKED: Mapping[bytes, tuple[str, Callable[[Path], Any]]] = {
    b"\x1f\x8b": ("gzip", gzip.open),
    b"BZh": ("bzip2", bz2.open),
    b"\xfd7zXZ\0": ("xz", lzma.open),
    b"\x28\xb5\x2f\xfd": ("zstd", _Zstd),
}
"""Name and reader of compressed files, by their first bytes."""
_DAMAGED = (OSError, zlib.error, lzma.LZMAError)


def head(path: Path, count: int) -> bytes:
    """The first bytes of a log, decompressed.

    Raises:
        FileError: it cannot be read.
    """
    found = bytearray()
    for piece in _pieces(path, []):
        found += piece
        if len(found) >= count:
            break
    return bytes(found[:count])


def content(path: Path) -> tuple[bytes, str | None]:
    """All bytes of a log, decompressed, and a sentence if the file is damaged or cut off.

    Raises:
        FileError: it cannot be read, or is too large.
    """
    found, broken = bytearray(), list[str]()
    for piece in _pieces(path, broken):
        found += piece
        if len(found) > LARGEST:
            raise mistake(path, f"holds more than {LARGEST >> 30} GiB", hint="cut it in parts")
    return bytes(found), broken[0] if broken else None


@contextmanager
def plain_file(path: Path, ending: str) -> Iterator[tuple[Path, str | None]]:
    """A log as an uncompressed file with this ending, for readers that go by the file name.

    Yields its path, and a sentence if the file is damaged or cut off.

    Raises:
        FileError: it cannot be read, or is too large.
    """
    packed = _packed(path) is not None
    if not packed and path.suffix == ending:
        yield path, None
        return
    with TemporaryDirectory() as folder:
        plain, broken = Path(folder) / f"log{ending}", None
        if packed:
            data, broken = content(path)
            plain.write_bytes(data)
        else:
            plain.symlink_to(path.resolve())
        yield plain, broken


def head_of_file(path: Path, count: int) -> bytes:
    """The first bytes of the file itself.

    Raises:
        FileError: it cannot be read.
    """
    if path.exists() and not path.is_file():  # reading a pipe would block
        raise mistake(path, "cannot be read: it is no regular file")
    try:
        with path.open("rb") as stream:
            return stream.read(count)
    except (OSError, ValueError) as error:
        raise unreadable(path, error) from None


def _packed(path: Path) -> tuple[str, Callable[[Path], Any]] | None:
    begins = head_of_file(path, max(map(len, _PACKED)))
    return next((found for first, found in _PACKED.items() if begins.startswith(first)), None)


def _pieces(path: Path, broken: list[str]) -> Iterator[bytes]:
    name, opened = _packed(path) or ("", lambda path: path.open("rb"))
    with opened(path) as stream:
        try:
            while piece := stream.read1(_PIECE):
                yield piece
        except EOFError:
            broken.append(f"its {name} data is cut off")
        except _DAMAGED:
            broken.append(f"its {name} data is damaged")
