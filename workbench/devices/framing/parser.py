"""The parser of tiles' data: turns bytes, in pieces of any size, into samples, and counts errors.

It searches for stuffed frames and for lines of text at once, until the first valid one settles the form of the sender;
after 4 KiB without a valid one it searches for both again. So it recovers from boot messages and from new firmware on
the same port, and of several boards each has its own form. A zero ends a frame or a line; newlines end lines.

After damage it is in step again with the next frame: a damaged delimiter costs the frame that it ended, not the one
after it, because the last 22 bytes before a zero are tried as a frame, whatever precedes them.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.devices.framing.wire_format import FORCES, MAX_VALUES, SAMPLE, STUFFED_BYTES, unpack
from underfoot.kernels import kernel

WINDOW = 64
"""Frames at least this many behind the newest are stale: they cannot be told from old ones."""
HELD_S = 1.0
"""A tile belongs to the sender of its last frames, until that has been silent for this many seconds."""

_OPEN, _BINARY, _CSV = range(3)  # forms of the stream
_SCANNERS = 4096  # a power of 2: senders with the same last bits share one, which is of one form at a time
_PATIENCE_BYTES = 4096  # after this many bytes without a valid frame, the form is open again
_HELD_UP_US = 500_000  # frames of up to this long ago may have been held up, several at once
_JUMP_US = 100_000  # a tile has restarted if its time and sequence disagree by more than this, and by half
_HALF_TURN = 1 << 31
_COMMA, _STAR = b",*"
_SEQUENCE, _MICROSECONDS, _LAST, _CHECKSUM = 1, 2, 6, 7  # columns of a line


class FrameCounts(Struct, frozen=True):
    """Counts of frames by outcome.

    `accepted` were handed over. `lost` did not arrive whole, by the sequence numbers: they include corrupted ones.
    `corrupted` are pieces between delimiters that were not valid frames (one frame may leave two). `doubled` arrived
    again, and `stale` more than 64 frames late, or from another board that is the same tile: neither is handed over.
    `reordered` arrived after a newer one, and are handed over. `restarts` are tiles whose sequence began again.
    `foreign` are of a tile that belongs to another sender, and are not handed over.
    """

    accepted: int = 0
    corrupted: int = 0
    lost: int = 0
    doubled: int = 0
    reordered: int = 0
    stale: int = 0
    restarts: int = 0
    foreign: int = 0

    @property
    def valid(self) -> int:
        """All valid frames, handed over or not."""
        return self.accepted + self.doubled + self.stale + self.foreign


_COUNTS = [(name, np.int64) for name in FrameCounts.__struct_fields__]
_TOTAL = np.dtype(_COUNTS, align=True)
_SCANNER = np.dtype(
    [
        ("form", np.int64),
        ("since_valid", np.int64),
        ("in_step", np.bool_),
        ("held", np.uint8, (STUFFED_BYTES,)),
        ("held_count", np.int64),
        ("column", np.int64),
        ("digits", np.int64),
        ("values", np.int64, (len(MAX_VALUES),)),
        ("is_bad", np.bool_),
        ("line_length", np.int64),
        ("checksum", np.int64),
        ("has_checksum", np.bool_),
    ],
    align=True,
)
"""State of the scanner of a sender. `since_valid` is the number of bytes since the last valid frame; `in_step` is true
if the beginning of the present piece was read. Of a frame: its last bytes, `held` in a ring, and their number. Of a
line: the column, its digits so far, the numbers, whether it is already invalid, its length and checksum; `has_checksum`
is of the latest line.
"""
_TILE = np.dtype(
    [
        *_COUNTS,
        ("is_known", np.bool_),
        ("newest", np.int64),
        ("time_us", np.int64),
        ("period_us", np.int64),
        ("still", np.int64),
        ("missed", np.int64),
        ("age", np.int64),
        ("suspect", np.int64),
        ("patience", np.int64),
        ("epoch", np.int64),
        ("received", np.uint64),
        ("checked", np.int64),
        ("sender", np.int64),
        ("heard_s", np.float64),
        ("stranger", np.int64),
        ("stranger_s", np.float64),
    ],
    align=True,
)
"""State of a tile: its counts, the sequence number of its `newest` frame, and that frame's unwrapped time; the number
of newest frames since which that time is the same, and of lost ones in gaps shorter than `WINDOW`. Bit i of
`received` is set if the frame i before the newest arrived; `age` is how many frames before it can be missing.
`suspect` is the sequence number of the latest frame, if that did not fit, or -1; after `patience` more that follow it,
the tile has begun anew. After a line with a checksum, `checked` more without one are taken for damaged. The tile
belongs to `sender`, last heard at `heard_s`; `stranger` is the last other sender of its frames, last heard at
`stranger_s`.
"""
_ONE_SENDER = np.array([[np.iinfo(np.int64).max, 0]], np.int64)
_TILES = 0x10000
"""Number of tiles. The table has them once for each kind of frame, forces first."""


class _State(NamedTuple):
    """State kept between two pieces; arrays of one record, except `scanners`, `stuffed` and `tiles`."""

    scanners: NDArray[np.void]
    sample: NDArray[np.void]
    stuffed: NDArray[np.uint8]
    total: NDArray[np.void]
    tiles: NDArray[np.void]


class Parser:
    """Extracts samples from a stream of bytes.

    >>> from underfoot.devices.framing.wire_format import encode
    >>> parser = Parser()
    >>> sent = encode([[0, 41, 1000, 1, 2, 3, 4], [0, 43, 3000, 5, 6, 7, 8]])
    >>> [parser.feed(piece)["sequence"].tolist() for piece in (sent[:30], sent[30:])]
    [[41], [43]]
    >>> parser.counts.accepted, parser.counts.lost
    (2, 1)
    """

    def __init__(self) -> None:
        self._state = _State(
            scanners=np.zeros(_SCANNERS, _SCANNER),
            sample=np.zeros(1, SAMPLE),
            stuffed=np.zeros(STUFFED_BYTES, np.uint8),
            total=np.zeros(1, _TOTAL),
            tiles=np.zeros(2 * _TILES, _TILE),  # memory is allocated by the system only for tiles in use
        )
        self._parts = tuple(self._state)
        self._state.scanners["in_step"] = True
        self._out = np.zeros(4096, SAMPLE)
        self.bytes = 0
        """Number of bytes read."""

    def feed(
        self, data: bytes | bytearray | memoryview, senders: Sequence[tuple[int, int]] | None = None, now_s: float = 0.0
    ) -> NDArray[np.void]:
        """Return the valid frames that end in these bytes: records of `SAMPLE` (n,).

        Doubled, stale and foreign ones are left out. `senders` has the end of each sender's bytes, and its
        number; they arrived at `now_s`. Without it, all are from one sender. Microseconds are unwrapped. The array
        belongs to the parser; the next call overwrites it.
        """
        given = np.frombuffer(memoryview(data).toreadonly(), np.uint8)  # one kind of array, one kernel
        self.bytes += len(given)
        if len(self._out) < len(given) // 13 + 1:  # the shortest line has 13 characters and a newline
            self._out = np.zeros(2 * len(given) // 13 + 1, SAMPLE)
        ends = _ONE_SENDER if senders is None else np.array(senders, np.int64)
        return self._out[: _scan(given, ends, now_s, self._parts, self._out)]

    def resync(self) -> None:
        """Discard the partial frame, and skip everything up to the end of the next.

        For a connection that was interrupted, or joined in the middle. The state of tiles is kept.
        """
        self._state.scanners[0]["in_step"] = False  # several senders' bytes are whole frames

    @property
    def counts(self) -> FrameCounts:
        """Counts of all frames so far."""
        return FrameCounts(*self._state.total[0].tolist())

    def period_us(self, tile: int) -> int:
        """Return the microseconds between a tile's samples, by its own clock; 0 if not known yet."""
        known = self._state.tiles[tile]
        return int(known["period_us"]) if known["accepted"] >= WINDOW else 0

    def only_leaps(self, tile: int) -> bool:
        """Return whether none of a tile's frames since it began came next to another, over `WINDOW` numbers or more."""
        known = self._state.tiles[tile]
        return bool(known["period_us"] == 0 and known["age"] >= WINDOW)

    def stands_still(self, tile: int) -> bool:
        """Return whether a tile's microseconds have been the same in its last `WINDOW` frames or more."""
        known = self._state.tiles[tile]
        return bool(known["still"] >= WINDOW)

    def tile_counts(self, tiles: int) -> NDArray[np.int64]:
        """Return what came of each of the first so many tiles (n, 5): frames that were handed over, those that were
        lost one by one, those that were refused as doubled or stale, those of strangers, and how often the tile began
        anew.
        """
        known = self._state.tiles[:tiles]
        refused = known["doubled"] + known["stale"]
        return np.stack([known["accepted"], known["missed"], refused, known["foreign"], known["restarts"]], axis=1)

    def lost(self, tiles: int) -> int:
        """Return how many frames of the first so many tiles did not arrive, as in `FrameCounts`."""
        return int(self._state.tiles[:tiles]["lost"].sum())

    def heard(self, tiles: int) -> NDArray[np.int64]:
        """Return how many valid frames of each of the first so many tiles came, handed over or not."""
        known = self._state.tiles[:tiles]
        return np.asarray(known["accepted"] + known["doubled"] + known["stale"] + known["foreign"])

    def senders_of(self, tile: int) -> tuple[int, int]:
        """Return the number of the sender that a tile belongs to, and of the last other sender of its frames."""
        known = self._state.tiles[tile]
        return int(known["sender"]), int(known["stranger"])

    def is_contested(self, tile: int) -> bool:
        """Return whether frames of a tile came from another sender while its own went on.

        One that is started anew sends from another port: it is a stranger until the old one has been silent for long
        enough, and then the tile is its own.
        """
        known = self._state.tiles[tile]
        is_other = known["foreign"] > 0 and known["stranger"] != known["sender"]
        return bool(is_other and known["heard_s"] > known["stranger_s"])


