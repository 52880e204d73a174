"""The plates of a simulated floor while they play: from what each shaker is sent to what its tile does.

A tile is its shaker, the shaker's compression, and the body of plate, frame, mounts and whoever stands on it
(`models.tile`); `SimulatedTile.respond` is the same chain under a load that does not change. Here the load is the one
that the force signals say. Nobody on it is one linear system; a foot is another for each of nine places: the tile's
middle, and three quarters of the way to its sensors in both directions. The one nearest to the foot plays, and is
faded to from the one before in 10 ms, beginning at rest.
"""

import hashlib
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from underfoot.array_cache import ArrayCache
from underfoot.clock import FADE, SPAN
from underfoot.errors import require
from underfoot.floor.layout import Floor, Point, Tile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.kernels import inlined, kernel
from underfoot.memory import LINE, aligned_zeros
from underfoot.models.filtering import poles
from underfoot.models.filtering.poles import Poles
from underfoot.models.tile import shaker

QUIET_M_S2 = 1e-9
"""What a plate can still do when it is taken to be at rest."""
STEPS = (-1, 0, 1)
"""Places of a foot along each axis, in parts of `REACH`."""
REACH = 0.75
"""How far from the tile's middle the outer places are, as a share of the way to the sensors."""
Heard = Literal["accelerometer", "foot"]
"""Where acceleration is taken: at the accelerometer, or under the foot, where it is 0 while nobody is there."""

ROW = np.dtype(
    [
        ("channel", np.int64),
        ("between_x_m", np.float64),
        ("between_y_m", np.float64),
        ("slot", np.int64),
        ("system", np.int64, (2,)),
        ("fade_frame", np.int64),
        ("zero_frames", np.int64),
        ("awake", np.bool_),
    ],
    align=True,
)
"""A tile: its output channel; half the way between two places of a foot; which of its two systems plays, for which load
each is (0: none, else 1 + the place's number), and since when the one is faded to; how many frames of zero have come
in, and whether anything moves."""

_LONG_AGO = -(1 << 60)
_CACHE = ArrayCache("plates", in_memory=4)
_state_at, _coefficients_at = poles.STATE.at, poles.COEFFICIENTS.at


class SimulatedPlates:
    """The plates of `floor`, of the kind that `parameters` describe, each drawn by `seed` as `SimulatedTile` draws it.

    `channels[row]` is the output channel that a tile's shaker hangs on, or -1. `apply` writes float32 [frame, tile],
    m/s^2, into `out`, which has room for `block` frames. `BadValue` for parts that cannot be built on a tile.
    """

    def __init__(
        self, floor: Floor, parameters: TileParameters | None, channels: list[int], rate_hz: float, block: int,
        heard: Heard = "accelerometer", seed: int = 1,
    ) -> None:  # fmt: skip
        require(heard in ("accelerometer", "foot"), "heard", heard, "accelerometer, foot")
        drawn = [(parameters or TileParameters()).drawn(seed, tile.id) for tile in floor.tiles]
        tiles = len(floor.tiles)
        self.out = np.zeros((block, tiles), np.float32)
        self._bodies = _bodies(floor, drawn, rate_hz, heard)
        shakers = [one.shaker.poles() for one in drawn]
        self._shakers = _coefficients(shakers, rate_hz)
        self._shaker_states = _zeros(tiles, 1, poles.STATE.size({"poles": int(self._shakers[:, 0].max())}))[:, 0]
        self._body_states = _zeros(tiles, 2, poles.STATE.size({"poles": int(self._bodies[..., 0].max())}))
        self._compressions = np.concatenate([one.shaker.compression() for one in drawn])
        self._rows = np.zeros(tiles, ROW)
        self._rows["channel"], self._rows["fade_frame"] = channels, _LONG_AGO
        for row, tile in zip(self._rows, floor.tiles, strict=True):
            row["between_x_m"], row["between_y_m"] = (0.5 * REACH * edge for edge in _edges_m(tile))
        self._buffers = np.zeros((3, SPAN))
        self._sounds = np.zeros(max(channels, default=0) + 1, np.bool_)
        self._moving = self._zeros_written = 0
        drive, silent_since = np.zeros((0, self._sounds.size), np.float32), self._rows["zero_frames"]
        self.apply(
            drive, 1, silent_since, np.zeros((3, tiles, 0)), 0, 0, 0
        )  # its kernels are loaded here, so that the first block is not late for them

    def apply(
        self, drive: NDArray[np.float32], sounding: int, silent_since: NDArray[np.int64], signals: NDArray[np.float64],
        frame: int, at: int, n: int,
    ) -> None:  # fmt: skip
        """Let `n` frames of `drive` [frame, channel], of full scale, from its row `at` on, move the plates.

        The first is session frame `frame`. `sounding` tiles are not silent; `silent_since` has for each the frame since
        which it is, -1 while it is not; `signals` [signal, tile, frame] are force, x and y of the same frames.
        Allocates nothing.
        """
        if self._moving or sounding:
            self._moving = _apply(
                drive, silent_since, signals, self.out, self._rows, self._sounds,
                (self._shakers, self._bodies, self._shaker_states, self._body_states), self._compressions,
                self._buffers, (frame, at, n),
            )  # fmt: skip
            self._zeros_written = 0
        elif self._zeros_written < 2 * len(self.out):  # else all of it is zero
            self.out[at : at + n] = 0.0
            self._zeros_written += n

    def awake(self) -> tuple[bool, ...]:
        """Of each tile, whether anything moves."""
        return tuple(bool(awake) for awake in self._rows["awake"])


