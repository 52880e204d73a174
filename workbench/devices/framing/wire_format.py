"""The wire format of a tile (docs/contracts.md#wire-format), for serial ports, datagrams and TCP.

A frame holds 21 bytes, little-endian: kind (u8), tile (u16), sequence (u16, counted per tile and kind), device time in
microseconds (u32), four readings (u16), and the CRC-32 of zlib and Ethernet over the preceding 17 bytes. Kind 1 holds
the readings of the four force sensors. Kind 2 holds four samples of an accelerometer, 32768 at rest: the last was
taken at the frame's time, the others evenly spaced since the previous frame. Consistent overhead byte stuffing
(Cheshire and Baker 1999) turns this into 22 bytes, none of them zero, followed by a zero. For first experiments there
is a line of text, `tile,sequence,microseconds,r1,r2,r3,r4`. It may end in a checksum, as in NMEA 0183: an asterisk, and
two hexadecimal digits of the exclusive or of all characters before it.

In arrays a frame is a record of `SAMPLE`.
"""

import zlib
from functools import reduce
from operator import xor

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import kernel

FORCES, ACCELERATION = 1, 2
"""The kinds of frames."""
REST = 1 << 15
"""Reading of an accelerometer at rest; full scale is this far from it in both directions."""
SAMPLE = np.dtype(
    [
        ("tile", np.int64),
        ("sequence", np.int64),
        ("microseconds", np.int64),
        ("readings", np.int64, (4,)),
        ("epoch", np.int64),
        ("kind", np.int64),
    ],
    align=True,
)
"""One frame of one tile. `epoch` counts the restarts of the tile's sequence; it is set by the parser, not sent."""
COLUMNS = ("tile", "sequence", "microseconds", "r1", "r2", "r3", "r4")
"""The columns of a line of text."""
MAX_VALUES = np.array([0xFFFF, 0xFFFF, 0xFFFF_FFFF, 0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF], np.int64)
"""Largest value of each column."""
CHECKED_BYTES = 17
"""Bytes covered by the checksum."""
STUFFED_BYTES = CHECKED_BYTES + 4 + 1
"""Bytes of a stuffed frame, without the final zero."""
FRAME_BYTES = STUFFED_BYTES + 1

_CRC = np.array([zlib.crc32(bytes([i])) ^ zlib.crc32(b"\0") for i in range(256)], np.int64)


def encode(rows: ArrayLike) -> bytes:
    """Encode integers (n, 7), or one row, of `COLUMNS` as frames; raise `BadValue` for values out of range.

    >>> encode([3, 7, 1_000_000, 0, 1, 2, 65535]).hex(" ")
    '03 01 03 02 07 04 40 42 0f 01 01 02 01 02 02 07 ff ff 4e 61 73 92 00'
    """
    samples = samples_of(rows)
    out = np.empty(len(samples) * FRAME_BYTES, np.uint8)
    pack(samples, out)
    return out.tobytes()


def csv_lines(rows: ArrayLike) -> bytes:
    """Encode the same samples as lines of text, with checksums.

    >>> csv_lines([3, 7, 1_000_000, 0, 1, 2, 65535])
    b'3,7,1000000,0,1,2,65535*36\\n'
    """
    lines = (b"%d,%d,%d,%d,%d,%d,%d" % tuple(row) for row in _checked(rows).tolist())
    return b"".join(b"%b*%02X\n" % (line, reduce(xor, line)) for line in lines)


def samples_of(rows: ArrayLike) -> NDArray[np.void]:
    """Convert integers (n, 7), or one row, of `COLUMNS` to records of `SAMPLE` (n,); `BadValue` if out of range.

    >>> samples_of([3, 7, 1_000_000, 0, 1, 2, 65535])["readings"]
    array([[    0,     1,     2, 65535]])
    """
    checked = _checked(rows)
    samples = np.zeros(len(checked), SAMPLE)
    samples["tile"], samples["sequence"], samples["microseconds"] = checked[:, :3].T
    samples["readings"] = checked[:, 3:]
    samples["kind"] = FORCES
    return samples


