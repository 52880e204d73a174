"""Rigs: requests of a calibration to the tile under test, and the readings or recordings they return.

A rig is the tile with the means to load or shake it: the simulated tile and a simulated hand, hardware with a person
and a load cell, or a shaker with an accelerometer.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class PressRequest:
    """Position and force of a press: `at_m` in the tile's frame, newtons; 0 N means to stand clear.

    `sensor` (0 to 3) is set if the load goes over one sensor. `hold_s` is the duration of the hold. A `footstep` is a
    load that comes and goes. `position`, 0 to 1, is where a variable stiffness plate goes meanwhile; None to hold it.
    """

    at_m: tuple[float, float]
    force_n: float
    hold_s: float = 0.5
    sensor: int | None = None
    footstep: bool = False
    position: float | None = None


@dataclass(frozen=True)
class Sound:
    """Sound for the shaker: full scale, shape (frames,), with the load on the tile.

    With `block`, a sound card plays it as the engine does: in blocks of that many frames, with the lowest latency of
    the device; otherwise with the safest settings.
    """

    signal: NDArray[np.float64]
    rate_hz: int
    load: str
    block: int = 0


@dataclass(frozen=True)
class Readings:
    """Readings: `time_s` (n,), `values` (n, 4) in the sensors' units, and `force_n` (n,) of the reference or None.

    n may be 0. Lost samples are left out: `time_s` jumps. Of a variable stiffness plate, `displacement_mm` (n,) is how
    far it is down, and `position` (n,) where its servo is, NaN on the way; otherwise None.

    >>> readings = Readings(np.arange(4.0), np.zeros((4, 4)), np.arange(4.0))
    >>> readings.last(1.0).force_n, readings.last(5.0)
    (array([2., 3.]), None)
    """

    time_s: NDArray[np.float64]
    values: NDArray[np.float64]
    force_n: NDArray[np.float64] | None = None
    displacement_mm: NDArray[np.float64] | None = None
    position: NDArray[np.float64] | None = None

    def followed_by(self, later: "Readings") -> "Readings":
        """Return these readings and then `later` ones; without a reference unless both have one."""
        if self.time_s.size == 0:
            return later
        return Readings(
            np.concatenate([self.time_s, later.time_s]),
            np.concatenate([self.values, later.values]),
            _joined(self.force_n, later.force_n),
            _joined(self.displacement_mm, later.displacement_mm),
            _joined(self.position, later.position),
        )

    def since(self, index: int) -> "Readings":
        """Return the readings from this index on."""
        others = (self.force_n, self.displacement_mm, self.position)
        return Readings(
            self.time_s[index:], self.values[index:], *(None if one is None else one[index:] for one in others)
        )

    def last(self, seconds: float) -> "Readings | None":
        """Return the last `seconds` of the readings; None if they are shorter."""
        start = self.time_s[-1] - seconds
        return None if self.time_s[0] > start else self.since(int(np.searchsorted(self.time_s, start)))

    def trend(self, sensor: int) -> float:
        """Return how far a sensor's reading goes, by the means of twenty stretches, which noise hardly moves."""
        values = self.values[:, sensor]
        return float(np.ptp([part.mean() for part in np.array_split(values, min(20, values.size))]))


def _joined(one: NDArray[np.float64] | None, two: NDArray[np.float64] | None) -> NDArray[np.float64] | None:
    return None if one is None or two is None else np.concatenate([one, two])


NO_READINGS = Readings(np.empty(0), np.empty((0, 4)), None)
STOPPED = "the sound was stopped; take it again"
"""What `BadMeasurement` says of a sound that was silenced."""


class Rig(Protocol):
    """Tile under test with the means to load or shake it: simulated, or hardware and a person."""

    def press(self, press: PressRequest | None) -> None:
        """Request a press. A simulator does it; on hardware a person reads the page."""
        ...

    def read(self) -> Readings:
        """Return the readings since the last call; never waits."""
        ...

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Play through the shaker, bypassing the limiter; return the accelerometer's signal from the first frame on."""
        ...

    def close(self) -> None:
        """Release the tile."""
        ...
