"""Figures 8.4 to 8.10: trajectories, upcrossings, slip durations, periods and distances of the stick-slip model."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.figures.figure import Compared, Figure, density
from underfoot.drawing import Drawing, Series, series
from underfoot.kernels import Floats, kernel
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.sample_paths import paths
from underfoot.models.stick_slip.slip_distribution import SlipDistribution
from underfoot.models.stick_slip.tabulated import Distribution
from underfoot.models.stick_slip.upcrossings import Upcrossings, coloured_upcrossings, escape_time, white_upcrossings

_8_4 = BlockOnBelt(w0=1.0, zeta=0.01, noise=0.0005, belt_velocity=1.0, x0=0.3, v0=0.95)
_STEP_8_4_S = 0.001
_LEFT_8_5 = BlockOnBelt(w0=1.0, zeta=0.1, noise=0.4, belt_velocity=1.0, x0=0.0, v0=-1.0)
"""As captioned, like the others; where x0 or v0 is not printed, 0.3 and 0."""
_RIGHT_8_5 = BlockOnBelt(w0=1.0, zeta=0.11, noise=0.04, belt_velocity=1.3, x0=0.3, v0=0.0)
_8_6 = _LEFT_8_5
_LEFT_8_7 = BlockOnBelt(w0=1.0, zeta=0.11, noise=0.04, belt_velocity=1.0, x0=0.3, v0=0.0)
_RIGHT_8_7 = BlockOnBelt(w0=1.0, zeta=0.125, noise=0.33, belt_velocity=1.0, x0=0.3, v0=0.0)
_LEFT_8_8 = BlockOnBelt(w0=1.0, zeta=0.4, noise=0.1, belt_velocity=1.0, x0=0.3, v0=0.0)
_RIGHT_8_8 = _LEFT_8_7
_8_9 = BlockOnBelt(w0=1.0, zeta=0.11, noise=0.01, belt_velocity=1.0, x0=0.1, v0=0.0)  # with the weakest noise
_8_10 = BlockOnBelt(w0=1.0, zeta=0.4, noise=0.1, belt_velocity=0.45, x0=0.9, v0=0.0)
_STEP_S = 0.002
"""Time step of the thesis's simulations, over which white noise is an acceleration of variance 2 D / h."""
_COLOUR_S = 0.3
"""Correlation time of the noise for which the decoupled distribution exists."""


def trajectories(quick: bool) -> Figure:
    """Draw figure 8.4: two slips in the phase plane, one that ends within a period and one that lasts two."""
    found: dict[int, tuple[NDArray[np.float64], NDArray[np.float64], float]] = {}
    for seed in range(400):
        x, v = _slip(np.random.default_rng(seed))
        periods = len(x) * _STEP_8_4_S / (2.0 * math.pi)
        found.setdefault(round(periods), (x, v, periods))
        if {1, 2} <= set(found):
            break
    lines = [
        series(f"{found[k][2]:.2f} periods", found[k][0], found[k][1], style, colour)
        for k, style, colour in ((1, "line", "vibration"), (2, "dashed", "force"))
    ]
    lines.append(series("belt", [-1.2, 1.2], [_8_4.belt_velocity] * 2, "dashed", "muted"))
    return Figure(
        "8.4",
        "Two slips from one beginning, until the block sticks again",
        (Drawing("Until v reaches the belt's velocity", "place x", "velocity v", tuple(lines)),),
        (
            Compared("the first sticks after", "one period", f"{found[1][2]:.2f} periods"),
            Compared("the second after", "two: frequency w'/2", f"{found[2][2]:.2f} periods"),
        ),
        f"Where they begin is not printed: here at x = {_8_4.x0}, v = {_8_4.v0}.",
    )


