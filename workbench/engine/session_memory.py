"""What the processes of a session share: the engine's status, and rings of forces, vibration and the scope."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.engine.rings import Reader, Ring, RingName
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
    scope: RingName


@dataclass(frozen=True)
class SessionMemory:
    """Status and rings: `create` in the supervisor, `open` elsewhere.

    `force` has float64 rows of stamp, arrival, and the corners tile after tile; `vibration` and `scope` have float32
    rows of a value for each tile.
    """

    status: Status
    force: Ring
    vibration: Ring
    scope: Ring

    @staticmethod
    def create(tiles: int, rate_hz: float, force_rate_hz: float) -> "SessionMemory":
        """New memory for a floor of so many tiles."""
        frames = round(RING_S * rate_hz)
        samples = round(RING_S * max(_LEAST_FORCE_HZ, force_rate_hz))
        return SessionMemory(
            Status.create(),
            Ring.create(2 + 4 * tiles, samples, "float64"),
            Ring.create(tiles, frames),
            Ring.create(tiles, frames),
        )

    @staticmethod
    def open(names: MemoryNames) -> "SessionMemory":
        """The memory that another process created."""
        rings = (Ring.open(name) for name in (names.force, names.vibration, names.scope))
        return SessionMemory(Status.open(names.status), *rings)

    @property
    def names(self) -> MemoryNames:
        """Where it is found."""
        return MemoryNames(self.status.name, self.force.where, self.vibration.where, self.scope.where)

    def close(self) -> None:
        """Let go of it; the one who created it removes it."""
        for part in (self.status, self.force, self.vibration, self.scope):
            part.close()


class VibrationReader:
    """What each tile plays: `read` gives the first new session frame, and float32 [frame, tile], of full scale."""

    def __init__(self, ring: Ring) -> None:
        self._reader = Reader(ring)

    def read(self) -> tuple[int, NDArray[np.float32]]:
        """What is new since the last read."""
        return self._reader.read()


class ForceReader:
    """Force samples: `read` gives session frames, float64 [n], and corner forces, float64 [n, tile, 4], not tared."""

    def __init__(self, ring: Ring) -> None:
        self._reader = Reader(ring)

    def read(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What is new since the last read."""
        _, rows = self._reader.read()
        return rows[:, 0].copy(), rows[:, 2:].reshape(len(rows), rows.shape[1] // 4, 4).copy()
