"""The rigs that `underfoot calibrate` can measure on, and the options that choose one.

A rig is of one of the sorts that a calibration can need (`calibration.declaration`): it presses, it shakes, or it steps
on a variable stiffness plate.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from underfoot.calibration.declaration import PRESSING, SHAKING, STEPPING
from underfoot.commands.files import complete_names, live_targets
from underfoot.devices.transports import split_target, target_forms, transport_of
from underfoot.errors import BadValue
from underfoot.options import option

if TYPE_CHECKING:
    from underfoot.calibration.rig import Rig
    from underfoot.devices.transport import Transport
    from underfoot.floor.layout import Floor, Tile
    from underfoot.floor.simulated_tile import SimulatedTile


class _LoadedRig:
    """Options of rigs with forces; the simulator's has a load cell."""

    target: str
    cell: str
    displacement: str = ""

    @property
    def is_simulated(self) -> bool:
        """Whether the target moves by itself."""
        from underfoot.engine.target import simulation_of

        return simulation_of(self.target) is not None

    @property
    def has_load_cell(self) -> bool:
        """Whether readings come with a reference force."""
        return bool(self.cell) or self.is_simulated

    @property
    def sensors(self) -> tuple[str, str]:
        """What load cell and displacement sensor are called in a report, with their scales."""
        from underfoot.calibration.rigs.device import sensor_names

        return sensor_names(self.cell, self.displacement)

    def transport(self) -> "Transport":
        """Return the transport to the hardware; `BadValue` for another target."""
        hardware = split_target(self.target)
        if hardware is None:
            raise BadValue(f"--target is {self.target!r}; allowed: simulator[:PARAMETERS.json], {target_forms()}")
        return transport_of(*hardware)


@dataclass(frozen=True)
class PressingRig(_LoadedRig):
    """Options of a rig whose tile is pressed: by the simulator, or by a person on hardware."""

    target: str = option(
        f"Measure on this target: simulator[:PARAMETERS.json] (which presses), {target_forms()}.",
        "",
        shell_complete=complete_names(live_targets),
    )
    cell: str = option("Load cell on the target: TILE.SENSOR:NEWTONS_PER_COUNT:ZERO, such as 9.1:0.05:120.", "")

    def open(self, floor: "Floor", tile: "Tile", seed: int) -> "Rig":
        """Open the rig within the context; `BadValue` for another target."""
        from underfoot.calibration.rigs.device import DeviceRig, load_cell_of
        from underfoot.calibration.rigs.simulated_hand import SimulatedHand

        simulated = _simulated_tile(self.target, tile, seed)
        if simulated is not None:
            if self.cell:
                raise BadValue("--cell is for hardware; the simulator has a load cell of its own")
            return SimulatedHand(simulated, seed)
        transport = self.transport()
        cell = load_cell_of(self.cell) if self.cell else None
        return DeviceRig(transport, floor.index(tile.id), cell)


_SHAKERS = "simulator[:PARAMETERS.json], sound"


@dataclass(frozen=True)
class ShakingRig:
    """Options of a rig whose shaker plays and whose accelerometer records: simulated, or through a sound card."""

    target: str = option(f"Measure on this target instead: {_SHAKERS}.", "")
    output_device: str = option("Sound card of --target sound; by default the system's.", "", "--output")
    input_device: str = option("Sound card of the accelerometer; by default the system's.", "", "--input")
    input_channel: int = option("Channel of the accelerometer, from 0.", 0)
    has_load_cell: ClassVar[bool] = False
    sensors: ClassVar[tuple[str, str]] = ("", "")
    """None but the accelerometer."""

    @property
    def is_simulated(self) -> bool:
        """Whether nobody need stand on the tile."""
        return self.target != "sound"

    def open(self, floor: "Floor", tile: "Tile", seed: int) -> "Rig":
        """Open the rig within the context; `BadValue` for another target, `DeviceError` for an unknown sound card."""
        from underfoot.engine.shaker_rigs import SimulatedShaker, SoundCard, channels_of

        if self.target == "sound":
            channel, opened = channels_of(floor, tile)
            return SoundCard(self.output_device, self.input_device, channel, self.input_channel, channels=opened)
        simulated = _simulated_tile(self.target, tile, seed)
        if simulated is None:
            raise BadValue(f"--target is {self.target!r}; allowed: {_SHAKERS}")
        return SimulatedShaker(simulated)


@dataclass(frozen=True)
class SteppingRig(_LoadedRig):
    """Options of a rig with a variable stiffness plate on a tile: the simulator steps on it, or a person."""

    target: str = option(
        f"Measure on this target: simulator[:PARAMETERS.json] (which steps), {target_forms()}.",
        "",
        shell_complete=complete_names(live_targets),
    )
    plate: str = option('Serial port of the plate, or "simulated".', "simulated")
    displacement: str = option(
        "Displacement sensor on the target: TILE.SENSOR:MM_PER_COUNT:ZERO, as 9.2:0.001:120.", ""
    )
    cell: str = option("Load cell on the target: TILE.SENSOR:NEWTONS_PER_COUNT:ZERO; else the tile's forces.", "")

    def open(self, floor: "Floor", tile: "Tile", seed: int) -> "Rig":
        """Open the rig within the context; `BadValue` for another target, `DeviceError` if there is no such plate."""
        from underfoot.calibration.rigs.device import DISPLACEMENT_FORM, DeviceRig, displacement_of, load_cell_of
        from underfoot.calibration.rigs.plate import PlateRig, simulated_plate_rig
        from underfoot.devices.plate import PlateServo

        simulated = _simulated_tile(self.target, tile, seed)
        if simulated is not None:
            if self.cell or self.displacement:
                raise BadValue("--cell and --displacement are for hardware; the simulator has its own")
            return simulated_plate_rig(simulated, self.plate, seed)
        transport = self.transport()
        if not self.displacement:
            raise BadValue(f"--displacement is missing; allowed: {DISPLACEMENT_FORM}")
        sensor, cell = displacement_of(self.displacement), load_cell_of(self.cell) if self.cell else None
        servo = PlateServo(self.plate)
        try:
            return PlateRig(DeviceRig(transport, floor.index(tile.id), cell, displacement=sensor), servo)
        except BaseException:
            servo.close()
            raise


MeasuringRig = PressingRig | ShakingRig | SteppingRig
RIGS: dict[str, type[MeasuringRig]] = {
    PRESSING: PressingRig,
    SHAKING: ShakingRig,
    STEPPING: SteppingRig,
}


def _simulated_tile(target: str, tile: "Tile", seed: int) -> "SimulatedTile | None":
    """Return the tile of the target "simulator" or "simulator:..."; None for another target."""
    from underfoot.engine.target import simulation_of
    from underfoot.floor.simulated_tile import SimulatedTile
    from underfoot.floor.tile_parameters import simulation

    path = simulation_of(target)
    if path is None:
        return None
    if seed < 0:
        raise BadValue(f"--seed is {seed}; allowed: 0 or more")
    return SimulatedTile(tile, simulation(path)[0], seed)
