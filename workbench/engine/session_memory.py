"""Memory shared by the processes of a session: the engine's status, and rings of forces and of each tile's output."""

from contextlib import ExitStack

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.engine.rings import Reader, Ring, RingName
from underfoot.engine.shared_blocks import remove_orphans
from underfoot.engine.status import Status

RING_S = 4.0
"""Seconds that the rings hold."""
_LEAST_FORCE_HZ = 2000.0
"""Least rate of force samples that their ring has room for."""


class MemoryNames(Struct, frozen=True):
    """The data another process needs to open the memory of a session: of its status, and of its rings in order."""

    status: str
    rings: tuple[RingName, ...]


class SessionMemory(Struct, frozen=True):
    """Status and rings: `create` in the supervisor, `open` elsewhere.

    `force` has float64 rows of stamp, arrival, and the corners of each tile in turn. The others have float32 rows with
    one value per tile: `vibration` is the drive, relative to full scale; `commanded` and `measured` (by the
    accelerometer) are in m/s^2, and stay empty where nothing measures.
    """

    status: Status
    force: Ring
    vibration: Ring
    commanded: Ring
    measured: Ring
    scope: Ring

    @staticmethod
    def create(tiles: int, rate_hz: float, force_rate_hz: float) -> "SessionMemory":
        """Create memory for this number of tiles, and remove blocks left by killed programs.

        Raise `DeviceError` if there is no room for it.
        """
        remove_orphans()
        frames = round(RING_S * rate_hz)
        samples = round(RING_S * max(_LEAST_FORCE_HZ, force_rate_hz))
        with ExitStack() as unless_made:
            status = Status.create()
            unless_made.callback(status.close)
            rings: list[Ring] = []
            for width, capacity, dtype in ((2 + 4 * tiles, samples, "float64"), *[(tiles, frames, "float32")] * 4):
                rings.append(Ring.create(width, capacity, dtype))
                unless_made.callback(rings[-1].close)
            unless_made.pop_all()
        return SessionMemory(status, *rings)

    @staticmethod
    def open(names: MemoryNames) -> "SessionMemory":
        """Open the memory that another process created."""
        return SessionMemory(Status.open(names.status), *map(Ring.open, names.rings))

    @property
    def names(self) -> MemoryNames:
        """Names by which other processes open it."""
        return MemoryNames(self.status.name, tuple(ring.where for ring in self._rings))

    @property
    def recorded(self) -> dict[str, Ring]:
        """The rings that are recorded, by the name of their table."""
        return {name: getattr(self, name) for name in ("force", "vibration", "commanded", "measured")}

    def skip(self, frame: int) -> None:
        """Continue at a session frame, where an engine begins."""
        for ring in self._rings[1:]:
            ring.skip(frame)

    def close(self) -> None:
        """Release it; its creator also removes it."""
        self.status.close()
        for ring in self._rings:
            ring.close()

    @property
    def _rings(self) -> tuple[Ring, ...]:
        return self.force, self.vibration, self.commanded, self.measured, self.scope


class ResponseReader:
    """Reads commanded and measured acceleration of the same session frames, however late the second arrives."""

    def __init__(self, commanded: Ring, measured: Ring) -> None:
        self._readers = Reader(commanded), Reader(measured)
        self._waiting = [(0, np.zeros((0, ring.where.width), np.float32)) for ring in (commanded, measured)]

    def read(self) -> tuple[int, NDArray[np.float32], NDArray[np.float32]]:
        """Return the first new session frame, and both signals from it on, float32 [frame, tile]."""
        for which, reader in enumerate(self._readers):
            first, rows = reader.read()
            begin, waiting = self._waiting[which]
            if len(rows):
                follows = len(waiting) and begin + len(waiting) == first  # usually no backlog and no copy
                self._waiting[which] = (begin, np.concatenate([waiting, rows])) if follows else (first, rows)
        (one, commanded_rows), (other, measured_rows) = self._waiting
        first = max(one, other)
        end = max(min(one + len(commanded_rows), other + len(measured_rows)), first)
        rest = [(max(end, begin), rows[max(end - begin, 0) :]) for begin, rows in self._waiting]
        most = self._readers[0].ring.where.capacity
        self._waiting = [(begin + max(len(rows) - most, 0), rows[-most:]) for begin, rows in rest]
        return first, commanded_rows[first - one : end - one], measured_rows[first - other : end - other]


class ForceReader:
    """Reads force samples: session frames, float64 [n], and corner forces, float64 [n, tile, 4], not tared."""

    def __init__(self, ring: Ring) -> None:
        self._reader = Reader(ring)

    def read(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the times and forces since the last read."""
        _, rows = self._reader.read()
        return rows[:, 0].copy(), rows[:, 2:].reshape(len(rows), rows.shape[1] // 4, 4).copy()
