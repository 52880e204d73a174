"""The simulated floor: walkers, and a hand or mouse, on tiles sampled at 1 kHz."""

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import MAX_SAMPLES, SENSOR_HZ, sample_buffers
from underfoot.floor import simulated_loads
from underfoot.floor.forces import read_forces
from underfoot.floor.layout import Floor, Point
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_people import Person, people_footfalls, walk_round
from underfoot.floor.simulated_sensors import SimulatedSensors
from underfoot.floor.tile_parameters import TileParameters
from underfoot.kernels import block_kernel
from underfoot.models import gait

WALK_S = 600.0
"""Length of the generated walk in seconds, which then repeats."""


class SimulatedFloor:
    """Forces on `floor`, determined by the seed. Without `simulation` its sensors are ideal: noise-free and tared.

    With `simulation` they have the errors of real ones, and are converted by `profiles` (by tile id) or, for a tile
    without one, by the nominal curve of their kind: `notices` say so, and `sensors` has the counts. The walker, people
    or recording are then those that the parameters name; `people` walk in any case. The whole walk is known, so every
    sample arrives in time; `footfalls` and `curves` say whose foot is where (`simulated_loads.feet_down`). `walk` and
    `press` take effect with the next sample. The walk ends after `walk_s` seconds; a shorter one is the beginning of a
    longer one.
    """

    def __init__(
        self,
        floor: Floor,
        rate: float = RATE_HZ,
        seed: int = 1,
        walking: bool = True,
        simulation: TileParameters | None = None,
        profiles: Mapping[str, Profile] | None = None,
        people: Sequence[Person] = (),
        walk_s: float = WALK_S,
    ) -> None:
        self.floor, self.rate_hz = floor, SENSOR_HZ
        self.stamps, _, self.forces = sample_buffers(floor)
        self.arrivals = self.stamps  # the future is known
        self._period = rate / SENSOR_HZ
        self._rate = float(rate)
        self._plates = floor.plates()
        people = tuple(people or (simulation.people if simulation else ()))
        walker = simulation.walker if simulation else gait.Walker()
        path = simulation.path_m if simulation else ()
        self.footfalls = _footfalls(floor, seed, people, walker, path, walk_s).copy()
        self.curves = simulated_loads.gait_curves([person.walker for person in people] or [walker])
        self._is_walking = walking
        self._hands = np.zeros(len(floor.tiles), simulated_loads.HAND)
        self._footing = simulated_loads.footing_table(floor)
        self._recorded = np.zeros((0, len(floor.tiles), 4))
        self._sample = 0
        self.sensors: SimulatedSensors | None = None
        self.notices: tuple[str, ...] = ()
        if simulation is not None:
            self.sensors = SimulatedSensors(floor, simulation, seed, SENSOR_HZ, MAX_SAMPLES, profiles)
            self._footing["shift_m"], self.notices = self.sensors.foot_shift_m, self.sensors.lines
            if simulation.recording:
                self._recorded = recorded(simulation.recording, floor)

    def skip(self, frame: int) -> None:
        """Start at session frame `frame`, with sensors at rest until then."""
        self._sample = math.ceil(frame / self._period)

    def walk(self, *, on: bool) -> None:
        """Start or stop the walker."""
        self._is_walking = on

    def press(self, row: int, x_m: float, y_m: float, force_n: float) -> None:
        """Press on a tile at a point in its frame; 0 N releases it."""
        if force_n > 0.0:
            place = np.array([x_m, y_m])
            if self.sensors is not None:
                place += self.sensors.hand_shift_m[row]
            self._hands[row]["x_m"], self._hands[row]["y_m"] = place
        self._hands[row]["target_n"] = force_n

    def pull(self, end: int) -> int:
        """Write the samples before session frame `end` to the buffers."""
        count = min(max(math.ceil(end / self._period) - self._sample, 0), MAX_SAMPLES)
        if count:
            _clear(self.stamps, self.forces, self._sample, count, self._period)
            if self._is_walking:
                if len(self._recorded):
                    _add_recorded(self.forces, self._recorded, self._sample, count)
                else:
                    simulated_loads.walk(
                        self.forces, self.stamps, count, self._rate, self._plates, self.footfalls, self.curves,
                        self._footing,
                    )  # fmt: skip
            simulated_loads.press(self.forces, count, self._plates, self._hands)
            if self.sensors is not None:
                self.sensors.read(self.forces, self._sample, count, is_split=len(self._recorded) > 0)
            self._sample += count
        return count


@lru_cache(maxsize=16)
def _footfalls(
    floor: Floor, seed: int, people: tuple[Person, ...], walker: gait.Walker, path_m: tuple[Point, ...], seconds: float
) -> NDArray[np.void]:
    """The table of a walk, which the floors of a process share: a whole one takes 5 ms, and often they are alike."""
    if people:
        walks = people_footfalls(people, floor, seconds, seed)
    else:
        walks = [walk_round(floor, seconds, seed, walker, path_m)]
    return simulated_loads.footfall_table(walks)


def recorded(path: str, floor: Floor) -> NDArray[np.float64]:
    """Read a force CSV of `floor` at 1 kHz, linearly interpolated also across gaps: shape (n, tiles, 4)."""
    forces = read_forces(path, floor)
    time_s = forces.time_s - forces.time_s[0]
    at = np.arange(math.floor(time_s[-1] * SENSOR_HZ) + 1) / SENSOR_HZ
    flat = forces.force_n.reshape(len(time_s), -1)
    found = np.stack([np.interp(at, time_s, column) for column in flat.T], axis=1)
    return np.ascontiguousarray(found.reshape(len(at), len(floor.tiles), 4))


@block_kernel
def _clear(stamps: NDArray[np.float64], forces: NDArray[np.float64], first: int, count: int, period: float) -> None:
    """Stamp `count` samples from number `first` on, with zero force."""
    for i in range(count):
        stamps[i] = (first + i) * period
        forces[i] = 0.0


@block_kernel
def _add_recorded(forces: NDArray[np.float64], recorded: NDArray[np.float64], first: int, count: int) -> None:
    for i in range(count):
        sample = recorded[(first + i) % len(recorded)]
        for k in range(forces.shape[1]):
            for sensor in range(4):
                forces[i, k, sensor] += sample[k, sensor]
