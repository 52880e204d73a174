"""The one parser of what tiles send: bytes from anywhere, in any pieces, to frames; and a count of what went wrong.

It looks for stuffed frames and for lines of text at once, until the first sound one settles which of the two the
stream is made of; when 4 KiB bring no sound one it looks for both again. So neither a boot message in front nor new
firmware on the same port confuses it. A zero ends a frame and any line; newlines end lines.

After damage it is in step again with the next frame: a delimiter that was hit costs the frame that it ended, not the
one behind it, because the last 22 bytes before a zero are tried, whatever stands in front of them.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.framing.wire_format import FIELDS, LARGEST, MICROSECONDS, SEQUENCE, STUFFED, TILE, unpack
from underfoot.errors import require
from underfoot.kernels import kernel

LIFE = len(FIELDS)
"""The column behind a frame's own: how often its tile has begun anew."""
WIDTH = LIFE + 1
FORMS = ("auto", "binary", "csv")
WINDOW = 64
"""A frame that comes behind one that is this much newer is too late to be told from an old one."""

_AUTO, _BINARY, _CSV = range(3)
_PATIENCE = 4096  # bytes without one sound frame after which the form is open again
_JUMP_US = 100_000  # a tile whose time and sequence disagree by more than this, and by half, began anew
_LOST_STEP = 1 << 31

# What the scanner is in the middle of.
_FORM, _SINCE, _IN_STEP, _HELD, _FIELD, _DIGITS, _BAD, _LENGTH, _SCANNER = range(9)
_GOOD, _CORRUPTED, _LOST, _DOUBLED, _REORDERED, _STALE, _RESTARTS, _COUNTS = range(8)
# What is known of a tile, behind its counts: its newest frame, and one that did not fit to it.
_SEEN, _NEWEST, _TIME, _PERIOD, _AGE, _ODD, _LIVES, _TILE = range(_COUNTS, _COUNTS + 8)
_TILES = 0x10000


@dataclass(frozen=True)
class Counts:
    """What became of frames.

    `good` were handed over. `lost` never came, or not whole, as the sequence tells: those that were corrupted are
    among them. `corrupted` are pieces between delimiters that were no sound frame (one frame may leave two).
    `doubled` came again, and `stale` more than 64 frames late: neither is handed over. `reordered` came behind a newer
    one, and are handed over. `restarts` are tiles that began to count anew.
    """

    good: int = 0
    corrupted: int = 0
    lost: int = 0
    doubled: int = 0
    reordered: int = 0
    stale: int = 0
    restarts: int = 0


