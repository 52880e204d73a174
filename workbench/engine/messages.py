"""What crosses between the processes of a session: commands to the engine, reports from it. Plain frozen data."""

from dataclasses import dataclass, field

import numpy as np

from underfoot.clock import RATE_HZ

# --- commands: to the engine ---


@dataclass(frozen=True)
class Swap:
    """Play this patch instead (JSON text): built beside, states kept, faded in. Kernels are in the cache already.

    The engine fades the old patch out first, not `together` with the new one, where both at once would cost too much.
    """

    patch: bytes
    scopes: tuple[str, ...] = ()
    together: bool = True


@dataclass(frozen=True)
class Set:
    """Let a number of a node go to a value, in a ramp."""

    node: str
    name: str
    value: float


@dataclass(frozen=True)
class Strike:
    """An event of this strength for a node that can be struck, on one tile; node "" is every such node."""

    node: str
    tile: str
    strength: float = 1.0


@dataclass(frozen=True)
class Press:
    """A hand or mouse on a simulated tile: force in newtons at a place in the tile's frame; 0 lets go."""

    tile: str
    x_m: float
    y_m: float
    force_n: float


@dataclass(frozen=True)
class Walk:
    """Let the synthetic walker walk over the simulated floor, or stand aside."""

    on: bool


@dataclass(frozen=True)
class Tare:
    """Take the present forces of all unloaded tiles as their zero."""


@dataclass(frozen=True)
class Level:
    """Output level in dB of full scale, at most 0."""

    db: float


@dataclass(frozen=True)
class Play:
    """Let sound out, or ramp it down; the session goes on either way."""

    on: bool


@dataclass(frozen=True)
class Panic:
    """Close in 1 ms, before all other commands. The engine makes it itself when it sees the shared panic byte."""


@dataclass(frozen=True)
class Pulse:
    """A short 60 Hz burst on one tile, past the patch but not past the limiter: which tile is which."""

    tile: str


@dataclass(frozen=True)
class Correct:
    """How a tile is driven from now on, as its profile says: m/s^2 a full-scale unit, and its equaliser.

    `sections` are second-order sections [b0, b1, b2, 1, a1, a2] at `rate_hz`; none for no equaliser.
    """

    tile: str
    acceleration_per_unit: float = 20.0
    sections: tuple[tuple[float, ...], ...] = ()
    rate_hz: float = RATE_HZ


@dataclass(frozen=True)
class Quit:
    """Ramp down and leave."""


Command = Swap | Set | Strike | Press | Walk | Tare | Level | Play | Panic | Pulse | Correct | Quit


# --- reports: from the engine, compiler and supervisor ---


@dataclass(frozen=True)
class Started:
    """The engine runs: what it plays on, in words, and why it is not what was asked for, if so.

    `channels` has that of each tile, or -1 for a tile that is silent because the sound card has none for it.
    """

    where: str
    notice: str = ""
    process: int = 0
    channels: tuple[int, ...] = ()


@dataclass(frozen=True)
class Done:
    """A command took effect at this session frame: with the force samples, all that a replay needs."""

    frame: int
    command: Command


@dataclass(frozen=True)
class Fault:
    """A node made a value that is not finite; its output was silenced."""

    node: str
    tile: str
    frame: int


@dataclass(frozen=True)
class Costs:
    """What each node costs (share of the time a block may take) and for how many tiles it is awake, twice a second."""

    share: dict[str, float]
    awake: dict[str, int]


@dataclass(frozen=True)
class Lost:
    """A process went away and was started again."""

    process: str
    reason: str


@dataclass(frozen=True)
class Notice:
    """A line for the person: a device that is not there, a tile without a channel."""

    text: str


@dataclass(frozen=True)
class Compiling:
    """Kernels are being compiled: how many of how many are ready."""

    ready: int
    total: int


@dataclass(frozen=True)
class Preview:
    """What a patch does for one step on one tile: force in newtons, and the frames of each output asked for."""

    ticket: int
    rate_hz: float
    force_n: np.ndarray
    signals: dict[str, np.ndarray]
    error: str = ""
    events: dict[str, np.ndarray] = field(default_factory=dict)


Report = Started | Done | Fault | Costs | Lost | Notice | Compiling | Preview


@dataclass(frozen=True)
class Health:
    """How the engine is, read at any time."""

    running: bool
    load: float
    """Share of the time a block may take, a mean over half a second."""
    worst: float
    """The largest share since the start."""
    xruns: int
    lost: int
    """Force samples that did not arrive."""
    latency_s: float
    """From a force sample's arrival to the first output frame that it can change leaving the engine."""
    stream_latency_s: float
    """What the output stream adds, as it reports itself."""
    frame: int
    """Session frames played."""
    peak: float
    """Largest sample of the last tenth of a second, of full scale."""
    awake: int
    """Tiles for which something is awake."""