@kernel
def _scan(
    data: NDArray[np.uint8], senders: NDArray[np.int64], now_s: float, parts: tuple[Any, ...], out: NDArray[np.void]
) -> int:
    """Read bytes; return the number of samples written to `out`.

    `parts` are those of a `_State`: Numba allocates when it is given a named tuple.
    """
    state = _State(*parts)
    sample, total = state.sample[0], state.total[0]
    written = of = 0
    scanner = state.scanners[senders[of, 1] % _SCANNERS]
    for at, byte in enumerate(data):
        while at >= senders[of, 0]:
            of += 1
            scanner = state.scanners[senders[of, 1] % _SCANNERS]
        scanner.since_valid += 1
        if scanner.since_valid > _PATIENCE_BYTES:
            scanner.form = _OPEN
            scanner.since_valid = 0
        is_valid = False
        if scanner.form != _CSV:
            if byte == 0:
                is_valid = _end_frame(scanner, state.stuffed, sample, total)
            else:
                scanner.held[scanner.held_count % STUFFED_BYTES] = byte
                scanner.held_count += 1
        if scanner.form != _BINARY and not is_valid:
            is_valid = _read_text(byte, scanner, sample, total)
        if is_valid:
            scanner.since_valid = 0
            tile = state.tiles[sample.tile + (sample.kind - FORCES) * _TILES]
            is_own = _is_own(tile, senders[of, 1], now_s, total)
            if is_own and _is_whole(scanner, tile, total) and _accept(sample, tile, total):
                out[written] = sample
                written += 1
    return written


