"""Fracture: bundles of fibres that break, or of force chains that restructure, one random threshold after another.

The bundle moves by (7.1), `sigma = A (b_F x' + k_F x) + N (b_R x' + m x'')`; A is the number of intact fibres, or
the stiffness of the restructured chains. A fibre fails when the strain x passes its threshold; `damage`
draws which do.

Between failures the motion is exact for a load that is linear between frames. Failures act from the end of their
frame on, half a frame late on average. The mean models take the damage at the predicted middle of four frames:
second order where frames resolve the motion, first where they do not.

A renewal makes fresh ground: where the load has not been above 0 for the renewal time, the next load meets a new
bundle with new draws. Until then the damage stays, and no fibre fails below the strain that was reached before
(the Kaiser effect). A bundle that has wholly broken carries nothing, and (7.1) lets it fall without end: in real
time its strain is held instead until the renewal.

Real time: `run` for one tile, `rest`, `state_size`, `tuning_size`; `tune` and its two companions are in
`damage`. Offline: `bundle`, `critical_stress`.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers, seed_of, whole
from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.fibre_bundle.damage import (
    DRAWS,
    INVERSE_MEAN,
    KAPPA,
    LIMIT,
    MEAN,
    MODEL,
    MODELS,
    PRESSURE,
    RENEWAL,
    THRESHOLDS,
    TUNING_SIZE,
    bundle_step,
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


@dataclass(frozen=True)
class Fracture:
    """What a bundle did: one value a frame, shape [frames], and the times of its events."""

    strain: NDArray[np.float64]
    """Strain x at each frame."""
    failures: NDArray[np.int64]
    """Fibres that failed in each frame; of an inverse bundle, chains that restructured."""
    energy: NDArray[np.float64]
    """Energy set free in each frame: k_F x^2 / 2 a failure (errata, chapter 7)."""
    threshold: NDArray[np.float64]
    """Strain at which the next fibre fails, xi(t) of Fig. 7.5; infinite where none is left or drawn."""
    event_s: NDArray[np.float64]
    """Times in seconds of each frame's first failure, to a share of a frame."""


def bundle(
    stress: ArrayLike,
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
    restructurings: int = 20,
    stiffening: float = 0.005,
    compound: bool = False,
    renewal_s: float = math.inf,
) -> Fracture:
    """The response of a bundle of `fibres` to the whole load `stress` of (7.1), one value a frame at `rate` hertz.

    The load is linear between frames and 0 before the first. `stiffness` k_F, `mass` m, `damping` b_F and `creep`
    b_R are per fibre. `thresholds` are "weibull", with `shape` k and `scale` lambda (7.13), or "uniform" from 0
    to `scale`. `model` is

    - "exact": a failed fibre is gone (7.1 to 7.7);
    - "mean": the damage is its mean at the largest strain so far (7.8 to 7.10), the failures a Poisson process
      (errata 7.10);
    - "inverse": a failed chain is stiffer by the share `stiffening`, at most `restructurings` times (7.16 to
      7.20); `compound` takes (7.18), averaged over the chains, instead of its linear form (7.19);
    - "inverse_mean": the same with mean damage (7.21 to 7.24).

    Fresh ground forms after `renewal_s` seconds without load. A mass or damping so small that no frame could show
    it is raised to what settles within a frame. Raises `BadValue`.

    >>> ramp = np.linspace(0.0, 2000.0, 4800)  # below the critical stress of 2753.5
    >>> result = bundle(ramp, 48000.0, 2000, mass=0.0, damping=0.0)
    >>> round(result.strain[-1], 2), bool(30 < result.failures.sum() < 90)  # 2000 P(x) = 57
    (np.float64(1.02), True)
    """
    load = numbers("stress", stress)
    codes = require_bundle(rate, fibres, shape, scale, stiffness, mass, damping, creep, model, thresholds)
    require_inverse(restructurings, stiffening, renewal_s)
    tuning, state = np.zeros(TUNING_SIZE), np.zeros(state_size())
    tune(tuning, rate, *codes, *map(float, (fibres, shape, scale, stiffness, mass, damping, creep)))
    tune_inverse(tuning, restructurings, stiffening, compound)
    tune_contact(tuning, rate, 1.0, renewal_s, 1.0, 1.0, False)
    strain, failures, energy, threshold = np.zeros((4, load.size))
    events = np.zeros(3 * load.size)
    key = stream_key(seed_of(seed), "fracture")
    count = _run(state, tuning, key, 0, load, strain, events, failures, energy, threshold)
    return Fracture(strain, failures.astype(np.int64), energy, threshold, events[: 3 * count : 3] / rate)


def critical_stress(
    fibres: int, shape: float = 4.0, scale: float = 2.5, stiffness: float = 1.0, thresholds: str = "weibull"
) -> float:
    """The quasi-static critical stress of a large bundle: the largest of N (1 - P(x)) k_F x (errata, sigma_c).

    >>> round(critical_stress(2000), 1), critical_stress(2000, thresholds="uniform")
    (2753.5, 1250.0)
    """
    require_bundle(1.0, fibres, shape, scale, stiffness, 0.0, 0.0, 0.0, "exact", thresholds)
    if thresholds == "uniform":
        return fibres * stiffness * scale / 4.0
    return fibres * stiffness * scale * shape ** (-1.0 / shape) * math.exp(-1.0 / shape)


# The state; all zero is a fresh bundle at rest. WORN: 0 fresh, else 1 and the frames since the last load.
_STRAIN, _SPEED, _LOAD, _FAILED, _NEXT, _WORN, _PEAK, _WEARING = range(8)

#: Mean damage is renewed when the strain has come as far as it would in so many frames, for the middle of that way.
_WEAR_FRAMES = 4.0


