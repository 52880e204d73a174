"""A rendering as plain data: what is played on what, for this process, another one, or another computer."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import ForceSource
from underfoot.devices.offline import DEFAULT_S, TAIL_S
from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import equalisers_of
from underfoot.engine.loop import LoopOptions
from underfoot.engine.render import Rendered
from underfoot.engine.render import render as play
from underfoot.errors import BadValue
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_plates import Heard
from underfoot.floor.tile_parameters import TileParameters
from underfoot.patch.node import installed_nodes
from underfoot.patch.patch import Patch
from underfoot.records.forces import Forces


@dataclass(frozen=True)
class RenderJob:
    """All that a rendering depends on.

    Without `forces` the patch's seeded walker walks on `floor`, unless `walking` is False: then nobody does. `seconds`
    is the forces' length and a tail, or 5 s, unless given. `profiles`, by tile id, say how tiles are driven;
    `simulation` what simulated ones are made of; `plates` where their acceleration is taken. Sound files of the patch
    lie in `folder`.
    """

    patch: Patch
    forces: Forces | None = None
    floor: Floor | None = None
    walking: bool = True
    seconds: float | None = None
    rate_hz: float = RATE_HZ
    block: int = 1024
    seed: int | None = None
    profiles: Mapping[str, Profile] = field(default_factory=dict)
    simulation: TileParameters | None = None
    plates: tuple[Heard, ...] = ()
    folder: Path | None = None

    def run(self) -> Rendered:
        """Render it; `BadValue` for a length, block or rate that cannot be, and where a node makes no finite value."""
        if not float(self.rate_hz).is_integer():
            raise BadValue(f"rate is {self.rate_hz:g}; allowed: whole numbers, 8000 to 192000 Hz")
        options = LoopOptions(
            rate_hz=self.rate_hz,
            block=self.block,
            equalisers=equalisers_of(self.profiles),
            folder=self.folder,
            seed=self.seed,
            plates=self.plates,
            simulation=self.simulation,
        )
        return play(self.patch, installed_nodes(), self._source(), self._length_s(), options)

    def _length_s(self) -> float:
        if self.seconds is not None:
            return self.seconds
        if self.forces is None:
            return DEFAULT_S
        return float(self.forces.time_s[-1] - self.forces.time_s[0]) + TAIL_S

    def _source(self) -> ForceSource:
        if self.forces is not None:
            return Replay(self.forces, self.forces.floor, self.rate_hz)
        floor = self.floor or default_floor()
        if self.simulation is None:
            seed = self.patch.seed if self.seed is None else self.seed
            return SimulatedFloor(floor, self.rate_hz, seed, self.walking)
        return SimulatedFloor(floor, self.rate_hz, 1, self.walking, self.simulation, self.profiles)  # these very tiles


def render(
    patch: Patch,
    forces: Forces | None = None,
    *,
    seconds: float | None = None,
    floor: Floor | None = None,
    seed: int | None = None,
    rate_hz: float = RATE_HZ,
    plates: tuple[Heard, ...] = (),
    folder: str | Path | None = None,
) -> Rendered:
    """Play a patch offline, to the bytes that a live session would have played: `samples`, float32 [frame, channel].

    Without `forces` a simulated walker walks on `floor`, 2 x 2 tiles by default. The rest is as in `RenderJob`.
    `BadValue` for what cannot be.

    >>> render(Patch().add("tile-output"), seconds=0.5)
    <Rendered: 24000 frames of 4 channels at 48000 Hz, peak 0.0000>
    """
    where = Path(folder) if folder is not None else None
    return RenderJob(patch, forces, floor, True, seconds, rate_hz, 1024, seed, {}, None, plates, where).run()