@kernel
def _end_frame(scanner: np.record, stuffed: NDArray[np.uint8], sample: np.record, total: np.record) -> bool:
    """Read a delimiter; return whether the bytes before it are a valid frame, which is then in `sample`."""
    length = scanner.held_count
    scanner.held_count = 0
    if length == 0:
        return False
    is_valid = False
    if length >= STUFFED_BYTES:
        for i in range(STUFFED_BYTES):
            stuffed[i] = scanner.held[(length + i) % STUFFED_BYTES]
        is_valid = unpack(stuffed, sample)
    # The first bytes read may be the end of a frame whose beginning was missed.
    if scanner.form == _BINARY and scanner.in_step and (not is_valid or length > STUFFED_BYTES):
        total.corrupted += 1
    scanner.in_step = True
    if is_valid:
        scanner.form = _BINARY
    return is_valid


@kernel
def _read_text(byte: int, scanner: np.record, sample: np.record, total: np.record) -> bool:
    """Read a character of a line; return whether it ends a valid line, whose numbers are then in `sample`."""
    if byte == 10 or byte == 0:
        return _end_line(scanner, sample, total)
    column = scanner.column
    if column < _CHECKSUM and byte != _STAR:
        scanner.checksum ^= byte
    if byte == 13 or byte == 32:
        return False
    scanner.line_length += 1
    if scanner.is_bad:
        return False
    if column == _CHECKSUM:
        digit = scanner.checksum & 15 if scanner.digits > 0 else scanner.checksum >> 4
        scanner.is_bad = byte | 32 != digit + (48 if digit < 10 else 87)  # a capital or small letter
        scanner.digits += 1
    elif 48 <= byte <= 57:
        scanner.values[column] = (scanner.values[column] * 10 if scanner.digits > 0 else 0) + byte - 48
        scanner.digits += 1
        # The counter of simple firmware may exceed sixteen bits.
        most = MAX_VALUES[_MICROSECONDS] if column == _SEQUENCE else MAX_VALUES[column]
        scanner.is_bad = scanner.values[column] > most
    elif byte == (_STAR if column == _LAST else _COMMA) and scanner.digits > 0:
        scanner.column += 1
        scanner.digits = 0
    else:
        scanner.is_bad = True
    return False


