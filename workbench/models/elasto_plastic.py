"""Plasticity: the normal-force texture of a visco-elasto-plastic ground that slips (4.1, 5.4).

The surface obeys `F = m x'' + b x' + K (x - x0)` with K = k1 + k2 and x0 = k2 xi / K. When the force on the
plastic unit, `k2 (x - xi)`, passes a threshold (constant or drawn for each slip), xi jumps: an energy is drawn
from a truncated power law, p(E) ~ E^-gamma from E0 to E1, and turned into the displacement that sets it free
(errata 4.1). Time and energy of each slip are the model's output; what they sound like is another model's part.

The motion between slips is exact for a force that is linear between frames. A slip acts from the end of its frame
on. No slip takes more than the plastic unit holds, k2 (x - xi)^2 / 2: a larger draw is cut to that.

Without a force above 0 for the renewal time the ground springs back, and the next step meets fresh ground with
new draws. Until then xi stays, so that a load below the former largest one makes no slip.

Real time: `tune`, `run` for one tile, `rest`, `state_size`, `tuning_size`. Offline: `slip`.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers, seed_of
from underfoot.kernels import kernel
from underfoot.models.driven_oscillator import frame_step, resolved
from underfoot.models.fibre_bundle.damage import crossing
from underfoot.models.signals.random import stream_key, uniform


@dataclass(frozen=True)
class Slips:
    """What the ground did: two signals [frames], and one value a frame in which it slipped."""

    displacement_m: NDArray[np.float64]
    """Displacement x of the surface, shape [frames]."""
    plastic_m: NDArray[np.float64]
    """Plastic displacement xi, shape [frames]."""
    time_s: NDArray[np.float64]
    """Times of the slips, shape [slips]."""
    energy_j: NDArray[np.float64]
    """Energies that they set free, shape [slips]."""


def slip(
    force_n: ArrayLike,
    rate_hz: float,
    *,
    mass_kg: float = 0.5,
    damping_ns_m: float = 400.0,
    stiffness_n_m: float = 4e5,
    plastic_stiffness_n_m: float = 4e5,
    threshold_n: float = 100.0,
    spread: float = 0.0,
    gamma: float = 1.5,
    least_j: float = 1e-5,
    most_j: float = 1e-2,
    renewal_s: float = math.inf,
    seed: int = 0,
) -> Slips:
    """The response of elasto-plastic ground to `force_n`, one value a frame.

    The force is linear between frames and 0 before the first. `stiffness_n_m` is k1 and `plastic_stiffness_n_m`
    k2, both above 0; mass and damping are 0 or more, and raised to what settles within a frame where no frame
    could show them. The threshold of each slip lies evenly within `threshold_n` (1 +- `spread`), `spread` below
    1. `gamma` (0 to 10), `least_j` and `most_j` are the law of the energies. Several slips in one frame count as
    one, at the first one's time and with the sum of their energies. Raises `BadValue`.

    >>> result = slip(np.linspace(0.0, 500.0, 4800), 48000.0)
    >>> len(result.time_s) > 10, bool(result.energy_j.min() >= 1e-5)
    (True, True)
    """
    load = numbers("force_n", force_n)
    for name, value in (
        ("rate_hz", rate_hz),
        ("stiffness_n_m", stiffness_n_m),
        ("plastic_stiffness_n_m", plastic_stiffness_n_m),
        ("threshold_n", threshold_n),
        ("least_j", least_j),
    ):
        number(name, value, TINY, HUGE, "above 0")
    for name, value in (("mass_kg", mass_kg), ("damping_ns_m", damping_ns_m)):
        number(name, value, 0.0, HUGE, "0 or more")
    number("spread", spread, 0.0, math.nextafter(1.0, 0.0), "0 or more, below 1")
    number("gamma", gamma, 0.0, 10.0, "0 to 10")
    number("most_j", most_j, least_j, HUGE, f"least_j, {least_j}, or more")
    number("renewal_s", renewal_s, TINY, math.inf, "above 0 s")
    tuning, state = np.zeros(tuning_size()), np.zeros(state_size())
    tune(tuning, rate_hz, mass_kg, damping_ns_m, stiffness_n_m, plastic_stiffness_n_m, threshold_n, spread)
    tune_energy(tuning, gamma, least_j, most_j, most_j, 1.0)
    tune_renewal(tuning, rate_hz, renewal_s)
    displacement, plastic = np.zeros((2, load.size))
    events = np.zeros(3 * load.size)
    count = _run(state, tuning, stream_key(seed_of(seed), "slip"), 0, load, displacement, events, plastic)
    return Slips(displacement, plastic, events[: 3 * count : 3] / rate_hz, events[1 : 3 * count : 3])


# The state; all zero is fresh ground at rest. WORN: 0 fresh, else 1 and the frames since the last load.
_DISPLACEMENT, _SPEED, _LOAD, _PLASTIC, _THRESHOLD, _WORN = range(6)

# The tuning. KAPPA, GAMMA and GAIN are K, b and 1 over the mass, with time in frames.
(_KAPPA, _GAMMA, _GAIN, _PLASTIC_STIFFNESS, _MEAN_THRESHOLD, _SPREAD, _LEAST, _RANGE, _POWER) = range(9)
(_STRENGTH, _EXPONENT, _RENEWAL) = range(9, 12)

#: Slips of one frame, at most; the last one takes the plastic unit down to its threshold.
_MOST_SLIPS = 32

#: Draws that one frame may use: the counter of a draw is its frame times this, plus its number.
_DRAWS = 128
_FIRST_THRESHOLD = 127

#: Forces beyond this, in newtons, count as this: all that follows stays finite.
_LARGEST_FORCE = 1e12


def state_size() -> int:
    """Float64 values of one row's state.

    >>> state_size()
    6
    """
    return 6


def tuning_size() -> int:
    """Float64 values of one row's tuning.

    >>> tuning_size()
    12
    """
    return 12


@kernel
def tune(t, rate_hz, mass_kg, damping_ns_m, stiffness_n_m, plastic_stiffness_n_m, threshold_n, spread):
    """Fill the tuning `t` from the parameters of `slip`; `tune_energy` and `tune_renewal` follow.

    May be called at any time: a change acts from the next call of `run` on.
    """
    frame_s = 1.0 / rate_hz
    whole = stiffness_n_m + plastic_stiffness_n_m
    mass_kg, damping_ns_m = resolved(frame_s, whole, damping_ns_m, 0.0, mass_kg)
    t[_KAPPA] = whole * frame_s * frame_s / mass_kg
    t[_GAMMA] = damping_ns_m * frame_s / mass_kg
    t[_GAIN] = frame_s * frame_s / mass_kg
    t[_PLASTIC_STIFFNESS] = plastic_stiffness_n_m
    t[_MEAN_THRESHOLD] = threshold_n
    t[_SPREAD] = spread


@kernel
def tune_energy(t, gamma, least_j, most_j, strength, exponent):
    """After `tune`: the law of the energies, and an event's strength, `strength` (E / `most_j`)^`exponent`.

    The exponent 1/2 gives an impact's velocity, 1 its energy.
    """
    t[_LEAST] = least_j
    t[_RANGE] = math.log(most_j / least_j)
    t[_POWER] = 1.0 - gamma
    t[_STRENGTH] = strength * most_j**-exponent
    t[_EXPONENT] = exponent


@kernel
def tune_renewal(t, rate_hz, renewal_s):
    """After `tune`: the time without force to fresh ground, in seconds."""
    t[_RENEWAL] = renewal_s * rate_hz


@kernel
def run(s, t, key, frame, force_n, displacement_m, events):
    """One tile, `force_n.size` frames from session frame `frame` on: `force_n` in, `displacement_m` out, both [frames].

    Events go to `events` (room for three values a frame: time, strength, duration 0), and their number is
    returned. `key` is the row's `stream_key(seed, node, tile)`; draws are numbered by the frame, so that no split
    and no sleep changes them. `force_n` is the value at the end of its frame; the slips lie within it.
    """
    return _run(s, t, key, frame, force_n, displacement_m, events, displacement_m[:0])


@kernel
def rest(s, t):
    """A bound of the displacement's size if no force comes; infinite while worn ground waits for its renewal."""
    if s[_WORN] > 0.0:
        return math.inf
    return math.sqrt(s[_DISPLACEMENT] ** 2 + s[_SPEED] ** 2 / t[_KAPPA])


