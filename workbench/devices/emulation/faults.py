"""Transmission faults, injected on request and counted exactly: frames lost, doubled, reordered, corrupted, late."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.framing.wire_format import FRAME_BYTES, SAMPLE, csv_lines, pack, rows_of
from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.signals.random import stream_key, uniform

KINDS = ("lost", "doubled", "reordered", "corrupted", "late")
"""The faults of single frames."""
_LOST, _DOUBLED, _REORDERED, _CORRUPTED, _LATE = (KINDS.index(kind) + 1 for kind in KINDS)  # 0: none


@dataclass(frozen=True)
class Faults:
    """Probability of each fault of a frame, 0 to 1, at most one fault per frame; and when the transport is unplugged.

    A reordered frame is sent after the next one of its tile, a late one after `late_frames` more of its tile (at most
    60, up to which a parser can still recognise it as late). `unplugged` are intervals in seconds: begin, and length.
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
class FaultCounts:
    """Number of frames given, and of those with each fault; all others were sent unchanged."""

    frames: int = 0
    lost: int = 0
    doubled: int = 0
    reordered: int = 0
    corrupted: int = 0
    late: int = 0


class FaultInjector:
    """Encodes samples and injects faults; the result depends on the seed, not on how samples are split.

    `sent`, if it is a list, records what was sent, in order: tile, sequence, and 1 if intact or 0 if corrupted.

    >>> from underfoot.devices.framing.wire_format import samples_of
    >>> injector = FaultInjector(Faults(lost=0.5), seed=3)
    >>> data = injector.send(samples_of([[0, i, 1000 * i, 1, 2, 3, 4] for i in range(100)]))
    >>> len(data) == FRAME_BYTES * (100 - injector.counts.lost), 30 < injector.counts.lost < 70
    (True, True)
    """

    def __init__(self, faults: Faults | None = None, seed: int = 1, csv: bool = False, keep: bool = False) -> None:
        self.faults, self.counts, self.csv = faults or Faults(), FaultCounts(), csv
        self.sent: list[NDArray[np.int64]] | None = [] if keep else None
        self._key = stream_key(seed, "faults")
        self._ends = np.cumsum([getattr(self.faults, kind) for kind in KINDS])
        self._held: dict[int, list[tuple[int, np.void]]] = {}
        self._count = 0

    def send(self, samples: NDArray[np.void]) -> bytes:
        """Return the bytes sent for these samples, records of `wire_format.SAMPLE`."""
        kinds = np.zeros(len(samples), np.int64)
        if self._ends[-1] > 0.0:
            _draw(self._key, self._count, self._ends, kinds)
        self._count += len(samples)
        self.counts.frames += len(samples)
        for number, kind in enumerate(KINDS, start=_LOST):
            setattr(self.counts, kind, getattr(self.counts, kind) + int((kinds == number).sum()))
        return self._encode(*self._order(samples, kinds))

    def end(self) -> bytes:
        """Return the bytes of frames still held back."""
        rest = [sample for waiting in self._held.values() for _, sample in waiting]
        self._held.clear()
        return self._encode(np.array(rest, SAMPLE), np.ones(len(rest), np.bool_))

    def _order(self, samples: NDArray[np.void], kinds: NDArray[np.int64]) -> tuple[NDArray[np.void], NDArray[np.bool_]]:
        """Return the samples in the order in which they are sent, and which of their frames are intact."""
        if not (self._held or np.isin(kinds, (_REORDERED, _LATE)).any()):
            times = np.where(kinds == _LOST, 0, np.where(kinds == _DOUBLED, 2, 1))
            return np.repeat(samples, times), np.repeat(kinds != _CORRUPTED, times)
        out: list[np.void] = []
        intact: list[bool] = []
        for sample, kind in zip(samples, kinds.tolist(), strict=True):
            tile = int(sample["tile"])
            waiting = self._held.get(tile, [])
            if kind in (_REORDERED, _LATE):
                after = 1 if kind == _REORDERED else self.faults.late_frames
                self._held.setdefault(tile, []).append((after + 1, sample))
                waiting = self._held[tile]
            else:
                copies = {_LOST: 0, _DOUBLED: 2}.get(kind, 1)
                out += [sample] * copies
                intact += [kind != _CORRUPTED] * copies
            waiting[:] = [(after - 1, held) for after, held in waiting]
            due = [held for after, held in waiting if after <= 0]
            out += due
            intact += [True] * len(due)
            waiting[:] = [(after, held) for after, held in waiting if after > 0]
        return np.array(out, SAMPLE), np.array(intact, np.bool_)

    def _encode(self, samples: NDArray[np.void], intact: NDArray[np.bool_]) -> bytes:
        if self.sent is not None:
            self.sent.append(np.column_stack([samples["tile"], samples["sequence"], intact]))
        if self.csv:
            lines = [csv_lines(row) for row in rows_of(samples)]
            return b"".join(
                line if good else self._corrupt(line) for line, good in zip(lines, intact.tolist(), strict=True)
            )
        data = np.empty(len(samples) * FRAME_BYTES, np.uint8)
        pack(samples, data)
        frames = data.reshape(-1, FRAME_BYTES)
        for place in np.flatnonzero(~intact):
            frames[place] = np.frombuffer(self._corrupt(frames[place].tobytes()), np.uint8)
        return data.tobytes()

    def _corrupt(self, data: bytes) -> bytes:
        """Change one to three bytes anywhere in a frame, including its delimiter; in a line of text, to "?"."""
        corrupted = bytearray(data)
        key = stream_key(int(self._key), "spoil", data)
        length = len(data) - (1 if self.csv else 0)  # without its newline, a line would damage the next one
        places = {int(uniform(key, 2 * i) * length) for i in range(1 + int(uniform(key, 99) * 3))}
        for i, place in enumerate(sorted(places)):
            corrupted[place] = ord("?") if self.csv else corrupted[place] ^ (1 + int(uniform(key, 2 * i + 1) * 255))
        return bytes(corrupted)


@kernel
def _draw(key: np.uint64, first: int, ends: NDArray[np.float64], kinds: NDArray[np.int64]) -> None:
    """Draw the fault of each frame: 0 for none, otherwise one plus its index in `KINDS`."""
    for i in range(len(kinds)):
        u = uniform(key, first + i)
        for kind in range(len(ends)):
            if u < ends[kind]:
                kinds[i] = kind + 1
                break
