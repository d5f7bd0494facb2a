"""Grey images for maps: PGM (P2, P5) and PNG, read and written without other libraries.

Pixels are (rows, columns, channels) uint8, the top row first; channels are grey, grey and alpha,
RGB or RGBA. Deeper images are brought to 8 bits.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from engine.files.finding import mistake
from engine.files.text import read_bytes

Pixels = NDArray[np.uint8]

MAX_PIXELS = 100_000_000
MAX_BYTES = 400_000_000
_PNG = b"\x89PNG\r\n\x1a\n"
_PNG_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_PNG_TYPES = {1: 0, 2: 4, 3: 2, 4: 6}


def read_image(path: Path) -> Pixels:
    """The pixels of a PGM or PNG file, whatever its name says.

    Raises:
        FileError: naming the file and what is wrong with it.
    """
    data = read_bytes(path, MAX_BYTES)
    if data.startswith(_PNG):
        return _Png(path, data).pixels()
    if data[:2] in (b"P5", b"P2"):
        return _read_pgm(path, data)
    raise mistake(path, "is neither PGM (P5, P2) nor PNG")


def write_image(path: Path, pixels: Pixels) -> None:
    """Write as the file's suffix says: `.pgm` (one channel) or `.png`.

    Raises:
        FileError: another suffix, or channels that the format cannot hold.
    """
    rows, columns, channels = pixels.shape
    if path.suffix == ".pgm" and channels == 1:
        path.write_bytes(b"P5\n%d %d\n255\n" % (columns, rows) + pixels.tobytes())
    elif path.suffix == ".png":
        path.write_bytes(_png_bytes(pixels))
    else:
        raise mistake(path, f"cannot hold {channels} channels; use .pgm for grey, else .png")


def _size(path: Path, columns: int, rows: int) -> None:
    if columns < 1 or rows < 1:
        raise mistake(path, f"has {columns} x {rows} pixels; at least one is needed")
    if columns * rows > MAX_PIXELS:
        raise mistake(path, f"has {columns} x {rows} pixels; at most {MAX_PIXELS:g} are read")


def _read_pgm(path: Path, data: bytes) -> Pixels:
    columns, rows, most, start = _pgm_header(path, data)
    _size(path, columns, rows)
    if not 1 <= most <= 65535:
        raise mistake(path, f"has {most} as its largest grey; 1 to 65535 is allowed")
    if data[:2] == b"P2":
        words = data[start:].split()
        if not all(word.isdigit() for word in words):
            raise mistake(path, "has a grey that is not a number")
        if len(words) > columns * rows:
            raise mistake(path, f"holds more than its {columns} x {rows} pixels")
        grey = np.array(words, dtype=np.float64)
    else:
        kind = np.dtype(np.uint8 if most < 256 else ">u2")
        fit = (len(data) - start) // kind.itemsize
        grey = np.frombuffer(data, kind, min(fit, columns * rows), start).astype(np.float64)
        if data[start + columns * rows * kind.itemsize :].strip():
            raise mistake(path, f"holds more than its {columns} x {rows} pixels")
    if len(grey) < columns * rows:
        raise mistake(
            path, f"is cut off: {len(grey)} of {columns} x {rows} = {columns * rows} pixels"
        )
    scaled = np.floor(np.minimum(grey, most) * 255.0 / most + 0.5)
    return scaled.astype(np.uint8).reshape(rows, columns, 1)


def _pgm_header(path: Path, data: bytes) -> tuple[int, int, int, int]:
    """Columns, rows, largest grey and where the pixels start; comments may stand anywhere."""
    numbers: list[int] = []
    at = 2
    while len(numbers) < 3:
        if data[at : at + 1] == b"#":
            end = data.find(b"\n", at)
            at = len(data) if end < 0 else end
        elif data[at : at + 1].isdigit():
            end = at
            while data[end : end + 1].isdigit() and end - at < 10:
                end += 1
            numbers.append(int(data[at:end]))
            at = end
        elif data[at : at + 1].isspace():
            at += 1
        else:
            raise mistake(path, "has no PGM header: width, height and largest grey expected")
    return numbers[0], numbers[1], numbers[2], at + 1


class _Png:
    """One PNG file being read (ISO/IEC 15948); interlaced ones are refused."""

    def __init__(self, path: Path, data: bytes) -> None:
        self._path = path
        chunks = self._chunks(data)
        if "IHDR" not in chunks or len(chunks["IHDR"]) != 13:
            raise mistake(path, "has no PNG header")
        header = struct.unpack(">IIBBBBB", chunks["IHDR"])
        self._columns, self._rows, self._depth, self._type = header[:4]
        if self._type not in _PNG_CHANNELS or self._depth not in (1, 2, 4, 8, 16):
            raise mistake(path, f"is PNG of unknown type {self._type}, depth {self._depth}")
        if header[6]:
            raise mistake(path, "is an interlaced PNG; save it without interlacing")
        _size(path, self._columns, self._rows)
        self._palette = np.frombuffer(chunks.get("PLTE", b""), np.uint8).reshape(-1, 3)
        self._packed = chunks.get("IDAT", b"")

    def pixels(self) -> Pixels:
        """All pixels, unpacked and brought to 8 bits."""
        channels = _PNG_CHANNELS[self._type]
        samples = self._columns * channels
        width = (samples * self._depth + 7) // 8
        lines = self._unfilter(self._inflate(width), max(1, channels * self._depth // 8))
        if self._depth == 16:
            values = lines[:, 0::2]
        elif self._depth == 8:
            values = lines
        else:
            bits = np.unpackbits(lines, axis=1)[:, : samples * self._depth]
            weights = 2 ** np.arange(self._depth - 1, -1, -1)
            values = bits.reshape(self._rows, samples, self._depth) @ weights
            if self._type == 0:
                values = values * (255 // (2**self._depth - 1))
        if self._type == 3:
            if values.max() >= len(self._palette):
                raise mistake(self._path, "has a colour that is not in its palette")
            return self._palette[values].reshape(self._rows, self._columns, 3)
        return values.astype(np.uint8).reshape(self._rows, self._columns, channels)

    def _chunks(self, data: bytes) -> dict[str, bytes]:
        found: dict[str, bytes] = {}
        at = len(_PNG)
        while at + 12 <= len(data):
            (length,) = struct.unpack_from(">I", data, at)
            name, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
            if len(body) < length or at + 12 + length > len(data):
                break
            if zlib.crc32(name + body) != struct.unpack_from(">I", data, at + 8 + length)[0]:
                raise mistake(self._path, "is damaged: a check sum is wrong")
            key = name.decode("latin-1")
            found[key] = found.get(key, b"") + body
            if key == "IEND":
                return found
            at += 12 + length
        raise mistake(self._path, "is cut off: the end of the PNG is missing")

    def _inflate(self, width: int) -> Pixels:
        expected = self._rows * (width + 1)
        try:
            unpack = zlib.decompressobj()
            raw = unpack.decompress(self._packed, expected)
            more = unpack.decompress(unpack.unconsumed_tail, 1)
        except zlib.error as failure:
            raise mistake(self._path, f"is damaged: {failure}") from None
        if len(raw) < expected:
            raise mistake(self._path, f"is cut off: {len(raw)} of {expected} bytes")
        if more:
            size = f"{self._columns} x {self._rows}"
            raise mistake(self._path, f"holds more than its {size} pixels")
        return np.frombuffer(raw, np.uint8).reshape(self._rows, width + 1)

    def _unfilter(self, filtered: Pixels, step: int) -> Pixels:
        """Undo the five filters, each line from the one above and from `step` bytes before."""
        width = filtered.shape[1] - 1
        lines = np.zeros((len(filtered), width), np.uint8)
        above = np.zeros(width, np.uint8)
        for row, (kind, *_) in enumerate(filtered[:, :1].tolist()):
            line = filtered[row, 1:]
            if kind == 2:
                line = line + above
            elif kind == 1:
                line = _undo_sub(line, step)
            elif kind in (3, 4):
                line = _undo_predictor(line.tolist(), above.tolist(), step, kind == 4)
            elif kind != 0:
                raise mistake(self._path, f"is damaged: line {row} has filter {kind}")
            lines[row] = above = line
        return lines


def _undo_sub(line: Pixels, step: int) -> Pixels:
    padded = np.zeros(-(-len(line) // step) * step, np.uint8)
    padded[: len(line)] = line
    sums: Pixels = np.cumsum(padded.reshape(-1, step), axis=0, dtype=np.uint8)
    return sums.reshape(-1)[: len(line)]


def _undo_predictor(line: list[int], above: list[int], step: int, paeth: bool) -> Pixels:
    out = [0] * len(line)
    for i, value in enumerate(line):
        left, up = (out[i - step] if i >= step else 0), above[i]
        if paeth:
            corner = above[i - step] if i >= step else 0
            guess = _paeth(left, up, corner)
        else:
            guess = (left + up) // 2
        out[i] = (value + guess) & 255
    return np.array(out, np.uint8)


def _paeth(left: int, up: int, corner: int) -> int:
    estimate = left + up - corner
    by_left, by_up, by_corner = abs(estimate - left), abs(estimate - up), abs(estimate - corner)
    if by_left <= by_up and by_left <= by_corner:
        return left
    return up if by_up <= by_corner else corner


def _png_bytes(pixels: Pixels) -> bytes:
    rows, columns, channels = pixels.shape
    header = struct.pack(">IIBBBBB", columns, rows, 8, _PNG_TYPES[channels], 0, 0, 0)
    lines = np.zeros((rows, columns * channels + 1), np.uint8)
    lines[:, 1:] = pixels.reshape(rows, -1)
    parts = [(b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes())), (b"IEND", b"")]
    return _PNG + b"".join(_chunk(name, body) for name, body in parts)


def _chunk(name: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
