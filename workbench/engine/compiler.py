"""The compiler's process: fills the kernel cache before the engine needs it, and renders previews.

Compiling holds the interpreter for long stretches; here nobody minds. The engine then only loads what is in the cache.
"""

import signal
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.loop import Loop
from underfoot.engine.messages import Compiling, Play, Preview, Strike
from underfoot.engine.process import load_kernels
from underfoot.engine.target import Target, source_of
from underfoot.errors import UnderfootError
from underfoot.floor.forces import Forces
from underfoot.floor.layout import Floor
from underfoot.models import gait
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

STEP_S = 0.05
"""When the foot of a preview comes down."""
_FORCE_HZ = 1000.0
_BLOCK = 480  # the strike falls between two blocks


@dataclass(frozen=True)
class Warm:
    """Have every kernel of a patch, and of what brings the target's force, in the cache; answered with `Ready`."""

    ticket: int
    patch: bytes
    target: Target
    folder: str = ""


@dataclass(frozen=True)
class Ready:
    """The kernels of the patch of this ticket are in the cache; or why they are not."""

    ticket: int
    error: str = ""


@dataclass(frozen=True)
class Look:
    """Render what a node does in one step; answered with `Preview`."""

    ticket: int
    patch: bytes
    node: str
    tile: str
    seconds: float
    rate: float
    folder: str = ""


def run(connection: Connection) -> None:
    """The process's main function; returns when the connection ends. Of several requests to look, the newest counts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the session
    try:
        while True:
            request = connection.recv()
            while isinstance(request, Look) and connection.poll():
                request = connection.recv()
            if isinstance(request, Warm):
                connection.send(_warm(request, connection.send))
            elif isinstance(request, Look):
                connection.send(_look(request))
    except (EOFError, OSError):
        return  # the supervisor is gone


def _warm(request: Warm, tell: Callable[[object], None]) -> Ready:
    try:
        patch = Patch.loads(request.patch, REGISTRY)
        types = {node.type for node in patch.nodes}
        total = len(types) + 1
        for ready, name in enumerate(sorted(types)):
            tell(Compiling(ready, total))
            REGISTRY[name].compile()
        tell(Compiling(total - 1, total))
        warm(patch, Path(request.folder) if request.folder else None)
        if request.target.kind in TRANSPORTS or request.target.simulation:
            source_of(request.target).pull(round(request.target.rate))
        tell(Compiling(total, total))
    except UnderfootError as error:
        return Ready(request.ticket, str(error))
    return Ready(request.ticket)


def warm(patch: Patch, folder: Path | None = None) -> None:
    """Run a patch for a moment on a floor of one tile, a swap included, so that all its kernels are compiled."""
    loop = Loop(patch, REGISTRY, SimulatedFloor(_one_tile("t1")), block=256, folder=folder)
    loop.send(Play(True))
    loop.send(loop.build(patch))
    for _ in range(24):
        loop.run(256)
    load_kernels()


def _look(request: Look) -> Preview:
    try:
        patch = Patch.loads(request.patch, REGISTRY)
        type = REGISTRY[patch.node(request.node).type]
        scopes = tuple(f"{request.node}.{port.name}" for port in type.outputs)
        force, signals, events = look(patch, scopes, request.tile, request.seconds, request.rate, request.folder)
    except UnderfootError as error:
        return Preview(request.ticket, request.rate, np.zeros(0), {}, str(error))
    return Preview(request.ticket, request.rate, force, signals, events=events)


def look(
    patch: Patch, scopes: tuple[str, ...], tile: str, seconds: float, rate: float, folder: str = ""
) -> tuple[np.ndarray, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """One step on one tile, and a strike as it begins: force in newtons, and what comes from each scope ("node.port").

    By port: the frames of signals, and the (frame, strength, duration) of events.
    """
    time_s = np.arange(round((seconds + 0.1) * _FORCE_HZ)) / _FORCE_HZ
    walker = gait.Walker(variation=0.0)
    floor = _one_tile(tile)
    step = gait.footfalls(walker, [(0.0, 0.0)], STEP_S + 0.01, start_s=STEP_S)[0]
    along = walker.foot_length_m * (gait.roll((time_s - step.start_s) / step.duration_s) - 0.5)
    force = step.force_n(time_s)
    corners = gait.corner_forces(force, along, np.zeros_like(along), floor.tiles[0].sensors_m)
    source = Replay(Forces(time_s, corners[:, None, :], _FORCE_HZ), floor, rate)
    loop = Loop(
        patch, REGISTRY, source, rate=rate, block=_BLOCK, scopes=scopes, folder=Path(folder) if folder else None
    )
    loop.send(Strike("", tile), round(STEP_S * rate))
    frames = round(seconds * rate)
    signals = {name: np.zeros(frames, np.float32) for name in loop.program.scope_names}
    events: dict[str, list[np.ndarray]] = {name: [] for name in scopes if name not in signals}
    for at in range(0, frames, _BLOCK):
        n = min(_BLOCK, frames - at)
        loop.run(n)
        for name, frames_of in signals.items():
            frames_of[at : at + n] = loop.program.scope[name][0, :n]
        for name, found in events.items():
            found.append(loop.program.events(name))
    return (
        np.interp(np.arange(frames) / rate, time_s, force).astype(np.float32),
        {_port(name): frames_of for name, frames_of in signals.items()},
        {_port(name): np.concatenate(found) for name, found in events.items()},
    )


def _port(scope: str) -> str:
    return scope.partition(".")[2]


def _one_tile(id: str) -> Floor:
    from underfoot.floor.layout import Tile

    edge = 0.1335
    corners = ((edge, edge), (-edge, edge), (-edge, -edge), (edge, -edge))
    return Floor((Tile(id, (0.305, 0.305), (0.1525, 0.1525), sensors_m=corners),))
