"""The wire format of a tile (docs/contracts.md#wire-format): what a sample is on a serial line or in a datagram.

A frame holds 21 bytes, little-endian: version (u8, 1), tile (u16), sequence (u16, counted per tile), device time in
microseconds (u32), four readings (u16), and the CRC-32 of zlib and Ethernet over the 17 bytes before it. Consistent
overhead byte stuffing (Cheshire and Baker 1999) makes 22 bytes of it, none of them zero, and a zero ends it. The
alternative for a first afternoon is a line of text, `tile,sequence,microseconds,r1,r2,r3,r4`, which has no checksum.

In arrays a frame is a row of seven int64, in the order of that line.
"""

import zlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import kernel

VERSION = 1
FIELDS = ("tile", "sequence", "microseconds", "r1", "r2", "r3", "r4")
"""What a row holds."""
TILE, SEQUENCE, MICROSECONDS, READINGS = 0, 1, 2, 3
"""Where in a row: the four readings stand last."""
LARGEST = np.array([0xFFFF, 0xFFFF, 0xFFFF_FFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF], np.int64)
"""The largest number that each field can carry."""
CHECKED = 17
"""Bytes that the checksum covers."""
STUFFED = CHECKED + 4 + 1
"""Bytes of a stuffed frame; a zero follows."""
FRAME = STUFFED + 1

_CRC = np.array([zlib.crc32(bytes([i])) ^ zlib.crc32(b"\0") for i in range(256)], np.int64)


def encode(frames: ArrayLike) -> bytes:
    """Frames as a tile sends them: integers (n, 7), or one row, to 23 bytes each. `BadValue` for what does not fit.

    >>> encode([3, 7, 1_000_000, 0, 1, 2, 65535]).hex(" ")
    '03 01 03 02 07 04 40 42 0f 01 01 02 01 02 02 07 ff ff 4e 61 73 92 00'
    """
    rows = _checked(frames)
    out = np.empty(len(rows) * FRAME, np.uint8)
    pack(rows, out)
    return out.tobytes()


def csv_lines(frames: ArrayLike) -> bytes:
    """The same frames as lines of text.

    >>> csv_lines([3, 7, 1_000_000, 0, 1, 2, 65535])
    b'3,7,1000000,0,1,2,65535\\n'
    """
    return b"".join(b"%d,%d,%d,%d,%d,%d,%d\n" % tuple(row) for row in _checked(frames).tolist())


def _checked(frames: ArrayLike) -> NDArray[np.int64]:
    rows = np.atleast_2d(np.asarray(frames))
    if not rows.size:
        return np.zeros((0, len(FIELDS)), np.int64)
    require(rows.ndim == 2 and rows.shape[1] == len(FIELDS), "the shape of frames", rows.shape, "(n, 7)")
    require(np.issubdtype(rows.dtype, np.integer), "the type of frames", rows.dtype.name, "integers")
    for name, column, most in zip(FIELDS, rows.T, LARGEST.tolist(), strict=True):
        wrong = column[(column < 0) | (column > most)]
        require(not len(wrong), name, int(wrong[0]) if len(wrong) else 0, f"0 to {most}")
    return np.ascontiguousarray(rows, np.int64)


@kernel
def pack(frames, out):
    """Encode `frames` (n, 7) into `out`, uint8 of 23 n."""
    for i in range(len(frames)):
        begin = i * FRAME
        raw = out[begin + 1 : begin + STUFFED]
        raw[0] = VERSION
        _put(raw, 1, frames[i, TILE], 2)
        _put(raw, 3, frames[i, SEQUENCE], 2)
        _put(raw, 5, frames[i, MICROSECONDS], 4)
        for j in range(4):
            _put(raw, 9 + 2 * j, frames[i, READINGS + j], 2)
        _put(raw, CHECKED, _checksum(raw), 4)
        # Every zero gives way to the distance to the next; the first of these distances stands in front.
        code = begin
        for j in range(begin + 1, begin + STUFFED):
            if out[j] == 0:
                out[code] = j - code
                code = j
        out[code] = begin + STUFFED - code
        out[begin + STUFFED] = 0


@kernel
def unpack(stuffed, row):
    """Decode 22 bytes, which are overwritten, into a row of seven; whether they were a whole and sound frame."""
    code = 0
    while code < STUFFED:
        step = np.int64(stuffed[code])
        stuffed[code] = 0
        if step == 0:
            return False
        code += step
    raw = stuffed[1:]
    if code != STUFFED or raw[0] != VERSION or _get(raw, CHECKED, 4) != _checksum(raw):
        return False
    row[TILE] = _get(raw, 1, 2)
    row[SEQUENCE] = _get(raw, 3, 2)
    row[MICROSECONDS] = _get(raw, 5, 4)
    for j in range(4):
        row[READINGS + j] = _get(raw, 9 + 2 * j, 2)
    return True


@kernel
def _checksum(raw):
    check = np.int64(0xFFFFFFFF)
    for i in range(CHECKED):
        check = _CRC[(check ^ np.int64(raw[i])) & 0xFF] ^ (check >> 8)
    return check ^ 0xFFFFFFFF


@kernel
def _put(raw, at, value, size):
    for i in range(size):
        raw[at + i] = (value >> (8 * i)) & 0xFF


@kernel
def _get(raw, at, size):
    value = np.int64(0)
    for i in range(size):
        value |= np.int64(raw[at + i]) << (8 * i)
    return value
