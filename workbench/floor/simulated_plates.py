"""Plates of a simulated floor in real time: from the drive of each shaker to the acceleration of its tile.

A tile is a shaker, its compression, and a body of plate, frame, mounts and the person on it (`models.tile`).
`SimulatedTile.respond` is the same chain under a constant load; here the load follows the force signals. The body is
one linear system without load, and another for each place of a foot on a grid between the sensors. Under a foot three
systems run, those at the corners of the grid triangle around it, weighted by its position (barycentric). When the foot
moves to the next triangle, the systems in common continue and the others begin at rest. A change to another load, or to
a triangle further away, is a crossfade of `FADE` frames.
"""

import hashlib
from collections.abc import Callable
from typing import Annotated, Any, Literal, NamedTuple, get_args

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.arguments import choice
from underfoot.array_cache import ArrayCache
from underfoot.array_tables import F2, F3, F4, addresses, arrays_at
from underfoot.clock import FADE, LONG_AGO, SPAN
from underfoot.floor.layout import Floor, Point, Tile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.kernels import copy, inlined, kernel
from underfoot.layouts import Memory
from underfoot.memory import LINE, aligned_zeros
from underfoot.models.filtering import poles
from underfoot.models.filtering.poles import Poles
from underfoot.models.tile import shaker
from underfoot.models.tile.assembly import Assembly

QUIET_M_S2 = 1e-9
"""Bound of the remaining acceleration below which a plate is set to rest."""
STEPS = 8
"""Steps of the grid of foot places from the tile's middle to its sensors, in each direction."""
CORNERS = 3
"""Systems that run at once: one for each corner of a triangle."""
NEIGHBOURS = 0.95
"""Share of the output in systems common to two triangles from which the change needs no crossfade."""
PlateOutput = Literal["accelerometer", "foot"]
"""Point of measurement: the accelerometer, or the contact with the foot, which is 0 without a foot."""

ROW = np.dtype(
    [
        ("channel", np.int64),
        ("steps_x_m", np.float64),
        ("steps_y_m", np.float64),
        ("slot", np.int64),
        ("systems", np.int64, (2, CORNERS)),
        ("shares", np.float64, (2, CORNERS)),
        ("shares_before", np.float64, (2, CORNERS)),
        ("fade_frame", np.int64),
        ("zero_frames", np.int64),
        ("written", np.int64),
        ("awake", np.bool_),
    ],
    align=True,
)
"""A tile: its output channel; steps of the grid a metre; which of its two slots plays, which systems each has (0:
nobody's, else 1 + the place's number; -1: none), their shares at the end of this span and at its beginning, and since
when the slot is faded to; how many frames of zero have come in, from which row on its output is zero, and whether
anything moves."""

LOAD = np.dtype([("systems", np.int64, (CORNERS,)), ("shares", np.float64, (CORNERS,))], align=True)
"""Load of a tile: the systems to run, and their weights."""

SEED = 1
"""Seed of the deviations that are drawn for tiles."""
_CACHE = ArrayCache("plates", in_memory=256, on_disk=2000)
_state_at, _coefficients_at = poles.STATE.at, poles.COEFFICIENTS.at


class PlateMemory(NamedTuple):
    """All arrays of `SimulatedPlates` that the kernels read and write, as `array_tables` passes them."""

    out: Annotated[np.ndarray, np.dtype(np.float32), 2]  # [frame, tile]
    rows: Annotated[np.ndarray, ROW, 1]  # [tile]
    sounds: Annotated[np.ndarray, np.dtype(np.bool_), 1]  # [channel]: whether a tile on it is not silent
    shakers: F2  # [tile, value]: coefficients, like those of bodies
    bodies: F3  # [tile, load, value]
    shaker_states: F2  # [tile, value]
    body_states: F4  # [tile, slot, system, value]
    compressions: Annotated[np.ndarray, shaker.COMPRESSION, 1]  # [tile]
    buffers: F2  # [4, `SPAN`]
    load: Annotated[np.ndarray, LOAD, 1]