def rows_of(samples: NDArray[np.void]) -> NDArray[np.int64]:
    """Convert records to integers (n, 7): the inverse of `samples_of`.

    >>> rows_of(samples_of([3, 7, 1_000_000, 0, 1, 2, 65535])).tolist()
    [[3, 7, 1000000, 0, 1, 2, 65535]]
    """
    return np.column_stack([samples["tile"], samples["sequence"], samples["microseconds"], samples["readings"]])


def unshifted(reading: int) -> str:
    """Return a question after a reading of all bits of a smaller converter, not shifted to the top of the word.

    >>> unshifted(1023), unshifted(65535)
    ('; does its device send 10 bits that belong at the top of 16?', '')
    """
    bits = reading.bit_length()
    is_all = 8 <= bits < 16 and reading == 2**bits - 1
    return f"; does its device send {bits} bits that belong at the top of 16?" if is_all else ""


def _checked(rows: ArrayLike) -> NDArray[np.int64]:
    given = np.atleast_2d(np.asarray(rows))
    if not given.size:
        return np.zeros((0, len(COLUMNS)), np.int64)
    require(given.ndim == 2 and given.shape[1] == len(COLUMNS), "the shape of frames", given.shape, "(n, 7)")
    require(np.issubdtype(given.dtype, np.integer), "the type of frames", given.dtype.name, "integers")
    for name, column, most in zip(COLUMNS, given.T, MAX_VALUES.tolist(), strict=True):
        wrong = column[(column < 0) | (column > most)]
        require(not len(wrong), name, int(wrong[0]) if len(wrong) else 0, f"0 to {most}")
    return np.ascontiguousarray(given, np.int64)


@kernel
def pack(samples: NDArray[np.void], out: NDArray[np.uint8]) -> None:
    """Encode records of `SAMPLE` (n,) into `out`, 23 n bytes."""
    for i in range(len(samples)):
        sample = samples[i]
        begin = i * FRAME_BYTES
        raw = out[begin + 1 : begin + STUFFED_BYTES]
        raw[0] = sample.kind
        _put(raw, 1, sample.tile, 2)
        _put(raw, 3, sample.sequence, 2)
        _put(raw, 5, sample.microseconds, 4)
        for sensor in range(4):
            _put(raw, 9 + 2 * sensor, sample.readings[sensor], 2)
        _put(raw, CHECKED_BYTES, _checksum(raw), 4)
        # Each zero is replaced by the distance to the next; the first distance is put in front.
        code = begin
        for j in range(begin + 1, begin + STUFFED_BYTES):
            if out[j] == 0:
                out[code] = j - code
                code = j
        out[code] = begin + STUFFED_BYTES - code
        out[begin + STUFFED_BYTES] = 0


@kernel
def unpack(stuffed: NDArray[np.uint8], sample: np.record) -> bool:
    """Decode 22 bytes, which are overwritten, into a record of `SAMPLE`; return False if they are not a valid frame.

    `epoch` is left unchanged.
    """
    code = np.int64(0)
    while code < STUFFED_BYTES:
        step = np.int64(stuffed[code])
        stuffed[code] = 0
        if step == 0:
            return False
        code += step
    raw = stuffed[1:]
    if code != STUFFED_BYTES or not FORCES <= raw[0] <= ACCELERATION or _get(raw, CHECKED_BYTES, 4) != _checksum(raw):
        return False
    sample.kind = raw[0]
    sample.tile = _get(raw, 1, 2)
    sample.sequence = _get(raw, 3, 2)
    sample.microseconds = _get(raw, 5, 4)
    for sensor in range(4):
        sample.readings[sensor] = _get(raw, 9 + 2 * sensor, 2)
    return True


@kernel
def _checksum(raw: NDArray[np.uint8]) -> np.int64:
    check = np.int64(0xFFFFFFFF)
    for i in range(CHECKED_BYTES):
        check = _CRC[(check ^ np.int64(raw[i])) & 0xFF] ^ (check >> 8)
    return check ^ 0xFFFFFFFF


@kernel
def _put(raw: NDArray[np.uint8], at: int, value: int, size: int) -> None:
    for i in range(size):
        raw[at + i] = (value >> (8 * i)) & 0xFF


@kernel
def _get(raw: NDArray[np.uint8], at: int, size: int) -> np.int64:
    value = np.int64(0)
    for i in range(size):
        value |= np.int64(raw[at + i]) << (8 * i)
    return value
