"""Commands to the engine: one class each, with its fields, their allowed values, its effect, and its recorded form.

A command goes from the session to the engine's process as plain frozen data, takes effect at a span edge, and is
reported with its frame. Recordings keep it as JSON text under its `kind`.
"""

import math
from collections.abc import Mapping
from typing import Any, ClassVar, Protocol

import msgspec
import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, fields
from numpy.typing import NDArray

from underfoot.arguments import choice
from underfoot.clock import FADE, RATE_HZ, next_span
from underfoot.devices.force_source import ForceSource
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.equaliser_bank import EqualiserBank, coefficients_of
from underfoot.engine.intake import Intake
from underfoot.engine.program_fade import ProgramFader
from underfoot.engine.safety import Safety
from underfoot.engine.simulated_step import STEP_S, step_forces
from underfoot.engine.tile_pulse import TilePulse
from underfoot.errors import require
from underfoot.floor.layout import Floor
from underfoot.floor.profile import NOMINAL_ACCELERATION, Profile
from underfoot.models.filtering.cascade import checked
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

SILENT_DB = -120.0
"""Level in dB at or below which the output is silent."""
MOST_DELAY_S = 1.0
"""Longest delay in seconds of a strike after its command."""


class LoopParts(Protocol):
    """The parts of the block loop that commands act on."""

    registry: Registry
    source: ForceSource
    intake: Intake
    programs: ProgramFader
    pulse: TilePulse
    equalisers: EqualiserBank
    safety: Safety
    rate_hz: float

    def build(self, patch: Patch, scopes: tuple[str, ...] = ()) -> Program:
        """Build the program of a patch for this loop."""
        ...


class Action(Struct, frozen=True):
    """An operation that the loop performs at a span edge."""

    def free_from(self, loop: LoopParts) -> int:
        """Return the first frame at which the action can be applied; 0 if there is no restriction."""
        return 0

    def apply(self, loop: LoopParts, frame: int) -> None:
        """Apply it from `frame` on. Runs in the audio callback: allocates, loads and locks nothing."""

    def reported(self) -> "Command | None":
        """Return the command to report after it was applied; None for none."""
        return None


class Command(Action, frozen=True):
    """Base class of all commands. `kind` is the name in recordings, by default the name of the class."""

    kind: ClassVar[str]
    kinds: ClassVar[dict[str, type["Command"]]] = {}

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.kind = vars(cls).get("kind", cls.__name__)
        Command.kinds[cls.kind] = cls

    def check(self, floor: Floor) -> None:
        """Raise `BadValue` for a `tile` that is not on the floor, or a number that is not finite."""
        values = asdict(self)
        if "tile" in values:
            floor.index(values["tile"])
        for name, value in values.items():
            require(not isinstance(value, float) or math.isfinite(value), name, value, "a finite number")

    def prepared(self, loop: LoopParts) -> Action:
        """Build and load everything needed, and return the action to apply. Never called in the audio callback."""
        return self

    def reported(self) -> "Command":
        return self


class Swap(Command, frozen=True):
    """Replace the program by this patch (JSON text): it is built first, and faded in. Its kernels are in the cache."""

    patch: bytes
    scopes: tuple[str, ...] = ()
    together: bool = True
    """Whether both programs run during the fade; the engine clears it where they would cost too much."""
    anew: bool = False
    """Whether the patch begins from rest: only nodes that follow the floor keep their state."""
    settle_s: float = 0.0
    """Time for which a program with new nodes runs silently before the fade."""

    def prepared(self, loop: LoopParts) -> "ProgramSwap":
        """Build the program."""
        program = loop.build(Patch.loads(self.patch, loop.registry), self.scopes)
        program.begins_anew = self.anew
        return ProgramSwap(program, self)


class Start(Swap, frozen=True):
    """Play the patch from its start, with the preview's step on a tile, and a strike with it, `STEP_S` later.

    The recorded forces are without that step; a replay adds it again. A start whose `from_frame` is in the future
    waits, without blocking other commands, until another patch is played or another start replaces it.
    """

    tile: str = ""
    from_frame: int = 0
    anew: bool = True

    def prepared(self, loop: LoopParts) -> "ProgramStart":
        """Build the program and the forces of the step."""
        floor = loop.source.floor
        step_n = step_forces(floor.tiles[floor.index(self.tile)])
        return ProgramStart(super().prepared(loop).program, self, step_n)


