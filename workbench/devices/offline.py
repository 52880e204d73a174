"""The force of a rendering: forces that were measured, a simulated walker, or nobody; and how long it lasts."""

from collections.abc import Mapping

from underfoot.devices.force_source import ForceSource
from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.tile_parameters import TileParameters

DEFAULT_S = 5.0
"""Seconds that are rendered where no forces say how long."""
TAIL_S = 0.5
"""Seconds that are rendered behind the last sample of forces."""
_THESE_TILES = 1
"""The seed of simulated tiles: those that a session simulates."""


def offline_source(
    forces: ForceSeries | None,
    floor: Floor | None,
    rate_hz: float,
    seed: int,
    *,
    walking: bool = True,
    simulation: TileParameters | None = None,
    profiles: Mapping[str, Profile] | None = None,
) -> tuple[ForceSource, float]:
    """Where the force of a rendering comes from, and how many seconds there are of it.

    Without `forces` the seeded walker walks on the floor, 2 x 2 tiles by default; or, not `walking`, nobody does. With
    `simulation` the floor is the very tiles of a session, with their `profiles`.
    """
    floor = floor or default_floor()
    if forces is not None:
        return Replay(forces, floor, rate_hz), float(forces.time_s[-1] - forces.time_s[0]) + TAIL_S
    if simulation is not None:
        return SimulatedFloor(floor, rate_hz, _THESE_TILES, walking, simulation, dict(profiles or {})), DEFAULT_S
    return SimulatedFloor(floor, rate_hz, seed, walking), DEFAULT_S
