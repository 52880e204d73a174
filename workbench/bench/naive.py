"""Naive methods, as one would write them first, as a baseline for the models.

Loops are compiled like the models, so that methods are compared and not languages.
"""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, kernel
from underfoot.layouts import Memory
from underfoot.models.modal.impact import Hammer, ModalObject
from underfoot.models.stick_slip.oscillator import BlockOnBelt


def struck_object(
    by: Hammer,
    target: ModalObject,
    times_s: NDArray[np.float64],
    method: Literal["RK45", "DOP853"],
    tolerance: float,
    longest_step_s: float = math.inf,
) -> NDArray[np.float64]:
    """Return the displacement (m) of a struck object at `times_s`, by SciPy's solve_ivp, without load on the hammer."""
    from scipy.integrate import solve_ivp

    mass, velocity, stiffness, exponent, damping = (
        *(by.mass_kg, by.velocity_m_s, by.stiffness),
        *(by.exponent, by.damping_s_m),
    )
    frequencies, decays, masses, shapes = (np.asarray(values, np.float64) for values in target)
    n = frequencies.size
    squares = (2.0 * math.pi * frequencies) ** 2 + decays**2

    def motion(_: float, y: Floats) -> Floats:
        q, v = y[2 : 2 + n], y[2 + n :]
        x, closing = y[0] - shapes @ q, y[1] - shapes @ v
        force = max(stiffness * max(x, 0.0) ** exponent * (1.0 + damping * closing), 0.0)
        return np.concatenate([[y[1], -force / mass], v, shapes * force / masses - squares * q - 2.0 * decays * v])

    free = 1.0 / (1.0 / mass + float((shapes**2 / masses).sum()))
    depth = ((exponent + 1.0) * free * velocity**2 / (2.0 * stiffness)) ** (1.0 / (exponent + 1.0))
    lasts = 3.0 * depth / velocity
    start = np.zeros(2 + 2 * n)
    start[1] = velocity
    scale = tolerance * np.concatenate([[depth, velocity], np.full(n, depth), np.full(n, velocity)])
    parts = []
    middle = min(6.0 * lasts, float(times_s[-1]))
    for first, last, longest in ((0.0, middle, lasts / 10.0), (middle, float(times_s[-1]), math.inf)):
        if not last > first:
            break
        inside = times_s[(times_s >= first) & (times_s < last)]
        at = np.append(inside, last)
        longest = min(longest, longest_step_s)
        part = solve_ivp(motion, (first, last), start, method, at, rtol=tolerance, atol=scale, max_step=longest)
        start = part.y[:, -1]
        parts.append(part.y[:, :-1])
    return shapes @ np.concatenate([*parts, start[:, None]], axis=1)[2 : 2 + n]


def filter_per_mode(
    frequencies_hz: Sequence[float] | Floats,
    decays_per_s: Sequence[float] | Floats,
    amplitudes: Sequence[float] | Floats,
    excitation: Floats,
    rate: float,
) -> Floats:
    """Compute a bank of modes as a sum of second-order filters, one after the other, by SciPy's lfilter."""
    from scipy.signal import lfilter

    out = np.zeros(excitation.size)
    for f, b, a in zip(frequencies_hz, decays_per_s, amplitudes, strict=True):
        pole = np.exp((-b + 2j * np.pi * f) / rate)
        out += lfilter([0.0, a * pole.imag], [1.0, -2.0 * pole.real, abs(pole) ** 2], excitation)
    return out


def sum_of_sines(f0_hz: float, amplitudes: NDArray[np.float64], frames: int, rate: float) -> NDArray[np.float64]:
    """Compute a tone as the sum of its harmonics.

    >>> sum_of_sines(50.0, np.array([1.0]), 3, 400.0).round(3)
    array([0.   , 0.707, 1.   ])
    """
    t = np.arange(frames) / rate
    return sum(a * np.sin(2.0 * np.pi * k * f0_hz * t) for k, a in enumerate(amplitudes, 1))


def sorted_fibres(load: NDArray[np.float64], fibres: int, shape: float, scale: float, seed: int) -> NDArray[np.float64]:
    """Compute the strain of a slowly loaded bundle of stiffness 1 per fibre, with sorted thresholds."""
    thresholds = scale * np.random.default_rng(seed).weibull(shape, fibres)
    thresholds.sort()
    strain = np.empty(load.size)
    _break_in_order(load, thresholds, strain)
    return strain


def scanned_fibres(
    load: NDArray[np.float64], fibres: int, shape: float, scale: float, seed: int
) -> NDArray[np.float64]:
    """Compute the same without sorting: all fibres are tested in every frame."""
    thresholds = scale * np.random.default_rng(seed).weibull(shape, fibres)
    strain = np.empty(load.size)
    _scan(load, thresholds, strain)
    return strain


@kernel
def _break_in_order(load: Floats, thresholds: Floats, strain: Floats) -> None:
    broken, count = 0, thresholds.size
    for i in range(load.size):
        x = load[i] / max(count - broken, 1)
        while broken < count and thresholds[broken] < x:
            broken += 1
            x = load[i] / max(count - broken, 1)
        strain[i] = x


@kernel
def _scan(load: Floats, thresholds: Floats, strain: Floats) -> None:
    whole = thresholds.size
    for i in range(load.size):
        x = load[i] / max(whole, 1)
        left = 0
        for threshold in thresholds:
            left += threshold >= x
        whole = left
        strain[i] = load[i] / max(whole, 1)


@kernel
def slip_by_euler(force: Floats, h: float, ground: Memory, energy: float, out: Floats) -> None:
    """Compute elasto-plastic slips of one `energy` by semi-implicit Euler, a step of `h` seconds per value of `force`.

    `ground` is `Ground.parameters()`.
    """
    x = v = xi = 0.0
    mass, damping, stiffness, plastic = ground.mass, ground.damping, ground.stiffness, ground.plastic_stiffness
    for i in range(force.size):
        v += h / mass * (force[i] - damping * v - stiffness * x - plastic * (x - xi))
        x += h * v
        held = plastic * (x - xi)
        if held > ground.threshold:
            left = max(held * held - 2.0 * plastic * energy, 0.0)
            xi += 2.0 * energy / (held + math.sqrt(left))
        out[i] = x


@kernel
def strain_rate_by_euler(force: Floats, h: float, w0: float, damping: float, mass: float, out: Floats) -> None:
    """Compute the strain rate of a compressible layer (6.1) by the semi-implicit Euler method."""
    x = v = 0.0
    for i in range(force.size):
        v += h * (force[i] / mass - 2.0 * damping * w0 * v - w0 * w0 * x)
        x += h * v
        out[i] = v


@kernel
def slips_by_euler_maruyama(
    block: BlockOnBelt, t_end: float, h: float, generator: np.random.Generator, durations: NDArray[np.float64]
) -> None:
    """Simulate durations of slips by Euler-Maruyama in steps of `h` seconds; t_end for a slip that lasts."""
    w0, zeta, noise, belt, x0, v0 = block
    kick = math.sqrt(2.0 * noise * h)
    for k in range(durations.size):
        x, v, t = x0, v0, 0.0
        while t < t_end and v < belt:
            x, v = x + h * v, v - h * (w0 * w0 * x + zeta * v) + kick * generator.standard_normal()
            t += h
        durations[k] = min(t, t_end)