class SimulatedPlates:
    """Plates of `floor` with these `parameters`, each with deviations drawn by `SEED` as in `SimulatedTile`.

    `channels[row]` is the output channel of a tile's shaker, or -1. `apply` writes m/s^2, float32 [frame, tile], to
    `out`, which has `block` frames. `BadValue` for parts that do not fit on a tile.
    """

    def __init__(
        self, floor: Floor, parameters: TileParameters | None, channels: list[int], rate_hz: float, block: int,
        measured_at: PlateOutput,
    ) -> None:  # fmt: skip
        choice("measured_at", measured_at, get_args(PlateOutput))
        drawn = [_drawn(tile, parameters) for tile in floor.tiles]
        tiles = len(floor.tiles)
        self.out = np.zeros((block, tiles), np.float32)
        bodies = _bodies(floor, drawn, rate_hz, measured_at)
        shakers = _coefficients([one.shaker.poles().at_rate(rate_hz)[1] for one in drawn])
        body = poles.STATE.size({"poles": int(bodies[..., 0].max())})
        self._rows = np.zeros(tiles, ROW)
        self._rows["channel"], self._rows["fade_frame"] = channels, LONG_AGO
        for row, tile in zip(self._rows, floor.tiles, strict=True):
            row["steps_x_m"], row["steps_y_m"] = (STEPS / edge for edge in _edges_m(tile))
        sounds = np.zeros(max(channels, default=0) + 1, np.bool_)
        self._memory = PlateMemory(
            self.out,
            self._rows,
            sounds,
            shakers,
            bodies,
            _zeros(tiles, 1, poles.STATE.size({"poles": int(shakers[:, 0].max())}))[:, 0],
            _zeros(tiles, 2 * CORNERS, body).reshape(tiles, 2, CORNERS, -1),
            np.concatenate([one.shaker.compression() for one in drawn]),
            np.zeros((4, SPAN)),
            np.zeros(1, LOAD),
        )
        self._where = addresses(self._memory)
        self._unsettled = 0
        drive, silent_since = np.zeros((0, sounds.size), np.float32), np.zeros(2, ROW)["zero_frames"]  # with gaps
        self._apply = _apply.specialised(self._where, drive, silent_since, np.zeros((3, tiles, 0)), (0, 0, 0))

    def apply(
        self, drive: NDArray[np.float32], sounding: int, silent_since: NDArray[np.int64], signals: NDArray[np.float64],
        frame: int, at: int, n: int,
    ) -> None:  # fmt: skip
        """Drive the plates with `n` frames of `drive` [frame, channel], relative to full scale, from row `at` on.

        The first is session frame `frame`. `sounding` is the number of tiles that are not silent, `silent_since` the
        frame since which each tile is silent, or -1; `signals` [signal, tile, frame] are force, x and y of the same
        frames. Allocates nothing.
        """
        if self._unsettled or sounding:  # else all of `out` is zero
            self._unsettled = self._apply(self._where, drive, silent_since, signals, (frame, at, n))

    def awake(self) -> tuple[bool, ...]:
        """Return for each tile whether anything moves."""
        return tuple(bool(awake) for awake in self._rows["awake"])


def foot_places_m(tile: Tile) -> list[Point]:
    """Return the grid of foot places on a tile, in its frame, y fastest.

    >>> from underfoot.floor.layout import default_floor
    >>> places = foot_places_m(default_floor(1, 1).tiles[0])
    >>> len(places), places[144], round(places[-1][0], 4)
    (289, (0.0, 0.0), 0.1335)
    """
    x, y = _edges_m(tile)
    steps = [step / STEPS for step in range(-STEPS, STEPS + 1)]
    return [(x * i, y * j) for i in steps for j in steps]


def _edges_m(tile: Tile) -> Point:
    """Return the distance of the sensors from the tile's middle, along x and y."""
    return max(abs(x) for x, _ in tile.sensors_m), max(abs(y) for _, y in tile.sensors_m)


def load_plate(tile: Tile, parameters: TileParameters | None, rate_hz: float, measured_at: PlateOutput) -> bool:
    """Load or compute the plate of a tile for `SimulatedPlates`; return whether it was computed, which takes 0.5 s."""
    computed = False

    def note() -> None:
        nonlocal computed
        computed = True

    _body(tile, _drawn(tile, parameters), rate_hz, measured_at, note)
    return computed


