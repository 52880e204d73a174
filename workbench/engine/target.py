"""Where force comes from and vibration goes."""

from dataclasses import dataclass

from workbench.devices.device import ForceSource
from workbench.devices.replay import Replay
from workbench.devices.simulated import SENSOR_HZ, SimulatedFloor
from workbench.floor.forces import read_forces
from workbench.floor.layout import Floor


@dataclass(frozen=True)
class Target:
    """Where force comes from and vibration goes.

    `kind` is "simulator" or "replay" (of the force CSV `source`). `sound` is None for no sound card, "" for the default
    one, else a device's name. `latency_s` is what to ask of the sound device, 0 for its own low latency.
    """

    floor: Floor
    kind: str = "simulator"
    source: str = ""
    sound: str | None = None
    rate: int = 48_000
    block: int = 128
    walker: bool = True
    latency_s: float = 0.0


def force_rate_hz(target: Target) -> float:
    """Force samples a second of a target; `BadFile` for a file that cannot be played back."""
    return read_forces(target.source, target.floor).rate_hz if target.kind == "replay" else SENSOR_HZ


def source_of(target: Target, frame: int = 0) -> ForceSource:
    """What brings the force of a target, from session frame `frame` on."""
    if target.kind == "replay":
        return Replay(read_forces(target.source, target.floor), target.floor, target.rate, start=frame, repeats=True)
    simulated = SimulatedFloor(target.floor, target.rate, walking=target.walker)
    simulated.skip(frame)
    return simulated
