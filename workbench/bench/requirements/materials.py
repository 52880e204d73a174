"""Requirements on materials, slipping ground and fibre bundles: run time, statistics, strength."""

import math
from collections.abc import Callable, Iterable, Iterator

import numpy as np

from underfoot.bench.accuracy import relative_error
from underfoot.bench.figures import fracture
from underfoot.bench.requirements.requirement import Requirement, Timing
from underfoot.bench.timing import Run
from underfoot.models.elasto_plastic import Ground
from underfoot.models.fibre_bundle import bundle
from underfoot.models.fibre_bundle.bundle import FibreBundle
from underfoot.models.fibre_bundle.damage import COEFFICIENTS
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key

RATE = 48_000
SHAPE, SCALE = 4.0, 2.5
"""Weibull parameters of the thesis's thresholds."""
_BEST_MS = {2_000: 0.21, 100_000: 0.79, 10_000_000: 1.47}
"""Best times seen in ms of a second under a footstep, by the number of fibres."""


def requirements(quick: bool) -> Iterable[Requirement]:
    """Yield the rows of elasto-plastic slip and of fibre bundles."""
    yield from slips()
    yield from thresholds()
    yield from quasi_static(400 if quick else 4000)
    yield from _dynamic(400 if quick else 4000)


def timings() -> Iterator[Timing]:
    """Yield the cost of a second of a bundle under a foot."""
    for fibres, best_ms in _BEST_MS.items():
        second = Run(_second_of(fibres))
        yield Timing("bundles", f"a second under a foot, {fibres:.0e} fibres", second, "ms", 1e3, best_ms)


def slips() -> Iterator[Requirement]:
    """Yield the error of the motion between slips, and the chance of the energies of slips under a slow ramp."""
    from scipy import signal, stats

    force = np.cumsum(np.random.default_rng(1).standard_normal(RATE // 10))
    moved = Ground(threshold_n=1e9).response(force, RATE).displacement_m
    system = ([1.0], [0.5, 400.0, 8e5])
    exact = signal.lsim(system, np.append(0.0, force), np.arange(force.size + 1) / RATE)[1][1:]
    yield Requirement("slip", "error of the motion between slips", relative_error(moved, exact), high=1e-9)
    # The plastic unit holds more than the largest draw, and the ramp is so slow that no frame has two slips.
    least, most = 1e-5, 1e-3
    ramp = np.linspace(0.0, 1e3, 20 * RATE)
    energy = Ground(threshold_n=100.0, gamma=1.5, least_j=least, most_j=most).response(ramp, RATE).energy_j
    chances = (least**-0.5 - energy**-0.5) / (least**-0.5 - most**-0.5)
    chance = float(stats.kstest(chances, "uniform").pvalue)
    yield Requirement("slip", "chance of such energies, if of E^-1.5", chance, low=1e-3)


def _second_of(fibres: int) -> Callable[[], None]:
    """Return a function that runs a second under a footstep whose peak is near the bundle's strength."""
    up = np.clip(np.arange(RATE) / RATE / 0.75, 0.0, 1.0)
    step = np.sin(np.pi * up) * (1.0 + 0.35 * np.cos(4.0 * np.pi * (up - 0.25))) * (up < 1.0)
    load = 1.30 * fibres * step / step.max()
    coefficients, events = COEFFICIENTS.zeros(), event_list(room=RATE)
    motion = bundle.Motion(*np.empty((3, RATE)), *np.empty((2, 0)))
    FibreBundle(fibres, SHAPE, SCALE, 1.0, 1e-5, 0.003, renewal_s=10.0).design(RATE, 1.0, coefficients)
    coefficients.loudness, coefficients.softness, coefficients.holds = (0.5 * SCALE**2) ** -0.5, 0.5, 1.0
    key = stream_key(1, "bench")

    def second() -> None:
        events.count = 0.0
        bundle.run(load, key, 0, coefficients, bundle.STATE.zeros(), motion, events)

    return second


def thresholds() -> Iterator[Requirement]:
    """Test that under a slow load, nearly one fibre per frame, the strains at failure are the sorted thresholds."""
    from scipy import stats

    still = FibreBundle(10_000, SHAPE, SCALE, mass=0.0, damping=0.0)
    found = still.response(np.linspace(0.0, 1.37e4, 4_000_000), 1e6)
    strain = np.repeat(found.strain, found.failures)
    below = -np.expm1(-((strain[-1] / SCALE) ** SHAPE))
    chances = -np.expm1(-((strain / SCALE) ** SHAPE)) / below
    chance = float(stats.kstest(chances, "uniform").pvalue)
    yield Requirement("bundles", "chance of such thresholds, if Weibull", chance, low=1e-3)


def quasi_static(samples: int) -> Iterator[Requirement]:
    """Yield the strength of a bundle of 2000 fibres: exact, and its mean and deviation over `samples` drawn bundles."""
    yield Requirement(
        "bundles", "quasi-static strength of 2000", FibreBundle(2000).critical_stress, "", 2753.45, 2753.55
    )
    # So slow near the end that less than 1 is added while a bundle collapses.
    slow = np.concatenate((np.linspace(0.0, 2620.0, 500, endpoint=False), np.arange(2620.0, 2920.0, 0.006)))
    found = np.empty(samples)
    for seed in range(samples):
        failed = FibreBundle(2000, mass=0.0, damping=0.0).response(slow, 1000.0, seed).failures
        found[seed] = slow[np.flatnonzero(np.cumsum(failed) < 1000)[-1]]
    off = 1.0 + 4.0 * 32.0 / math.sqrt(samples)
    text = f"of {samples} exact bundles"
    yield Requirement("bundles", f"mean strength {text}", float(found.mean()), "", 2766.0 - off, 2766.0 + off)
    yield Requirement("bundles", f"deviation of the strength {text}", float(found.std()), "", 32.0 - off, 32.0 + off)


def _dynamic(samples: int) -> Iterator[Requirement]:
    """Test the thesis's ramp: 0.8 s of 1 s, m 1e-3, b_F 0.0065, b_R 0."""
    off = 6.0 + 4.0 * math.sqrt(18.0 * 300.0 / samples)  # 2804 is from 200 loads; 18: integral of p (1 - p)
    exact, mean = (fracture.critical(model, samples) for model in ("exact", "mean"))
    what = "strength under the thesis's ramp"
    yield Requirement("bundles", f"{what}, exact", exact, "", 2804.0 - off, 2804.0 + off)
    yield Requirement("bundles", f"{what}, mean", mean, "", 2842.0, 2848.0)
