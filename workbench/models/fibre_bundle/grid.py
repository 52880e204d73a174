"""Grid of fibre bundles under the foot: fracture that follows the contact, with local load sharing.

The tile has columns x rows of cells, each a bundle (`damage`). The contact's force is distributed over the cells by a
Gaussian footprint around its centroid, all of it within the tile. Each cell is connected to its four neighbours by the
`coupling` of the sole, a stiffness per fibre, and a broken cell keeps the small stiffness `rubble`. The load that a
breaking cell no longer carries therefore moves to its surroundings, over a distance of sqrt(coupling / k_F) cells.
Without coupling the cells are independent; with large coupling the grid has the global load sharing of (7.1).

The motion of each cell is exact over the frame; neighbours act in one kick between frames. This conserves the energy of
the coupled motion and is second order in the frame. The footprint is sampled at each 32nd session frame and
interpolated linearly, one such span late.
"""

import math
from typing import NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, choice, integer, number, numbers, seed_of
from underfoot.clock import SPAN
from underfoot.errors import require
from underfoot.kernels import Floats, copy, inlined, kernel
from underfoot.lanes import all_four, anywhere, chosen, four, put
from underfoot.layouts import Layout, Memory
from underfoot.memory import LANES
from underfoot.models.driven_oscillator import crossing, frame_step
from underfoot.models.fibre_bundle import damage
from underfoot.models.fibre_bundle.bundle import FibreBundle
from underfoot.models.fibre_bundle.damage import (
    AT_REST,
    DRAWS,
    NO_THRESHOLD,
    REST_INTERVAL,
    energy_released,
    fail,
    first_hazard,
    stiffness_left,
    strength_of,
    threshold_strain,
)
from underfoot.models.signals.events import append, event_list
from underfoot.models.signals.random import stream_key

GRID_MODELS = ("exact", "inverse")
"""Damage models available in a grid."""

PARAMETERS = Layout("grid_parameters", "columns", "rows", "width", "depth", "reach", "coupling", "rubble")
"""Input of `design`: number of cells along x and y; size of the tile and standard deviation of the footprint, in
metres; stiffness between cells, and that left in a broken one, as shares of k_F."""

COEFFICIENTS = Layout(
    "grid_coefficients",
    *("columns", "rows", "width", "depth", "sharpness", "coupling", "rubble"),
    bundle=damage.COEFFICIENTS,
    tied=(4, "row"),
)
"""`tied` is 1 for each cell with a neighbour before it, after it, in the row before, and in the row after, else 0."""

STATE = Layout(
    "grid",
    *("worn", "load", "designed"),
    kick=("row",),
    strain=("row",),
    speed=("row",),
    failed=("row",),
    next_hazard=("row",),
    share=("row",),
    next_share=("row",),
    breaking=("row",),
    former=("row",),
    step=(8, "row"),
)
"""Zeros are an intact grid at rest. `worn` is 0 for an intact grid, else 1 plus the frames since the last load. All
cells lie in a row, which is padded for vectors; the cells that are none stay 0. Strains of the next failures,
`breaking`, and coefficients of the motion, `step`, are those of the design with number `designed`; `kick` and `former`
are working memory of a call. A cell's neighbours may lie outside of `strain`, but lie in the arrays beside it."""

_FASTEST = 0.25
"""Largest square of the coupled cells' angular frequency, in radians per frame; kicks are stable up to about 4."""

_TIES = 8.0
"""Largest eigenvalue of the connections between cells, for a coupling of 1."""

_STIFFEST = 16.0
"""Largest stiffness of a cell, relative to its initial stiffness."""


