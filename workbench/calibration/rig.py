"""What a calibration asks of the rig that a tile is on, and what the rig brings: readings, or a recording.

A rig is the tile with whatever loads or shakes it: the simulated tile and a simulated hand, a device of hardware with a
person and a load cell, or a shaker with an accelerometer.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class PressRequest:
    """Where and how hard to press: `at_m` in the tile's frame, newtons; 0 N is to stand clear.

    `sensor` (0 to 3) is set where the load goes over one sensor. `hold_s` is how long the load is to be held.
    """

    at_m: tuple[float, float]
    force_n: float
    hold_s: float = 0.5
    sensor: int | None = None


@dataclass(frozen=True)
class Sound:
    """What to play through the shaker: full scale, shape (frames,), with the load that stands on the tile.

    With `block`, a sound card plays it as the engine plays: in blocks of so many frames, with as little latency as the
    device can; otherwise as safely as it can.
    """

    signal: NDArray[np.float64]
    rate_hz: int
    load: str
    block: int = 0


@dataclass(frozen=True)
class Readings:
    """What came in: `time_s` (n,), `values` (n, 4) in the sensors' units, and `force_n` (n,) of the reference or None.

    n may be 0. Lost samples are left out: `time_s` jumps.

    >>> readings = Readings(np.arange(4.0), np.zeros((4, 4)), np.arange(4.0))
    >>> readings.last(1.0).force_n, readings.last(5.0)
    (array([2., 3.]), None)
    """

    time_s: NDArray[np.float64]
    values: NDArray[np.float64]
    force_n: NDArray[np.float64] | None = None

    def followed_by(self, later: "Readings") -> "Readings":
        """These readings and then `later` ones; without a reference unless both have one."""
        if self.time_s.size == 0:
            return later
        force = None
        if self.force_n is not None and later.force_n is not None:
            force = np.concatenate([self.force_n, later.force_n])
        return Readings(np.concatenate([self.time_s, later.time_s]), np.concatenate([self.values, later.values]), force)

    def since(self, index: int) -> "Readings":
        """The readings from this index on."""
        force = None if self.force_n is None else self.force_n[index:]
        return Readings(self.time_s[index:], self.values[index:], force)

    def last(self, seconds: float) -> "Readings | None":
        """The last `seconds` of the readings; None where they are shorter."""
        start = self.time_s[-1] - seconds
        return None if self.time_s[0] > start else self.since(int(np.searchsorted(self.time_s, start)))


NO_READINGS = Readings(np.empty(0), np.empty((0, 4)), None)


class Rig(Protocol):
    """The tile that is calibrated, and what loads or shakes it: simulated, or hardware and a person."""

    def press(self, press: PressRequest | None) -> None:
        """What the page asks for. A simulator does it; on hardware a person reads the page."""
        ...

    def read(self) -> Readings:
        """What came in since the last call; never waits."""
        ...

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Play through the shaker, past the limiter; the accelerometer's signal, from the sound's first frame on."""
        ...

    def close(self) -> None:
        """Let the tile go."""
        ...
