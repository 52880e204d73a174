"""Requests of the supervisor to the engine and the compiler. Plain frozen data."""

from pathlib import Path

from msgspec import Struct

from underfoot.engine.commands import TileEqualiser
from underfoot.engine.session_memory import MemoryNames
from underfoot.engine.target import Target
from underfoot.floor.layout import Tile
from underfoot.floor.simulated_plates import PlateOutput


class Setup(Struct, frozen=True):
    """The engine process's configuration: target, patch, names of the shared memory, and the state to resume from.

    `folder` has the patch's files. `frame` is the session frame to begin with; in a restart it belongs to `since`, by
    `time.perf_counter`.
    """

    target: Target
    patch: bytes
    scopes: tuple[str, ...]
    folder: Path | None
    memory: MemoryNames
    frame: int
    equalisers: tuple[TileEqualiser, ...] = ()
    since: float | None = None


class StandBy(Struct, frozen=True):
    """Load the kernels of the other engine's program, for an immediate takeover."""

    setup: Setup


class CardsThere(Struct, frozen=True):
    """PortAudio's whole names of the sound cards that are there, of those that were missing, by the target's names."""

    names: dict[str, str]


class CompileRequest(Struct, frozen=True):
    """Compile all kernels of a patch, and of the target's force source, into the cache; answered by `Compiled`."""

    ticket: int
    patch: bytes
    target: Target
    folder: Path | None = None
    plates: tuple[PlateOutput, ...] = ()
    from_end: bool = False


class PreviewRequest(Struct, frozen=True):
    """Render a node's response to one step; answered by `Preview`, and on request by `Distributions`."""

    ticket: int
    patch: bytes
    node: str
    tile: Tile
    seconds: float
    rate: float
    folder: Path | None = None
    distributions: bool = False
    equalisers: tuple[TileEqualiser, ...] = ()


class OutlinesRequest(Struct, frozen=True):
    """Render several nodes' responses to one step, for small pictures; answered by `Outlines`."""

    ticket: int
    patch: bytes
    nodes: tuple[str, ...]
    tile: Tile
    seconds: float
    rate: float
    folder: Path | None = None


class ErrorCurveRequest(Struct, frozen=True):
    """Measure the run time over error of a node; answered with `ErrorCurveDrawn` again and again, until another request
    comes."""

    ticket: int
    patch: bytes
    node: str
