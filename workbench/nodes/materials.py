"""Materials that fracture, restructure or slip under a foot. They output events, which excite resonators."""

from underfoot.models import elasto_plastic
from underfoot.models.fibre_bundle import bundle, damage, grid
from underfoot.parameters import Choice, Count, Number
from underfoot.patch.node import Input, Output, node


class _Fibres:
    """Common part: the parameters of one bundle."""

    model = Choice(
        "exact", options=damage.MODELS, doc="fracture model; inverse: chains that stiffen as they restructure"
    )
    thresholds = Choice("weibull", options=damage.THRESHOLDS, doc="distribution of the breaking strains")
    fibres = Count(2000, 1, 10_000_000, doc="number of fibres N: more give more cracks, each as strong")
    shape = Number(
        4.0, 0.5, 50.0, scale="log", doc="Weibull shape k: higher makes thresholds alike, so that all breaks at once"
    )
    scale = Number(
        2.5, 0.01, 1000.0, scale="log", doc="scale lambda of the distribution, a strain; no event depends on it"
    )
    stiffness = Number(
        1.0, 1e-3, 1e6, scale="log", doc="stiffness k_F of a fibre; events depend on its ratios to mass and damping"
    )
    mass = Number(1e-5, 1e-9, 1.0, scale="log", doc="mass m of a fibre: the strain swings at sqrt(k_F / m) / 2 pi")
    damping = Number(
        0.003, 1e-6, 100.0, scale="log", doc="damping b_F of a fibre: more slows the strain, with fewer cracks"
    )
    creep = Number(
        0.0,
        0.0,
        100.0,
        scale="amplitude",
        doc="damping b_R of the whole bundle: more makes it yield slowly, with fewer cracks",
    )
    restructurings = Count(20, 1, 10_000, doc="restructurings n_max of a chain (inverse model)")
    stiffening = Number(
        0.005, 0.0, 1.0, scale="amplitude", doc="alpha: stiffening of a chain per restructuring (inverse model)"
    )
    strength = Number(
        1200.0, 1.0, 1e5, unit="N", scale="log", doc="force that breaks the whole bundle under quasi-static load"
    )
    renewal = Number(
        0.25, 0.01, 10.0, unit="s", scale="log", doc="time without load after which the ground is intact again"
    )
    loudness = Number(
        1.0, 0.0, 1000.0, scale="gain", wire="span", doc="strength of an event with energy k_F lambda^2 / 2"
    )
    softness = Number(0.5, 0.0, 2.0, doc="exponent from energy to strength; 0.5 makes strength a velocity")


@node("fibre-bundle", "Materials")
class FibreBundle(_Fibres):
    """Fibre bundle: fibres that share a load and break at random thresholds (7.1 to 7.15), or restructure (to 7.24).

    Each failure is an event. Below the largest strain so far nothing breaks, until the ground is renewed.
    """

    also_called = "sand, gravel, crackle, grain"
    accuracy = "exact in distribution: order statistics, by Kolmogorov-Smirnov at 1 %; strain to the step of a frame"
    force = Input("N", doc="load on the bundle")
    events = Output(kind="event", doc="failures; at most one per frame")
    strain = Output(doc="strain x of the bundle")
    state, coefficients = bundle.STATE, damage.COEFFICIENTS
    damage = Output(doc="share of failed fibres, xi (7.15); of restructurings, for the inverse model")
    energy = Output(doc="energy released by the failures of a frame, in units of the bundle")

    def distributions(values):
        from underfoot.models.fibre_bundle.bundle_drawings import bundle_drawings

        return bundle_drawings(values)

    def design(controls, rate, coefficients):
        c = controls
        load = damage.critical_load(c.thresholds, c.fibres, c.shape, c.scale, c.stiffness)
        damage.design(c, c.model, load / c.strength, rate, coefficients)
        coefficients.holds = 1.0

    def run(force, key, frame, coefficients, state, strain, damage, energy, events):
        motion = bundle.Motion(strain, damage, energy, strain[:0], strain[:0])
        bundle.run(force, key, frame, coefficients, state, motion, events)

    def tail(state, coefficients):
        return bundle.tail(state, coefficients)


