"""Visco-elasto-plastic ground: the normal-force texture of a surface that slips (4.1, 5.4).

The surface obeys `F = m x'' + b x' + K (x - x0)` with K = k1 + k2 and x0 = k2 xi / K. When the force on the
plastic unit, `k2 (x - xi)`, exceeds a threshold (constant, or random for each slip), xi jumps: an energy is drawn
from a truncated power law, p(E) ~ E^-gamma from E0 to E1, and converted to the displacement that releases it
(docs/models.md#elasto-plastic-ground). The outputs are time and energy of each slip; other models turn them into
vibration.

The motion between slips is exact for a force that is linear between frames. A slip takes effect at the end of its
frame. It releases at most the energy stored in the plastic unit, k2 (x - xi)^2 / 2; larger draws are cut to that.

After the renewal time without a force above 0 the ground is renewed: xi returns to 0, and the thresholds are drawn
anew. Until then xi stays, so that a load below the largest so far causes no slip.

In scripts: `Ground().response(force_n, rate_hz)`. In real time: `design`, `run` for one tile, `tail`.
"""

import math

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers, seed_of
from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.driven_oscillator import crossing, frame_step, resolved
from underfoot.models.signals.events import append, event_list
from underfoot.models.signals.random import stream_key, uniform

PARAMETERS = Layout(
    "slip_parameters",
    *("mass", "damping", "stiffness", "plastic_stiffness", "threshold", "spread"),
    *("gamma", "least", "renewal"),
)
"""Input of `design`: m, b, k1 and k2; the threshold and its relative spread; the exponent and the lower end of the
distribution of energies; the renewal time in seconds."""

COEFFICIENTS = Layout(
    "slip_coefficients",
    *("kappa", "gamma", "gain", "plastic_stiffness", "threshold", "spread"),
    *("least", "log_range", "power", "strength", "exponent", "renewal"),
)
"""kappa, gamma and gain are K, b and 1 over the mass, with time in frames. The strength of an event is `strength`
E^`exponent`."""

STATE = Layout("slip", "displacement", "speed", "load", "plastic", "threshold", "worn")
"""Zeros are intact ground at rest. `worn` is 0 on intact ground, else 1 plus the frames since the last load."""

_MOST_SLIPS = 32
"""Largest number of slips in one frame; the last one takes the plastic unit down to its threshold."""

_DRAWS = 128
"""Random draws reserved for each frame: the counter of a draw is frame times this, plus its index."""
_FIRST_THRESHOLD = 127

_LARGEST_FORCE = 1e12
"""Forces are limited to this size, in newtons, so that all results stay finite."""


class Slips(Struct, frozen=True):
    """Response of the ground: two signals [frames], and one value for each frame in which it slipped."""

    displacement_m: NDArray[np.float64]
    """Displacement x of the surface, shape [frames]."""
    plastic_m: NDArray[np.float64]
    """Plastic displacement xi, shape [frames]."""
    time_s: NDArray[np.float64]
    """Times of the slips, shape [slips]."""
    energy_j: NDArray[np.float64]
    """Energies released by the slips, shape [slips]."""


