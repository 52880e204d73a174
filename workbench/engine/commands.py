"""Commands to the engine. Each is one class here: its fields, what they may be, what it does, and how it is recorded.

A command goes from the session to the engine's process as plain frozen data, takes effect at a span edge, and is
reported with its frame; a recording keeps it as JSON text under its `kind`.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, ClassVar, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

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
from underfoot.floor.profile import Profile
from underfoot.models.filtering.cascade import checked
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

SILENT_DB = -120.0
"""A level of this or less is silence."""
MOST_DELAY_S = 1.0
"""A strike comes this much later than its command, at most."""


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
        """The program of a patch for this loop."""
        ...


class Action:
    """Something that the loop does at a span edge."""

    def free_from(self, loop: LoopParts) -> int:
        """The first frame at which it may be done; 0 where nothing is in its way."""
        return 0

    def apply(self, loop: LoopParts, frame: int) -> None:
        """Do it, from `frame` on. This runs in the audio callback: it allocates, loads and locks nothing."""

    def reported(self) -> "Command | None":
        """What is reported of it, once it is done; None for nothing."""
        return None


@dataclass(frozen=True)
class Command(Action):
    """What all commands have. `kind` is the name in recordings, by default that of the class."""

    kind: ClassVar[str]
    kinds: ClassVar[dict[str, type["Command"]]] = {}

    def __init_subclass__(cls, kind: str = "") -> None:
        super().__init_subclass__()
        cls.kind = kind or cls.__name__
        Command.kinds[cls.kind] = cls

    def check(self, floor: Floor) -> None:
        """Raise `BadValue` for a `tile` that the floor does not have, and for a number that is not finite."""
        if "tile" in vars(self):
            floor.index(vars(self)["tile"])
        for name, value in vars(self).items():
            require(not isinstance(value, float) or math.isfinite(value), name, value, "a finite number")

    def prepared(self, loop: LoopParts) -> Action:
        """What the loop is to do, with all that it needs built and loaded; never called in the audio callback."""
        return self

    def reported(self) -> "Command":
        return self


@dataclass(frozen=True)
class Swap(Command):
    """Play this patch instead (JSON text): built beside, states kept, faded in. Kernels are in the cache already.

    The engine fades the old patch out first, not `together` with the new one, where both at once would cost too much.
    A patch that begins `anew` plays from its start: of states, only those are kept that follow the floor. Where states
    cannot be kept, the patch runs unheard for `settle_s` before it is faded in: feet that stand are no step to it.
    """

    patch: bytes
    scopes: tuple[str, ...] = ()
    together: bool = True
    anew: bool = False
    settle_s: float = 0.0

    def prepared(self, loop: LoopParts) -> "ProgramSwap":
        """The program, built."""
        program = loop.build(Patch.loads(self.patch, loop.registry), self.scopes)
        program.begins_anew = self.anew
        return ProgramSwap(program, self.together, self, next_span(round(self.settle_s * loop.rate_hz)))


@dataclass(frozen=True)
class Start(Swap):
    """Play the patch from its start, with the step of a preview on a tile: `STEP_S` later, and a strike with it.

    What is recorded of the floor is without that step: a replay adds it again. A start whose `from_frame` is still to
    come waits for it beside all other commands, until another patch is played or another start takes its place.
    """

    tile: str = ""
    from_frame: int = 0
    anew: bool = True

    def prepared(self, loop: LoopParts) -> "ProgramStart":
        """The program, built, and the step's forces."""
        swap, floor = super().prepared(loop), loop.source.floor
        row = floor.index(self.tile)
        step_n = step_forces(floor.tiles[row])
        return ProgramStart(swap.program, swap.together, self, swap.settle_frames, row, self.from_frame, step_n)


@dataclass(frozen=True)
class CancelStart(Command):
    """Let no start wait any more. It is not recorded: what did not begin is not, either."""

    def reported(self) -> None:  # type: ignore[override]
        return None


