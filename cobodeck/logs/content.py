"""The bytes of a log, gzipped or not; a truncated file is read as far as it is intact."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from engine.files.finding import mistake
from engine.files.text import unreadable

LARGEST = 2 << 30
"""Largest log that is read into memory, bytes."""
_PIECE = 1 << 20
_GZIP = b"\x1f\x8b"


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
    packed = head_of_file(path) == _GZIP
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


def head_of_file(path: Path, count: int = 2) -> bytes:
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


def _pieces(path: Path, broken: list[str]) -> Iterator[bytes]:
    packed = head_of_file(path) == _GZIP
    with path.open("rb") as stream:
        unpack = zlib.decompressobj(wbits=31)
        while piece := stream.read(_PIECE):
            if not packed:
                yield piece
                continue
            while piece:
                try:
                    yield unpack.decompress(piece, _PIECE)
                except zlib.error:
                    broken.append("its gzip data is damaged")
                    return
                piece = unpack.unconsumed_tail or unpack.unused_data
                if unpack.eof:  # a gzip file may have several members
                    if not piece.startswith(_GZIP[:1]):
                        return
                    unpack = zlib.decompressobj(wbits=31)
        if packed and not unpack.eof:
            yield unpack.flush()
            broken.append("its gzip data is cut off")