def foot_places_m(tile: Tile) -> list[Point]:
    """Where a foot is taken to stand on a tile, in its frame: nine places, y fastest.

    >>> from underfoot.floor.layout import default_floor
    >>> places = foot_places_m(default_floor(1, 1).tiles[0])
    >>> len(places), places[4], round(places[8][0], 4)
    (9, (0.0, 0.0), 0.1001)
    """
    x, y = _edges_m(tile)
    return [(REACH * x * i, REACH * y * j) for i in STEPS for j in STEPS]


def _edges_m(tile: Tile) -> Point:
    """How far the sensors are from the tile's middle, along x and y."""
    return max(abs(x) for x, _ in tile.sensors_m), max(abs(y) for _, y in tile.sensors_m)


def _bodies(floor: Floor, drawn: list[TileParameters], rate_hz: float, heard: Heard) -> NDArray[np.float64]:
    """The coefficients of every tile's systems, [tile, load, value]; known ones are read from the cache."""
    said = b"".join((floor.dumps(), *(one.dumps() for one in drawn), repr((rate_hz, heard)).encode()))

    def made() -> NDArray[np.float64]:
        systems = [_systems(tile, one, heard) for tile, one in zip(floor.tiles, drawn, strict=True)]
        flat = _coefficients([one for of_tile in systems for one in of_tile], rate_hz)
        return flat.reshape(len(systems), -1, flat.shape[1])

    return _aligned(_CACHE.get(hashlib.blake2b(said, digest_size=16).hexdigest(), made))


def _systems(tile: Tile, parameters: TileParameters, heard: Heard) -> list[Poles]:
    """From a shaker's force to acceleration: with nobody on the tile, then with a foot at each of its places."""
    place = parameters.accelerometer_m(tile)
    free = parameters.assembly(tile).poles(place)
    if heard == "foot":
        free = Poles(free.poles, 0.0 * free.residues)
    standing = parameters.assembly(tile, "standing")
    found = [free]
    for foot_m in foot_places_m(tile):
        loaded = replace(standing, foot_m=foot_m)
        found.append(loaded.poles(place if heard == "accelerometer" else foot_m))
    return found


def _coefficients(systems: list[Poles], rate_hz: float) -> NDArray[np.float64]:
    """[system, value]: how many poles a system's memory has, and from the second line on its coefficients."""
    memories = [one.at_rate(rate_hz)[1] for one in systems]
    found = _zeros(len(systems), 1, LINE + max(len(memory.values) for memory in memories))[:, 0]
    for row, memory in zip(found, memories, strict=True):
        row[0], row[LINE : LINE + len(memory.values)] = memory.poles, memory.values
    return found


def _zeros(rows: int, columns: int, size: int) -> NDArray[np.float64]:
    return aligned_zeros(rows * columns * size).reshape(rows, columns, size)


def _aligned(values: NDArray[np.float64]) -> NDArray[np.float64]:
    found = aligned_zeros(values.size).reshape(values.shape)
    found[:] = values
    return found


_Memories = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]
"""The coefficients of shakers [tile, value] and bodies [tile, load, value], then the states of both; a body has two."""