def _drawn(tile: Tile, parameters: TileParameters | None) -> TileParameters:
    return (parameters or TileParameters()).drawn(SEED, tile.id)


def _bodies(floor: Floor, drawn: list[TileParameters], rate_hz: float, measured_at: PlateOutput) -> NDArray[np.float64]:
    """Return the coefficients of all tiles' systems, [tile, load, value]."""
    several = [_body(tile, one, rate_hz, measured_at) for tile, one in zip(floor.tiles, drawn, strict=True)]
    found = _zeros(len(several), len(several[0]), max(body.shape[1] for body in several))
    for row, body in zip(found, several, strict=True):
        row[:, : body.shape[1]] = body
    return found


def _body(
    tile: Tile, drawn: TileParameters, rate_hz: float, measured_at: PlateOutput, note: Callable[[], None] = lambda: None
) -> NDArray[np.float64]:
    """Return the coefficients of a tile's systems, [load, value], from the cache if present; others are `note`d."""
    said = b"".join(
        (
            msgspec.json.encode(replace(tile, id="any", centre_m=(0.0, 0.0), output=None)),
            drawn.dumps(),
            repr((rate_hz, measured_at, STEPS, poles.COEFFICIENTS)).encode(),
        )
    )

    def made() -> NDArray[np.float64]:
        note()
        return _coefficients([one.at_rate(rate_hz)[1] for one in _systems(tile, drawn, measured_at)])

    return _CACHE.get(hashlib.blake2b(said, digest_size=16).hexdigest(), made)


def _systems(tile: Tile, parameters: TileParameters, measured_at: PlateOutput) -> list[Poles]:
    """Return the systems from a shaker's force to acceleration: without load, then with a foot at each place.

    On a symmetric tile, feet at mirrored places give one system, measured at mirrored points.
    """
    place = parameters.accelerometer_m(tile)
    free = parameters.assembly(tile).poles(place)
    if measured_at == "foot":
        free = Poles(free.poles, 0.0 * free.residues)
    standing = parameters.assembly(tile, "standing")
    alike: dict[Point, list[tuple[int, Point]]] = {}
    for number, foot_m in enumerate(foot_places_m(tile)):
        mirrored = _mirror(standing, foot_m)
        sensed_m = place if measured_at == "accelerometer" else foot_m
        alike.setdefault(mirrored(foot_m), []).append((number, mirrored(sensed_m)))
    found = [free] * (1 + sum(map(len, alike.values())))
    for foot_m, heard_at in alike.items():
        every = replace(standing, foot_m=foot_m).poles_at([at for _, at in heard_at])
        for (number, _), one in zip(heard_at, every, strict=True):
            found[1 + number] = one
    return found


def _mirror(tile: Assembly, foot_m: Point) -> Callable[[Point], Point]:
    """Return the reflection that moves a foot to x >= y >= 0, as far as the tile is symmetric.

    The tile is symmetric if its mounts and shakers are.
    """

    def keeps(reflected: Callable[[Point], Point]) -> bool:
        return all(set(map(reflected, places)) == set(places) for places in (tile.mounts_m, tile.shakers_m))

    flip_x = -1.0 if foot_m[0] < 0.0 and keeps(lambda at: (0.0 - at[0], at[1])) else 1.0
    flip_y = -1.0 if foot_m[1] < 0.0 and keeps(lambda at: (at[0], 0.0 - at[1])) else 1.0
    x, y = flip_x * foot_m[0], flip_y * foot_m[1]
    if x < y and tile.size_m[0] == tile.size_m[1] and keeps(lambda at: (at[1], at[0])):
        return lambda at: (flip_y * at[1], flip_x * at[0])
    return lambda at: (flip_x * at[0], flip_y * at[1])


def _coefficients(memories: list[Memory]) -> NDArray[np.float64]:
    """Return [system, value]: the number of poles, and from the second cache line on the coefficients."""
    found = _zeros(len(memories), 1, LINE + max(len(memory.values) for memory in memories))[:, 0]
    for row, memory in zip(found, memories, strict=True):
        row[0], row[LINE : LINE + len(memory.values)] = memory.poles, memory.values
    return found