@kernel
def _run(s, t, key, frame, force_n, displacement_m, events, plastic_m):
    """`run`, which besides fills the last where it has frames."""
    x, w, before, worn = s[_DISPLACEMENT], s[_SPEED], s[_LOAD], s[_WORN]
    stiffness = t[_PLASTIC_STIFFNESS]
    c0, c1, c2, c3, c4, c5, c6, c7 = frame_step(t[_KAPPA], t[_GAMMA], t[_GAIN])
    slipping = s[_PLASTIC] + s[_THRESHOLD] / stiffness if worn > 0.0 else math.inf
    count = 0
    for i in range(force_n.size):
        after = min(max(force_n[i], -_LARGEST_FORCE), _LARGEST_FORCE)
        if after > 0.0:
            if worn == 0.0:
                s[_THRESHOLD] = _threshold(t, key, (frame + i) * _DRAWS + _FIRST_THRESHOLD)
                slipping = s[_PLASTIC] + s[_THRESHOLD] / stiffness
            worn = 1.0
        elif worn > 0.0:
            worn += 1.0
            if worn > t[_RENEWAL]:
                worn = s[_PLASTIC] = s[_THRESHOLD] = 0.0
                slipping = math.inf
        held = stiffness * s[_PLASTIC]
        u, v = before + held, after + held
        moved = c0 * x + (c1 * w + (c2 * u + c3 * v))
        w = c5 * w + (c4 * x + (c6 * u + c7 * v))
        if moved > slipping:
            events[3 * count] = frame + i + crossing(x, moved, slipping)
            energy = _slips(s, t, key, (frame + i) * _DRAWS, moved)
            events[3 * count + 1] = t[_STRENGTH] * (
                math.sqrt(energy) if t[_EXPONENT] == 0.5 else energy ** t[_EXPONENT]
            )
            events[3 * count + 2] = 0.0
            count += 1
            slipping = s[_PLASTIC] + s[_THRESHOLD] / stiffness
        x, before = moved, after
        displacement_m[i] = x
        if plastic_m.size:
            plastic_m[i] = s[_PLASTIC]
    s[_DISPLACEMENT], s[_SPEED], s[_LOAD], s[_WORN] = x, w, before, worn
    return count


