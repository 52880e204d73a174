"""Pictures as PNG files."""

import struct
import zlib

import numpy as np
from numpy.typing import NDArray


def png(pixels: NDArray[np.uint8]) -> bytes:
    """Return a PNG file of a picture [row, column, channel], top row first, in RGB.

    >>> png(np.zeros((2, 3, 3), np.uint8))[:8]
    b'\\x89PNG\\r\\n\\x1a\\n'
    """
    rows, columns, _ = pixels.shape
    return _file(
        (b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)),
        (b"IDAT", zlib.compress(_lines(pixels.reshape(rows, -1)), 9)),
    )


def png_of_indices(indices: NDArray[np.uint8], colours: NDArray[np.uint8]) -> bytes:
    """Return a PNG file of a picture [row, column], top row first, of indices into `colours` [256, 4] (RGBA).

    >>> png_of_indices(np.zeros((2, 3), np.uint8), np.zeros((256, 4), np.uint8))[:8]
    b'\\x89PNG\\r\\n\\x1a\\n'
    """
    rows, columns = indices.shape
    return _file(
        (b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 3, 0, 0, 0)),
        (b"PLTE", np.ascontiguousarray(colours[:, :3]).tobytes()),
        (b"tRNS", np.ascontiguousarray(colours[:, 3]).tobytes()),
        (b"IDAT", zlib.compress(_lines(indices))),
    )


def _lines(rows: NDArray[np.uint8]) -> bytes:
    """Return rows of bytes, each behind its filter type: 0, none."""
    lines = np.zeros((len(rows), rows.shape[1] + 1), np.uint8)
    lines[:, 1:] = rows
    return lines.tobytes()


def _file(*chunks: tuple[bytes, bytes]) -> bytes:
    """Return a file of these chunks, each a kind with its data."""
    file = b"\x89PNG\r\n\x1a\n"
    for kind, data in (*chunks, (b"IEND", b"")):
        file += struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    return file