def _zeros(rows: int, columns: int, size: int) -> NDArray[np.float64]:
    return aligned_zeros(rows * columns * size).reshape(rows, columns, size)


_memory_at = arrays_at(PlateMemory)


@kernel
def _apply(
    where: NDArray[np.int64],
    drive: NDArray[np.float32],
    silent_since: NDArray[np.int64],
    signals: NDArray[np.float64],
    stretch: tuple[int, int, int],
) -> int:
    """See `SimulatedPlates.apply`; returns how many tiles move, or have an output that is not all zero yet."""
    memory = _memory_at(where)
    frame, at, n = stretch
    out, rows, sounds, load = memory.out, memory.rows, memory.sounds, memory.load[0]
    sounds[:] = False
    for k in range(len(rows)):
        if rows[k].channel >= 0 and not 0 <= silent_since[k] <= frame:
            sounds[rows[k].channel] = True
    unsettled = 0
    for k in range(len(rows)):
        row = rows[k]
        if row.channel < 0:
            continue
        begin = 0
        while begin < n and (row.awake or sounds[row.channel]):
            here = frame + begin
            end = min(n, begin + SPAN - here % SPAN)
            force = memory.buffers[0, : end - begin]
            sent = drive[at + begin : at + end, row.channel]
            for i in range(len(force)):
                force[i] = sent[i]
            if row.awake and here % SPAN == 0:
                _find_load(load, row, signals[:, k, begin])
                _follow_load(row, load, memory.body_states[k], here)
            elif not row.awake:
                _wake(row, load, force, signals[:, k, begin:end])
            if row.awake:
                _run(memory, k, here, end - begin)
            measured_at = out[at + begin : at + end, k]
            for i in range(len(force)):
                measured_at[i] = force[i]
            begin = end
            row.written = max(row.written, at + end)
        first = at + begin
        for i in range(first, min(at + n, row.written)):
            out[i, k] = 0.0
        if first < row.written <= at + n:
            row.written = first
        unsettled += row.awake or row.written > 0
    return unsettled


@kernel
def _wake(row: np.record, load: np.record, force: NDArray[np.float64], signals: NDArray[np.float64]) -> None:
    """Wake a tile at its first nonzero drive, with the load of that frame until the next span."""
    for i in range(len(force)):
        if force[i] != 0.0:
            row.awake = True
            _find_load(load, row, signals[:, i])
            _take_load(row, load)
            return


@kernel
def _find_load(load: np.record, row: np.record, signal: NDArray[np.float64]) -> None:
    """Find the load of a tile from its force, x and y: none, or a foot between three places of the grid."""
    load.systems[:] = -1
    load.shares[:] = 0.0
    if signal[0] == 0.0:
        load.systems[0], load.shares[0] = 0, 1.0
        return
    x = min(max(signal[1] * row.steps_x_m + STEPS, 0.0), 2.0 * STEPS)
    y = min(max(signal[2] * row.steps_y_m + STEPS, 0.0), 2.0 * STEPS)
    i, j = min(int(x), 2 * STEPS - 1), min(int(y), 2 * STEPS - 1)
    u, v = x - i, y - j
    along = 2 * STEPS + 1 if u > v else 1  # a cell is cut along its diagonal
    load.systems[0] = 1 + i * (2 * STEPS + 1) + j
    load.systems[1] = load.systems[0] + along
    load.systems[2] = load.systems[0] + 2 * STEPS + 2
    load.shares[0], load.shares[1], load.shares[2] = 1.0 - max(u, v), abs(u - v), min(u, v)


@kernel
def _take_load(row: np.record, load: np.record) -> None:
    """Set the load of the present slot, without a fade."""
    for corner in range(CORNERS):
        row.systems[row.slot, corner] = load.systems[corner]
        row.shares[row.slot, corner] = row.shares_before[row.slot, corner] = load.shares[corner]