@dataclass(frozen=True)
class Set(Command):
    """Let a number of a node go to a value, in a ramp."""

    node: str
    name: str
    value: float

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.programs.set(self.node, self.name, self.value, frame)


@dataclass(frozen=True)
class Strike(Command):
    """An event of this strength for a node that can be struck, on one tile; node "" is every such node.

    It comes `delay_s` after the command's frame: events that were found together keep the time between them.
    """

    node: str
    tile: str
    strength: float = 1.0
    delay_s: float = 0.0

    def check(self, floor: Floor) -> None:
        """As for every command, and `BadValue` for a delay below 0 or beyond a second."""
        super().check(floor)
        require(0.0 <= self.delay_s <= MOST_DELAY_S, "delay_s", self.delay_s, f"0 to {MOST_DELAY_S:g} s")

    def apply(self, loop: LoopParts, frame: int) -> None:
        time = float(frame) + self.delay_s * loop.rate_hz
        loop.programs.current.strike(self.node, self.tile, time, self.strength)


@dataclass(frozen=True)
class PressTile(Command, kind="Press"):
    """A hand or mouse on a simulated tile: force in newtons at a place in the tile's frame; 0 lets go."""

    tile: str
    x_m: float
    y_m: float
    force_n: float

    def apply(self, loop: LoopParts, frame: int) -> None:
        if isinstance(loop.source, SimulatedFloor):
            loop.source.press(loop.source.floor.index(self.tile), self.x_m, self.y_m, self.force_n)


@dataclass(frozen=True)
class Walk(Command):
    """Let the synthetic walker walk over the simulated floor, or stand aside."""

    on: bool

    def apply(self, loop: LoopParts, frame: int) -> None:
        if isinstance(loop.source, SimulatedFloor):
            loop.source.walk(self.on)


@dataclass(frozen=True)
class Tare(Command):
    """Take the present forces of all unloaded tiles as their zero."""

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.intake.tare()


@dataclass(frozen=True)
class Level(Command):
    """Output level in dB of full scale, at most 0."""

    db: float

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.safety.level(10.0 ** (min(self.db, 0.0) / 20.0) if self.db > SILENT_DB else 0.0, frame)


@dataclass(frozen=True)
class Play(Command):
    """Let sound out, or ramp it down; the session goes on either way."""

    on: bool

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.safety.open(self.on, frame)


@dataclass(frozen=True)
class Panic(Command):
    """Close in 1 ms, before all other commands. The engine makes it itself when it sees the shared panic byte."""

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.safety.panic(frame)


@dataclass(frozen=True)
class Pulse(Command):
    """A short 60 Hz burst on one tile, past the patch but not past the limiter: which tile is which."""

    tile: str

    def apply(self, loop: LoopParts, frame: int) -> None:
        loop.pulse.start(loop.source.floor.index(self.tile), frame)


@dataclass(frozen=True)
class Mark(Command):
    """Words at a moment that was `ago_s` before this takes effect; a recording keeps it as a mark, and no command."""

    text: str = ""
    ago_s: float = 0.0

    def frame(self, frame: int, rate_hz: float) -> int:
        """The session frame of the moment, where this took effect at `frame`.

        >>> Mark("begin", ago_s=0.5).frame(48_000, 48_000.0)
        24000
        """
        return max(frame - round(self.ago_s * rate_hz), 0)