@node("fibre-grid", "Materials")
class FibreGrid(_Fibres):
    """Grid of fibre bundles under the foot: ice, snow or twigs that crack.

    The load follows the contact: intact cells break where the foot rolls.
    """

    also_called = "sand, gravel, leaves, crackle"
    accuracy = "exact in distribution for each cell (Kolmogorov-Smirnov at 1 %); cells share load once per frame"
    force = Input("N", doc="load on the grid")
    x = Input("m", doc="contact position on the tile, from Contact")
    y = Input("m", doc="contact position on the tile, from Contact")
    model = Choice(
        "exact", options=grid.GRID_MODELS, doc="fracture model; inverse: chains that stiffen as they restructure"
    )
    fibres = Count(500, 1, 10_000_000, doc="number of fibres N per cell: more give more cracks, each as strong")
    strength = Number(
        1200.0, 1.0, 1e5, unit="N", scale="log", doc="force that breaks the whole grid under uniform load"
    )
    loudness = Number(
        1.0, 0.0, 1000.0, scale="gain", added=0.05, doc="strength of an event with energy k_F lambda^2 / 2"
    )
    columns = Count(3, 1, 8, doc="number of cells along the tile's x axis")
    rows = Count(3, 1, 8, doc="number of cells along the tile's y axis")
    width = Number(0.305, 0.01, 10.0, unit="m", scale="log", doc="size of the tile along x")
    depth = Number(0.305, 0.01, 10.0, unit="m", scale="log", doc="size of the tile along y")
    reach = Number(
        0.08, 0.005, 1.0, unit="m", scale="log", doc="standard deviation of the foot's pressure around its centre"
    )
    coupling = Number(
        0.1, 0.0, 10.0, scale="amplitude", doc="stiffness between neighbouring cells, relative to a cell's own"
    )
    rubble = Number(0.2, 0.01, 1.0, doc="share of its stiffness that a broken cell keeps")
    events = Output(kind="event", doc="failures; at most one per frame")
    strain = Output(doc="mean strain x of the cells")

    state, coefficients = grid.STATE, grid.COEFFICIENTS

    def distributions(values):
        from underfoot.models.fibre_bundle.bundle_drawings import bundle_drawings

        cells = values["columns"] * values["rows"]
        return bundle_drawings({**values, "strength": values["strength"] / cells}, f"Load on one of {cells} cells")

    def sizes(values, rate):
        return grid.sizes(values["columns"] * values["rows"])

    def design(controls, rate, coefficients):
        c = controls
        load = damage.critical_load(c.thresholds, c.fibres, c.shape, c.scale, c.stiffness) * (c.columns * c.rows)
        model = damage.INVERSE if c.model != 0.0 else damage.EXACT
        damage.design(c, model, load / c.strength, rate, coefficients.bundle)
        coefficients.bundle.holds = 1.0
        grid.design(c, coefficients)

    def run(force, x, y, key, frame, coefficients, state, strain, events):
        untraced = grid.Trace(strain[:0].reshape(0, 1), strain[:0])
        grid.run(grid.Contact(force, x, y), key, frame, coefficients, state, strain, events, untraced)

    def tail(state, coefficients):
        return grid.tail(state, coefficients)


@node("slip", "Materials", "Elasto-plastic slip")
class Slip:
    """Elasto-plastic ground, as wood that creaks or packed snow: a plastic unit slips at a threshold (4.1, 5.4).

    The energies of slips have a truncated power law.
    """

    accuracy = "exact: SciPy's solver, to 1e-9 between slips"
    force = Input("N", doc="load on the ground")
    mass = Number(2.0, 1e-3, 1000.0, unit="kg", scale="log", doc="mass m of the ground that moves")
    damping = Number(
        500.0, 0.1, 1e6, unit="N*s/m", scale="log", doc="damping b: more slows the ground, with fewer slips"
    )
    stiffness = Number(
        1e5, 1e2, 1e9, unit="N/m", scale="log", doc="stiffness k1 of the elastic unit: softer ground slips more often"
    )
    plastic_stiffness = Number(
        5e4, 1e2, 1e9, unit="N/m", scale="log", doc="stiffness k2 of the plastic unit: more gives more, weaker slips"
    )
    threshold = Number(
        5.0,
        0.01,
        1e4,
        unit="N",
        scale="log",
        doc="force on the plastic unit at which it slips: more gives fewer and stronger slips",
    )
    spread = Number(0.3, 0.0, 1.0, doc="relative spread of the thresholds")
    gamma = Number(1.5, 0.1, 5.0, doc="exponent of the energy distribution: higher gives more and weaker slips")
    least = Number(1e-6, 1e-12, 1.0, unit="J", scale="log", doc="smallest energy of a slip")
    most = Number(
        1e-3, 1e-9, 100.0, unit="J", scale="log", doc="largest energy of a slip; strengths are relative to it"
    )
    renewal = Number(
        0.25, 0.01, 10.0, unit="s", scale="log", doc="time without load after which the ground is intact again"
    )
    events = Output(kind="event", doc="slips; strength is the square root of energy over largest energy")
    displacement = Output("m", doc="displacement x")
    state, coefficients = elasto_plastic.STATE, elasto_plastic.COEFFICIENTS

    def design(controls, rate, coefficients):
        most = max(controls.most, 1.001 * controls.least)
        elasto_plastic.design(controls, most, 1.0, 0.5, rate, coefficients)

    def run(force, key, frame, coefficients, state, displacement, events):
        elasto_plastic.run(force, key, frame, coefficients, state, displacement, events, displacement[:0])

    def tail(state, coefficients):
        return elasto_plastic.tail(state, coefficients)