@kernel
def _slips(s, t, key, counter, x):
    """Slip until the force on the plastic unit is below its threshold; the energy set free."""
    stiffness = t[_PLASTIC_STIFFNESS]
    total = 0.0
    force = stiffness * (x - s[_PLASTIC])
    for k in range(_MOST_SLIPS):
        energy = power_law(uniform(key, counter + 2 * k), t[_LEAST], t[_RANGE], t[_POWER])
        if k == _MOST_SLIPS - 1:
            energy = slip_energy(force, (force - s[_THRESHOLD]) / stiffness, stiffness)
        energy = min(energy, 0.5 * force * force / stiffness)
        s[_PLASTIC] += slip_displacement(force, energy, stiffness)
        total += energy
        force = stiffness * (x - s[_PLASTIC])
        if k < _MOST_SLIPS - 1:
            s[_THRESHOLD] = _threshold(t, key, counter + 2 * k + 1)
        if not force > s[_THRESHOLD]:
            break
    return total


@kernel
def _threshold(t, key, counter):
    if t[_SPREAD] == 0.0:
        return t[_MEAN_THRESHOLD]
    return t[_MEAN_THRESHOLD] * (1.0 + t[_SPREAD] * (2.0 * uniform(key, counter) - 1.0))


@kernel
def slip_energy(force_n, displacement_m, stiffness_n_m):
    """The energy in joules that a slip takes from a plastic unit under `force_n` (errata 4.1): F d - k2 d^2 / 2.

    >>> slip_energy(100.0, 1e-4, 4e5)
    0.008
    """
    return force_n * displacement_m - 0.5 * stiffness_n_m * displacement_m * displacement_m


@kernel
def slip_displacement(force_n, energy_j, stiffness_n_m):
    """The displacement in metres of the slip that takes `energy_j` from a plastic unit under `force_n`.

    The inverse of `slip_energy` (errata 4.1) for energies up to F^2 / 2 k2, written without a difference of
    nearly equal numbers.

    >>> round(slip_displacement(100.0, 0.008, 4e5), 12)
    0.0001
    """
    left = max(force_n * force_n - 2.0 * stiffness_n_m * energy_j, 0.0)
    return 2.0 * energy_j / (force_n + math.sqrt(left))


@kernel
def power_law(chance, least, log_range, power):
    """The quantile `chance` of p(E) ~ E^-gamma from `least` to `least` exp(`log_range`), where `power` is 1 - gamma.

    A truncated power law, as errata chapter 5 has it.

    >>> round(power_law(0.5, 1.0, math.log(100.0), 1.0 - 1.0), 9)  # gamma = 1: even in the logarithm
    10.0
    """
    if abs(power * log_range) < 1e-12:
        return least * math.exp(chance * log_range)
    return least * math.exp(math.log1p(chance * math.expm1(power * log_range)) / power)