@dataclass(frozen=True)
class TileEqualiser(Command, kind="Correct"):
    """How a tile is driven from now on, as its profile says: m/s^2 a full-scale unit, and its equaliser.

    `sections` are second-order sections [b0, b1, b2, 1, a1, a2] at `rate_hz`; none for no equaliser.
    """

    tile: str
    acceleration_per_unit: float = 20.0
    sections: tuple[tuple[float, ...], ...] = ()
    rate_hz: float = RATE_HZ

    @staticmethod
    def of_profile(tile: str, profile: Profile) -> "TileEqualiser":
        """How a tile with this profile is driven; as an uncalibrated one where its response was not measured.

        >>> TileEqualiser.of_profile("t1", Profile(tile="t1"))
        TileEqualiser(tile='t1', acceleration_per_unit=20.0, sections=(), rate_hz=48000)
        """
        response = profile.response
        if response is None:
            return TileEqualiser(tile, profile.acceleration_per_unit)
        return TileEqualiser(tile, response.acceleration_per_unit, response.equaliser, response.rate_hz)

    def check(self, floor: Floor) -> None:
        """As for every command, and `BadValue` for sections that are not stable and a scale that is not above 0."""
        super().check(floor)
        scale = self.acceleration_per_unit
        require(scale > 0.0, "acceleration_per_unit", scale, "above 0")
        checked(self.sections)

    def coefficients(self, engine_rate_hz: float) -> np.record:
        """The equaliser, ready to run; `BadValue` for one that is not stable."""
        return coefficients_of(self.sections, self.rate_hz, engine_rate_hz)

    def prepared(self, loop: LoopParts) -> "EqualiserChange":
        """The equaliser, ready to run."""
        return EqualiserChange(self, loop.source.floor.index(self.tile), self.coefficients(loop.rate_hz))


@dataclass(frozen=True)
class Quit(Command):
    """Ramp down and leave."""


def equalisers_of(profiles: Mapping[str, Profile]) -> tuple[TileEqualiser, ...]:
    """The equalisers of tiles whose response was measured.

    >>> equalisers_of({"t1": Profile(tile="t1")})
    ()
    """
    return tuple(
        TileEqualiser.of_profile(id, profile) for id, profile in profiles.items() if profile.response is not None
    )


# --- what commands are made into, beside the audio callback ---


@dataclass(frozen=True)
class ProgramSwap(Action):
    """Fade over to a program; where both at once would cost too much, not `together` but one after the other."""

    program: Program
    together: bool = True
    command: Swap | None = None
    settle_frames: int = 0

    def free_from(self, loop: LoopParts) -> int:
        return loop.programs.free_from

    def apply(self, loop: LoopParts, frame: int) -> None:
        if self.together:
            loop.programs.crossfade(self.program, frame, self.settle_frames)
        else:
            loop.programs.fade_through_silence(self.program, frame, self.settle_frames)

    def reported(self) -> Swap | None:
        return self.command


@dataclass(frozen=True)
class ProgramStart(ProgramSwap):
    """Fade over to a program, and have a tile, the floor's `row`, stepped on and struck as in a preview."""

    row: int = 0
    from_frame: int = 0
    step_n: NDArray[np.float64] = field(default_factory=lambda: np.zeros((1, 4)))

    def apply(self, loop: LoopParts, frame: int) -> None:
        super().apply(loop, frame)
        begins = frame if self.together else frame + FADE
        step = begins + round(STEP_S * loop.rate_hz)
        loop.intake.steps.begin(self.row, step, self.step_n)
        self.program.strike("", loop.source.floor.tiles[self.row].id, float(step), 1.0)


@dataclass(frozen=True)
class EqualiserChange(Action):
    """Fade a tile's equaliser, and how loud its full scale is, over to those of a command."""

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
    """A command as its kind and JSON.

    >>> to_text(Level(-20.0))
    ('Level', '{"db":-20.0}')
    """
    body = {name: value.decode() if isinstance(value, bytes) else value for name, value in asdict(command).items()}
    return command.kind, msgspec.json.encode(body).decode()


def from_text(kind: str, body: str) -> Command:
    """The command of `to_text`; `BadValue` for a kind that there is not.

    >>> from_text("Level", '{"db":-20.0}')
    Level(db=-20.0)
    """
    require(kind in Command.kinds, "kind", kind, ", ".join(sorted(Command.kinds)))
    made = Command.kinds[kind]
    values: dict[str, Any] = msgspec.json.decode(body)
    for one in fields(made):
        if one.type is bytes:
            values[one.name] = values[one.name].encode()
    return msgspec.convert(values, made)
