"""Figures 7.5 to 7.8 and 7.15: fibre bundles under ramps, their fluctuations, and one played in real time."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.figures.figure import Compared, Figure, density, slope
from underfoot.drawing import Drawing, Series, series
from underfoot.models import gait
from underfoot.models.fibre_bundle.bundle import FibreBundle, Fracture
from underfoot.models.modal import bank

RATE = 48_000
FIBRES, SCALE = 2000, 2.5
WINDOW_S = 0.005
"""Windows in seconds over which the thesis sums the energies of failures."""
_TIME_S = np.arange(RATE) / RATE
_COLLAPSE_S = 0.68
"""Time at which the thesis's overloaded bundle collapses."""
_CRITICAL, _ABOVE = 2800.0, 2900.0
"""The thesis's critical load of M, and a load at which every bundle breaks."""
_MODELS = (("exact", "M", "vibration"), ("mean", "M-bar", "force"))


def ramp(most: float, seconds: float = 1.0) -> NDArray[np.float64]:
    """Return the load of 7.2.3: rising linearly to `most` in 0.8 s, then constant."""
    return most * np.minimum(np.arange(round(seconds * RATE)) / RATE / 0.8, 1.0)


def responses(quick: bool) -> Figure:
    """Draw figure 7.5: the number of surviving fibres, and strain and threshold, at three terminal loads."""
    above = _load_that_collapses_at(_COLLAPSE_S)
    drawings = []
    left = np.ones(len(_TIME_S))
    for most in (0.75 * _CRITICAL, 0.95 * _CRITICAL, above):
        result = FibreBundle(FIBRES).response(ramp(most), RATE, seed=3)
        left = 1.0 - np.cumsum(result.failures) / FIBRES
        shown = result.strain < 4.0
        time_s = _TIME_S[shown]
        named = f"terminal load {most:.0f}, {most / _CRITICAL:.2f} of {_CRITICAL:.0f}"
        drawings.append(Drawing(named, "time, s", "surviving fibres, of all", (series("", time_s, left[shown]),)))
        threshold = series("threshold", time_s, result.threshold[shown], colour="events")
        strain = series("strain", time_s, result.strain[shown], colour="force")
        drawings.append(Drawing(named, "time, s", "strain", (threshold, strain)))
    return Figure(
        "7.5",
        "A bundle of 2000 fibres under ramps",
        tuple(drawings),
        (
            Compared(
                "collapse of the overloaded bundle: imposed", f"{_COLLAPSE_S} s", f"{_TIME_S[left < 0.5][0]:.3f} s"
            ),
            Compared("terminal load that was chosen for it", "above 2800", f"{above:.0f}"),
        ),
        "The thesis prints neither its terminal loads nor m, b_F and b_R. With m = 0.001, b_F = 0.0065 and b_R = 0 the "
        "third load is chosen so that half of the fibres are gone after 0.68 s: the time is imposed, and the load is "
        "what is found.",
    )


def strengths(quick: bool) -> Figure:
    """Draw figure 7.6: stress over strain for the two models, with 95 % of the bundles, and their critical loads."""
    count = 60 if quick else 200
    at = np.linspace(0.02, 2.6, 130)
    drawings = []
    for model, name, colour in _MODELS:
        bundle = FibreBundle(FIBRES, model=model)
        curves = np.array([_stress_at(at, bundle.response(ramp(3000.0), RATE, seed)) for seed in range(count)])
        mean, spread = curves.mean(axis=0), 1.96 * curves.std(axis=0)
        load = critical(model, 4 * count)
        lines = (
            series(name, at, mean, colour=colour),
            series("95 % of the bundles", at, mean + spread, "dashed", "alarm"),
            series("", at, mean - spread, "dashed", "alarm"),
            series(f"critical load {load:.0f}", [at[0], at[-1]], [load] * 2, "dashed", "muted"),
        )
        drawings.append((Drawing(f"{name}, mean of {count}", "strain", "stress borne", lines), load))
    (exact, mean_of), quasi = (found for _, found in drawings), FibreBundle(FIBRES).critical_stress
    return Figure(
        "7.6",
        "Stress over strain, and critical loads",
        tuple(drawing for drawing, _ in drawings),
        (
            Compared("critical load, M", "2800", f"{exact:.0f}"),
            Compared("critical load, M-bar", "2850 (caption also 2900)", f"{mean_of:.0f}"),
            Compared("M-bar over M", "less than 2 % apart", f"{100.0 * (mean_of / exact - 1.0):.1f} %"),
            Compared("quasi-static, an endless bundle", "not given", f"{quasi:.1f}"),
        ),
        "Caption and text of the thesis disagree (2900 or 2850 for M-bar); ours are for m = 0.001, b_F = 0.0065 and "
        "b_R = 0, which are not printed, and carry some 50 above the quasi-static load because the ramp does not wait.",
    )