def _slip(rng: np.random.Generator) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return position and velocity of one slip, by Euler-Maruyama as in the thesis."""
    places, velocities = [_8_4.x0], [_8_4.v0]
    kick = math.sqrt(2.0 * _8_4.noise * _STEP_8_4_S)
    for noise in kick * rng.standard_normal(round(20.0 / _STEP_8_4_S)):
        x, v = places[-1], velocities[-1]
        places.append(x + v * _STEP_8_4_S)
        velocities.append(v - (_8_4.w0**2 * x + 2.0 * _8_4.zeta * _8_4.w0 * v) * _STEP_8_4_S + noise)
        if velocities[-1] >= _8_4.belt_velocity:
            break
    return np.array(places), np.array(velocities)


def upcrossings(quick: bool) -> Figure:
    """Draw figure 8.5: the density of upcrossings without absorption, formula and simulation."""
    paths = 2_000 if quick else 20_000
    drawings, ends = [], []
    for name, values, t_end in (("left", _LEFT_8_5, 20.0), ("right", _RIGHT_8_5, 40.0)):
        times = np.linspace(0.02, t_end, 1000)
        counts = np.zeros(100)
        _count_upcrossings(values, t_end, _STEP_S, paths, np.random.default_rng(1), counts)
        counted = counts / paths / (t_end / counts.size)
        at = (np.arange(counts.size) + 0.5) * t_end / counts.size
        formula = white_upcrossings(values, t=times, step=_STEP_S).density
        printed = white_upcrossings(values, t=times, step=1.0).density
        lines = (
            series("simulated, h = 0.002", at, counted, "dots", "force"),
            series("variance 2D/h", times, formula),
            series("variance 2D, as printed", times, printed, "dashed", "alarm"),
        )
        drawings.append(Drawing(f"Figure 8.5 {name}", "time, s", "upcrossings, 1/s", lines))
        ends.append((float(np.mean(counted[-20:])), float(formula[-1]), float(printed[-1])))
    rows = [
        Compared(
            f"n1 at the end, {name}", "formula on simulation", f"{s:.3f} simulated, {f:.3f} by formula, {p:.3f} with 2D"
        )
        for name, (s, f, p) in zip(("left", "right"), ends, strict=True)
    ]
    return Figure(
        "8.5",
        "Upcrossings of the belt velocity without absorption",
        tuple(drawings),
        tuple(rows),
        "White noise has no acceleration: the density depends on the step and grows as 1/sqrt(h), so the printed "
        "variance 2D, which is that of a step of 1 s, cannot lie on simulations with h = 0.002; those also lose a "
        "damping of w0^2 h, which shows on the right.",
    )


def durations(quick: bool) -> Figure:
    """Draw figure 8.6: the distribution of slip durations, and two approximations of it."""
    times = np.linspace(0.01, 12.0, 1200)
    distribution = SlipDistribution.solve(_8_6, t_end=20.0).duration
    drawn = paths(_8_6, t_end=20.0, count=20_000 if quick else 200_000, seed=1).duration
    at, found = density(drawn[np.isfinite(drawn)], np.linspace(0.0, 12.0, 61), drawn.size)
    simulated = series("exact paths", at, found, "dots", "force")
    exact = _drawn("exact", distribution, 12.0)
    white = white_upcrossings(_8_6, t=times, step=1.0)
    coloured = coloured_upcrossings(_8_6, t=times, correlation_time=_COLOUR_S)
    drawings = tuple(
        Drawing(title, "slip duration, s", "density, 1/s", (simulated, exact, *lines))
        for title, lines in (
            (
                "First-order density n1",
                (
                    series("white, variance 2D", times, white.density, "dashed", "alarm"),
                    series(f"noise of {_COLOUR_S} s", times, coloured.density, "dashed", "events"),
                ),
            ),
            (
                "Decoupled",
                (
                    series("white, variance 2D", times, white.durations(), "dashed", "alarm"),
                    series(f"noise of {_COLOUR_S} s", times, coloured.durations(), "dashed", "events"),
                ),
            ),
        )
    )
    steps = white_upcrossings(_8_6, t=np.linspace(0.005, 20.0, 2000), step=_STEP_S)
    return Figure(
        "8.6",
        "Slip durations: two approximations",
        drawings,
        (
            Compared(
                "largest CDF difference of exact paths", "simulation", f"{_apart(np.sort(drawn), distribution):.1e}"
            ),
            Compared(
                "of the decoupled distribution, variance 2D", "good agreement", f"{_off(white, distribution):.2f}"
            ),
            Compared(
                "of the decoupled distribution, variance 2D/h, h = 0.002",
                "good agreement",
                f"{_off(steps, distribution):.2f}",
            ),
            Compared(
                "the same in coloured noise, from its own paths",
                "not tried",
                f"{_off_its_paths(_8_6, 20.0, quick):.2f}",
            ),
        ),
        "With white noise the decoupled distribution depends on the step it is seen over and has no limit; with "
        "coloured noise it exists, for the motion in that noise, and undershoots the first peak as the thesis says.",
    )


def regimes(quick: bool) -> Figure:
    """Draw figure 8.7: the decoupled distribution at weak and strong noise."""
    drawings, rows = [], []
    for name, values, t_end, printed in (("left", _LEFT_8_7, 40.0, "3.9"), ("right", _RIGHT_8_7, 20.0, "0.8")):
        distribution = SlipDistribution.solve(values, t_end=4.0 * t_end).duration
        drawn = paths(values, t_end=t_end, count=20_000 if quick else 200_000, seed=1).duration
        at, found = density(drawn[np.isfinite(drawn)], np.linspace(0.0, t_end, 81), drawn.size)
        times = np.linspace(0.02, t_end, 1500)
        coloured = coloured_upcrossings(values, t=times, correlation_time=_COLOUR_S)
        lines = (
            series("exact paths", at, found, "dots", "force"),
            _drawn("exact", distribution, t_end),
            series(f"decoupled, noise of {_COLOUR_S} s", times, coloured.durations(), "dashed", "events"),
        )
        drawings.append(Drawing(f"Figure 8.7 {name}", "slip duration, s", "density, 1/s", lines))
        rice = 2.0 * math.pi / values.w0 * math.exp(values.belt_velocity * values.zeta / (2.0 * values.noise))
        white = escape_time(values, _STEP_S)
        rows += [
            Compared(f"T_R, {name}", f"{printed} (8.47 gives {rice:.1f})", f"{white:.2f} at h = 0.002; none without h"),
            Compared(f"mean time of late slips, {name}", "not given", f"{_late_s(distribution):.1f} s"),
            Compared(
                f"CDF error of the decoupled distribution in coloured noise, {name}",
                "good agreement",
                f"{_off_its_paths(values, t_end, quick):.2f}",
            ),
        ]
    return Figure(
        "8.7",
        "Slip durations at little and much noise",
        tuple(drawings),
        tuple(rows),
        "8.47 is the rate of another crossing (of x, with v_b where v_b^2 belongs), and neither it nor its correction "
        "gives the captions, which come near exp(1.375) and exp(-0.189); x0 = 0.3 and v0 = 0 are chosen here.",
    )


def periods(quick: bool) -> Figure:
    """Draw figure 8.8: the distribution of stick-slip periods."""
    drawings, rows = [], []
    for name, values in (("left", _LEFT_8_8), ("right", _RIGHT_8_8)):
        distribution, lines = _periods(values, 40.0, 20_000 if quick else 200_000)
        drawings.append(Drawing(f"Figure 8.8 {name}", "period, s", "density, 1/s", lines))
        rows += [
            Compared(f"share with a period, {name}", "1, by normalisation", f"{distribution.period.cdf[-1]:.3f}"),
            Compared(f"slips that end ahead of x0, {name}", "not mentioned", f"{distribution.negative_stick:.3f}"),
        ]
    return Figure(
        "8.8",
        "Stick-slip periods",
        tuple(drawings),
        tuple(rows),
        "8.15 lacks the factor v_b, without which p(T) integrates to 1/v_b; x0 is not printed, and is 0.3 here.",
    )


def resonance(quick: bool) -> Figure:
    """Draw figure 8.9: periods that exist only because of noise."""
    lines, rows = [], []
    for noise, colour in ((0.01, "muted"), (0.02, "vibration"), (0.04, "events"), (0.08, "contact"), (0.16, "force")):
        distribution = SlipDistribution.solve(_8_9._replace(noise=noise), 40.0, 1e-3)
        lines.append(_drawn(f"D = {noise:g}", distribution.period, 40.0, colour))
        share = float(distribution.period.cdf_at(40.0))
        rows.append(Compared(f"cycles shorter than 40 s, D = {noise:g}", "none without noise", f"{share:.3f}"))
    return Figure(
        "8.9",
        "Periods at several strengths of noise",
        (Drawing("Figure 8.9", "period, s", "density, 1/s", tuple(lines)),),
        tuple(rows),
        "The thesis draws the decoupled approximation for strengths that it does not print; these are exact.",
    )


def distances(quick: bool) -> Figure:
    """Draw figure 8.10: the distribution of slip distances."""
    distribution = SlipDistribution.solve(_8_10, t_end=40.0, error=1e-4)
    drawn = paths(_8_10, t_end=40.0, count=20_000 if quick else 200_000, seed=1)
    far = _8_10.x0 - drawn.position[np.isfinite(drawn.position)]
    at, found = density(far, np.linspace(-1.5, 4.0, 111), drawn.position.size)
    d = np.linspace(-1.5, 4.0, 300)
    coloured = coloured_upcrossings(_8_10, t=np.linspace(0.02, 40.0, 1500), correlation_time=_COLOUR_S)
    below, above = distribution.distance.cdf_at([-0.1, 0.1])
    near = float(above - below)
    peak = float(distribution.distance.points[np.argmax(distribution.distance.density)])
    lines = (
        series("exact paths", at, found, "dots", "force"),
        series("exact", distribution.distance.points, distribution.distance.density),
        series(f"decoupled, noise of {_COLOUR_S} s", d, coloured.distances(d), "dashed", "events"),
    )
    return Figure(
        "8.10",
        "Slip distances",
        (Drawing("Figure 8.10", "distance, m", "density, 1/m", lines),),
        (
            Compared("share of slips with |d| < 0.1", "small, not 0", f"{100.0 * near:.2f} %"),
            Compared("distance of the peak", "about Gaussian", f"{peak:.2f} m"),
        ),
        "v0 is not printed; a start on the belt's velocity would end at once in white noise, so slips start at rest.",
    )


def _periods(values: BlockOnBelt, t_end: float, count: int) -> tuple[SlipDistribution, tuple[Series, ...]]:
    distribution = SlipDistribution.solve(values, t_end=4.0 * t_end, error=1e-4)
    drawn = paths(values, t_end=t_end, count=count, seed=1)
    distance = values.x0 - drawn.position
    period = (drawn.duration + distance / values.belt_velocity)[distance >= 0.0]
    at, found = density(period[period < t_end], np.linspace(0.0, t_end, 81), count)
    times = np.linspace(0.04, t_end, 800)
    coloured = coloured_upcrossings(values, t=times, correlation_time=_COLOUR_S)
    grid = np.linspace(0.1, t_end, 300)
    lines = (
        series("exact paths", at, found, "dots", "force"),
        _drawn("exact", distribution.period, t_end),
        series(f"decoupled, noise of {_COLOUR_S} s", grid, coloured.periods(grid), "dashed", "events"),
    )
    return distribution, lines


def _drawn(name: str, distribution: Distribution, end: float, colour: str = "vibration") -> Series:
    """Return the density of a distribution up to `end`."""
    seen = distribution.points < end
    return series(name, distribution.points[seen], distribution.density[seen], colour=colour)


def _off(crossings: Upcrossings, distribution: Distribution) -> float:
    return float(np.abs(crossings.escaped - distribution.cdf_at(crossings.t)).max())


def _off_its_paths(values: BlockOnBelt, t_end: float, quick: bool) -> float:
    """Return the largest CDF difference of the decoupled distribution from paths, both in the same coloured noise."""
    durations = np.empty(2_000 if quick else 50_000)
    _coloured_durations(values, t_end, 0.005, _COLOUR_S, np.random.default_rng(1), durations)
    times = np.linspace(0.02, t_end, 1000)
    escaped = coloured_upcrossings(values, t=times, correlation_time=_COLOUR_S).escaped
    return float(np.abs(escaped - np.searchsorted(np.sort(durations), times) / durations.size).max())


def _apart(durations: NDArray[np.float64], distribution: Distribution) -> float:
    ended = durations[np.isfinite(durations)]
    drawn_cdf = (np.arange(ended.size) + 0.5) / durations.size
    return float(np.abs(distribution.cdf_at(ended) - drawn_cdf).max())


def _late_s(distribution: Distribution) -> float:
    """Return the time constant of an exponential tail, between the 80 % and 98 % quantiles."""
    some, few = np.interp([0.8, 0.98], distribution.cdf, distribution.points)
    return float((few - some) / math.log(10.0))


@kernel
def _count_upcrossings(
    block: BlockOnBelt, t_end: float, step: float, paths: int, generator: np.random.Generator, counts: Floats
) -> None:
    # Euler-Maruyama without absorption, as in the thesis.
    w0, zeta, noise, belt, x0, v0 = block
    kick = math.sqrt(2.0 * noise * step)
    steps = int(round(t_end / step))
    for _ in range(paths):
        x, v = x0, v0
        for i in range(steps):
            before = v
            x, v = x + step * v, v - step * (w0 * w0 * x + zeta * v) + kick * generator.standard_normal()
            if before < belt <= v:
                counts[i * counts.size // steps] += 1.0


@kernel
def _coloured_durations(
    block: BlockOnBelt,
    t_end: float,
    step: float,
    correlation_time: float,
    generator: np.random.Generator,
    durations: Floats,
) -> None:
    # In coloured noise the velocity is smooth, so short steps resolve every crossing that matters.
    w0, zeta, noise, belt, x0, v0 = block
    level = math.sqrt(noise / correlation_time)
    keep = math.exp(-step / correlation_time)
    fresh = level * math.sqrt(1.0 - keep * keep)
    for k in range(durations.size):
        x, v, t = x0, v0, 0.0
        push = level * generator.standard_normal()
        while t < t_end and v < belt:
            v += step * (push - w0 * w0 * x - zeta * v)
            x += step * v
            push = keep * push + fresh * generator.standard_normal()
            t += step
        durations[k] = t if v >= belt else math.inf