@kernel
def _apply(
    drive: NDArray[np.float32],
    silent_since: NDArray[np.int64],
    signals: NDArray[np.float64],
    out: NDArray[np.float32],
    rows: NDArray[np.void],
    sounds: NDArray[np.bool_],
    memories: _Memories,
    compressions: NDArray[np.void],
    buffers: NDArray[np.float64],
    stretch: tuple[int, int, int],
) -> int:
    """See `SimulatedPlates.apply`; returns how many tiles move."""
    frame, at, n = stretch
    sounds[:] = False
    for k in range(len(rows)):
        if rows[k].channel >= 0 and not 0 <= silent_since[k] <= frame:
            sounds[rows[k].channel] = True
    moving = 0
    for k in range(len(rows)):
        row = rows[k]
        if row.channel < 0:
            continue
        begin = 0
        while begin < n and (row.awake or sounds[row.channel]):
            here = frame + begin
            end = min(n, begin + SPAN - here % SPAN)
            force = buffers[0, : end - begin]
            for i in range(begin, end):
                force[i - begin] = drive[at + i, row.channel]
                if not row.awake and force[i - begin] != 0.0:
                    row.awake, row.system[row.slot] = True, _load(row, signals, k, i)
            if row.awake and here % SPAN == 0:
                _follow_load(row, _load(row, signals, k, begin), memories[3][k], here)
            if row.awake:
                _run(row, k, memories, compressions[k : k + 1], buffers, here, end - begin)
            for i in range(begin, end):
                out[at + i, k] = force[i - begin]
            begin = end
        for i in range(at + begin, at + n):
            out[i, k] = 0.0
        moving += row.awake
    return moving


@kernel
def _load(row: np.record, signals: NDArray[np.float64], k: int, i: int) -> int:
    """Which load is on a tile: 0 for none, else 1 + the number of the place that is nearest to the foot."""
    force_n, x_m, y_m = signals[0, k, i], signals[1, k, i], signals[2, k, i]
    if force_n == 0.0:
        return 0
    x = int(x_m > row.between_x_m) - int(x_m < -row.between_x_m)
    y = int(y_m > row.between_y_m) - int(y_m < -row.between_y_m)
    return 1 + 3 * (x + 1) + (y + 1)


@kernel
def _follow_load(row: np.record, load: int, states: NDArray[np.float64], here: int) -> None:
    """Begin to fade to the system of a new load, unless the last fade goes on."""
    if load != row.system[row.slot] and here >= row.fade_frame + FADE:
        slot: int = 1 - row.slot
        row.slot, row.system[slot], row.fade_frame = slot, load, here
        states[slot] = 0.0


@kernel
def _run(
    row: np.record,
    k: int,
    memories: _Memories,
    compression: NDArray[np.void],
    buffers: NDArray[np.float64],
    here: int,
    n: int,
) -> None:
    """Let `n` frames of drive in the first buffer become acceleration there; at a span's end, look whether it rests."""
    shakers, bodies, shaker_states, body_states = memories
    force, now, before = buffers[0, :n], buffers[1, :n], buffers[2, :n]
    for i in range(n):
        row.zero_frames = row.zero_frames + 1 if force[i] == 0.0 else 0
    motor, motor_system = _system(shaker_states[k], shakers[k])
    poles.run(motor, motor_system, force, force)
    shaker.compress(compression, force, force, n)
    slot = row.slot
    body, system = _system(body_states[k, slot], bodies[k, row.system[slot]])
    poles.run(body, system, force, now)
    fades = here < row.fade_frame + FADE
    if fades:
        body_before, system_before = _system(body_states[k, 1 - slot], bodies[k, int(row.system[1 - slot])])
        poles.run(body_before, system_before, force, before)
    for i in range(n):
        share = min((here + i - row.fade_frame) / FADE, 1.0)
        force[i] = before[i] + (now[i] - before[i]) * (share * share * (3.0 - 2.0 * share)) if fades else now[i]
    if row.zero_frames >= SPAN and (here + n) % SPAN == 0:
        poles.flush(motor)
        poles.flush(body)
        if not fades and poles.tail(motor, motor_system) * system.peak_gain + poles.tail(body, system) < QUIET_M_S2:
            shaker_states[k], body_states[k], row.awake = 0.0, 0.0, False


@inlined
def _system(state: NDArray[np.float64], coefficients: NDArray[np.float64]) -> tuple[Any, Any]:
    """The memories of a system and of its state, which are as long as it has poles."""
    count = int(coefficients[0])
    return _state_at(state, (count,)), _coefficients_at(coefficients[LINE:], (count,))