def intervals(quick: bool) -> Figure:
    """Draw figure 7.7: the times between failures."""
    count = 40 if quick else 200
    lines, rows = [], []
    for model, name, colour in _MODELS:
        bundle = FibreBundle(FIBRES, model=model)
        gaps = np.concatenate([np.diff(bundle.response(ramp(_ABOVE), RATE, seed).event_s) for seed in range(count)])
        at, found = density(gaps, np.geomspace(3e-5, 0.2, 40))
        lines.append(series(name, at, found, "dots", colour))
        rows.append(Compared(f"slope from 2 to 30 ms, {name}", "about -1.6 to -2.3", f"{slope(gaps, 2e-3, 3e-2):.2f}"))
    return Figure(
        "7.7",
        f"Times between failures, {count} bundles of 2000",
        (Drawing("Times between failures", "interval, s", "density, 1/s", tuple(lines), x_log=True, y_log=True),),
        tuple(rows),
        "The thesis's slopes are read off its picture; as there, the models differ only at short, frequent intervals.",
    )


def energies(quick: bool) -> Figure:
    """Draw figure 7.8: the energy released in windows of 5 ms."""
    count = 40 if quick else 200
    lines, rows, one = [], [], None
    for model, name, colour in _MODELS:
        bundle = FibreBundle(FIBRES, model=model)
        found = [windows(bundle.response(ramp(_ABOVE), RATE, seed)) for seed in range(count)]
        one = one if one is not None else found[0]
        every = np.concatenate(found)
        every = every[every > 0.0]
        at, dense = density(every, np.geomspace(every.min(), every.max() * 1.001, 30))
        lines.append(series(name, at, dense, "dots", colour))
        rows.append(Compared(f"slope from 3 to 300, {name}", "falls as a power law", f"{slope(every, 3.0, 300.0):.2f}"))
    assert one is not None
    inset = series("", WINDOW_S * np.arange(one.size), one)
    return Figure(
        "7.8",
        f"Energy of failures in windows of 5 ms, {count} bundles of 2000",
        (
            Drawing("Energy in a window", "energy, k_F x^2", "density", tuple(lines), x_log=True, y_log=True),
            Drawing("One bundle", "time, s", "energy in a window, k_F x^2", (inset,)),
        ),
        tuple(rows),
        "The load goes to 2900, where every bundle breaks: short of that there is no approach to failure and no power "
        "law; energies are the thesis's k_F x^2, twice what a spring holds.",
    )


def played(quick: bool) -> Figure:
    """Draw figure 7.15: 350 fibres under a foot, played through ten modes."""
    bundle = FibreBundle(350, mass=1e-5, damping=0.003)
    force, load = footstep(bundle)
    result = bundle.response(load, RATE, seed=2)
    draw = np.random.default_rng(4)
    frequencies = np.sort(draw.uniform(150.0, 2_500.0, 10))
    modes = frequencies, 0.15 * frequencies, (frequencies / 150.0) ** -0.5
    ringing = bank.ring(*modes, np.sqrt(result.energy), RATE)
    bands = (150.0, 300.0, 600.0, 1200.0, 2500.0)
    events = result.event_s
    first = int(events[0] * RATE)
    part = slice(first - 100, first + 1100)
    return Figure(
        "7.15",
        "A bundle of 350 fibres in real time, heard through ten modes",
        (
            Drawing("Force in", "time, s", "force, N", (series("", _TIME_S, force, colour="force"),)),
            Drawing(
                "Strain and threshold",
                "time, s",
                "strain",
                (
                    series(
                        "threshold",
                        _TIME_S,
                        np.where(np.isfinite(result.threshold), result.threshold, np.nan),
                        colour="events",
                    ),
                    series("strain", _TIME_S, result.strain, colour="force"),
                ),
            ),
            Drawing("Level in octaves", "time, s", "level, dB", tuple(_levels(ringing, bands))),
            Drawing(
                "The first failure",
                "time, ms",
                "vibration",
                (series("", 1e3 * (_TIME_S[part] - _TIME_S[part][0]), ringing[part]),),
            ),
        ),
        (Compared("fibres that failed", "not given", f"{int(result.failures.sum())} in {events.size} events"),),
        "The thesis prints neither load nor modes; the spectrogram is drawn as levels in four octaves.",
    )


