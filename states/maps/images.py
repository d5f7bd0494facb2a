"""Grey images for maps, PGM (P2, P5), PNG and BMP, read by Pillow; PGM and PNG written.

Pixels are (rows, columns, channels) uint8, the top row first; channels are grey, grey and alpha,
RGB or RGBA. Deeper images are brought to 8 bits, palettes to colours.
"""

from __future__ import annotations

import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageFile, UnidentifiedImageError

from engine.files import mistake, read_bytes

Pixels = NDArray[np.uint8]

MAX_PIXELS = Image.MAX_IMAGE_PIXELS or 89_000_000
MAX_BYTES = 400_000_000
_PNG = b"\x89PNG\r\n\x1a\n"
_FORMATS = {_PNG: "PNG", b"P5": "PPM", b"P2": "PPM", b"BM": "BMP"}
"""Pillow's formats by the first bytes of a file."""
_PLAIN = {"P": "RGB", "1": "L"}
"""What images of palettes and of single bits are converted to."""
_IHDR = struct.Struct(">4sIIBBBBB")
_CHUNK = struct.Struct(">I4s")
_PNG_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
"""Samples of a pixel, by the colour type of the PNG header."""


def read_image(path: Path) -> Pixels:
    """The pixels of a PGM, PNG or BMP file, whatever its suffix.

    Raises:
        FileError: naming the file and what is wrong with it.
    """
    data = read_bytes(path, MAX_BYTES)
    form = next((form for start, form in _FORMATS.items() if data.startswith(start)), None)
    if form is None:
        raise mistake(path, _refused(data))
    with _named(path):
        image = _opened(data, form)
        if form == "BMP":  # its decoder refuses one that is cut off
            return _pixels(image)
        held, needed = _png_bytes(data) if form == "PNG" else _pgm_pixels(data, image)
    # Pillow fills missing lines of a PNG with zeros, which would be walls, and drops surplus ones
    if held > needed:
        raise mistake(path, f"holds more than its {image.width} x {image.height} pixels")
    if held < needed:
        unit = "bytes" if form == "PNG" else "pixels"
        size = f"{image.width} x {image.height}"
        raise mistake(path, f"is cut off: {held} of {needed} {unit}, for {size} pixels")
    with _named(path):
        return _pixels(image)


def write_image(path: Path, pixels: Pixels) -> None:
    """Write in the format of the file's suffix: `.pgm` (one channel) or `.png`.

    Raises:
        FileError: another suffix, or channels that the format cannot hold.
    """
    channels = pixels.shape[2]
    form = {".pgm": "PPM" if channels == 1 else "", ".png": "PNG"}.get(path.suffix)
    if not form:
        raise mistake(path, f"cannot hold {channels} channels; use .pgm for grey, else .png")
    Image.fromarray(pixels[..., 0] if channels == 1 else pixels).save(path, form)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Turns what Pillow raises for a wrong file into an error that names the file."""
    try:
        yield
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise mistake(path, f"has too many pixels; at most {MAX_PIXELS} are read") from None
    except UnidentifiedImageError:
        raise mistake(path, "has no valid header with a width and height of at least 1") from None
    except (OSError, SyntaxError, ValueError, IndexError, zlib.error) as failure:
        raise mistake(path, f"is damaged: {failure}") from None


def _refused(data: bytes) -> str:
    if data.startswith(b"\xff\xd8\xff"):
        return "is a JPEG, whose compression changes greys; save it as PNG, PGM (P5, P2) or BMP"
    return "is empty" if not data else "is neither PGM (P5, P2), PNG nor BMP"


def _opened(data: bytes, form: str) -> ImageFile.ImageFile:
    """The image, its size and (PNG) its check sums verified, its pixels not yet decoded."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        Image.open(BytesIO(data), formats=[form]).verify()
        return Image.open(BytesIO(data), formats=[form])


def _pixels(image: ImageFile.ImageFile) -> Pixels:
    clear = image.info.get("transparency")
    if image.mode.startswith("I;16"):
        deep = np.asarray(image)
        alpha = [] if clear is None else [np.where(deep == clear, 0, 255)]
        return np.stack([deep >> 8, *alpha], axis=-1).astype(np.uint8)
    if image.mode == "I":  # PGM of more than 8 bits, scaled to 16 by Pillow
        values = np.floor(np.asarray(image) * 255.0 / 65535.0 + 0.5)
        return np.atleast_3d(values).astype(np.uint8)
    if image.mode == "P" and np.asarray(image).max() >= len(image.getpalette("RGB") or ()) // 3:
        raise ValueError("it has colours that are not in its palette")
    plain = _PLAIN.get(image.mode, image.mode) if clear is None else "RGBA"
    return np.atleast_3d(np.asarray(image.convert(plain)))


def _pgm_pixels(data: bytes, image: ImageFile.ImageFile) -> tuple[int, int]:
    """How many pixels a PGM file holds, and how many its header announces."""
    needed, start = image.width * image.height, image.tile[0].offset
    if data[:2] == b"P2":
        return len(data[start:].split()), needed
    size = 2 if image.mode == "I" else 1
    surplus = data[start + needed * size :].strip()
    return min(needed, (len(data) - start) // size) + len(surplus), needed


def _png_bytes(data: bytes) -> tuple[int, int]:
    """How many bytes the lines of a verified PNG unpack to (counted to one too many), and should.

    Each line begins with a byte for its filter (ISO/IEC 15948, 7.2).

    Raises:
        ValueError: the image is interlaced.
    """
    name, columns, rows, depth, colour, _, _, interlaced = _IHDR.unpack_from(data, len(_PNG) + 4)
    if name != b"IHDR" or interlaced:
        raise ValueError("an interlaced PNG; save it without interlacing")
    needed = rows * (1 + (columns * _PNG_CHANNELS[colour] * depth + 7) // 8)
    unpack, held, at = zlib.decompressobj(), 0, len(_PNG)
    while name != b"IEND" and held <= needed:
        length, name = _CHUNK.unpack_from(data, at)
        if name == b"IDAT":
            body = data[at + 8 : at + 8 + length]
            held += len(unpack.decompress(body, needed + 1 - held))
        at += 12 + length
    return held, needed