class CancelStart(Command, frozen=True):
    """Cancel a waiting start. Not recorded, because a start is recorded only when it begins."""

    def reported(self) -> None:  # type: ignore[override]
        return None


class Set(Command, frozen=True):
    """Ramp a number of a node to a value."""

    node: str
    name: str
    value: float

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.programs.set(self.node, self.name, self.value, frame)


class Strike(Command, frozen=True):
    """Strike a node on one tile with this strength; node "" is every node that can be struck.

    The event is `delay_s` after the command's frame, so that events detected together keep their spacing.
    """

    node: str
    tile: str
    strength: float = 1.0
    delay_s: float = 0.0

    def check(self, floor: Floor) -> None:
        """Check the tile, and raise `BadValue` for a delay outside 0 to `MOST_DELAY_S`."""
        super().check(floor)
        require(0.0 <= self.delay_s <= MOST_DELAY_S, "delay_s", self.delay_s, f"0 to {MOST_DELAY_S:g} s")

    def apply(self, loop: LoopParts, frame: int) -> None:
        time = float(frame) + self.delay_s * loop.rate_hz
        loop.programs.current.strike(self.node, self.tile, time, self.strength)


class PressTile(Command, frozen=True):
    """Press on a simulated tile, by hand or mouse: force in newtons at a point in the tile's frame; 0 releases it."""

    kind: ClassVar[str] = "Press"

    tile: str
    x_m: float
    y_m: float
    force_n: float

    def apply(self, loop: LoopParts, frame: int) -> None:
        if isinstance(loop.source, SimulatedFloor):
            loop.source.press(loop.source.floor.index(self.tile), self.x_m, self.y_m, self.force_n)


class Walk(Command, frozen=True):
    """Start or stop the synthetic walker on the simulated floor."""

    on: bool

    def apply(self, loop: LoopParts, frame: int) -> None:
        if isinstance(loop.source, SimulatedFloor):
            loop.source.walk(on=self.on)


class Tare(Command, frozen=True):
    """Take the present forces of all unloaded tiles as their zero."""

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.intake.tare()


class Level(Command, frozen=True):
    """Set the output level in dB of full scale, at most 0."""

    db: float

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.safety.level(10.0 ** (min(self.db, 0.0) / 20.0) if self.db > SILENT_DB else 0.0, frame)


class Play(Command, frozen=True):
    """Open the outputs, or ramp them down; the session continues in both cases."""

    on: bool

    def apply(self, loop: LoopParts, frame: int) -> None:
        if self.on:
            loop.safety.open(frame)
        else:
            loop.safety.close(frame)


class Panic(Command, frozen=True):
    """Close the outputs, before all other commands. Made by the engine itself at the panic byte."""

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.safety.panic(frame)


class Pulse(Command, frozen=True):
    """Play a short 60 Hz burst on one tile, to identify it; it bypasses the patch, but not the limiter."""

    tile: str

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.pulse.start(loop.source.floor.index(self.tile), frame)


class Mark(Command, frozen=True):
    """Text at a moment `ago_s` before this takes effect; a recording keeps it as a mark, not as a command."""

    text: str = ""
    ago_s: float = 0.0

    def frame(self, frame: int, rate_hz: float) -> int:
        """Return the session frame of the moment, if this took effect at `frame`.

        >>> Mark("begin", ago_s=0.5).frame(48_000, 48_000.0)
        24000
        """
        return max(frame - round(self.ago_s * rate_hz), 0)