@kernel
def _end_line(scanner: np.record, sample: np.record, total: np.record) -> bool:
    # In a line that was joined in the middle, the first number may lack digits.
    scanner.has_checksum = scanner.column == _CHECKSUM
    is_whole = scanner.digits == 2 if scanner.has_checksum else scanner.column == _LAST and scanner.digits > 0
    is_valid = is_whole and not scanner.is_bad and scanner.in_step
    if scanner.form == _CSV and scanner.in_step and not is_valid and scanner.line_length > 0:
        total.corrupted += 1
    scanner.in_step = True
    scanner.column = scanner.digits = scanner.line_length = scanner.checksum = 0
    scanner.is_bad = False
    if is_valid:
        scanner.form = _CSV
        sample.kind = FORCES
        sample.tile = scanner.values[0]
        sample.sequence = scanner.values[_SEQUENCE] & 0xFFFF
        sample.microseconds = scanner.values[_MICROSECONDS]
        for sensor in range(4):
            sample.readings[sensor] = scanner.values[3 + sensor]
    return is_valid


@kernel
def _is_whole(scanner: np.record, tile: np.record, total: np.record) -> bool:
    """Return whether the latest frame lacks no checksum, as a line would where the others of its tile have one."""
    if scanner.form == _BINARY:
        return True
    if scanner.has_checksum:
        tile.checked = WINDOW
    elif tile.checked > 0:
        tile.checked -= 1
        total.corrupted += 1
        return False
    return True


