"""The target of a command that opens a session: a simulator or hardware, with or without sound."""

from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.errors import BadValue

if TYPE_CHECKING:
    from underfoot.engine.target import Target


def session_target(
    name: str, floor: Path | None, profiles: Path | None, sound: str | None, *, walker: bool
) -> "Target":
    """Return the target `name` on a floor, with a sound device ("default" for the system's, None for none).

    `walker` says whether somebody walks on a simulated floor. Raise `BadValue` if a session cannot have this target.
    """
    from underfoot.devices.transports import split_target
    from underfoot.engine.target import Target, require_source, simulation_of
    from underfoot.floor.layout import Floor, default_floor

    layout = Floor.load(floor) if floor else default_floor()
    device = None if sound is None else "" if sound == "default" else sound
    hardware, simulation = split_target(name), simulation_of(name)
    if hardware is None and simulation is None:
        raise BadValue(f"--target is {name}; allowed: simulator, or hardware as `underfoot monitor` names it")
    kind, source = hardware or ("simulator", "")
    target = Target(layout, kind, source, device, walker=walker, profiles=str(profiles or ""),
                    simulation=simulation or "")  # fmt: skip
    require_source(target)
    return target