def sizes(cells: int) -> dict[str, int]:
    """Return the memory sizes for a number of cells.

    >>> sizes(4), sizes(9)
    ({'row': 4}, {'row': 12})
    """
    return {"row": -(-cells // LANES) * LANES}


class GridFracture(Struct, frozen=True):
    """Response of a grid. Cells are in rows, the first row at the smallest y, columns by rising x."""

    strain: NDArray[np.float64]
    """Mean strain of the cells, shape [frames]."""
    failures: NDArray[np.int64]
    """Failed fibres of each cell in each frame, shape [frames, cells]."""
    energy: NDArray[np.float64]
    """Energy released in each frame, shape [frames]."""


class FibreGrid(Struct, frozen=True):
    """Tile of `columns` x `rows` cells, each a `bundle` whose model is "exact" or "inverse". Raises `BadValue`.

    The tile is `width_m` by `depth_m`; `print_m` is the standard deviation of the footprint. The total stress of (7.1)
    is `pressure` times the force. `coupling` and `rubble` are shares of the stiffness k_F.
    """

    bundle: FibreBundle
    columns: int = 4
    rows: int = 4
    width_m: float = 0.3
    depth_m: float = 0.3
    print_m: float = 0.05
    coupling: float = 1.0
    rubble: float = 0.02
    pressure: float = 1.0

    def __post_init__(self) -> None:
        choice("model", self.bundle.model, GRID_MODELS)
        for name in ("columns", "rows"):
            integer(name, getattr(self, name), 1, 32, "1 to 32")
        for name in ("width_m", "depth_m", "print_m"):
            number(name, getattr(self, name), TINY, HUGE, "above 0 m")
        number("coupling", self.coupling, 0.0, HUGE, "0 or more")
        number("rubble", self.rubble, TINY, 1.0, "above 0, at most 1")
        number("pressure", self.pressure, -HUGE, HUGE, "a finite number")

    def response(self, force: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, rate_hz: float, seed: int = 0) -> GridFracture:
        """Return the response to a contact: `force`, `x_m` and `y_m` have one value per frame at `rate_hz`.

        x and y are the centroid from the tile's centre.

        >>> press = np.linspace(0.0, 120.0, 2400)
        >>> result = FibreGrid(FibreBundle(10)).response(press, np.full(2400, -0.1), np.zeros(2400), 48000.0)
        >>> int(result.failures[:, 0::4].sum()) > int(result.failures[:, 3::4].sum()) == 0
        True
        """
        load, across, along = numbers("force", force), numbers("x_m", x_m), numbers("y_m", y_m)
        require(across.size == load.size, "x_m", across.size, f"as many frames as force, {load.size}")
        require(along.size == load.size, "y_m", along.size, f"as many frames as force, {load.size}")
        cells = self.columns * self.rows
        coefficients, state = COEFFICIENTS.zeros(**sizes(cells)), STATE.zeros(**sizes(cells))
        self.design(rate_hz, coefficients)
        strain, energy = np.zeros((2, load.size))
        failures = np.zeros((load.size, cells))
        key, events = stream_key(seed_of(seed), "fracture grid"), event_list(room=load.size)
        contact = Contact(load, across, along)
        run(contact, key, 0, coefficients, state, strain, events, Trace(failures, energy))
        return GridFracture(strain, failures.astype(np.int64), energy)

    def design(self, rate_hz: float, coefficients: Memory) -> None:
        """Compute the grid's coefficients at `rate_hz`."""
        self.bundle.design(rate_hz, self.pressure, coefficients.bundle)
        coefficients.bundle.compound = 0.0
        p = PARAMETERS.zeros()
        p.columns, p.rows, p.width, p.depth, p.reach = self.columns, self.rows, self.width_m, self.depth_m, self.print_m
        p.coupling, p.rubble = self.coupling, self.rubble
        design(p, coefficients)


class Contact(NamedTuple):
    """Contact, frame by frame: force, and its centroid on the tile."""

    force: Floats
    x_m: Floats
    y_m: Floats


class Trace(NamedTuple):
    """Further outputs of a run: failures [frame, cell] and energy, each unless empty."""

    failures: NDArray[np.float64]
    energy: Floats


@kernel
def design(parameters: Memory, coefficients: Memory) -> None:
    """Compute the grid's own coefficients, after those of its bundles. Names as in `PARAMETERS`.

    If frames do not resolve the fastest motion of the coupled cells, their mass is raised until they do.
    """
    c, bundle, reach = coefficients, coefficients.bundle, parameters.reach
    c.columns, c.rows, c.width, c.depth = parameters.columns, parameters.rows, parameters.width, parameters.depth
    c.sharpness = 0.5 / (reach * reach)
    heavier = max((1.0 + _TIES * parameters.coupling) * bundle.kappa / _FASTEST, 1.0)
    bundle.kappa /= heavier
    bundle.gamma /= heavier
    bundle.creep /= heavier
    bundle.gain /= heavier
    c.coupling = parameters.coupling * bundle.kappa
    c.rubble = parameters.rubble
    columns, rows, tied = int(c.columns), int(c.rows), c.tied
    for cell in range(columns * rows):
        column, row = cell % columns, cell // columns
        tied[0, cell], tied[1, cell] = min(column, 1), min(columns - 1 - column, 1)
        tied[2, cell], tied[3, cell] = min(row, 1), min(rows - 1 - row, 1)


@kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """Return a bound of |mean strain| without further load; infinite while worn cells wait for their renewal.

    It follows from the energy, with a margin for its variation between kicks.
    """
    if state.worn > 0.0:
        return math.inf
    columns, kappa, coupling = int(coefficients.columns), coefficients.bundle.kappa, coefficients.coupling
    strain, speed, cells = state.strain, state.speed, columns * int(coefficients.rows)
    energy = 0.0
    for cell in range(cells):
        x = strain[cell]
        energy += kappa * x * x + speed[cell] ** 2
        if (cell + 1) % columns != 0:
            energy += coupling * (strain[cell + 1] - x) ** 2
        if cell + columns < cells:
            energy += coupling * (strain[cell + columns] - x) ** 2
    return 1.5 * math.sqrt(energy / (kappa * cells))


@kernel
def run(
    contact: Contact,
    key: np.uint64,
    frame: int,
    coefficients: Memory,
    state: Memory,
    strain: Floats,
    events: Memory,
    trace: Trace,
) -> None:
    """Run one tile from session frame `frame` on: force and position in, mean `strain` of the cells out.

    The position is sampled at every 32nd session frame and where a contact begins. Failures are appended to `events`;
    energies of all cells that fail in a frame add, at the time of the first. `key` is as in `bundle.run`.
    """
    c, s = coefficients.bundle, state
    cells = int(coefficients.columns) * int(coefficients.rows)
    if s.designed != c.designs:
        for cell in range(cells):
            s.breaking[cell] = threshold_strain(c, s.next_hazard[cell]) if s.worn > 0.0 else math.inf
            _set_step(s, coefficients, cell)
        s.designed = c.designs
    for i in range(contact.force.size):
        now = frame + i
        load = min(max(c.pressure * contact.force[i], -c.limit), c.limit)
        _wear(load, key, now, coefficients, s, cells)
        if now % SPAN == 0:
            copy(s.next_share, s.share)
            _print(s, coefficients, contact.x_m[i], contact.y_m[i])
        if load > 0.0 and not s.load > 0.0:
            _print(s, coefficients, contact.x_m[i], contact.y_m[i])
            copy(s.next_share, s.share)
        strain[i], passed = _move(s, coefficients, cells, s.load, load, now % SPAN)
        s.load = load
        if passed:
            energy, strength, place = _break(key, now, coefficients, s, cells, trace.failures[i : i + 1])
            append(events, now + place, strength)
            if trace.energy.size:
                trace.energy[i] = energy
    for cell in range(cells):
        s.breaking[cell] = min(s.breaking[cell], NO_THRESHOLD)  # as finite as all states


@inlined
def _wear(load: float, key: np.uint64, now: int, coefficients: Memory, s: Memory, cells: int) -> None:
    """Draw the thresholds of intact cells when a load begins; renew those that were without load for long enough, and
    let those come to rest that hardly move."""
    c = coefficients.bundle
    if load > 0.0:
        if s.worn == 0.0:
            for cell in range(cells):
                s.next_hazard[cell] = first_hazard(c, key, (now * cells + cell) * DRAWS, s.strain[cell])
                s.breaking[cell] = threshold_strain(c, s.next_hazard[cell])
        s.worn = 1.0
    elif s.worn > 0.0:
        s.worn += 1.0
        if now % REST_INTERVAL == 0:
            for cell in range(cells):
                if abs(s.strain[cell]) < AT_REST and abs(s.speed[cell]) < AT_REST:
                    s.strain[cell] = s.speed[cell] = 0.0
        if s.worn > c.renewal:
            s.worn = 0.0
            for cell in range(cells):
                s.failed[cell] = s.next_hazard[cell] = 0.0
                s.breaking[cell] = math.inf
                _set_step(s, coefficients, cell)


@kernel
def _break(
    key: np.uint64, now: int, coefficients: Memory, s: Memory, cells: int, failures: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Fail cells that have passed their thresholds; return energies and strengths, added, and the share of the frame
    before the first.

    `failures` [1, cell] takes their numbers, unless it is empty.
    """
    c = coefficients.bundle
    energy, strength, place = 0.0, 0.0, 1.0
    for cell in range(cells):
        x = s.strain[cell]
        if x > s.breaking[cell]:
            counter = (now * cells + cell) * DRAWS
            failed, s.next_hazard[cell] = fail(c, key, counter, s.next_hazard[cell], x, s.failed[cell])
            s.failed[cell] += failed
            energy += energy_released(c, failed, x)
            strength += strength_of(c, failed, x)
            place = min(place, crossing(s.former[cell], x, s.breaking[cell]))
            s.breaking[cell] = threshold_strain(c, s.next_hazard[cell])
            _set_step(s, coefficients, cell)
            if failures.shape[0]:
                failures[0, cell] = failed
    return energy, strength, place


@inlined
def _move(s: Memory, coefficients: Memory, cells: int, before: float, after: float, within: int) -> tuple[float, bool]:
    """Advance all cells over one frame, number `within` of its span, while the load goes from `before` to `after`.

    Returns the mean strain, and whether a cell has passed its threshold.
    """
    x, w, former, step, row = s.strain, s.speed, s.former, s.step, s.row
    _pull(x, coefficients, row, s.kick)
    start, end = all_four(within / SPAN), all_four((within + 1.0) / SPAN)
    begins, ends = all_four(before * coefficients.bundle.gain), all_four(after * coefficients.bundle.gain)
    passed = False
    for m in range(0, row, LANES):
        share = four(s.share, m)
        growth = four(s.next_share, m) - share
        u, v = begins * (share + start * growth), ends * (share + end * growth)
        here, speed = four(x, m), four(w, m) + four(s.kick, m)
        put(former, m, here)
        freely = four(step, m) * here + four(step, row + m) * speed
        moved = freely + (four(step, 2 * row + m) * u + four(step, 3 * row + m) * v)
        put(x, m, moved)
        freely = four(step, 4 * row + m) * here + four(step, 5 * row + m) * speed
        put(w, m, freely + (four(step, 6 * row + m) * u + four(step, 7 * row + m) * v))
        passed |= anywhere(moved > four(s.breaking, m))
    total = 0.0
    for cell in range(cells):
        total += x[cell]
    return total / cells, passed


@inlined
def _pull(x: Floats, coefficients: Memory, row: int, kick: Floats) -> None:
    """Compute the kick of each cell's speed by its neighbours between two frames."""
    tied, columns = coefficients.tied, int(coefficients.columns)
    nothing, coupling = all_four(0.0), all_four(coefficients.coupling)
    for m in range(0, row, LANES):
        here = four(x, m)
        pull = chosen(four(tied, m) > nothing, four(x, m - 1) - here, nothing)
        pull = pull + chosen(four(tied, row + m) > nothing, four(x, m + 1) - here, nothing)
        pull = pull + chosen(four(tied, 2 * row + m) > nothing, four(x, m - columns) - here, nothing)
        pull = pull + chosen(four(tied, 3 * row + m) > nothing, four(x, m + columns) - here, nothing)
        put(kick, m, coupling * pull)


@kernel
def _set_step(s: Memory, coefficients: Memory, cell: int) -> None:
    """Set the coefficients of a cell's own motion, from its fibres or their rubble."""
    c = coefficients.bundle
    left = min(max(stiffness_left(c, s.failed[cell], 0.0), coefficients.rubble), _STIFFEST)
    step = frame_step(left * c.kappa, left * c.gamma + c.creep, 1.0)
    for k in range(8):
        s.step[k, cell] = step[k]


@kernel
def _print(s: Memory, coefficients: Memory, x_m: float, y_m: float) -> None:
    """Set each cell's share of the contact's force, from a Gaussian footprint around the centroid; the sum is 1."""
    c, share = coefficients, s.next_share
    columns, rows = int(c.columns), int(c.rows)
    x = min(max(x_m, -0.5 * c.width), 0.5 * c.width)
    y = min(max(y_m, -0.5 * c.depth), 0.5 * c.depth)
    nearest, cells = math.inf, columns * rows
    for row in range(rows):
        off_y = y - ((row + 0.5) / rows - 0.5) * c.depth
        for column in range(columns):
            off_x = x - ((column + 0.5) / columns - 0.5) * c.width
            cell = row * columns + column
            share[cell] = c.sharpness * (off_x * off_x + off_y * off_y)
            nearest = min(nearest, share[cell])
    total = 0.0
    for cell in range(cells):
        share[cell] = math.exp(nearest - share[cell])
        total += share[cell]
    for cell in range(cells):
        share[cell] /= total