class Ground(Struct, frozen=True):
    """Elasto-plastic ground. Raises `BadValue` for values out of range.

    `stiffness_n_m` is k1 and `plastic_stiffness_n_m` k2, both above 0. Mass and damping are at least 0; values too
    small for frames to resolve are raised so that the motion settles within a frame. The threshold of each slip is
    uniform in `threshold_n` (1 +- `spread`), `spread` below 1. `gamma` (0 to 10), `least_j` and `most_j` define the
    distribution of energies. The ground is renewed after `renewal_s` without force.
    """

    mass_kg: float = 0.5
    damping_ns_m: float = 400.0
    stiffness_n_m: float = 4e5
    plastic_stiffness_n_m: float = 4e5
    threshold_n: float = 100.0
    spread: float = 0.0
    gamma: float = 1.5
    least_j: float = 1e-5
    most_j: float = 1e-2
    renewal_s: float = math.inf

    def __post_init__(self) -> None:
        for name in ("stiffness_n_m", "plastic_stiffness_n_m", "threshold_n", "least_j"):
            number(name, getattr(self, name), TINY, HUGE, "above 0")
        for name in ("mass_kg", "damping_ns_m"):
            number(name, getattr(self, name), 0.0, HUGE, "0 or more")
        number("spread", self.spread, 0.0, math.nextafter(1.0, 0.0), "0 or more, below 1")
        number("gamma", self.gamma, 0.0, 10.0, "0 to 10")
        number("most_j", self.most_j, self.least_j, HUGE, f"least_j, {self.least_j}, or more")
        number("renewal_s", self.renewal_s, TINY, math.inf, "above 0 s")

    def response(self, force_n: ArrayLike, rate_hz: float, seed: int = 0) -> Slips:
        """Return the response to `force_n`, one value per frame.

        The force is linear between frames and 0 before the first. Several slips in one frame are merged: time of the
        first, sum of the energies.

        >>> result = Ground().response(np.linspace(0.0, 500.0, 4800), 48000.0)
        >>> len(result.time_s) > 10, bool(result.energy_j.min() >= 1e-5)
        (True, True)
        """
        load = numbers("force_n", force_n)
        number("rate_hz", rate_hz, TINY, HUGE, "above 0")
        coefficients, state, events = COEFFICIENTS.zeros(), STATE.zeros(), event_list(room=load.size)
        design(self.parameters(), self.most_j, self.most_j, 1.0, float(rate_hz), coefficients)
        displacement, plastic = np.zeros((2, load.size))
        key = stream_key(seed_of(seed), "slip")
        run(load, key, 0, coefficients, state, displacement, events, plastic)
        count = len(events)
        return Slips(displacement, plastic, events.time[:count] / rate_hz, events.strength[:count])

    def parameters(self) -> Memory:
        """Return the parameters in the layout that `design` takes."""
        p = PARAMETERS.zeros()
        p.mass, p.damping = self.mass_kg, self.damping_ns_m
        p.stiffness, p.plastic_stiffness = self.stiffness_n_m, self.plastic_stiffness_n_m
        p.threshold, p.spread = self.threshold_n, self.spread
        p.gamma, p.least, p.renewal = self.gamma, self.least_j, self.renewal_s
        return p


@kernel
def design(
    parameters: Memory, most_j: float, strength: float, exponent: float, rate_hz: float, coefficients: Memory
) -> None:
    """Compute the coefficients of the ground with `parameters` (named as in `PARAMETERS`).

    `most_j` is the largest energy E1. The strength of an event is `strength` (E / E1)^`exponent`: 1/2 gives the
    velocity of an impact, 1 its energy. May be called at any time; a change takes effect with the next call of `run`.
    """
    p, c = parameters, coefficients
    frame_s = 1.0 / rate_hz
    whole = p.stiffness + p.plastic_stiffness
    mass_kg, damping_ns_m = resolved(frame_s, whole, p.damping, 0.0, p.mass)
    c.kappa = whole * frame_s * frame_s / mass_kg
    c.gamma = damping_ns_m * frame_s / mass_kg
    c.gain = frame_s * frame_s / mass_kg
    c.plastic_stiffness, c.threshold, c.spread = p.plastic_stiffness, p.threshold, p.spread
    c.least, c.log_range, c.power = p.least, math.log(most_j / p.least), 1.0 - p.gamma
    c.strength, c.exponent = strength * most_j**-exponent, exponent
    c.renewal = p.renewal * rate_hz


@kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """Return a bound of |displacement| without further force; infinite while worn ground waits for its renewal."""
    if state.worn > 0.0:
        return math.inf
    return math.sqrt(state.displacement**2 + state.speed**2 / coefficients.kappa)


