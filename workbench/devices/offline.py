"""The force source of an offline rendering (measured forces, a simulated walker, or nobody) and its length."""

from collections.abc import Mapping

from underfoot.devices.force_source import ForceSource
from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import WALK_S, SimulatedFloor
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.tile_parameters import TileParameters

DEFAULT_S = 5.0
"""Default length of a rendering in seconds, without forces."""
TAIL_S = 0.5
"""Seconds rendered after the last force sample."""
_THESE_TILES = 1
"""Seed of simulated tiles, as in a session."""


def offline_source(
    forces: ForceSeries | None,
    floor: Floor | None,
    rate_hz: float,
    seed: int,
    *,
    walking: bool,
    simulation: TileParameters | None = None,
    profiles: Mapping[str, Profile] | None = None,
    seconds: float | None = None,
) -> tuple[ForceSource, float]:
    """Return the force source of a rendering, and its length in seconds: `seconds` if they are given.

    Without `forces` the seeded walker walks on the floor, 2 x 2 tiles by default; without `walking`, nobody does. With
    `simulation` the floor has the same simulated tiles as a session, with their `profiles`.
    """
    floor = floor or default_floor()
    if forces is not None:
        length_s = float(forces.time_s[-1] - forces.time_s[0]) + TAIL_S
        return Replay(forces, floor, rate_hz), length_s if seconds is None else seconds
    length_s = DEFAULT_S if seconds is None else seconds
    walk_s = length_s if 0.0 < length_s < WALK_S else WALK_S
    if simulation is not None:
        tiles = simulation, dict(profiles or {})
        return SimulatedFloor(floor, rate_hz, _THESE_TILES, walking, *tiles, walk_s=walk_s), length_s
    return SimulatedFloor(floor, rate_hz, seed, walking, walk_s=walk_s), length_s
