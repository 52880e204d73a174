"""Run time against error: every model over its accuracy parameter, beside naive implementations, in one run."""

import math
from collections.abc import Callable, Iterable
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from underfoot.bench import naive, rows
from underfoot.bench.method_comparison import Comparison, Method, Task, measured
from underfoot.kernels import Floats
from underfoot.models.elasto_plastic import Ground
from underfoot.models.fibre_bundle.bundle import FibreBundle
from underfoot.models.filtering import second_order
from underfoot.models.modal import bank, hammer
from underfoot.models.modal.impact import Hammer, ModalObject, strike
from underfoot.models.signals import envelopes, noise, waveshaping
from underfoot.models.signals.random import stream_key
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.sample_paths import paths
from underfoot.models.stick_slip.slip_distribution import SlipDistribution

RATE = 48_000
HAMMER, DAMPING_S_M = (0.02, 1.0), 0.3
"""Mass (kg) and velocity (m/s) of the hammer of all blows, and the damping of its contacts."""
CONTACTS = {"soft": (1e4, 1.5), "medium": (1e7, 1.5), "hard": (1e11, 1.8)}
"""Stiffness in N/m^a and exponent a."""

Times = TypeVar("Times", float, NDArray[np.float64])


def run(quick: bool = False, progress: Callable[[str], None] = lambda line: None) -> list[Comparison]:
    """Measure every task. With `quick`, signals are shorter, values fewer, and each point has one or two runs."""
    found = []
    for make in TASKS:
        for task in make(quick):
            progress(f"accuracy: {task.model}, {task.task}")
            found.append(measured(task, 0.05 if quick else 1.0))
    return found


def relative_error(result: NDArray[np.float64], truth: NDArray[np.float64]) -> float:
    """Return the L2 norm of the difference, relative to that of the truth."""
    return float(np.linalg.norm(result - truth) / np.linalg.norm(truth))


