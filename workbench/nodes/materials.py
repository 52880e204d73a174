"""Materials that break, restructure or slip under the foot: what they make are events, which ring something behind."""

import math

from underfoot.kernels import kernel
from underfoot.models import elasto_plastic
from underfoot.models.fibre_bundle import bundle, damage, grid
from underfoot.parameters import Choice, Count, Number
from underfoot.patch.node import Input, Output, frames, grow, moved, node, rest_kernel, room, run_kernel

LAWS = damage.THRESHOLDS
_BUNDLE = 15  # controls that every bundle has, kept at the head of its tuning
_GRID = 22
_SLIP = 11
_BUNDLE_STATE, _SLIP_STATE, _SLIP_TUNING = (
    bundle.state_size(),
    elasto_plastic.state_size(),
    elasto_plastic.tuning_size(),
)
_BUNDLE_TUNING, _GRID_TUNING = bundle.tuning_size(), grid.tuning_size()


@kernel
def _critical(law, fibres, shape, scale, stiffness):
    """The quasi-static load at which a bundle breaks: N k_F lambda k^(-1/k) exp(-1/k); uniform, N k_F lambda / 4."""
    if law == 1:
        return 0.25 * fibres * stiffness * scale
    return fibres * stiffness * scale * shape ** (-1.0 / shape) * math.exp(-1.0 / shape)


@kernel
def _tune_bundle(c, model, t, rate, parts):
    """The tuning of a bundle from the controls that all bundles share; `parts` bundles carry the force together."""
    law, fibres, shape, scale = c[1], c[2], c[3], c[4]
    stiffness, mass, damping, creep = c[5], c[6], c[7], c[8]
    damage.tune(t, rate, model, law, fibres, shape, scale, stiffness, mass, damping, creep)
    damage.tune_inverse(t, c[9], c[10], False)
    pressure = _critical(law, fibres, shape, scale, stiffness) * parts / c[11]
    damage.tune_contact(t, rate, pressure, c[12], c[13], c[14], True)


@node("fibre-bundle", "Materials")
class FibreBundle:
    """Fibres that share the load and break at random thresholds (7.1 to 7.15), or chains that restructure (to 7.24).

    Each failure is an event. No fibre breaks below a strain that was reached before, until the ground is renewed.
    """

    force = Input("N", doc="the load")
    model = Choice("exact", options=tuple(damage.MODELS), doc="inverse: chains that stiffen")
    thresholds = Choice("weibull", options=tuple(LAWS), doc="law of the thresholds")
    fibres = Count(2000, 1, 10_000_000, doc="N: how many; the cost hardly depends on it")
    shape = Number(4.0, 0.5, 50.0, scale="log", doc="k of the Weibull law: more is more alike")
    scale = Number(2.5, 0.01, 1000.0, scale="log", doc="lambda of the law, a strain")
    stiffness = Number(1.0, 1e-3, 1e6, scale="log", doc="k_F of a fibre")
    mass = Number(1e-5, 1e-9, 1.0, scale="log", doc="m of a fibre")
    damping = Number(0.003, 1e-6, 100.0, scale="log", doc="b_F of a fibre")
    creep = Number(0.0, 0.0, 100.0, doc="b_R: what slows the bundle as a whole")
    restructurings = Count(20, 1, 10_000, doc="n_max of a chain of an inverse bundle")
    stiffening = Number(0.005, 0.0, 1.0, doc="alpha: how much stiffer a chain gets each time")
    strength = Number(
        1200.0, 1.0, 1e5, unit="N", scale="log", doc="force at which the whole would break, slowly loaded"
    )
    renewal = Number(0.25, 0.01, 10.0, unit="s", scale="log", doc="time without load to fresh ground")
    loudness = Number(1.0, 0.0, 1000.0, doc="strength of an event of energy k_F lambda^2 / 2")
    softness = Number(0.5, 0.0, 2.0, doc="exponent from energy to strength: 0.5 is a velocity")
    events = Output(kind="event", doc="failures, one a frame at most")
    strain = Output(doc="x of the bundle")
    state = _BUNDLE_STATE
    tuning = _BUNDLE + _BUNDLE_TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        table = frames(t, _BUNDLE + _BUNDLE_TUNING)[_BUNDLE:]
        if moved(c, t, _BUNDLE):
            _tune_bundle(c, c[0], table, rate, 1.0)
        state, load, strain = frames(s, _BUNDLE_STATE), frames(x[0], n), frames(y[0], n)
        grow(o[0], bundle.run(state, table, key, frame, load, strain, room(o[0], n)))

    @rest_kernel
    def rest(c, s, t, d):
        return bundle.rest(frames(s, _BUNDLE_STATE), frames(t, _BUNDLE + _BUNDLE_TUNING)[_BUNDLE:])


