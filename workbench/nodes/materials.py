"""Materials that break, restructure or slip under the foot: what they make are events, which ring something behind."""

from underfoot.models import elasto_plastic
from underfoot.models.fibre_bundle import bundle, damage, grid
from underfoot.parameters import Choice, Count, Number
from underfoot.patch.node import Input, Output, node

THRESHOLDS = damage.THRESHOLDS


@node("fibre-bundle", "Materials")
class FibreBundle:
    """Fibres that share the load and break at random thresholds (7.1 to 7.15), or chains that restructure (to 7.24).

    Each failure is an event. No fibre breaks below a strain that was reached before, until the ground is renewed.
    """

    accuracy = "exact in law: order statistics, by Kolmogorov-Smirnov at 1 %; strain to the step of a frame"
    force = Input("N", doc="the load")
    model = Choice("exact", options=damage.MODELS, doc="inverse: chains that stiffen")
    thresholds = Choice("weibull", options=THRESHOLDS, doc="distribution of the thresholds")
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
    loudness = Number(
        1.0, 0.0, 1000.0, scale="gain", wire="span", doc="strength of an event of energy k_F lambda^2 / 2"
    )
    softness = Number(0.5, 0.0, 2.0, doc="exponent from energy to strength: 0.5 is a velocity")
    events = Output(kind="event", doc="failures, one a frame at most")
    strain = Output(doc="x of the bundle")
    state, coefficients = bundle.STATE, damage.COEFFICIENTS
    damage = Output(doc="share of the fibres that failed, xi (7.15); of an inverse bundle, of the restructurings")
    energy = Output(doc="set free by the failures of a frame, of the bundle's units")

    def laws(values):
        from underfoot.models.fibre_bundle.bundle_laws import bundle_laws

        return bundle_laws(values)

    def design(controls, rate, coefficients):
        c = controls
        load = damage.critical_load(c.thresholds, c.fibres, c.shape, c.scale, c.stiffness)
        damage.design(c, c.model, load / c.strength, rate, coefficients)
        coefficients.holds = 1.0

    def run(force, key, frame, coefficients, state, strain, damage, energy, events):
        bundle.run(force, key, frame, coefficients, state, strain, damage, energy, events)

    def tail(state, coefficients):
        return bundle.tail(state, coefficients)


@node("fibre-grid", "Materials")
class FibreGrid:
    """Bundles in a grid under the foot, whose load follows the contact: where it rolls to, fresh ground breaks."""

    accuracy = (
        "exact in law for each cell, which is a bundle (Kolmogorov-Smirnov at 1 %); cells share load once a frame"
    )
    force = Input("N", doc="the load")
    x = Input("m", doc="where it is on the tile, from Contact")
    y = Input("m", doc="where it is on the tile, from Contact")
    model = Choice("exact", options=grid.GRID_MODELS, doc="inverse: chains that stiffen")
    thresholds = Choice("weibull", options=THRESHOLDS, doc="distribution of the thresholds")
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
    loudness = Number(1.0, 0.0, 1000.0, scale="gain", doc="strength of an event of energy k_F lambda^2 / 2")
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

    state, coefficients = grid.STATE, grid.COEFFICIENTS

    def laws(values):
        from underfoot.models.fibre_bundle.bundle_laws import bundle_laws

        cells = values["columns"] * values["rows"]
        return bundle_laws({**values, "strength": values["strength"] / cells}, f", one of {cells} cells")

    def sizes(values, rate):
        return {"cells": values["columns"] * values["rows"]}

    def design(controls, rate, coefficients):
        c = controls
        load = damage.critical_load(c.thresholds, c.fibres, c.shape, c.scale, c.stiffness) * (c.columns * c.rows)
        model = damage.INVERSE if c.model != 0.0 else damage.EXACT
        damage.design(c, model, load / c.strength, rate, coefficients.bundle)
        coefficients.bundle.holds = 1.0
        grid.design(c, coefficients)

    def run(force, x, y, key, frame, coefficients, state, strain, events):
        grid.run(grid.Contact(force, x, y), key, frame, coefficients, state, strain, events)

    def tail(state, coefficients):
        return grid.tail(state, coefficients)


@node("slip", "Materials", "Elasto-plastic slip")
class Slip:
    """A spring with a plastic unit that slips at its threshold, by energies of a truncated power law (4.1, 5.4)."""

    accuracy = "exact: SciPy's solver, to 1e-9 between slips"
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
    state, coefficients = elasto_plastic.STATE, elasto_plastic.COEFFICIENTS

    def design(controls, rate, coefficients):
        most = max(controls.most, 1.001 * controls.least)
        elasto_plastic.design(controls, most, 1.0, 0.5, rate, coefficients)

    def run(force, key, frame, coefficients, state, displacement, events):
        elasto_plastic.run(force, key, frame, coefficients, state, displacement, events)

    def tail(state, coefficients):
        return elasto_plastic.tail(state, coefficients)
