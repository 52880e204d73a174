"""A grid of bundles under the foot: fracture that follows the contact, with local load sharing.

The tile carries columns x rows of cells, each a bundle of its own (`damage`). The contact's force is
spread over the cells by a Gaussian print around its centroid, all of it within the tile. Cells are tied to their
four neighbours by the `coupling` of the sole, a stiffness per fibre, and a broken cell keeps the small stiffness
`rubble`. So what a breaking cell can no longer carry goes to those around it: over a distance of sqrt(coupling /
k_F) cells. Without coupling each cell is on its own; a large one is the global load sharing of (7.1).

Each cell's own motion is exact over the frame; its neighbours pull in one kick between frames. That keeps the
energy of the coupled motion and is second order in the frame. The print is taken at each 32nd session frame and
moves linearly in between, one such span late.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers, seed_of, whole
from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.driven_oscillator import frame_step
from underfoot.models.fibre_bundle.bundle import require_bundle, require_inverse
from underfoot.models.fibre_bundle.damage import (
    CREEP,
    DRAWS,
    GAIN,
    GAMMA,
    KAPPA,
    LIMIT,
    PRESSURE,
    RENEWAL,
    TUNING_SIZE,
    crossing,
    energy_released,
    event_strength,
    fail,
    first_hazard,
    stiffness_left,
    threshold_strain,
    tune,
    tune_contact,
    tune_inverse,
)
from underfoot.models.signals.random import stream_key

#: Frames between two prints.
SPAN = 32

#: Models of damage that a grid can have.
GRID_MODELS = ("exact", "inverse")


@dataclass(frozen=True)
class GridFracture:
    """What a grid did: cells in rows, the first row at the least y, columns by rising x."""

    strain: NDArray[np.float64]
    """Mean strain of the cells, shape [frames]."""
    failures: NDArray[np.int64]
    """Fibres of each cell that failed in each frame, shape [frames, cells]."""
    energy: NDArray[np.float64]
    """Energy set free in each frame, shape [frames]."""


def grid(
    force: ArrayLike,
    x_m: ArrayLike,
    y_m: ArrayLike,
    rate: float,
    fibres: int,
    shape: float = 4.0,
    scale: float = 2.5,
    stiffness: float = 1.0,
    mass: float = 1e-3,
    damping: float = 0.0065,
    creep: float = 0.0,
    model: str = "exact",
    seed: int = 0,
    *,
    thresholds: str = "weibull",
    columns: int = 4,
    rows: int = 4,
    width_m: float = 0.3,
    depth_m: float = 0.3,
    print_m: float = 0.05,
    coupling: float = 1.0,
    rubble: float = 0.02,
    pressure: float = 1.0,
    restructurings: int = 20,
    stiffening: float = 0.005,
    renewal_s: float = math.inf,
) -> GridFracture:
    """The response of a tile of `columns` x `rows` cells of `fibres` fibres each to a contact.

    `force`, `x_m` and `y_m` have one value a frame; x and y are the centroid from the tile's centre; the tile is
    `width_m` by `depth_m`; `print_m` is the print's deviation. The whole stress of (7.1) is `pressure` times the
    force. `coupling` and `rubble` are shares of the stiffness k_F. The other parameters are those of
    `fracture.bundle`, with `model` "exact" or "inverse". Raises `BadValue`.

    >>> press = np.linspace(0.0, 120.0, 2400)
    >>> result = grid(press, np.full(2400, -0.1), np.zeros(2400), 48000.0, 10)
    >>> int(result.failures[:, 0::4].sum()) > int(result.failures[:, 3::4].sum()) == 0
    True
    """
    load, across, along = numbers("force", force), numbers("x_m", x_m), numbers("y_m", y_m)
    require(across.size == load.size, "x_m", across.size, f"as many frames as force, {load.size}")
    require(along.size == load.size, "y_m", along.size, f"as many frames as force, {load.size}")
    require(model in GRID_MODELS, "model", model, "one of " + ", ".join(GRID_MODELS))
    codes = require_bundle(rate, fibres, shape, scale, stiffness, mass, damping, creep, model, thresholds)
    require_inverse(restructurings, stiffening, renewal_s)
    for name, count in (("columns", columns), ("rows", rows)):
        whole(name, count, 1, 32, "1 to 32")
    for name, value in (("width_m", width_m), ("depth_m", depth_m), ("print_m", print_m)):
        number(name, value, TINY, HUGE, "above 0 m")
    number("coupling", coupling, 0.0, HUGE, "0 or more")
    number("rubble", rubble, TINY, 1.0, "above 0, at most 1")
    number("pressure", pressure, -HUGE, HUGE, "a finite number")
    cells = columns * rows
    tuning, state = np.zeros(tuning_size()), np.zeros(state_size(cells))
    tune(tuning, rate, *codes, fibres, shape, scale, stiffness, mass, damping, creep)
    tune_inverse(tuning, restructurings, stiffening, False)
    tune_contact(tuning, rate, pressure, renewal_s, 1.0, 1.0, False)
    tune_grid(tuning, columns, rows, width_m, depth_m, print_m, coupling, rubble)
    strain, energy = np.zeros((2, load.size))
    failures = np.zeros((load.size, cells))
    key = stream_key(seed_of(seed), "fracture grid")
    _run(state, tuning, key, 0, load, across, along, strain, np.zeros(3 * load.size), failures, energy)
    return GridFracture(strain, failures.astype(np.int64), energy)


#: The coupled cells turn by at most the root of this in a frame, in radians; the kicks are stable up to about 4.
_FASTEST = 0.25

#: The largest eigenvalue of the ties between cells, for a coupling of 1.
_TIES = 8.0

#: No cell gets stiffer than this times its first stiffness.
_STIFFEST = 16.0

# The tuning goes on where the bundle's ends.
_COLUMNS, _ROWS, _WIDTH, _DEPTH, _SHARPNESS, _COUPLING, _RUBBLE = range(TUNING_SIZE, TUNING_SIZE + 7)

# The state: two common values, then arrays of one value a cell; all zero is fresh ground at rest. The arrays from
# BREAKING on serve within a call only. WORN: 0 fresh, else 1 and the frames since the last load.
_WORN, _LOAD, _COMMON = range(3)
_STRAIN, _SPEED, _FAILED, _NEXT, _SHARE, _NEW_SHARE, _BREAKING, _FORMER, _KICK, _STEP = range(10)
_ARRAYS = _STEP + 8


@kernel
def state_size(cells):
    """Float64 values of one row's state with `cells` cells.

    >>> state_size(16)
    274
    """
    return _COMMON + _ARRAYS * cells


def tuning_size() -> int:
    """Float64 values of one row's tuning.

    >>> tuning_size() - TUNING_SIZE
    7
    """
    return TUNING_SIZE + 7


@kernel
def tune_grid(t, columns, rows, width_m, depth_m, print_m, coupling, rubble):
    """After `tune`, `tune_inverse` and `tune_contact` of `damage`: the grid's own parameters, as in `grid`.

    Where frames would not resolve the fastest motion of the coupled cells, their mass is raised until they do.
    """
    t[_COLUMNS] = columns
    t[_ROWS] = rows
    t[_WIDTH] = width_m
    t[_DEPTH] = depth_m
    t[_SHARPNESS] = 0.5 / (print_m * print_m)
    heavier = max((1.0 + _TIES * coupling) * t[KAPPA] / _FASTEST, 1.0)
    for k in (KAPPA, GAMMA, CREEP, GAIN):
        t[k] /= heavier
    t[_COUPLING] = coupling * t[KAPPA]
    t[_RUBBLE] = rubble


@kernel
def run(s, t, key, frame, force, x_m, y_m, strain, events):
    """One tile, `force.size` frames from session frame `frame` on: force and place in, the cells' mean `strain` out.

    `x_m` and `y_m` are read at every 32nd session frame and where a contact begins. Events are as in
    `fracture.run`; the energies of all cells that fail in one frame add, at the time of the first.
    """
    return _run(s, t, key, frame, force, x_m, y_m, strain, events, strain[:0].reshape(0, 1), strain[:0])


@kernel
def rest(s, t):
    """A bound of the mean strain's size if no load comes; infinite while worn ground waits for its renewal.

    From the energy, with a margin for its swing between kicks.
    """
    if s[_WORN] > 0.0:
        return math.inf
    columns, rows = int(t[_COLUMNS]), int(t[_ROWS])
    cells = columns * rows
    c = s[_COMMON : _COMMON + _ARRAYS * cells].reshape(_ARRAYS, cells)
    energy = 0.0
    for cell in range(cells):
        x = c[_STRAIN, cell]
        energy += t[KAPPA] * x * x + c[_SPEED, cell] ** 2
        if (cell + 1) % columns != 0:
            energy += t[_COUPLING] * (c[_STRAIN, cell + 1] - x) ** 2
        if cell + columns < cells:
            energy += t[_COUPLING] * (c[_STRAIN, cell + columns] - x) ** 2
    return 1.5 * math.sqrt(energy / (t[KAPPA] * cells))


@kernel
def _run(s, t, key, frame, force, x_m, y_m, strain, events, failures, energies):
    """`run`, which besides fills the last two where they have frames."""
    columns, rows = int(t[_COLUMNS]), int(t[_ROWS])
    cells = columns * rows
    c = s[_COMMON : _COMMON + _ARRAYS * cells].reshape(_ARRAYS, cells)
    for cell in range(cells):
        c[_BREAKING, cell] = threshold_strain(t, c[_NEXT, cell]) if s[_WORN] > 0.0 else math.inf
        _set_step(c, t, cell)
    count = 0
    for i in range(force.size):
        now = frame + i
        load = min(max(t[PRESSURE] * force[i], -t[LIMIT]), t[LIMIT])
        if load > 0.0:
            if s[_WORN] == 0.0:
                for cell in range(cells):
                    c[_NEXT, cell] = first_hazard(t, key, (now * cells + cell) * DRAWS, c[_STRAIN, cell])
                    c[_BREAKING, cell] = threshold_strain(t, c[_NEXT, cell])
            s[_WORN] = 1.0
        elif s[_WORN] > 0.0:
            s[_WORN] += 1.0
            if s[_WORN] > t[RENEWAL]:
                s[_WORN] = 0.0
                for cell in range(cells):
                    c[_FAILED, cell] = c[_NEXT, cell] = 0.0
                    c[_BREAKING, cell] = math.inf
                    _set_step(c, t, cell)
        if now % SPAN == 0:
            c[_SHARE] = c[_NEW_SHARE]
            _print(c, t, x_m[i], y_m[i], columns, rows)
        if load > 0.0 and not s[_LOAD] > 0.0:
            _print(c, t, x_m[i], y_m[i], columns, rows)
            c[_SHARE] = c[_NEW_SHARE]
        strain[i], passed = _move(c, t, columns, rows, s[_LOAD], load, now % SPAN)
        s[_LOAD] = load
        if not passed:
            continue
        energy, place = 0.0, 1.0
        for cell in range(cells):
            x = c[_STRAIN, cell]
            if x > c[_BREAKING, cell]:
                counter = (now * cells + cell) * DRAWS
                failed, c[_NEXT, cell] = fail(t, key, counter, c[_NEXT, cell], x, c[_FAILED, cell])
                c[_FAILED, cell] += failed
                energy += energy_released(t, failed, x)
                place = min(place, crossing(c[_FORMER, cell], x, c[_BREAKING, cell]))
                c[_BREAKING, cell] = threshold_strain(t, c[_NEXT, cell])
                _set_step(c, t, cell)
                if failures.shape[0]:
                    failures[i, cell] = failed
        events[3 * count] = now + place
        events[3 * count + 1] = event_strength(t, energy)
        events[3 * count + 2] = 0.0
        count += 1
        if energies.size:
            energies[i] = energy
    return count


@kernel
def _move(c, t, columns, rows, before, after, within):
    """Move all cells over one frame, number `within` of its span, while the load goes from `before` to `after`.

    Gives the mean strain, and whether a cell has passed its threshold.
    """
    x, w, former, kick = c[_STRAIN], c[_SPEED], c[_FORMER], c[_KICK]
    for row in range(rows):
        for cell in range(row * columns, (row + 1) * columns):
            pull = 0.0
            if cell > row * columns:
                pull += x[cell - 1] - x[cell]
            if cell < (row + 1) * columns - 1:
                pull += x[cell + 1] - x[cell]
            if row > 0:
                pull += x[cell - columns] - x[cell]
            if row < rows - 1:
                pull += x[cell + columns] - x[cell]
            kick[cell] = t[_COUPLING] * pull
    start, end = within / SPAN, (within + 1.0) / SPAN
    before *= t[GAIN]
    after *= t[GAIN]
    share, new_share = c[_SHARE], c[_NEW_SHARE]
    c0, c1, c2, c3 = c[_STEP], c[_STEP + 1], c[_STEP + 2], c[_STEP + 3]
    c4, c5, c6, c7 = c[_STEP + 4], c[_STEP + 5], c[_STEP + 6], c[_STEP + 7]
    breaking, passed, total = c[_BREAKING], False, 0.0
    for cell in range(columns * rows):
        growth = new_share[cell] - share[cell]
        u = before * (share[cell] + start * growth)
        v = after * (share[cell] + end * growth)
        speed = w[cell] + kick[cell]
        former[cell] = x[cell]
        x[cell] = c0[cell] * x[cell] + c1[cell] * speed + (c2[cell] * u + c3[cell] * v)
        w[cell] = c4[cell] * former[cell] + c5[cell] * speed + (c6[cell] * u + c7[cell] * v)
        total += x[cell]
        passed |= x[cell] > breaking[cell]
    return total / (columns * rows), passed


@kernel
def _set_step(c, t, cell):
    """The coefficients of the cell's own motion: its fibres', or their rubble's."""
    left = min(max(stiffness_left(t, c[_FAILED, cell], 0.0), t[_RUBBLE]), _STIFFEST)
    step = frame_step(left * t[KAPPA], left * t[GAMMA] + t[CREEP], 1.0)
    for k in range(8):
        c[_STEP + k, cell] = step[k]


@kernel
def _print(c, t, x_m, y_m, columns, rows):
    """Each cell's share of the contact's force, from a Gaussian print around the centroid; their sum is 1."""
    x = min(max(x_m, -0.5 * t[_WIDTH]), 0.5 * t[_WIDTH])
    y = min(max(y_m, -0.5 * t[_DEPTH]), 0.5 * t[_DEPTH])
    share = c[_NEW_SHARE]
    nearest = math.inf
    for row in range(rows):
        off_y = y - ((row + 0.5) / rows - 0.5) * t[_DEPTH]
        for column in range(columns):
            off_x = x - ((column + 0.5) / columns - 0.5) * t[_WIDTH]
            cell = row * columns + column
            share[cell] = t[_SHARPNESS] * (off_x * off_x + off_y * off_y)
            nearest = min(nearest, share[cell])
    total = 0.0
    for cell in range(share.size):
        share[cell] = math.exp(nearest - share[cell])
        total += share[cell]
    for cell in range(share.size):
        share[cell] /= total
