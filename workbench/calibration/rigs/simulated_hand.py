"""Simulated rig: a hand that presses the simulated tile, with a load cell."""

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.rig import PressRequest, Readings, Sound
from underfoot.floor.simulated_tile import SimulatedTile

_BLOCK_S = 0.1
_TREMOR, _TREMOR_S = 0.008, 0.06
"""Tremor of a careful hand: RMS as a share of the force, and its correlation time."""
_PLACEMENT_M = 0.0007
"""Standard deviation of the position of a press, in x and in y."""
_CELL = 0.001
"""Standard deviation of the load cell's gain from block to block."""
_RISE_S = (1.5, 2.5)
"""Shortest and longest time of a rise or fall of the force."""
_GAP_S = 0.3
"""Time that the hand stays off the tile on its way to another position."""


class SimulatedHand:
    """Hand that presses as requested, in simulated time, as fast as possible.

    The force rises and falls as a hand's does, with tremor, at about a millimetre from the requested position; all this
    is drawn from `seed`. `read` returns a tenth of a second at `rate_hz`, with the load cell's newtons.

    >>> from underfoot.floor.layout import default_floor
    >>> tile = default_floor(1, 1).tiles[0]
    >>> hand = SimulatedHand(SimulatedTile(tile, seed=1), seed=1)
    >>> hand.press(PressRequest(tile.sensors_m[0], 200.0, sensor=0))
    >>> [round(float(hand.read().force_n[-1]), -1) for _ in range(40)][-1]
    200.0
    """

    def __init__(self, tile: SimulatedTile, seed: int = 1, rate_hz: float = 1000.0) -> None:
        self._tile, self._rate_hz = tile, rate_hz
        self._random = np.random.default_rng(seed)
        self._asked: PressRequest | None = None
        self._place, self._landed_m = np.zeros(2), (0.0, 0.0)
        self._from_n, self._to_n, self._since_s, self._rise_s = 0.0, 0.0, 0.0, 1.0
        self._waiting: PressRequest | None = None
        self._tremor = 0.0
        self._samples = 0

    def press(self, press: PressRequest | None) -> None:
        """Start a press; at another position only after letting go."""
        wanted = press or PressRequest((0.0, 0.0), 0.0)
        if wanted == self._asked:
            return
        self._asked = wanted
        if self._waiting is not None:
            self._waiting = wanted
        elif self._force_n() > 0.0 and wanted.at_m != self._landed_m:
            self._waiting = wanted
            self._towards(0.0)
        else:
            self._land(wanted)

    def read(self) -> Readings:
        """Return the next tenth of a second of readings."""
        count = int(round(_BLOCK_S * self._rate_hz))
        force = np.empty(count)
        places = np.empty((count, 2))
        kept = np.exp(-1.0 / (self._rate_hz * _TREMOR_S))
        drawn = np.sqrt(1.0 - kept**2)
        for i in range(count):
            self._since_s += 1.0 / self._rate_hz
            if self._waiting is not None and self._since_s > self._rise_s + _GAP_S:
                self._land(self._waiting)
                self._waiting = None
            self._tremor = kept * self._tremor + drawn * self._random.standard_normal()
            force[i] = self._force_n() * (1.0 + _TREMOR * self._tremor)
            places[i] = self._place
        corners = self._tile.corner_forces(places, force)
        time_s = (self._samples + np.arange(count)) / self._rate_hz
        self._samples += count
        cell = force * (1.0 + _CELL * self._random.standard_normal()) + 0.02 * self._random.standard_normal(count)
        return Readings(time_s, self._tile.sense(corners, self._rate_hz), cell)

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Return the simulated accelerometer's recording of a sound through the simulated shaker, in full scale."""
        recording = self._tile.respond(sound.signal, float(sound.rate_hz), sound.load)
        return recording / self._tile.parameters.accelerometer.range_m_s2

    def close(self) -> None:
        """Do nothing: no resources are held."""

    def _land(self, press: PressRequest) -> None:
        if self._force_n() == 0.0:
            self._landed_m = press.at_m
            self._place = np.array(press.at_m) + _PLACEMENT_M * self._random.standard_normal(2)
            half = 0.5 * np.array(self._tile.tile.size_m)
            self._place = np.clip(self._place, -half, half)
        self._towards(press.force_n)

    def _towards(self, force_n: float) -> None:
        self._from_n, self._to_n, self._since_s = self._force_n(), force_n, 0.0
        self._rise_s = float(self._random.uniform(*_RISE_S))

    def _force_n(self) -> float:
        along = min(self._since_s / self._rise_s, 1.0)
        # A raised cosine: it starts and ends softly.
        return self._from_n + (self._to_n - self._from_n) * 0.5 * (1.0 - float(np.cos(np.pi * along)))