def footstep(bundle: FibreBundle) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the force of a step in N, and the load by it whose peak is 97 % of a bundle's quasi-static strength."""
    walker = gait.Walker(variation=0.0)
    step = gait.Footfall("left", 0.1, walker.contact_s, 0.0, 0.0, 0.0, 0.26, 770.0, 504.0, 840.0)
    force = step.force_n(_TIME_S)
    return force, 0.97 * bundle.critical_stress * force / force.max()


def windows(result: Fracture) -> NDArray[np.float64]:
    """Return the energy k_F x^2 released in each window of 5 ms."""
    frames = round(WINDOW_S * RATE)
    return 2.0 * result.energy[: result.energy.size // frames * frames].reshape(-1, frames).sum(axis=1)


def _load_that_collapses_at(time_s: float) -> float:
    """Return the terminal load under which half of the fibres are broken after `time_s`."""
    low, high = _CRITICAL, 3.0 * _CRITICAL
    while high - low > 1.0:
        middle = 0.5 * (low + high)
        gone = np.cumsum(FibreBundle(FIBRES).response(ramp(middle, time_s), RATE, seed=3).failures)[-1] > FIBRES // 2
        low, high = (low, middle) if gone else (middle, high)
    return high


def _stress_at(at: NDArray[np.float64], result: Fracture) -> NDArray[np.float64]:
    """Return the load of the intact fibres when the strain first reaches each of `at`."""
    intact = FIBRES - np.cumsum(result.failures)
    first = np.searchsorted(np.maximum.accumulate(result.strain), at)
    first = np.minimum(first, result.strain.size - 1)
    return np.maximum(intact[first], 0) * at


def critical(model: str, count: int) -> float:
    """Return the terminal load at which half of the bundles, of `count`, or the mean one, collapse within a second."""
    low, high, bundle = 2650.0, 2950.0, FibreBundle(FIBRES, model=model)
    if model == "exact":
        most = low + (high - low) * (np.arange(count) + 0.5) / count
        broken = [bundle.response(ramp(m), RATE, seed=s).failures.sum() == FIBRES for s, m in enumerate(most)]
        return float(high - (high - low) * np.mean(broken))
    while high - low > 0.25:  # the mean bundle keeps its last fibre: far beyond its thresholds it has collapsed
        middle = 0.5 * (low + high)
        gone = bundle.response(ramp(middle), RATE).strain[-1] > 3.0 * SCALE
        low, high = (low, middle) if gone else (middle, high)
    return high


def _levels(ringing: NDArray[np.float64], edges: Sequence[float]) -> Iterator[Series]:
    """Yield levels in bands, in windows of 10 ms, relative to the loudest."""
    frames = RATE // 100
    parts = ringing[: ringing.size // frames * frames].reshape(-1, frames) * np.hanning(frames)
    power = np.abs(np.fft.rfft(parts, axis=1)) ** 2
    hz = np.fft.rfftfreq(frames, 1.0 / RATE)
    time_s = (np.arange(len(parts)) + 0.5) * frames / RATE
    for low, high, colour in zip(edges[:-1], edges[1:], ("force", "vibration", "events", "contact"), strict=True):
        band = power[:, (hz >= low) & (hz < high)].sum(axis=1)
        level = 10.0 * np.log10(np.maximum(band, 1e-8 * power.sum(axis=1).max()) / power.sum(axis=1).max())
        yield series(f"{low:.0f} to {high:.0f} Hz", time_s, level, colour=colour)
