"""Why nothing can be read in bytes of a device: what a maker's sender does otherwise than the wire format."""

import re
from collections import Counter
from functools import reduce
from operator import xor

from underfoot.devices.framing.wire_format import ACCELERATION, COLUMNS, FORCES, STUFFED_BYTES
from underfoot.quantities import counted

_SHOWN = 60  # characters of a line
_CHECKED_LINE = re.compile(r"\d+(,\d+){6}\*.*")


def why_unread(data: bytes, doubt: str) -> str:
    """Return why there is no valid frame or line in `data`; `doubt` is the transport's, of bytes that are anything.

    >>> why_unread(3 * b"0;41;41000;312;298;305;290\\n", "is the baud rate right?")
    "lines as '0;41;41000;312;298;305;290'; allowed: tile,sequence,microseconds,r1,r2,r3,r4 in whole numbers, 0 or more"
    """
    text = data.replace(b"\0", b"\n")  # a zero ends each datagram
    lines = [line.strip() for line in text.split(b"\n")[1:-1]]  # the first and the last may be parts
    if any(lines) and all(32 <= byte < 127 or byte in b"\t\r\n" for byte in text):
        shown = max(lines, key=len)[:_SHOWN].decode("ascii")
        if _CHECKED_LINE.fullmatch(shown):
            right = reduce(xor, shown.rpartition("*")[0].encode())
            return f"lines as {shown!r}; allowed: *{right:02X} at its end, the exclusive or of all characters before *"
        return f"lines as {shown!r}; allowed: {','.join(COLUMNS)} in whole numbers, 0 or more"
    pieces = data.split(b"\0")[1:-1]
    if not pieces:
        return f"no zero byte, which ends a frame; {doubt}"
    length, often = Counter(map(len, pieces)).most_common(1)[0]
    if 2 * often <= len(pieces):
        return f"zero bytes are anywhere in them, not at the ends of frames alone (COBS); {doubt}"
    if length != STUFFED_BYTES:
        return f"{counted(length, 'byte')} before each zero byte; allowed: {STUFFED_BYTES}, a stuffed frame"
    raw = _unstuffed(next(piece for piece in pieces if len(piece) == length))
    if len(raw) != STUFFED_BYTES - 1:
        return f"frames of {STUFFED_BYTES} bytes that are not stuffed as COBS does"
    if not FORCES <= raw[0] <= ACCELERATION:
        return f"frames of kind {raw[0]}; allowed: {FORCES}, forces, and {ACCELERATION}, acceleration"
    return "frames with a wrong CRC-32; allowed: that of zlib over the 17 bytes before it, the low byte first"


def _unstuffed(piece: bytes) -> bytes:
    """Return the bytes that COBS has stuffed into a piece without zeros; the last zero is the delimiter's."""
    raw, at = bytearray(), 0
    while at < len(piece):
        raw += piece[at + 1 : at + piece[at]] + b"\0"
        at += piece[at]
    return bytes(raw[:-1]) if at == len(piece) else b""