@node("fibre-grid", "Materials")
class FibreGrid:
    """Bundles in a grid under the foot, whose load follows the contact: where it rolls to, fresh ground breaks."""

    force = Input("N", doc="the load")
    x = Input("m", doc="where it is on the tile, from Contact")
    y = Input("m", doc="where it is on the tile, from Contact")
    model = Choice("exact", options=tuple(grid.GRID_MODELS), doc="inverse: chains that stiffen")
    thresholds = Choice("weibull", options=tuple(LAWS), doc="law of the thresholds")
    fibres = Count(500, 1, 10_000_000, doc="N of each cell")
    shape = Number(4.0, 0.5, 50.0, scale="log", doc="k of the Weibull law: more is more alike")
    scale = Number(2.5, 0.01, 1000.0, scale="log", doc="lambda of the law, a strain")
    stiffness = Number(1.0, 1e-3, 1e6, scale="log", doc="k_F of a fibre")
    mass = Number(1e-5, 1e-9, 1.0, scale="log", doc="m of a fibre")
    damping = Number(0.003, 1e-6, 100.0, scale="log", doc="b_F of a fibre")
    creep = Number(0.0, 0.0, 100.0, doc="b_R: what slows a bundle as a whole")
    restructurings = Count(20, 1, 10_000, doc="n_max of a chain of an inverse bundle")
    stiffening = Number(0.005, 0.0, 1.0, doc="alpha: how much stiffer a chain gets each time")
    strength = Number(
        1200.0, 1.0, 1e5, unit="N", scale="log", doc="force at which the whole would break, evenly loaded"
    )
    renewal = Number(0.25, 0.01, 10.0, unit="s", scale="log", doc="time without load to fresh ground")
    loudness = Number(1.0, 0.0, 1000.0, doc="strength of an event of energy k_F lambda^2 / 2")
    softness = Number(0.5, 0.0, 2.0, doc="exponent from energy to strength: 0.5 is a velocity")
    columns = Count(3, 1, 8, doc="cells along the tile's x axis")
    rows = Count(3, 1, 8, doc="cells along the tile's y axis")
    width = Number(0.305, 0.01, 10.0, unit="m", doc="of the tile, along x")
    depth = Number(0.305, 0.01, 10.0, unit="m", doc="of the tile, along y")
    reach = Number(0.08, 0.005, 1.0, unit="m", scale="log", doc="how far around its centre the foot presses")
    coupling = Number(0.1, 0.0, 10.0, doc="stiffness between neighbouring cells, of their own")
    rubble = Number(0.2, 0.01, 1.0, doc="what stiffness a broken cell keeps")
    events = Output(kind="event", doc="failures, one a frame at most")
    strain = Output(doc="mean x of the cells")

    def state(values, rate):
        return grid.state_size(values["columns"] * values["rows"])

    tuning = _GRID + _GRID_TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        table = frames(t, _GRID + _GRID_TUNING)[_GRID:]
        if moved(c, t, _GRID):
            _tune_bundle(c, 2.0 * c[0], table, rate, c[15] * c[16])
            grid.tune_grid(table, c[15], c[16], c[17], c[18], c[19], c[20], c[21])
        state = frames(s, grid.state_size(int(c[15] * c[16])))
        load, strain = frames(x[0], n), frames(y[0], n)
        place_x, place_y, events = frames(x[1], n), frames(x[2], n), room(o[0], n)
        grow(o[0], grid.run(state, table, key, frame, load, place_x, place_y, strain, events))

    @rest_kernel
    def rest(c, s, t, d):
        table = frames(t, _GRID + _GRID_TUNING)[_GRID:]
        return grid.rest(frames(s, grid.state_size(int(c[15] * c[16]))), table)


@node("slip", "Materials", "Elasto-plastic slip")
class Slip:
    """A spring with a plastic unit that slips at its threshold, by energies of a truncated power law (4.1, 5.4)."""

    force = Input("N", doc="the load")
    mass = Number(2.0, 1e-3, 1000.0, unit="kg", scale="log", doc="m")
    damping = Number(500.0, 0.1, 1e6, unit="N s/m", scale="log", doc="b")
    stiffness = Number(1e5, 100.0, 1e9, unit="N/m", scale="log", doc="k1, the elastic unit")
    plastic_stiffness = Number(5e4, 100.0, 1e9, unit="N/m", scale="log", doc="k2, the unit that slips")
    threshold = Number(5.0, 0.01, 1e4, unit="N", scale="log", doc="force on the plastic unit at which it slips")
    spread = Number(0.3, 0.0, 1.0, doc="how much thresholds vary, of their mean")
    gamma = Number(1.5, 0.1, 5.0, doc="exponent of the law of energies")
    least = Number(1e-6, 1e-12, 1.0, unit="J", scale="log", doc="smallest energy of a slip")
    most = Number(1e-3, 1e-9, 100.0, unit="J", scale="log", doc="largest energy of a slip")
    renewal = Number(0.25, 0.01, 10.0, unit="s", scale="log", doc="time without load to fresh ground")
    events = Output(kind="event", doc="slips; strength 1 at the largest energy, as its square root")
    displacement = Output("m", doc="x")
    state = _SLIP_STATE
    tuning = _SLIP + _SLIP_TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        table = frames(t, _SLIP + _SLIP_TUNING)[_SLIP:]
        if moved(c, t, 10):
            elasto_plastic.tune(table, rate, c[0], c[1], c[2], c[3], c[4], c[5])
            elasto_plastic.tune_energy(table, c[6], c[7], max(c[8], 1.001 * c[7]), 1.0, 0.5)
            elasto_plastic.tune_renewal(table, rate, c[9])
        state, force, displacement = frames(s, _SLIP_STATE), frames(x[0], n), frames(y[0], n)
        grow(o[0], elasto_plastic.run(state, table, key, frame, force, displacement, room(o[0], n)))

    @rest_kernel
    def rest(c, s, t, d):
        return elasto_plastic.rest(frames(s, _SLIP_STATE), frames(t, _SLIP + _SLIP_TUNING)[_SLIP:])
