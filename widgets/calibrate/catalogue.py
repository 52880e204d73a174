"""The calibrations that there are, and how each is made ready for a tile of a target."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from underfoot.calibration.procedures.procedure import Bench, Procedure, ask
from underfoot.engine.target import Target
from underfoot.errors import DeviceError
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Profile
from underfoot.parameters import Parameter, Text

if TYPE_CHECKING:
    from underfoot.floor.simulated_tile import SimulatedTile

MakeReady = Callable[[Target, Tile, Profile, str], tuple[Procedure, Bench]]
"""From target, tile, what is known of it, and what was said of the reference beside it."""


@dataclass(frozen=True)
class Kind:
    """One calibration: the part of a profile that it makes, its name, what it is for, and how it is made ready.

    `reference` is what is asked on hardware of the reference; `first` is the part that must be there before it.
    """

    key: str
    name: str
    title: str
    about: str
    make: MakeReady
    reference: Parameter
    first: str = ""


def by_hand(target: Target) -> bool:
    """Whether a person presses: the target is hardware."""
    return target.kind not in ("simulator", "replay")


def why_not(target: Target) -> str:
    """Why tiles of a target cannot be calibrated; "" where they can."""
    if target.kind == "replay":
        return "A recording cannot be pressed. Choose the simulated floor or a tile as the target."
    return ""


def _fsr(target: Target, tile: Tile, profile: Profile, reference: str) -> tuple[Procedure, Bench]:
    from underfoot.calibration.procedures.fsr import FsrProcedure

    return FsrProcedure(tile), _pressed(target, tile, reference)


def _centroid(target: Target, tile: Tile, profile: Profile, reference: str) -> tuple[Procedure, Bench]:
    from underfoot.calibration.procedures.centroid import CentroidProcedure

    return CentroidProcedure(tile, profile), _pressed(target, tile, reference)


def _response(target: Target, tile: Tile, profile: Profile, reference: str) -> tuple[Procedure, Bench]:
    from underfoot.calibration.procedures.response import FrequencyResponse
    from underfoot.engine.loop import output_channels
    from underfoot.engine.sounding import SimulatedShaker, SoundCard

    procedure = FrequencyResponse(tile, target.rate)
    if not by_hand(target):
        return procedure, SimulatedShaker(_simulated(target, tile))
    if target.sound is None:
        raise DeviceError("no sound device is chosen; choose the one that drives the shakers under Audio")
    channel = output_channels(target.floor)[target.floor.index(tile.id)]
    return procedure, SoundCard(target.sound, reference, channel)


def _pressed(target: Target, tile: Tile, cell: str) -> Bench:
    """Whoever presses `tile`: the simulator, or a person, with a load cell where one is named."""
    from underfoot.calibration.procedures.device_bench import LinkBench, cell_of
    from underfoot.calibration.procedures.simulated_bench import SimulatedBench
    from underfoot.devices.transports import transport_of

    if not by_hand(target):
        return SimulatedBench(_simulated(target, tile))
    port = transport_of(target.kind, target.source)
    return LinkBench(port, target.floor.index(tile.id), cell_of(cell) if cell else None)


def _simulated(target: Target, tile: Tile) -> "SimulatedTile":
    """The tile as the simulated floor of `target` has it; an ideal floor's is of the usual kind."""
    from underfoot.floor.simulated_tile import SimulatedTile, TileParameters

    return SimulatedTile(tile, TileParameters.load(target.simulation) if target.simulation else None)


_CELL = ask(
    "load_cell",
    Text(
        "",
        doc="A load cell on the tile's line: its tile number and sensor, newtons a count, and its reading at rest, as "
        "9.1:0.05:120. Nothing: known weights.",
    ),
)
_INPUT = ask(
    "accelerometer", Text("", doc="The sound card that hears it, by a part of its name. Nothing: the default input.")
)


KINDS = (
    Kind(
        "fsr",
        "Forces",
        "Forces: readings to newtons",
        "Each sensor is loaded with known forces, rising and falling, and held for a while. What comes of it turns its "
        "readings into newtons. The reference is a load cell, or known weights that are typed in.",
        _fsr,
        _CELL,
    ),
    Kind(
        "centroid",
        "Places",
        "Places: where a foot stands",
        "The tile is pressed at places that are shown on it, or on the floor by a projector. What comes of it corrects "
        "where contacts seem to be, and says how true that is on places it was not learned from.",
        _centroid,
        _CELL,
        "fsr",
    ),
    Kind(
        "response",
        "Vibration",
        "Vibration: what the shaker makes of a signal",
        "A sweep is played through the shaker and heard by an accelerometer, with nothing on the tile, a person, and a "
        "foot on a corner. What comes of it lets stimuli in m/s² play at that level, and evens the response out.",
        _response,
        _INPUT,
    ),
)
