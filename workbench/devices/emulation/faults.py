"""What goes wrong on a line, made on request and counted exactly: frames lost, doubled, reordered, corrupted, late."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.framing.wire_format import FRAME, TILE, csv_lines, pack
from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.signals.random import stream_key, uniform

KINDS = ("lost", "doubled", "reordered", "corrupted", "late")
_SOUND, _LOST, _DOUBLED, _REORDERED, _CORRUPTED, _LATE = range(6)


@dataclass(frozen=True)
class Faults:
    """How likely each fault befalls a frame, 0 to 1, at most one each; and when the line is unplugged.

    A reordered frame goes out behind the next of its tile, a late one behind `late_frames` more of its tile (at most
    60, of which a parser can still tell that they are late). `unplugged` are stretches in seconds: from, and for.
    """

    lost: float = 0.0
    doubled: float = 0.0
    reordered: float = 0.0
    corrupted: float = 0.0
    late: float = 0.0
    late_frames: int = 20
    unplugged: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        for kind in KINDS:
            require(0.0 <= getattr(self, kind) <= 1.0, kind, getattr(self, kind), "0 to 1")
        total = sum(getattr(self, kind) for kind in KINDS)
        require(total <= 1.0 + 1e-12, "all faults together", total, "at most 1")
        require(1 <= self.late_frames <= 60, "late_frames", self.late_frames, "1 to 60")
        for begin, length in self.unplugged:
            require(begin >= 0.0 and length > 0.0, "unplugged", (begin, length), "from 0 s on, for more than 0 s")


@dataclass
class Made:
    """What was made of the frames that were given: a frame is in one of the last five, or else went out as it was."""

    frames: int = 0
    lost: int = 0
    doubled: int = 0
    reordered: int = 0
    corrupted: int = 0
    late: int = 0


class FaultyLine:
    """Encodes frames and lets faults befall them; the same for the same seed, however the frames are split.

    `sent`, where it is a list, keeps what went out in order: rows of tile, sequence, and 1 or 0 for sound or corrupted.

    >>> line = FaultyLine(Faults(lost=0.5), seed=3)
    >>> rows = [[0, i, 1000 * i, 1, 2, 3, 4] for i in range(100)]
    >>> len(line.send(rows)) == FRAME * (100 - line.made.lost), 30 < line.made.lost < 70
    (True, True)
    """

    def __init__(self, faults: Faults | None = None, seed: int = 1, csv: bool = False, keep: bool = False) -> None:
        self.faults, self.made, self.csv = faults or Faults(), Made(), csv
        self.sent: list[NDArray[np.int64]] | None = [] if keep else None
        self._key = stream_key(seed, "faults")
        self._ends = np.cumsum([getattr(self.faults, kind) for kind in KINDS])
        self._held: dict[int, list[tuple[int, NDArray[np.int64]]]] = {}
        self._count = 0

    def send(self, frames: object) -> bytes:
        """The bytes that go out when these frames (n, 7) are sent."""
        rows = np.atleast_2d(np.asarray(frames, np.int64))
        kinds = np.zeros(len(rows), np.int64)
        if self._ends[-1] > 0.0:
            _draw(self._key, self._count, self._ends, kinds)
        self._count += len(rows)
        self.made.frames += len(rows)
        for number, kind in enumerate(KINDS, start=_LOST):
            setattr(self.made, kind, getattr(self.made, kind) + int((kinds == number).sum()))
        out, sound = self._order(rows, kinds)
        return self._encode(out, sound)

    def end(self) -> bytes:
        """What is still held back."""
        rest = [row for waiting in self._held.values() for _, row in waiting]
        self._held.clear()
        rows = np.array(rest, np.int64).reshape(-1, 7)
        return self._encode(rows, np.ones(len(rows), np.bool_))

    def _order(self, rows: NDArray[np.int64], kinds: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
        """Frames in the order in which they go out, and which of them are sound."""
        if not (self._held or np.isin(kinds, (_REORDERED, _LATE)).any()):
            times = np.where(kinds == _LOST, 0, np.where(kinds == _DOUBLED, 2, 1))
            return np.repeat(rows, times, axis=0), np.repeat(kinds != _CORRUPTED, times)
        out: list[NDArray[np.int64]] = []
        sound: list[bool] = []
        for row, kind in zip(rows, kinds.tolist(), strict=True):
            waiting = self._held.get(int(row[TILE]), [])
            if kind in (_REORDERED, _LATE):
                after = 1 if kind == _REORDERED else self.faults.late_frames
                self._held.setdefault(int(row[TILE]), []).append((after + 1, row))
                waiting = self._held[int(row[TILE])]
            else:
                for _ in range((1, 0, 2, 1, 1)[kind]):
                    out.append(row)
                    sound.append(kind != _CORRUPTED)
            waiting[:] = [(after - 1, held) for after, held in waiting]
            for _, held in [each for each in waiting if each[0] <= 0]:
                out.append(held)
                sound.append(True)
            waiting[:] = [each for each in waiting if each[0] > 0]
        return np.array(out, np.int64).reshape(-1, rows.shape[1]), np.array(sound, np.bool_)

    def _encode(self, rows: NDArray[np.int64], sound: NDArray[np.bool_]) -> bytes:
        if self.sent is not None:
            self.sent.append(np.column_stack([rows[:, :2], sound]))
        if self.csv:
            return b"".join(
                csv_lines(row) if good else self._spoil(csv_lines(row))
                for row, good in zip(rows, sound.tolist(), strict=True)
            )
        data = np.empty(len(rows) * FRAME, np.uint8)
        pack(np.ascontiguousarray(rows), data)
        for place in np.flatnonzero(~sound):
            data[place * FRAME : (place + 1) * FRAME] = np.frombuffer(
                self._spoil(data[place * FRAME : (place + 1) * FRAME].tobytes()), np.uint8
            )
        return data.tobytes()

    def _spoil(self, data: bytes) -> bytes:
        """One to three bytes are not what they were; anywhere, the delimiter too. In a line of text it shows."""
        spoilt = bytearray(data)
        key = stream_key(int(self._key), "spoil", data)
        length = len(data) - (1 if self.csv else 0)  # without its end, a line would spoil the next
        places = {int(uniform(key, 2 * i) * length) for i in range(1 + int(uniform(key, 99) * 3))}
        for i, place in enumerate(sorted(places)):
            spoilt[place] = ord("?") if self.csv else spoilt[place] ^ (1 + int(uniform(key, 2 * i + 1) * 255))
        return bytes(spoilt)


def names() -> tuple[str, ...]:
    """The faults that befall single frames.

    >>> names()
    ('lost', 'doubled', 'reordered', 'corrupted', 'late')
    """
    return tuple(field.name for field in fields(Made))[1:]


@kernel
def _draw(key, first, ends, kinds):
    for i in range(len(kinds)):
        u = uniform(key, first + i)
        for kind in range(len(ends)):
            if u < ends[kind]:
                kinds[i] = kind + 1
                break