class TileEqualiser(Command, frozen=True):
    """Set the drive of a tile as in its profile: the acceleration in m/s^2 per full-scale unit, and the equaliser.

    `sections` are second-order sections [b0, b1, b2, 1, a1, a2] at `rate_hz`; none for no equaliser. `calibration` is
    the `identity` of the profile's response.
    """

    kind: ClassVar[str] = "Correct"

    tile: str
    acceleration_per_unit: float = NOMINAL_ACCELERATION
    sections: tuple[tuple[float, ...], ...] = ()
    rate_hz: float = RATE_HZ
    calibration: str = ""

    @staticmethod
    def of_profile(tile: str, profile: Profile) -> "TileEqualiser":
        """Return the command for a tile with this profile; without equaliser if its response was not measured.

        >>> TileEqualiser.of_profile("t1", Profile(tile="t1"))
        TileEqualiser(tile='t1', acceleration_per_unit=20.0, sections=(), rate_hz=48000, calibration='')
        """
        response = profile.response
        if response is None:
            return TileEqualiser(tile, profile.acceleration_per_unit)
        level, sections = response.acceleration_per_unit, response.equaliser
        return TileEqualiser(tile, level, sections, response.rate_hz, response.identity)

    def check(self, floor: Floor) -> None:
        """Check the tile, and raise `BadValue` for unstable sections, or a scale that is not above 0."""
        super().check(floor)
        scale = self.acceleration_per_unit
        require(scale > 0.0, "acceleration_per_unit", scale, "above 0")
        checked(self.sections)

    def coefficients(self, engine_rate_hz: float) -> np.record:
        """Return the equaliser's coefficients at the engine's rate; raise `BadValue` if it is not stable."""
        return coefficients_of(self.sections, self.rate_hz, engine_rate_hz)

    def prepared(self, loop: LoopParts) -> "EqualiserChange":
        """Compute the equaliser's coefficients."""
        return EqualiserChange(self, loop.source.floor.index(self.tile), self.coefficients(loop.rate_hz))


class Quit(Command, frozen=True):
    """Ramp down and exit."""


def equalisers_of(profiles: Mapping[str, Profile]) -> tuple[TileEqualiser, ...]:
    """Return the equalisers of tiles whose response was measured.

    >>> equalisers_of({"t1": Profile(tile="t1")})
    ()
    """
    return tuple(
        TileEqualiser.of_profile(id, profile) for id, profile in profiles.items() if profile.response is not None
    )


# --- actions that commands are prepared into, outside the audio callback ---


class ProgramSwap(Action, frozen=True):
    """Fade to the program of a command: together with the old one, or one after the other."""

    program: Program
    command: Swap

    def free_from(self, loop: LoopParts) -> int:
        return loop.programs.free_from

    def apply(self, loop: LoopParts, frame: int) -> None:
        settle_frames = next_span(round(self.command.settle_s * loop.rate_hz))
        if self.command.together:
            loop.programs.crossfade(self.program, frame, settle_frames)
        else:
            loop.programs.fade_through_silence(self.program, frame, settle_frames)

    def reported(self) -> Swap:
        return self.command


class ProgramStart(ProgramSwap, frozen=True):
    """Fade to the program of a start, and press and strike its tile, as in a preview."""

    command: Start
    step_n: NDArray[np.float64]

    def apply(self, loop: LoopParts, frame: int) -> None:
        super().apply(loop, frame)
        begins = frame if self.command.together else frame + FADE
        step = begins + round(STEP_S * loop.rate_hz)
        loop.intake.steps.begin(loop.source.floor.index(self.command.tile), step, self.step_n)
        self.program.strike("", self.command.tile, float(step), 1.0)


class EqualiserChange(Action, frozen=True):
    """Fade a tile's equaliser and its full-scale acceleration to those of a command."""

    command: TileEqualiser
    row: int
    coefficients: np.record

    def free_from(self, loop: LoopParts) -> int:
        return loop.equalisers.free_from(self.row)

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.equalisers.change(self.row, self.coefficients, frame)
        loop.safety.rescale(self.row, self.command.acceleration_per_unit, frame)

    def reported(self) -> TileEqualiser:
        return self.command


# --- commands as text ---


def to_text(command: Command) -> tuple[str, str]:
    """Return a command as its kind and JSON.

    >>> to_text(Level(-20.0))
    ('Level', '{"db":-20.0}')
    """
    body = {name: value.decode() if isinstance(value, bytes) else value for name, value in asdict(command).items()}
    return command.kind, msgspec.json.encode(body).decode()


def from_text(kind: str, body: str) -> Command:
    """Return the command of `to_text`; raise `BadValue` for an unknown kind.

    >>> from_text("Level", '{"db":-20.0}')
    Level(db=-20.0)
    """
    choice("kind", kind, sorted(Command.kinds))
    made = Command.kinds[kind]
    values: dict[str, Any] = msgspec.json.decode(body)
    for one in fields(made):
        if one.type is bytes:
            values[one.name] = values[one.name].encode()
    return msgspec.convert(values, made)
