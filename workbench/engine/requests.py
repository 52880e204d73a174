"""What the supervisor asks of the engine and of the compiler. Plain frozen data."""

from dataclasses import dataclass

from underfoot.engine.commands import TileEqualiser
from underfoot.engine.session_memory import MemoryNames
from underfoot.engine.target import Target
from underfoot.floor.simulated_plates import PlateOutput


@dataclass(frozen=True)
class Setup:
    """All that the engine's process is given: target, patch, where the shared memory is, and where to go on from.

    `since` is when it was `frame`, by `time.monotonic`; None at the session's beginning, which waits for the engine.
    """

    target: Target
    patch: bytes
    scopes: tuple[str, ...]
    folder: str
    memory: MemoryNames
    frame: int
    equalisers: tuple[TileEqualiser, ...] = ()
    since: float | None = None


@dataclass(frozen=True)
class StandBy:
    """Load the kernels of what another engine plays, so that it can be taken over at once."""

    setup: Setup


@dataclass(frozen=True)
class CompileRequest:
    """Have every kernel of a patch, and of what brings the target's force, in the cache; answered with `Compiled`.

    `plates` are as in `LoopOptions`. `from_end` is for a process that shares this with another one.
    """

    ticket: int
    patch: bytes
    target: Target
    folder: str = ""
    plates: tuple[PlateOutput, ...] = ()
    from_end: bool = False


@dataclass(frozen=True)
class PreviewRequest:
    """Render what a node does in one step; answered with `Preview`, and with `Distributions` where these are wanted."""

    ticket: int
    patch: bytes
    node: str
    tile: str
    seconds: float
    rate: float
    folder: str = ""
    distributions: bool = False
    equalisers: tuple[TileEqualiser, ...] = ()


@dataclass(frozen=True)
class OutlinesRequest:
    """Render what several nodes do in one step, for small pictures; answered with `Outlines`."""

    ticket: int
    patch: bytes
    nodes: tuple[str, ...]
    tile: str
    seconds: float
    rate: float
    folder: str = ""


@dataclass(frozen=True)
class ErrorCurveRequest:
    """Measure the run time over error of a node; answered with `ErrorCurveDrawn` again and again, until another request
    comes."""

    ticket: int
    patch: bytes
    node: str