@kernel
def run(
    force_n: Floats,
    key: np.uint64,
    frame: int,
    coefficients: Memory,
    state: Memory,
    displacement_m: Floats,
    events: Memory,
    plastic_m: Floats,
) -> None:
    """Run one tile from session frame `frame` on: `force_n` in, `displacement_m` out, both [frames].

    Slips are appended to `events`. `key` is the row's `stream_key(seed, node, tile)`; draws are numbered by frame, so
    that they do not depend on splits or sleep. `force_n` holds the value at the end of each frame; slips lie within it.
    The plastic displacement is written if `plastic_m` is not empty.
    """
    c, s = coefficients, state
    x, w, before, worn = s.displacement, s.speed, s.load, s.worn
    stiffness = c.plastic_stiffness
    c0, c1, c2, c3, c4, c5, c6, c7 = frame_step(c.kappa, c.gamma, c.gain)
    slipping = s.plastic + s.threshold / stiffness if worn > 0.0 else math.inf
    for i in range(force_n.size):
        after = min(max(force_n[i], -_LARGEST_FORCE), _LARGEST_FORCE)
        if after > 0.0:
            if worn == 0.0:
                s.threshold = _threshold(c, key, (frame + i) * _DRAWS + _FIRST_THRESHOLD)
                slipping = s.plastic + s.threshold / stiffness
            worn = 1.0
        elif worn > 0.0:
            worn += 1.0
            if worn > c.renewal:
                worn = s.plastic = s.threshold = 0.0
                slipping = math.inf
        held = stiffness * s.plastic
        u, v = before + held, after + held
        moved = c0 * x + (c1 * w + (c2 * u + c3 * v))
        w = c5 * w + (c4 * x + (c6 * u + c7 * v))
        if moved > slipping:
            time = frame + i + crossing(x, moved, slipping)
            energy = _slips(s, c, key, (frame + i) * _DRAWS, moved)
            append(events, time, c.strength * (math.sqrt(energy) if c.exponent == 0.5 else energy**c.exponent))
            slipping = s.plastic + s.threshold / stiffness
        x, before = moved, after
        displacement_m[i] = x
        if plastic_m.size:
            plastic_m[i] = s.plastic
    s.displacement, s.speed, s.load, s.worn = x, w, before, worn


@kernel
def _slips(s: Memory, c: Memory, key: np.uint64, counter: int, x: float) -> float:
    """Slip until the force on the plastic unit is below its threshold; return the energy released."""
    stiffness = c.plastic_stiffness
    total = 0.0
    force = stiffness * (x - s.plastic)
    for k in range(_MOST_SLIPS):
        energy = power_law(uniform(key, counter + 2 * k), c.least, c.log_range, c.power)
        if k == _MOST_SLIPS - 1:
            energy = slip_energy(force, (force - s.threshold) / stiffness, stiffness)
        energy = min(energy, 0.5 * force * force / stiffness)
        s.plastic += slip_displacement(force, energy, stiffness)
        total += energy
        force = stiffness * (x - s.plastic)
        if k < _MOST_SLIPS - 1:
            s.threshold = _threshold(c, key, counter + 2 * k + 1)
        if not force > s.threshold:
            break
    return total


@kernel
def _threshold(c: Memory, key: np.uint64, counter: int) -> float:
    if c.spread == 0.0:
        return c.threshold
    return c.threshold * (1.0 + c.spread * (2.0 * uniform(key, counter) - 1.0))


@kernel
def slip_energy(force_n: float, displacement_m: float, stiffness_n_m: float) -> float:
    """Return the energy, J, that a slip takes from a plastic unit under `force_n`: F d - k2 d^2 / 2.

    >>> slip_energy(100.0, 1e-4, 4e5)
    0.008
    """
    return force_n * displacement_m - 0.5 * stiffness_n_m * displacement_m * displacement_m


@kernel
def slip_displacement(force_n: float, energy_j: float, stiffness_n_m: float) -> float:
    """Return the displacement, m, of a slip that takes `energy_j` from a plastic unit under `force_n`.

    Inverse of `slip_energy` for energies up to F^2 / 2 k2, written without cancellation.

    >>> round(slip_displacement(100.0, 0.008, 4e5), 12)
    0.0001
    """
    left = max(force_n * force_n - 2.0 * stiffness_n_m * energy_j, 0.0)
    return 2.0 * energy_j / (force_n + math.sqrt(left))


@kernel
def power_law(probability: float, least: float, log_range: float, power: float) -> float:
    """Return the quantile at `probability` of p(E) ~ E^-gamma from `least` to `least` exp(`log_range`).

    `power` is 1 - gamma.

    >>> round(power_law(0.5, 1.0, math.log(100.0), 1.0 - 1.0), 9)  # gamma = 1: log-uniform
    10.0
    """
    if abs(power * log_range) < 1e-12:
        return least * math.exp(probability * log_range)
    return least * math.exp(math.log1p(probability * math.expm1(power * log_range)) / power)