class Parser:
    """Frames from a stream of bytes; `form` is "binary", "csv", or "auto" for whichever comes.

    >>> from underfoot.devices.framing.wire_format import encode
    >>> parser = Parser()
    >>> sent = encode([[0, 41, 1000, 1, 2, 3, 4], [0, 43, 3000, 5, 6, 7, 8]])
    >>> [len(parser.feed(piece)) for piece in (sent[:30], sent[30:])]
    [1, 1]
    >>> parser.counts.good, parser.counts.lost
    (2, 1)
    """

    def __init__(self, form: str = "auto") -> None:
        require(form in FORMS, "form", form, ", ".join(FORMS))
        self._open_form = FORMS.index(form)
        self._scanner = np.zeros(_SCANNER, np.int64)
        self._scanner[_FORM] = self._open_form
        self._scanner[_IN_STEP] = 1
        self._held = np.zeros(STUFFED, np.uint8)
        self._row = np.zeros(WIDTH, np.int64)
        self._scratch = np.zeros(STUFFED, np.uint8)
        self._counts = np.zeros(_COUNTS, np.int64)
        self._tiles = np.zeros((_TILES, _TILE), np.int64)  # taken by the system only where a tile is heard of
        self._bits = np.zeros(_TILES, np.uint64)
        self._out = np.zeros((4096, WIDTH), np.int64)
        self.bytes = 0
        """Bytes that were read."""

    def feed(self, data: bytes | bytearray | memoryview) -> NDArray[np.int64]:
        """The sound frames that end in these bytes, (n, 8): a frame's seven fields, then its tile's life.

        Microseconds are unwrapped. The array is the parser's own, and is written to by the next call.
        """
        given = np.frombuffer(memoryview(data).toreadonly(), np.uint8)  # one kind of array, one kernel
        self.bytes += len(given)
        if len(self._out) < len(given) // 13 + 1:  # the shortest line has 13 characters and an end
            self._out = np.zeros((2 * len(given) // 13 + 1, WIDTH), np.int64)
        count = _scan(
            given, self._open_form, self._scanner, self._held, self._scratch, self._row, self._counts, self._tiles,
            self._bits, self._out,
        )  # fmt: skip
        return self._out[:count]

    def cut(self) -> None:
        """Forget the piece of a frame that is being read, and pass over the next up to its end: the line was broken, or
        joined in the middle. What is known of tiles stays."""
        self._scanner[_IN_STEP] = self._scanner[_HELD] = 0
        self._scanner[_FIELD] = self._scanner[_DIGITS] = self._scanner[_BAD] = self._scanner[_LENGTH] = 0

    @property
    def form(self) -> str:
        """What the stream is made of: "binary" or "csv"; "auto" while that is open."""
        return FORMS[self._scanner[_FORM]]

    @property
    def counts(self) -> Counts:
        """What became of all frames so far."""
        return Counts(*self._counts.tolist())

    def period_us(self, tile: int) -> int:
        """Microseconds between a tile's samples, by its own clock; 0 where that is not known yet."""
        return int(self._tiles[tile, _PERIOD]) if self._tiles[tile, _GOOD] >= WINDOW else 0

    def counts_of(self, tile: int) -> Counts:
        """What became of one tile's frames; corrupted ones belong to no tile."""
        return Counts(*self._tiles[tile, :_COUNTS].tolist())


@kernel
def _scan(data, open_form, scanner, held, scratch, row, counts, tiles, bits, out):
    written = 0
    for byte in data:
        scanner[_SINCE] += 1
        if scanner[_SINCE] > _PATIENCE:
            scanner[_FORM] = open_form
            scanner[_SINCE] = 0
        sound = False
        if scanner[_FORM] != _CSV:
            if byte == 0:
                sound = _end_frame(scanner, held, scratch, row, counts)
            else:
                held[scanner[_HELD] % STUFFED] = byte
                scanner[_HELD] += 1
        if scanner[_FORM] != _BINARY and not sound:
            sound = _read_text(byte, scanner, row, counts)
        if sound:
            scanner[_SINCE] = 0
            if _accept(row, tiles[row[TILE]], bits, counts):
                out[written] = row
                written += 1
    return written


@kernel
def _end_frame(scanner, held, scratch, row, counts):
    """A delimiter: whether the bytes in front of it are a frame, which is then in `row`."""
    length = scanner[_HELD]
    scanner[_HELD] = 0
    if length == 0:
        return False
    sound = False
    if length >= STUFFED:
        for i in range(STUFFED):
            scratch[i] = held[(length + i) % STUFFED]
        sound = unpack(scratch, row)
    # What is read first may be the end of a frame whose beginning was never read.
    if scanner[_FORM] == _BINARY and scanner[_IN_STEP] == 1 and (not sound or length > STUFFED):
        counts[_CORRUPTED] += 1
    scanner[_IN_STEP] = 1
    if sound:
        scanner[_FORM] = _BINARY
    return sound


@kernel
def _read_text(byte, scanner, row, counts):
    """A character of a line: whether it ends a frame, which is then in `row`."""
    field = scanner[_FIELD]
    if byte == 10 or byte == 0:
        # Of a line that was joined in the middle, the first number may lack digits.
        sound = field == 6 and scanner[_DIGITS] > 0 and scanner[_BAD] == 0 and scanner[_IN_STEP] == 1
        if scanner[_FORM] == _CSV and scanner[_IN_STEP] == 1 and not sound and scanner[_LENGTH] > 0:
            counts[_CORRUPTED] += 1
        scanner[_IN_STEP] = 1
        scanner[_FIELD] = scanner[_DIGITS] = scanner[_BAD] = scanner[_LENGTH] = 0
        if sound:
            scanner[_FORM] = _CSV
            row[SEQUENCE] &= 0xFFFF
        return sound
    if byte == 13 or byte == 32:
        return False
    scanner[_LENGTH] += 1
    if scanner[_BAD] == 1:
        return False
    if 48 <= byte <= 57:
        row[field] = (row[field] * 10 if scanner[_DIGITS] > 0 else 0) + byte - 48
        scanner[_DIGITS] += 1
        # A beginner's counter may be longer than sixteen bits.
        most = LARGEST[MICROSECONDS] if field == SEQUENCE else LARGEST[field]
        scanner[_BAD] = 1 if row[field] > most else 0
    elif byte == 44 and scanner[_DIGITS] > 0 and field < 6:
        scanner[_FIELD] += 1
        scanner[_DIGITS] = 0
    else:
        scanner[_BAD] = 1
    return False


@kernel
def _accept(row, tile, bits, counts):
    """Whether a sound frame is handed over; completes it, and counts what its place in the sequence says."""
    number = row[TILE]
    if tile[_SEEN] == 0:
        tile[_SEEN] = 1
        return _begin(row, tile, bits, counts)
    ahead = ((row[SEQUENCE] - tile[_NEWEST] + 0x8000) & 0xFFFF) - 0x8000
    passed = ((row[MICROSECONDS] - tile[_TIME] + _LOST_STEP) & 0xFFFF_FFFF) - _LOST_STEP
    expected = ahead * tile[_PERIOD]
    odd = tile[_PERIOD] > 0 and abs(passed - expected) > max(_JUMP_US, abs(expected) // 2)
    if odd or ahead <= -WINDOW:
        # A tile that began anew goes on from there; a frame that was held up somewhere stays alone.
        follows = 0 < ((row[SEQUENCE] - tile[_ODD]) & 0xFFFF) < WINDOW
        if tile[_ODD] >= 0 and follows:
            tile[_LIVES] += 1
            _count(counts, tile, _RESTARTS, 1)
            return _begin(row, tile, bits, counts)
        tile[_ODD] = row[SEQUENCE]
        _count(counts, tile, _STALE, 1)
        return False
    tile[_ODD] = -1
    row[MICROSECONDS] = tile[_TIME] + passed
    row[LIFE] = tile[_LIVES]
    if ahead > 0:
        _count(counts, tile, _LOST, ahead - 1)
        bits[number] = (bits[number] << np.uint64(ahead)) | np.uint64(1) if ahead < WINDOW else np.uint64(1)
        if ahead == 1:
            tile[_PERIOD] += (passed - tile[_PERIOD]) // 16 if tile[_PERIOD] > 0 else passed
        tile[_NEWEST] = row[SEQUENCE]
        tile[_TIME] += passed
        tile[_AGE] = min(tile[_AGE] + ahead, WINDOW)
    else:
        mark = np.uint64(1) << np.uint64(-ahead)
        if bits[number] & mark:
            _count(counts, tile, _DOUBLED, 1)
            return False
        bits[number] |= mark
        _count(counts, tile, _REORDERED, 1)
        # Only what lies behind the very first frame was counted as lost.
        earlier = -ahead - tile[_AGE]
        _count(counts, tile, _LOST, earlier - 1 if earlier > 0 else -1)
        tile[_AGE] = max(tile[_AGE], -ahead)
    _count(counts, tile, _GOOD, 1)
    return True


@kernel
def _begin(row, tile, bits, counts):
    """The first frame of a tile, or of its new life."""
    tile[_NEWEST], tile[_TIME] = row[SEQUENCE], row[MICROSECONDS]
    tile[_PERIOD] = tile[_AGE] = 0
    tile[_ODD] = -1
    bits[row[TILE]] = 1
    row[LIFE] = tile[_LIVES]
    _count(counts, tile, _GOOD, 1)
    return True


@kernel
def _count(counts, tile, kind, many):
    counts[kind] += many
    tile[kind] += many