def state_size() -> int:
    """Float64 values of one row's state.

    >>> state_size()
    8
    """
    return 8


def tuning_size() -> int:
    """Float64 values of one row's tuning.

    >>> tuning_size() == TUNING_SIZE
    True
    """
    return TUNING_SIZE


@kernel
def run(s, t, key, frame, load, strain, events):
    """One tile, `load.size` frames from session frame `frame` on: `load` in, `strain` out, both [frames].

    Events go to `events` (room for three values a frame: time, strength, duration 0), and their number is
    returned. `key` is the row's `stream_key(seed, node, tile)`; draws are numbered by the frame, so that no split
    and no sleep changes them. `load` is the value at the end of its frame; the failures lie within it.
    """
    return _run(s, t, key, frame, load, strain, events, strain[:0], strain[:0], strain[:0])


@kernel
def rest(s, t):
    """A bound of the strain's size if no load comes; infinite while worn ground waits for its renewal."""
    if s[_WORN] > 0.0:
        return math.inf
    return math.sqrt(s[_STRAIN] ** 2 + s[_SPEED] ** 2 / t[KAPPA])


@kernel
def _run(s, t, key, frame, load, strain, events, failures, energies, thresholds):
    """`run`, which besides fills the last three where they have frames."""
    x, w, before, worn = s[_STRAIN], s[_SPEED], s[_LOAD], s[_WORN]
    gradual = t[MODEL] == MEAN or t[MODEL] == INVERSE_MEAN
    breaking = threshold_strain(t, s[_NEXT]) if worn > 0.0 else math.inf
    wearing = s[_WEARING] if gradual and worn > 0.0 else math.inf
    c0, c1, c2, c3, c4, c5, c6, c7 = bundle_step(t, stiffness_left(t, s[_FAILED], s[_PEAK]))
    count = 0
    for i in range(load.size):
        after = min(max(t[PRESSURE] * load[i], -t[LIMIT]), t[LIMIT])
        if after > 0.0:
            if worn == 0.0:
                s[_NEXT] = first_hazard(t, key, (frame + i) * DRAWS, x)
                breaking = threshold_strain(t, s[_NEXT])
                wearing = 0.0 if gradual else math.inf
            worn = 1.0
        elif worn > 0.0:
            worn += 1.0
            if worn > t[RENEWAL]:
                worn = s[_FAILED] = s[_NEXT] = s[_PEAK] = 0.0
                breaking = wearing = math.inf
                c0, c1, c2, c3, c4, c5, c6, c7 = bundle_step(t, 1.0)
        if x + 0.5 * w > wearing:
            ahead = _WEAR_FRAMES * max(w, 0.0)
            s[_PEAK], wearing = x + 0.5 * ahead, x + ahead
            c0, c1, c2, c3, c4, c5, c6, c7 = bundle_step(t, stiffness_left(t, s[_FAILED], s[_PEAK]))
        moved = c0 * x + (c1 * w + (c2 * before + c3 * after))
        w = c5 * w + (c4 * x + (c6 * before + c7 * after))
        if moved > breaking:
            failed, s[_NEXT] = fail(t, key, (frame + i) * DRAWS, s[_NEXT], moved, s[_FAILED])
            s[_FAILED] += failed
            energy = energy_released(t, failed, moved)
            events[3 * count] = frame + i + crossing(x, moved, breaking)
            events[3 * count + 1] = event_strength(t, energy)
            events[3 * count + 2] = 0.0
            count += 1
            breaking = threshold_strain(t, s[_NEXT])
            if not gradual:
                c0, c1, c2, c3, c4, c5, c6, c7 = bundle_step(t, stiffness_left(t, s[_FAILED], 0.0))
            if failures.size:
                failures[i] = failed
                energies[i] = energy
        x, before = moved, after
        strain[i] = x
        if thresholds.size:
            thresholds[i] = breaking
    s[_STRAIN], s[_SPEED], s[_LOAD], s[_WORN] = x, w, before, worn
    s[_WEARING] = wearing if gradual and worn > 0.0 else 0.0
    return count


def require_bundle(
    rate: float,
    fibres: float,
    shape: float,
    scale: float,
    stiffness: float,
    mass: float,
    damping: float,
    creep: float,
    model: str,
    thresholds: str,
) -> tuple[int, int]:
    """Check what every bundle needs, and give the codes of its model and of its law of thresholds.

    >>> require_bundle(48000.0, 2000, 4.0, 2.5, 1.0, 1e-3, 0.0065, 0.0, "exact", "uniform")
    (0, 1)
    """
    number("rate", rate, TINY, HUGE, "above 0 Hz")
    whole("fibres", fibres, 1, 10**12, "1 to 1e12")
    number("shape", shape, 0.1, 50.0, "0.1 to 50")
    number("scale", scale, TINY, HUGE, "above 0")
    number("stiffness", stiffness, TINY, HUGE, "above 0")
    for name, value in (("mass", mass), ("damping", damping), ("creep", creep)):
        number(name, value, 0.0, HUGE, "0 or more")
    require(model in MODELS, "model", model, "one of " + ", ".join(MODELS))
    require(thresholds in THRESHOLDS, "thresholds", thresholds, "one of " + ", ".join(THRESHOLDS))
    return MODELS.index(model), THRESHOLDS.index(thresholds)


def require_inverse(restructurings: int, stiffening: float, renewal_s: float) -> None:
    """Check what an inverse bundle needs besides, and the renewal time.

    >>> require_inverse(20, 0.005, 0.25)
    """
    whole("restructurings", restructurings, 1, 10_000, "1 to 10000")
    number("stiffening", stiffening, 0.0, 10.0, "0 to 10")
    number("renewal_s", renewal_s, TINY, math.inf, "above 0 s")
