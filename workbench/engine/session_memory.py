"""What the processes of a session share: the engine's status, and rings of forces and of what each tile is to do."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.engine.rings import Reader, Ring, RingName
from underfoot.engine.shared_blocks import remove_orphans
from underfoot.engine.status import Status

RING_S = 4.0
"""How long rows stay in the rings."""
_LEAST_FORCE_HZ = 2000.0


@dataclass(frozen=True)
class MemoryNames:
    """What another process needs to find the memory of a session."""

    status: str
    force: RingName
    vibration: RingName
    commanded: RingName
    measured: RingName
    scope: RingName


@dataclass(frozen=True)
class SessionMemory:
    """Status and rings: `create` in the supervisor, `open` elsewhere.

    `force` has float64 rows of stamp, arrival, and the corners tile after tile. The others have float32 rows of a value
    for each tile: `vibration` is the drive, of full scale, `commanded` what was asked of the tile and `measured` what
    its accelerometer says, both m/s^2. Where nothing measures, nothing is written to these two.
    """

    status: Status
    force: Ring
    vibration: Ring
    commanded: Ring
    measured: Ring
    scope: Ring

    @staticmethod
    def create(tiles: int, rate_hz: float, force_rate_hz: float) -> "SessionMemory":
        """New memory for a floor of so many tiles; what killed programs left is removed."""
        remove_orphans()
        frames = round(RING_S * rate_hz)
        samples = round(RING_S * max(_LEAST_FORCE_HZ, force_rate_hz))
        return SessionMemory(
            Status.create(),
            Ring.create(2 + 4 * tiles, samples, "float64"),
            *(Ring.create(tiles, frames) for _ in range(4)),
        )

    @staticmethod
    def open(names: MemoryNames) -> "SessionMemory":
        """The memory that another process created."""
        rings = (names.force, names.vibration, names.commanded, names.measured, names.scope)
        return SessionMemory(Status.open(names.status), *(Ring.open(name) for name in rings))

    @property
    def names(self) -> MemoryNames:
        """Where it is found."""
        return MemoryNames(self.status.name, *(ring.where for ring in self._rings))

    @property
    def recorded(self) -> dict[str, Ring]:
        """The rings that a recording keeps, by the name of its table."""
        return {
            "force": self.force,
            "vibration": self.vibration,
            "commanded": self.commanded,
            "measured": self.measured,
        }

    def skip(self, frame: int) -> None:
        """Go on at a session frame, where an engine begins."""
        for ring in self._rings[1:]:
            ring.skip(frame)

    def close(self) -> None:
        """Let go of it; the one who created it removes it."""
        self.status.close()
        for ring in self._rings:
            ring.close()

    @property
    def _rings(self) -> tuple[Ring, ...]:
        return self.force, self.vibration, self.commanded, self.measured, self.scope


class VibrationReader:
    """A value a tile and frame: `read` gives the first new session frame, and float32 [frame, tile]."""

    def __init__(self, ring: Ring) -> None:
        self._reader = Reader(ring)

    def read(self) -> tuple[int, NDArray[np.float32]]:
        """What is new since the last read."""
        return self._reader.read()


class ResponseReader:
    """What was commanded and what the tiles did, of the same session frames, however late the second is told."""

    def __init__(self, commanded: Ring, measured: Ring) -> None:
        self._readers = Reader(commanded), Reader(measured)
        self._waiting = [(0, np.zeros((0, ring.where.width), np.float32)) for ring in (commanded, measured)]

    def read(self) -> tuple[int, NDArray[np.float32], NDArray[np.float32]]:
        """The first new session frame, and both from it on, float32 [frame, tile]."""
        for which, reader in enumerate(self._readers):
            first, rows = reader.read()
            begin, waiting = self._waiting[which]
            if len(rows):
                follows = len(waiting) and begin + len(waiting) == first  # mostly nothing waits, nothing is copied
                self._waiting[which] = (begin, np.concatenate([waiting, rows])) if follows else (first, rows)
        (one, asked), (other, done) = self._waiting
        first = max(one, other)
        end = max(min(one + len(asked), other + len(done)), first)
        rest = [(max(end, begin), rows[max(end - begin, 0) :]) for begin, rows in self._waiting]
        most = self._readers[0].ring.where.capacity
        self._waiting = [(begin + max(len(rows) - most, 0), rows[-most:]) for begin, rows in rest]
        return first, asked[first - one : end - one], done[first - other : end - other]


class ForceReader:
    """Force samples: `read` gives session frames, float64 [n], and corner forces, float64 [n, tile, 4], not tared."""

    def __init__(self, ring: Ring) -> None:
        self._reader = Reader(ring)

    def read(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What is new since the last read."""
        _, rows = self._reader.read()
        return rows[:, 0].copy(), rows[:, 2:].reshape(len(rows), rows.shape[1] // 4, 4).copy()
