"""Previews: the response of a patch's nodes to one step on one tile, with a strike at the foot's contact."""

from pathlib import Path

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.devices.replay import Replay
from underfoot.engine.commands import Play, Strike, TileEqualiser
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.reports import COMMANDED, MEASURED
from underfoot.engine.simulated_step import FORCE_HZ, STEP_S, adult_step
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import Floor, Tile, default_floor
from underfoot.nodes import REGISTRY
from underfoot.parameters import Number
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import node_id, port_name

ONE_TILE = default_floor(1, 1).tiles[0]
"""The thesis's tile, where no other is said."""
WHOLE_STEP_S = 0.9
"""Duration of a step and its decay: the shortest preview of a patch without a duration of its own."""
LONGEST_S = 10.0
"""Duration of the longest preview."""
_RINGING_S = 1.0
"""Decay time after the last note of a patch, in seconds."""
DRIVE = "drive"
"""The name of the shaker's drive, in full scale, among the signals of a preview that `measures`."""
_BLOCK = 480  # the strike falls between two blocks


def previewed(
    patch: Patch,
    scopes: tuple[str, ...],
    tile: Tile,
    seconds: float,
    rate_hz: float,
    folder: Path | None = None,
    *,
    measures: bool = False,
    equalisers: tuple[TileEqualiser, ...] = (),
) -> tuple[NDArray[np.float32], dict[str, NDArray[np.float32]], dict[str, NDArray[np.float64]]]:
    """Return the step's force in N (frames,), and `seconds` of signals and events of each scope ("node.port").

    The step is that of `one_step`. With `seconds` 0 they end once every node sleeps, after `WHOLE_STEP_S` at the
    earliest and `longest_s` at the latest. With `measures`, the signals have what the tile was commanded, its response
    and its drive.
    """
    ends_by_itself = seconds == 0.0
    force_n, source = one_step(seconds or longest_s(patch), rate_hz, tile)
    options = LoopOptions(
        rate_hz=rate_hz,
        block=_BLOCK,
        scopes=scopes,
        folder=folder,
        equalisers=equalisers,
        plates=("accelerometer",) if measures else (),
    )
    loop = Loop(patch, REGISTRY, source, options)
    loop.send(Play(True), 0)
    loop.send(Strike("", tile.id), round(STEP_S * rate_hz))
    frames = len(force_n)
    signals = {name: np.zeros(frames, np.float32) for name in loop.program.scope_names}
    measured, commanded, drive = (np.zeros(frames if measures else 0, np.float32) for _ in range(3))
    events: dict[str, list[NDArray[np.float64]]] = {name: [] for name in scopes if name not in signals}
    for at in range(0, frames, _BLOCK):
        n = min(_BLOCK, frames - at)
        loop.run(n)
        for name, frames_of in signals.items():
            frames_of[at : at + n] = loop.program.scope[name][0, :n]
        if measures:
            measured[at : at + n] = loop.plates["accelerometer"].out[:n, 0]
            commanded[at : at + n] = loop.commanded[:n, 0]
            drive[at : at + n] = loop.out[:n, 0]
        for name, found in events.items():
            found.append(loop.program.events(name))
        if ends_by_itself and at + n >= WHOLE_STEP_S * rate_hz and not any(loop.program.awake().values()):
            frames = at + n
            break
    if measures:
        signals |= {MEASURED: measured, COMMANDED: commanded, DRIVE: drive}
    return (
        force_n[:frames],
        {name: frames_of[:frames] for name, frames_of in signals.items()},
        {name: np.concatenate(found) for name, found in events.items()},
    )


def longest_s(patch: Patch) -> float:
    """Return an upper bound, in seconds, for how long a patch continues after a step, from what its nodes declare
    (`lasts`), one after the other along its wires.

    >>> longest_s(Patch().add("tone", REGISTRY))
    0.9
    >>> longest_s(Patch().add("rhythm", REGISTRY, bar=0.6, repeats=3))
    2.9
    """
    ends_s: dict[str, float] = {}
    for id in patch.order():
        before = [node_id(source) for source, target in patch.wires if node_id(target) == id]
        ends_s[id] = max((ends_s[one] for one in before), default=0.0) + _lasting_s(patch, id)
    seconds = max(ends_s.values(), default=0.0)
    return min(round(seconds + _RINGING_S + 2 * STEP_S, 3), LONGEST_S) if seconds else WHOLE_STEP_S


def _lasting_s(patch: Patch, id: str) -> float:
    """Return the seconds for which a node lasts, each parameter that a wire drives at the end, of the two between which
    the wire moves it, with which it lasts longer; where these are not known, at its own value.
    """
    node = patch.node(id)
    type = REGISTRY[node.type]
    values = type.values(node.parameters)
    for source, target in patch.wires:
        driven = type.parameters.get(port_name(target)) if node_id(target) == id else None
        if isinstance(driven, Number):
            driver = patch.node(node_id(source))
            of_driver = REGISTRY[driver.type]
            given = of_driver.values(driver.parameters)
            ends = [min(max(given[end], driven.low), driven.high) for end in of_driver.ends(port_name(source))]
            values = max((values | {driven.name: end} for end in ends), key=type.lasting_s, default=values)
    return type.lasting_s(values)


def one_step(seconds: float, rate_hz: float, tile: Tile = ONE_TILE) -> tuple[NDArray[np.float32], Replay]:
    """Return the force of a step over the centre of a tile at each frame in N, and the source that replays it.

    The tile is the thesis's, with the id and at the place of `tile`.
    """
    time_s = np.arange(round((seconds + 0.1) * FORCE_HZ)) / FORCE_HZ
    floor = Floor((replace(ONE_TILE, id=tile.id, centre_m=tile.centre_m),))
    force_n, corners_n = adult_step(floor.tiles[0], time_s, STEP_S)
    source = Replay(ForceSeries(time_s, corners_n[:, None, :], FORCE_HZ), floor, rate_hz)
    frames = np.arange(round(seconds * rate_hz))
    return np.interp(frames / rate_hz, time_s, force_n).astype(np.float32), source