def impacts(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for the hammer of docs/models.md#impacts on ten modes."""
    for name in CONTACTS:
        yield blow(name, 960 if quick else 2400)


def drawn_modes(count: int) -> ModalObject:
    """Return frequencies, decays, masses and shapes of the struck object, slow decays first.

    >>> frequencies, decays, masses, shapes = drawn_modes(10)
    >>> bool((np.diff(decays) > 0.0).all()), frequencies.size
    (True, 10)
    """
    draw = np.random.default_rng(3)
    frequencies = np.sort(draw.uniform(50.0, 5_000.0 if count <= 10 else 15_000.0, count))
    decays = draw.uniform(5.0, 80.0, count)
    masses, shapes = 0.1 * draw.uniform(0.3, 2.0, count), draw.uniform(0.3, 1.0, count)
    order = np.argsort(decays)
    return ModalObject(frequencies[order], decays[order], masses[order], shapes[order])


def blow(name: str, frames: int) -> Task:
    """Return the comparison of methods for a blow on ten modes, with one of `CONTACTS`."""
    by, struck, times = Hammer(*HAMMER, *CONTACTS[name], DAMPING_S_M), drawn_modes(10), np.arange(frames) / RATE
    truth = naive.struck_object(by, struck, times, "DOP853", 1e-11, 0.25 / RATE)

    def by_substeps(substeps: float) -> NDArray[np.float64]:
        numbers = {"mass": by.mass_kg, "stiffness": by.stiffness, "exponent": by.exponent, "damping": by.damping_s_m}
        row = rows.hit(struck, RATE, [(0.0, by.velocity_m_s)], **numbers, substeps=substeps)
        out = hammer.Response(np.empty(frames), np.empty(frames), np.empty(frames))
        hammer.ring(row.events, row.hammer, 0, row.object, row.state, out)
        return out.displacement

    return Task(
        "impact",
        f"{name} blow on 10 modes, {frames / RATE * 1e3:.0f} ms",
        "relative L2 of the displacement against DOP853 at 1e-11",
        lambda result, _: relative_error(result, truth),
        [
            Method(
                "impact.strike",
                "error asked",
                (1e-1, 1e-2, 1e-4, 1e-6, 1e-8),
                lambda error: strike(by, struck, frames / RATE, RATE, error).displacement_m,
            ),
            Method("hammer.ring", "sub-steps a frame", (1, 2, 4, 8, 16, 32), by_substeps),
            Method(
                "solve_ivp RK45",
                "tolerance",
                (1e-4, 1e-6, 1e-8),
                lambda tolerance: naive.struck_object(by, struck, times, "RK45", tolerance),
                naive=True,
            ),
        ],
    )


def modes(count: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Draw modes with frequencies in eighths of a hertz, so that phases after many frames are known exactly."""
    count = int(count)
    draw = np.random.default_rng(count)
    frequencies = np.round(8.0 * np.exp(draw.uniform(np.log(20.0), np.log(20_000.0), count))) / 8.0
    return frequencies, np.sort(draw.uniform(0.5, 20.0, count)), draw.normal(size=count)


def _poles_to(f: float, b: float, frames: NDArray[np.int64]) -> NDArray[np.complex128]:
    """Return exp((-b + 2 pi i f) frames / rate), with the angle reduced before it is rounded."""
    return np.exp(-b * frames / RATE + 2j * np.pi * (f * frames % RATE / RATE))


def modal_banks(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for a bank of modes: after strikes, and after a step, against closed forms."""
    frames = RATE if quick else 10 * RATE
    last = np.arange(frames - 1000, frames)
    strikes = np.zeros(frames)
    strikes[::4800] = 1.0
    counts = (10, 64, 200)

    def after_strikes(count: float) -> NDArray[np.float64]:
        return sum(
            a * _poles_to(f, b, last - at).imag
            for f, b, a in zip(*modes(count), strict=True)
            for at in np.flatnonzero(strikes)
            if at < last[0]
        )

    def after_a_step(count: float) -> NDArray[np.float64]:
        return sum(
            a * ((1.0 - _poles_to(f, b, last + 1)) / (1.0 - _poles_to(f, b, np.array([1])))).imag
            for f, b, a in zip(*modes(count), strict=True)
        )

    yield _bank("a strike each 0.1 s", strikes, {count: after_strikes(count) for count in counts})
    yield _bank("driven in every frame", np.ones(frames), {count: after_a_step(count) for count in counts})


def _bank(what: str, signal: NDArray[np.float64], truths: dict[float, NDArray[np.float64]]) -> Task:
    """Return the comparison of methods for banks that this signal drives; `truths` are their ends, by the modes."""
    return Task(
        "modal",
        f"{what}, {len(signal) // RATE} s",
        "relative L2 of the last 1000 frames against the closed form",
        lambda result, count: relative_error(result[-1000:], truths[count]),
        [
            Method("modal.ring", "modes", tuple(truths), lambda count: bank.ring(*modes(count), signal, RATE)),
            Method(
                "lfilter, mode by mode",
                "modes",
                tuple(truths),
                lambda count: naive.filter_per_mode(*modes(count), signal, RATE),
                naive=True,
            ),
        ],
    )


def tones(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for a tone of 50 Hz with up to 60 harmonics, against sines."""
    frames = RATE if quick else 10 * RATE
    at = np.arange(frames)
    counts = (1, 3, 10, 30) if quick else (1, 3, 10, 30, 60)

    def amplitudes(count: float) -> NDArray[np.float64]:
        return 1.0 / np.arange(1.0, count + 1.0)

    turns = 50 * at[:, None] * np.arange(1, counts[-1] + 1) % RATE / RATE
    sines = np.cumsum(np.sin(2.0 * np.pi * turns) * amplitudes(counts[-1]), axis=1)
    truths: dict[float, NDArray[np.float64]] = {n: sines[:, n - 1] for n in counts}
    yield Task(
        "waveshaping",
        f"a tone of 50 Hz, {frames // RATE} s",
        "relative L2 against sines of exactly reduced phases",
        lambda result, count: relative_error(result, truths[count]),
        [
            Method(
                "waveshaping.tone",
                "harmonics",
                counts,
                lambda n: waveshaping.tone(50.0, amplitudes(n), frames / RATE, RATE),
            ),
            Method(
                "sum of sines",
                "harmonics",
                counts,
                lambda n: naive.sum_of_sines(50.0, amplitudes(n), frames, RATE),
                naive=True,
            ),
        ],
    )


def bundles(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for a bundle under a slow ramp to 95 % of its critical load.

    An infinite bundle follows load / N = x exp(-(x / scale)^shape).
    """
    shape, scale = 4.0, 2.5
    share = np.linspace(0.0, 0.95, RATE)
    critical = FibreBundle(1, shape, scale).critical_stress
    truth = np.zeros(RATE)
    for _ in range(200):
        truth = share * critical * np.exp((truth / scale) ** shape)
    counts = (2e3, 2e4, 2e5) if quick else (2e3, 2e4, 2e5, 2e6, 1e7)

    def strain(model: str, count: float) -> NDArray[np.float64]:
        bundle = FibreBundle(int(count), shape, scale, mass=0.0, damping=0.0, model=model)
        return bundle.response(share * bundle.critical_stress, RATE).strain

    def first(method: Callable[..., NDArray[np.float64]]) -> Callable[[float], NDArray[np.float64]]:
        return lambda count: method(share * critical * count, int(count), shape, scale, 0)

    yield Task(
        "fracture",
        "strain of a bundle loaded to 95 % in 1 s",
        "relative L2 against an endless bundle: falls as 1/sqrt(N) by nature",
        lambda result, _: relative_error(result, truth),
        [
            Method("FibreBundle.response", "fibres", counts, partial(strain, "exact")),
            Method("FibreBundle.response, mean", "fibres", counts[:1], partial(strain, "mean")),
            Method("sorting fibres", "fibres", counts, first(naive.sorted_fibres), naive=True),
            Method("scanning fibres", "fibres", counts[: 1 if quick else 2], first(naive.scanned_fibres), naive=True),
        ],
    )


def _slip_force(times: Times) -> Times:
    return 1500.0 * np.sin(np.pi * times / 0.4) ** 2


def _slips_solved(times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the displacement of ground that slips by 5 mJ whenever its plastic unit reaches 100 N, by DOP853."""
    from scipy.integrate import solve_ivp

    plastic, place, begin, state = 4e5, 0.0, 0.0, np.zeros(2)
    out = np.zeros(times.size)
    while begin < times[-1]:

        def motion(t: float, y: NDArray[np.float64], place: float = place) -> list[float]:
            return [y[1], (_slip_force(t) - 400.0 * y[1] - 4e5 * y[0] - plastic * (y[0] - place)) / 0.5]

        def reaches(t: float, y: NDArray[np.float64], place: float = place) -> float:
            return plastic * (y[0] - place) - 100.0

        reaches.terminal, reaches.direction = True, 1.0  # type: ignore[attr-defined]
        inside = times >= begin
        part = solve_ivp(
            motion, (begin, times[-1]), state, "DOP853", dense_output=True, events=reaches, rtol=1e-11, atol=1e-15
        )
        assert part.sol is not None
        out[inside] = part.sol(np.minimum(times[inside], part.t[-1]))[0]
        begin, state = float(part.t[-1]), part.y[:, -1]
        place += 2.0 * 5e-3 / (100.0 + math.sqrt(100.0**2 - 2.0 * plastic * 5e-3))
    return out


def slips(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for ground that slips under a push, against a solver from slip to slip."""
    times = np.arange(200) / 1000.0
    truth = _slips_solved(times)

    def slip(rate: float) -> NDArray[np.float64]:
        frames = np.arange(int(0.2 * rate)) / rate
        moved = Ground(least_j=5e-3, most_j=5e-3).response(_slip_force(frames), rate).displacement_m
        return moved[:: int(rate) // 1000]

    def euler(rate: float) -> NDArray[np.float64]:
        frames = np.arange(int(0.2 * rate)) / rate
        moved = np.empty(frames.size)
        naive.slip_by_euler(_slip_force(frames), 1.0 / rate, Ground().parameters(), 5e-3, moved)
        return moved[:: int(rate) // 1000]

    rates = (12e3, 48e3, 192e3, 1536e3)
    yield Task(
        "plasticity",
        "displacement of ground that slips, 0.2 s",
        "relative L2 at each ms against DOP853 from slip to slip; a slip late by a frame may miss its ms",
        lambda result, _: relative_error(result, truth),
        [
            Method("Ground.response", "rate, Hz", rates, slip),
            Method("semi-implicit Euler", "rate, Hz", rates, euler, naive=True),
        ],
    )


def frictions(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for how long a block on a belt slips, against the distribution at 1e-6."""
    block, t_end = BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, -1.0), 20.0  # thesis, figure 8.6
    reference = SlipDistribution.solve(block, t_end, error=1e-6).duration

    def error(result: tuple[Floats, Floats], _: float) -> float:
        at, cdf = result
        return float(np.abs(cdf - reference.cdf_at(at)).max())

    def solved(error_limit: float) -> tuple[Floats, Floats]:
        found = SlipDistribution.solve(block, t_end, error=error_limit).duration
        return found.points, found.cdf

    def counted(durations: Floats) -> tuple[Floats, Floats]:
        at = np.linspace(0.0, 20.0, 2001)[:-1]
        return at, np.searchsorted(np.sort(durations), at, side="right") / durations.size

    def euler(step: float) -> tuple[Floats, Floats]:
        durations = np.empty(20_000 if quick else 200_000)
        naive.slips_by_euler_maruyama(block, t_end, step, np.random.default_rng(1), durations)
        return counted(durations)

    yield Task(
        "friction",
        "distribution of the slip duration, thesis figure 8.6",
        "largest CDF difference against the distribution at 1e-6; paths add about 1/sqrt(their number)",
        error,
        [
            Method(
                "friction.first_passage",
                "error asked",
                (1e-2, 1e-3, 1e-4) if quick else (1e-2, 1e-3, 1e-4, 1e-5),
                solved,
            ),
            Method(
                "friction.paths",
                "paths",
                (1e3, 1e4, 1e5) if quick else (1e3, 1e4, 1e5, 1e6),
                lambda n: counted(paths(block, t_end, count=int(n), seed=1).duration),
            ),
            Method(
                "Euler-Maruyama", "step, s", (0.1, 0.03, 0.01) if quick else (0.1, 0.03, 0.01, 0.002), euler, naive=True
            ),
        ],
    )


def noises(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for band-limited noise, whose RMS should be 1."""
    lengths = (0.1, 1.0, 10.0) if quick else (0.1, 1.0, 10.0, 100.0)

    def band(seconds: float) -> list[float]:
        rms: list[float] = []
        coefficients = noise.BAND_COEFFICIENTS.zeros()
        noise.design_band(noise.LOW_HZ, noise.HIGH_HZ, float(RATE), coefficients)
        for seed in range(8):
            y = np.empty(round(seconds * RATE))
            noise.run_band(stream_key(seed, "bench"), 0, coefficients, noise.BAND_STATE.zeros(), y)
            rms.append(float(y.std()))
        return rms

    def filtered(seconds: float) -> list[float]:
        from scipy.signal import butter, sosfilt

        sections = butter(2, (noise.LOW_HZ, noise.HIGH_HZ), "bandpass", fs=RATE, output="sos")
        gain = 1.0 / np.linalg.norm(sosfilt(sections, np.eye(1, RATE)[0]))
        return [
            gain * sosfilt(sections, np.random.default_rng(seed).standard_normal(round(seconds * RATE))).std()
            for seed in range(8)
        ]

    yield Task(
        "noise",
        "band-limited noise of unit RMS, 8 streams",
        "RMS difference of the streams' RMS from 1: falls as 1/sqrt(length) by nature",
        lambda result, _: float(np.sqrt(np.mean((np.array(result) - 1.0) ** 2))),
        [
            Method("noise.run_band", "seconds", lengths, band),
            Method("normal draws, sosfilt", "seconds", lengths, filtered, naive=True),
        ],
    )


def strain_rates(quick: bool) -> Iterable[Task]:
    """Yield the comparison of methods for the strain rate of soft tissue under a footstep, against a solver."""
    from scipy.integrate import solve_ivp

    w0, mass = 2.0 * math.pi * envelopes.STRAIN_HZ, envelopes.STRAIN_MASS_KG
    times = np.arange(600) / 1000.0

    def force(t: Times) -> Times:
        return 700.0 * np.sin(np.pi * t / 0.6) ** 2

    def motion(t: float, y: NDArray[np.float64]) -> list[float]:
        return [y[1], force(t) / mass - 2.0 * w0 * y[1] - w0 * w0 * y[0]]

    truth = solve_ivp(motion, (0.0, 0.6), [0.0, 0.0], "DOP853", times, rtol=1e-12, atol=1e-15).y[1]

    def strain_rate(rate: float) -> NDArray[np.float64]:
        push = force(np.arange(int(0.6 * rate)) / rate)
        coefficients, out = second_order.COEFFICIENTS.zeros(), np.empty(push.size)
        envelopes.design_strain_rate(envelopes.STRAIN_HZ, envelopes.STRAIN_DAMPING, mass, rate, coefficients)
        second_order.run(push, coefficients, second_order.STATE.zeros(), out)
        return out[:: int(rate) // 1000]

    def euler(rate: float) -> NDArray[np.float64]:
        push = force(np.arange(int(0.6 * rate)) / rate)
        out = np.empty(push.size)
        naive.strain_rate_by_euler(push, 1.0 / rate, w0, envelopes.STRAIN_DAMPING, mass, out)
        return out[:: int(rate) // 1000]

    rates = (8e3, 48e3, 96e3, 192e3)
    yield Task(
        "envelopes",
        "strain rate under a footstep, 0.6 s",
        "relative L2 at each ms against DOP853",
        lambda result, _: relative_error(result, truth),
        [
            Method("envelopes.design_strain_rate", "rate, Hz", rates, strain_rate),
            Method("semi-implicit Euler", "rate, Hz", rates, euler, naive=True),
        ],
    )


TASKS = (impacts, modal_banks, tones, bundles, slips, frictions, noises, strain_rates)
