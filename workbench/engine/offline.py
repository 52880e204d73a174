"""Offline renderings as plain data, which can be run in this process, another one, or on another computer."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import get_args

from msgspec.structs import replace

from underfoot.arguments import TINY, integer, number, plain
from underfoot.clock import RATE_HZ
from underfoot.devices.offline import offline_source
from underfoot.engine.commands import equalisers_of
from underfoot.engine.loop import LoopOptions
from underfoot.engine.render import LONGEST_S, NO_FILES, Files, Rendered, render_source
from underfoot.errors import BadValue, require
from underfoot.files import path_of
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_plates import PlateOutput
from underfoot.patch.patch import Patch
from underfoot.records.forces import Forces


@dataclass(frozen=True)
class RenderJob:
    """All inputs of a rendering.

    Without `forces` the patch's seeded walker walks on `floor`, unless `walking` is False. `seconds` is by default the
    length of the forces and a tail, or 5 s. `profiles`, by tile id, give the drive of tiles, in place of the options'
    equalisers.
    """

    patch: Patch
    forces: Forces | None = None
    floor: Floor | None = None
    walking: bool = True
    seconds: float | None = None
    profiles: Mapping[str, Profile] = field(default_factory=dict)
    options: LoopOptions = field(default_factory=LoopOptions)

    @property
    def seed(self) -> int:
        """The seed that is played with."""
        return self.patch.seed if self.options.seed is None else self.options.seed

    def run(self, files: Files = NO_FILES) -> Rendered:
        """Render it, to `files` as it is played; raise `BadValue` for an invalid length, block or rate, or a node's
        value that is not finite."""
        options = replace(self.options, equalisers=equalisers_of(self.profiles))
        if not float(options.rate_hz).is_integer():
            raise BadValue(f"rate is {options.rate_hz:g}; allowed: whole numbers, 8000 to 192000 Hz")
        source, seconds = offline_source(
            self.forces,
            self.floor if self.forces is None else self.forces.floor,
            options.rate_hz,
            self.seed,
            walking=self.walking,
            simulation=options.simulation,
            profiles=self.profiles,
            seconds=self.seconds,
        )
        return render_source(self.patch, source, seconds, options, files=files)


def render(
    patch: Patch,
    forces: Forces | None = None,
    *,
    seconds: float | None = None,
    floor: Floor | None = None,
    seed: int | None = None,
    rate_hz: float = RATE_HZ,
    plates: tuple[PlateOutput, ...] = (),
    folder: str | Path | None = None,
) -> Rendered:
    """Render a patch offline, to the same bytes as a live session: `samples`, float32 [frame, channel].

    - `forces` drive it, on their floor; without them a simulated walker walks on `floor`, by default 2 x 2 tiles.
    - `seconds` is the length, by default that of the forces and a tail, or 5 s; `rate_hz` is in whole hertz.
    - `seed` replaces the patch's own seed.
    - `plates` adds the simulated acceleration of tiles, at the "accelerometer" or under the "foot", in m/s^2.
    - `folder` has the sound files that the patch names by relative paths.

    Raises `BadValue` for invalid arguments.

    >>> render(Patch().add("tile-output"), seconds=0.5)
    <Rendered: 24000 frames of 4 channels at 48000 Hz, peak 0.0000>
    """
    require(isinstance(patch, Patch), "patch", patch, 'a Patch, such as open_patch("gravel")')
    require(forces is None or isinstance(forces, Forces), "forces", forces, 'Forces, such as read_forces("walk.csv")')
    require(forces is None or len(forces) > 0, "forces", forces, "one sample or more")
    require(floor is None or isinstance(floor, Floor), "floor", floor, "a Floor, such as default_floor(1, 8)")
    require(forces is None or floor in (None, forces.floor), "floor", floor, "none with forces, which have their own")
    are_places = isinstance(plates, tuple | list) and all(plain(one) in get_args(PlateOutput) for one in plates)
    require(are_places, "plates", plates, f"a tuple of {', '.join(get_args(PlateOutput))}")
    options = LoopOptions(
        rate_hz=number("rate_hz", rate_hz, 8000.0, 192_000.0, "8000 to 192000 Hz"),
        seed=None if seed is None else integer("seed", seed, -(2**63), 2**63 - 1, "-2^63 to 2^63 - 1"),
        plates=plates,
        folder=None if folder is None else path_of(folder, "folder"),
    )
    length = None if seconds is None else number("seconds", seconds, TINY, LONGEST_S, "above 0, up to a day")
    return RenderJob(patch, forces, floor, seconds=length, options=options).run()