@kernel
def _follow_load(row: np.record, load: np.record, states: NDArray[np.float64], here: int) -> None:
    """Move the weights of the running systems, or begin a fade to others unless one is in progress."""
    slot = row.slot
    same = True
    for corner in range(CORNERS):
        same &= row.systems[slot, corner] == load.systems[corner]
        for either in range(2):
            row.shares_before[either, corner] = row.shares[either, corner]
    if same:
        for corner in range(CORNERS):
            row.shares[slot, corner] = load.shares[corner]
    elif here >= row.fade_frame + FADE:
        other: int = 1 - slot
        row.slot = other
        _take_load(row, load)
        kept = 0.0
        for corner in range(CORNERS):
            states[other, corner] = 0.0
            share = 0.0
            for before in range(CORNERS):
                if row.systems[slot, before] == load.systems[corner] >= 0:
                    copy(states[slot, before], states[other, corner])
                    share = row.shares[slot, before]
            row.shares_before[other, corner] = share
            kept += share
        if kept < NEIGHBOURS:
            row.fade_frame = here
            copy(row.shares[other], row.shares_before[other])


@kernel
def _run(memory: PlateMemory, k: int, here: int, n: int) -> None:
    """Turn `n` frames of drive in the first buffer into acceleration; at the end of a span, put a quiet tile to
    sleep."""
    row, buffers, bodies, body_states = memory.rows[k], memory.buffers, memory.bodies, memory.body_states
    force, now, before, one = buffers[0, :n], buffers[1, :n], buffers[2, :n], buffers[3, :n]
    zero_frames = row.zero_frames
    for i in range(n):
        zero_frames = zero_frames + 1 if force[i] == 0.0 else 0
    row.zero_frames = zero_frames
    motor, motor_system = _system(memory.shaker_states[k], memory.shakers[k])
    poles.run(motor, motor_system, force, force)
    shaker.compress(memory.compressions[k : k + 1], force, force, n)
    slot = row.slot
    _run_systems(row, slot, bodies[k], body_states[k, slot], (force, now, one), here)
    faded = here - row.fade_frame
    fades = faded < FADE
    if fades:
        other: int = 1 - slot
        _run_systems(row, other, bodies[k], body_states[k, other], (force, before, one), here)
        for i in range(n):
            share = min((faded + i) / FADE, 1.0)
            now[i] = before[i] + (now[i] - before[i]) * (share * share * (3.0 - 2.0 * share))
    copy(now, force)
    if zero_frames >= SPAN and (here + n) % SPAN == 0:
        poles.flush(motor)
        rings = _ring(row, bodies[k], body_states[k, slot], poles.tail(motor, motor_system))
        if not fades and rings < QUIET_M_S2:
            memory.shaker_states[k], body_states[k], row.awake = 0.0, 0.0, False


@kernel
def _run_systems(
    row: np.record,
    slot: int,
    bodies: NDArray[np.float64],
    states: NDArray[np.float64],
    buffers: tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]],
    here: int,
) -> None:
    """Run the systems of a slot on the force in the first buffer; write their weighted sum to the second."""
    force, out, one = buffers
    past = here % SPAN
    out[:] = 0.0
    for corner in range(CORNERS):
        number: int = row.systems[slot, corner]
        if number < 0:
            continue
        state, system = _system(states[corner], bodies[number])
        poles.run(state, system, force, one)
        share = row.shares_before[slot, corner]
        rise = (row.shares[slot, corner] - share) / SPAN
        for i in range(len(out)):
            out[i] += (share + rise * (past + i)) * one[i]


@kernel
def _ring(row: np.record, bodies: NDArray[np.float64], states: NDArray[np.float64], motor: float) -> float:
    """Return a bound of the remaining acceleration, m/s^2, from the systems and the remaining force of the shaker."""
    rings = gain = 0.0
    for corner in range(CORNERS):
        number: int = row.systems[row.slot, corner]
        if number >= 0:
            state, system = _system(states[corner], bodies[number])
            poles.flush(state)
            rings += poles.tail(state, system)
            gain = max(gain, system.peak_gain)
    return rings + motor * gain


@inlined
def _system(state: NDArray[np.float64], coefficients: NDArray[np.float64]) -> tuple[Any, Any]:
    """Return the memories of a state and of its system's coefficients, of the size for its poles."""
    count = int(coefficients[0])
    return _state_at(state, (count,)), _coefficients_at(coefficients[LINE:], (count,))