@kernel
def _accept(sample: np.record, tile: np.record, total: np.record) -> bool:
    """Complete a valid frame, count it by its sequence number, and return whether it is handed over."""
    if not tile.is_known:
        tile.is_known, tile.patience = True, 1
        return _begin(sample, tile, total)
    ahead = ((sample.sequence - tile.newest + 0x8000) & 0xFFFF) - 0x8000
    passed_us = ((sample.microseconds - tile.time_us + _HALF_TURN) & 0xFFFF_FFFF) - _HALF_TURN
    expected_us = ahead * tile.period_us
    jumped = tile.period_us > 0 and abs(passed_us - expected_us) > max(_JUMP_US, abs(expected_us) // 2)
    jumped |= ahead > 0 and passed_us <= -max(tile.period_us, 1)  # a later sample with an earlier time
    jumped |= ahead >= WINDOW and tile.period_us == 0 and tile.epoch > 0  # of before it began anew
    if jumped or ahead <= -WINDOW:
        # A restarted tile continues from there; a frame that was held up stays alone. One of which only the clock
        # stepped goes on in its numbers.
        follows = 0 < ((sample.sequence - tile.suspect) & 0xFFFF) < WINDOW
        if tile.suspect < 0 and not jumped and passed_us > -_HELD_UP_US:
            tile.patience = WINDOW
        if tile.suspect >= 0 and follows:
            tile.patience = 0 if 0 < ahead < WINDOW else tile.patience - 1
        if tile.patience == 0:
            tile.epoch += 1
            # After half a turn of the sequence nobody can tell: the line may have been away, or the computer asleep. A
            # board that slept goes on in its numbers, and its clock, too.
            has_slept = 0 < ahead < WINDOW and passed_us > 0
            if not has_slept and (tile.period_us == 0 or passed_us < 0x8000 * tile.period_us):
                tile.restarts += 1
                total.restarts += 1
            tile.patience = WINDOW
            return _begin(sample, tile, total)
        tile.suspect = sample.sequence
        tile.stale += 1
        total.stale += 1
        return False
    # Of two boards that send as one tile, one has it until it sends no more: else the force would be now of the other.
    tile.patience = max(tile.patience - 1, 1) if tile.suspect < 0 else WINDOW
    tile.suspect = -1
    sample.microseconds = tile.time_us + passed_us
    sample.epoch = tile.epoch
    if ahead > 0:
        _advance(sample, tile, total, ahead, passed_us)
    elif not _fill(tile, total, -ahead):
        return False
    tile.accepted += 1
    total.accepted += 1
    return True


@kernel
def _is_own(tile: np.record, sender: int, now_s: float, total: np.record) -> bool:
    """Return whether a tile's frame is from the sender that it belongs to, or from the first one after a silence."""
    if tile.is_known and tile.sender != sender and now_s - tile.heard_s < HELD_S:
        tile.stranger, tile.stranger_s = sender, now_s
        tile.foreign += 1
        total.foreign += 1
        return False
    tile.sender, tile.heard_s = sender, now_s
    return True


@kernel
def _begin(sample: np.record, tile: np.record, total: np.record) -> bool:
    """Accept the first frame of a tile, or of its new epoch."""
    tile.newest, tile.time_us = sample.sequence, sample.microseconds
    tile.period_us = tile.still = tile.age = 0
    tile.suspect = -1
    tile.received = 1
    sample.epoch = tile.epoch
    tile.accepted += 1
    total.accepted += 1
    return True


@kernel
def _advance(sample: np.record, tile: np.record, total: np.record, ahead: int, passed_us: int) -> None:
    """Accept a frame that is `ahead` of the newest; those in between count as lost until they arrive."""
    tile.lost += ahead - 1
    total.lost += ahead - 1
    tile.received = (tile.received << np.uint64(ahead)) | np.uint64(1) if ahead < WINDOW else np.uint64(1)
    if ahead < WINDOW:
        tile.missed += ahead - 1
    tile.still = tile.still + 1 if passed_us == 0 else 0
    if ahead == 1:
        tile.period_us += (passed_us - tile.period_us) // 16 if tile.period_us > 0 else passed_us
    tile.newest = sample.sequence
    tile.time_us += passed_us
    tile.age = min(tile.age + ahead, WINDOW)


@kernel
def _fill(tile: np.record, total: np.record, behind: int) -> bool:
    """Accept a frame that is `behind` the newest; return False if it arrived before."""
    mark = np.uint64(1) << np.uint64(behind)
    if tile.received & mark:
        tile.doubled += 1
        total.doubled += 1
        return False
    tile.received |= mark
    tile.reordered += 1
    total.reordered += 1
    # Only frames after the very first one were counted as lost.
    earlier = behind - tile.age
    lost = earlier - 1 if earlier > 0 else -1
    tile.lost += lost
    tile.missed += lost
    total.lost += lost
    tile.age = max(tile.age, behind)
    return True
