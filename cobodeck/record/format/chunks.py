"""Unpacks the chunks of a file, limited to the size that each chunk declares."""

from __future__ import annotations

from dataclasses import replace

import lz4.frame
import zstandard
from mcap.records import Chunk, McapRecord
from mcap.stream_reader import breakup_chunk

LARGEST = 64 << 20
"""Larger chunks are refused, bytes; ours are smaller."""


def records_of(chunk: Chunk) -> list[McapRecord]:
    """The schemas, channels and messages of a chunk.

    Raises:
        ValueError, and the libraries' exceptions: the chunk is damaged, or too large.
    """
    size = chunk.uncompressed_size
    if size > LARGEST:
        raise ValueError(f"a chunk of {size} bytes")
    data = _unpacked(chunk, size + 1)
    if len(data) != size:
        raise ValueError(f"a chunk is not of {size} bytes")
    return breakup_chunk(replace(chunk, data=data, compression=""), validate_crc=True)


def _unpacked(chunk: Chunk, limit: int) -> bytes:
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as stream:
            return stream.read(limit)
    if chunk.compression == "lz4":
        found: bytes = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, limit)
        return found
    if chunk.compression:
        raise ValueError(f"compressed by {chunk.compression!r}")
    return chunk.data
