"""The force of a rendering: a file of forces, a simulated walker, or nobody."""

from underfoot.devices.force_source import ForceSource
from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.layout import Floor, default_floor
from underfoot.records.force_files import read_force_file

DEFAULT_S = 5.0
"""Seconds that are rendered where no file of forces says how long."""
TAIL_S = 0.5
"""Seconds that are rendered behind the last sample of a file of forces."""


def offline_source(
    force: str | None,
    floor: Floor | None,
    rate_hz: float,
    seed: int,
) -> tuple[ForceSource, float]:
    """Where the force of a rendering comes from, and how many seconds there are of it.

    `force` is a CSV file, whose floor lies beside it where none is given; "none" for a floor on which nobody stands;
    None for the seeded walker.
    """
    if force is None or force == "none":
        return SimulatedFloor(floor or default_floor(), rate_hz, seed, force is None), DEFAULT_S
    forces, layout = read_force_file(force, floor)
    return Replay(forces, layout, rate_hz), float(forces.time_s[-1] - forces.time_s[0]) + TAIL_S
