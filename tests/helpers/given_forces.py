"""A source of given force samples, a person who stands and sways, and the intake's output for them."""

import numpy as np
from msgspec.structs import replace

from underfoot.devices.force_source import MAX_SAMPLES, sample_buffers
from underfoot.engine.intake import Intake
from underfoot.floor.layout import Floor, default_floor

FLOOR = Floor(tuple(replace(tile, rotation_deg=30.0) for tile in default_floor(1, 2).tiles))
RATE = 48_000.0
QUIET_S, STAND_S = 0.3, 1.0


class GivenForces:
    """A source that delivers given samples in the frame of their arrival."""

    def __init__(self, rate_hz, stamps, forces, arrivals=None):
        self.floor, self.rate_hz = FLOOR, rate_hz
        self.stamps, self.arrivals, self.forces = sample_buffers(FLOOR)
        self._all = stamps, stamps if arrivals is None else arrivals, forces
        self._next = 0

    def pull(self, end):
        stamps, arrivals, forces = self._all
        stop = min(int(np.searchsorted(arrivals, end)), self._next + MAX_SAMPLES)
        count = stop - self._next
        for mine, given in zip((self.stamps, self.arrivals, self.forces), (stamps, arrivals, forces), strict=True):
            mine[:count] = given[self._next : stop]
        self._next = stop
        return count


def standing_forces(rate_hz, rate=RATE, seconds=2.0):
    """Return samples of a person who stands and sways on the first tile from 0.3 to 1.3 s: stamps in frames, forces."""
    time_s = np.arange(round(seconds * rate_hz)) / rate_hz
    forces = np.zeros((len(time_s), 2, 4))
    on = (time_s >= QUIET_S) & (time_s < QUIET_S + STAND_S)
    sway = 0.3 * np.sin(2.0 * np.pi * 1.7 * time_s[on])
    lean = 0.2 * np.cos(2.0 * np.pi * 1.3 * time_s[on])
    load = 600.0 + 150.0 * np.sin(2.0 * np.pi * 3.1 * time_s[on])
    shares = [1 + sway + lean, 1 - sway + lean, 1 - sway - lean, 1 + sway - lean]
    forces[on, 0] = load[:, None] * np.stack(shares, axis=1) / 4.0
    return time_s * rate, forces


def intake_signals(source, frames, rate=RATE, blocks=(512,)):
    """Return force, x, y and cut [signal, tile, frame] from the intake, in blocks of these sizes."""
    intake = Intake(source, rate, max(blocks))
    out = np.zeros((4, 2, frames))
    at = turn = 0
    while at < frames:
        n = min(blocks[turn % len(blocks)], frames - at)
        intake.take(at + n)
        intake.fill(at, n)
        out[:, :, at : at + n] = intake.signals[:, :, :n]
        at, turn = at + n, turn + 1
    return out
