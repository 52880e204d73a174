"""Figures 7.12 to 7.14: inverse bundles, whose chains restructure and stiffen, and a bundle under a foot."""

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.figures.figure import Compared, Figure, density, slope
from underfoot.bench.figures.fracture import FIBRES, RATE, WINDOW_S, footstep, ramp, windows
from underfoot.drawing import Drawing, series
from underfoot.models.fibre_bundle.bundle import FibreBundle, Fracture

_TIME_S = np.arange(RATE) / RATE
_FEW = 200  # chains in figure 7.13
_LOAD = 1e5  # load in figure 7.13


def stiffening(quick: bool) -> Figure:
    """Draw figure 7.12: load, restructurings, strain, and stress over strain of the mean inverse bundle."""
    count = 20 if quick else 200
    load = ramp(2667.0)
    bundle = FibreBundle(FIBRES, mass=0.0, model="inverse_mean")
    results = [bundle.response(load, RATE, seed) for seed in range(count)]
    strain = np.mean([result.strain for result in results], axis=0)
    failed = np.mean([np.cumsum(result.failures) for result in results], axis=0) / FIBRES
    steeper = _steepness(strain, load)
    return Figure(
        "7.12",
        f"The inverse bundle under a ramp, mean of {count} of 2000 chains",
        (
            Drawing("Load", "time, s", "stress", (series("", _TIME_S, load, colour="force"),)),
            Drawing("Restructurings", "time, s", "a chain", (series("", _TIME_S, failed, colour="events"),)),
            Drawing("Strain", "time, s", "strain", (series("", _TIME_S, strain),)),
            Drawing("Constitutive behaviour", "strain", "stress", (series("", strain[load > 0.0], load[load > 0.0]),)),
        ),
        (
            Compared("terminal stress", "2667", f"{load[-1]:.0f}"),
            Compared("stiffness at the end over that at first", "grows", f"{steeper:.3f}"),
            Compared("restructurings a chain at the end", "not given", f"{failed[-1]:.2f}"),
        ),
        "The thesis calls stress over strain concave; it stiffens, so it is convex.",
    )


def fluctuations(quick: bool) -> Figure:
    """Draw figure 7.13: times between restructurings, and energies in windows, as captioned and as 7.18 compounds."""
    count = 40 if quick else 500
    bundle = FibreBundle(_FEW, mass=0.0, model="inverse")
    captioned = [bundle.response(ramp(_LOAD), RATE, seed) for seed in range(count)]
    gaps = np.concatenate([np.diff(result.event_s) for result in captioned])
    few = _positive(captioned)
    many_of = max(count // 5, 20)
    stiffer = FibreBundle(_FEW, mass=0.0, damping=0.0, model="inverse", restructurings=1000, compound=True)
    compound = [stiffer.response(ramp(_LOAD), RATE, seed) for seed in range(many_of)]
    many = _positive(compound)
    gaps_at, gaps_found = density(gaps, np.geomspace(5e-6, 2e-3, 40))
    drawn = []
    for name, values, colour in (("n_max 20, as captioned", few, "force"), ("n_max 1000, compound", many, "vibration")):
        at, found = density(values, np.geomspace(values.min(), values.max() * 1.001, 30))
        drawn.append(series(name, at, found, "dots", colour))
    low, high = np.quantile(few, [0.3, 0.95])
    within = np.quantile(few, 0.9)
    steep = slope(many, 2.5e3, 3e4)
    one = windows(compound[0])
    over = float(np.mean([result.event_s[-1] for result in captioned]))
    return Figure(
        "7.13",
        f"Fluctuations of inverse bundles of {_FEW} chains under a ramp to {_LOAD:.0e}",
        (
            Drawing(
                "Times between restructurings, n_max 20",
                "interval, s",
                "density, 1/s",
                (series("", gaps_at, gaps_found, "dots", "force"),),
                x_log=True,
                y_log=True,
            ),
            Drawing("Energy in windows of 5 ms", "energy, k_F x^2", "density", tuple(drawn), x_log=True, y_log=True),
            Drawing(
                "One bundle, n_max 1000, compound",
                "time, s",
                "energy in a window, k_F x^2",
                (series("", WINDOW_S * np.arange(one.size), one),),
            ),
        ),
        (
            Compared("slope of the energies, as captioned", "-2.0", f"{slope(few, low, high):.2f}"),
            Compared("windows with energy, as captioned", "enough for a power law", f"{few.size / count:.1f} a bundle"),
            Compared("the last restructuring, as captioned", "not given", f"after {1e3 * over:.0f} ms of 800"),
            Compared("nine tenths of those energies are below", "not given", f"{within:.0f}"),
            Compared("slope, n_max 1000, stiffness compounding", "-2.0 for n_max large enough", f"{steep:.2f}"),
        ),
        "With n_max = 20 the ramp to 1e5 is a hundred times what restructures all chains, and they are done after a "
        "few of 160 windows; with stiffness that compounds (7.18, not 7.19) and n_max near 1000 they last, I_F grows "
        "as ln t, the energy of a window falls as 1/t and so p(E) as E^-2: that must be what was drawn.",
    )


def under_a_foot(quick: bool) -> Figure:
    """Draw figure 7.14: a bundle of 2000 fibres under a footstep."""
    bundle = FibreBundle(FIBRES, mass=1e-5, damping=0.003)
    _, load = footstep(bundle)
    energy = np.mean([windows(bundle.response(load, RATE, seed)) for seed in range(5 if quick else 20)], axis=0)
    time_s = WINDOW_S * np.arange(energy.size)
    rising = np.gradient(load[:: RATE // 200][: energy.size]) > 0.0
    return Figure(
        "7.14",
        "A bundle of 2000 fibres under a foot",
        (
            Drawing("Load", "time, s", "stress", (series("", _TIME_S, load, colour="force"),)),
            Drawing("Energy in windows of 5 ms", "time, s", "energy, k_F x^2", (series("", time_s, energy),)),
        ),
        (
            Compared(
                "energy set free while the load rises",
                "most of it, at heel strike and before toe off",
                f"{100.0 * energy[rising].sum() / energy.sum():.0f} %",
            ),
        ),
        "The thesis prints neither the load nor how near to breaking it came; here the second peak comes to 97 % of "
        "the quasi-static strength, and were it not above the first, nothing would break before toe off.",
    )


def _positive(results: list[Fracture]) -> NDArray[np.float64]:
    every = np.concatenate([windows(result) for result in results])
    return every[every > 0.0]


def _steepness(strain: NDArray[np.float64], load: NDArray[np.float64]) -> float:
    """Return the slope of stress over strain near the end of the ramp, relative to that near its beginning."""

    def near(share: float) -> float:
        here = np.abs(load / load[-1] - share) < 0.02
        return float(np.polyfit(strain[here & (_TIME_S < 0.79)], load[here & (_TIME_S < 0.79)], 1)[0])

    return near(0.95) / near(0.1)
