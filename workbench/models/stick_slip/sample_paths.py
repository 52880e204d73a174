"""Single slips, drawn: exact Gaussian steps, and a Brownian bridge for what happens within a step."""

import math
from typing import NamedTuple

import numpy as np

from underfoot.arguments import seed_of, whole
from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.stick_slip.oscillator import require_slip, transition

_MOST_STEPS = 1e8
"""In t_end, of the shortest."""


class Paths(NamedTuple):
    """One entry a slip."""

    duration: np.ndarray
    """s; inf where the slip still lasted at t_end."""
    position: np.ndarray
    """x at its end, m; nan where it still lasted."""


def paths(
    w0: float,
    zeta: float,
    noise: float,
    belt_velocity: float,
    x0: float,
    v0: float,
    t_end: float,
    count: int,
    error: float = 1e-4,
    seed: int = 0,
) -> Paths:
    """Draw `count` slips: their durations and the places of their ends. The same `seed` gives the same slips.

    Parameters as for `friction.first_passage`; `error` here is that of the method (largest CDF difference of an endless
    sample), 1e-6 to 0.1, and sets the step: the sample's own noise is about 1/sqrt(count) whatever the step.

    >>> drawn = paths(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 20.0, count=2000, seed=1)
    >>> bool(abs(np.mean(drawn.duration < 3.0) - 0.814) < 0.04)
    True
    """
    w0, zeta, noise, belt_velocity, x0, v0, t_end, error = require_slip(
        w0, zeta, noise, belt_velocity, x0, v0, t_end, error
    )
    count = whole("count", count, 0, 2**31, "0 to 2^31")
    pull = w0 * w0 * abs(x0) + max(w0, zeta) * abs(v0)
    shortest = _shortest(w0, zeta, noise, belt_velocity - v0, pull, error)
    require(t_end <= _MOST_STEPS * shortest, "t_end", t_end, f"for these values: up to {_MOST_STEPS * shortest:.3g}")
    steps = max(1, math.ceil(t_end / shortest))
    longest = max(1, min(steps, int(steps / (t_end * (w0 + zeta)))))
    levels = np.empty((int(math.log2(longest)) + 1, 9))
    for level in range(len(levels)):
        stride = t_end / steps * 2.0**level
        a_xx, a_xv, a_vx, a_vv, s_xx, s_xv, s_vv = transition(w0, zeta, noise, stride)
        root = math.sqrt(s_vv)
        tied = s_xv / root
        free = math.sqrt(max(0.0, s_xx - tied * tied))
        levels[level] = stride, a_xx, a_xv, a_vx, a_vv, root, tied, free, 6.0 * root
    duration = np.full(count, math.inf)
    position = np.full(count, math.nan)
    motion = (w0, zeta, noise, belt_velocity)
    _draw(motion, x0, v0, steps, levels, np.random.default_rng(seed_of(seed)), duration, position)
    return Paths(duration, position)


def _shortest(w0: float, zeta: float, noise: float, gap: float, pull: float, error: float) -> float:
    """The step near the belt velocity, s, from the bias measured against `SlipLaw` at 2e6 slips.

    Drift that changes within a step costs 0.12 (max(w0, zeta) h)^2. That survivors' places are drawn as if the belt
    velocity were not there costs 0.06 (2 D h / gap^2)^1.3. A `pull` (m/s^2) that carries further in a step than noise
    does turns by max(w0, zeta) h of itself, and shifts the crossing by some 0.2 of that in deviations of the noise.
    """
    turning = max(w0, zeta)
    drifting = math.sqrt(error / 0.12) / turning
    spreading = (error / 0.06) ** (1.0 / 1.3) * gap * gap / (2.0 * noise)
    if pull == 0.0:
        return min(drifting, spreading)
    pulled = (error * math.sqrt(2.0 * noise) / (0.2 * turning * pull)) ** (2.0 / 3.0)
    return min(drifting, spreading, max(pulled, 2.0 * noise / (pull * pull)))


@kernel
def _draw(motion, x0, v0, steps, levels, generator, duration, position):
    w0, zeta, noise, belt = motion
    for i in range(duration.size):
        x = x0
        v = v0
        done = 0
        level = 0
        while done < steps:
            pull = w0 * w0 * abs(x) + zeta * abs(v)
            # As long a step, of 1, 2, 4, ... short ones, as leaves the belt velocity out of reach, or else a short one.
            level = min(level + 1, levels.shape[0] - 1)
            while level > 0:
                stride = levels[level, 0]
                swing = (pull + w0 * w0 * abs(v) * stride) * stride
                if done + (1 << level) <= steps and belt - v > swing + levels[level, 8]:
                    break
                level -= 1
            stride, a_xx, a_xv, a_vx, a_vv, root, tied, free, _ = levels[level]
            first = generator.standard_normal()
            next_v = a_vx * x + a_vv * v + root * first
            next_x = a_xx * x + a_xv * v + tied * first + free * generator.standard_normal()
            gap = belt - v
            next_gap = belt - next_v
            crossed = next_gap <= 0.0
            if not crossed:
                odds = gap * next_gap / (noise * stride)
                crossed = odds < 40.0 and generator.random() < math.exp(-odds)
            if crossed:
                part = stride * _bridge(gap, abs(next_gap), 2.0 * noise * stride, generator)
                duration[i] = levels[0, 0] * done + part
                position[i] = x + belt * part - _lag_behind(gap, part, noise, generator)
                break
            x = next_x
            v = next_v
            done += 1 << level


@kernel
def _bridge(gap, next_gap, variance, generator):
    # When within the step the bridge first meets the line, as a part of it: r / (1 + r), r inverse Gaussian with mean
    # gap / next_gap and shape gap^2 / variance (Michael, Schucany and Haas's draw, its root free of cancellation).
    if gap <= 1e-12 * next_gap:
        return 0.0
    shape = gap * gap / variance
    square = generator.standard_normal() ** 2
    # With m the mean, next_gap -> 0 is the Levy law: r = shape / square.
    inverse_mean = next_gap / gap
    root = 2.0 * shape * inverse_mean + square
    # smaller root: r = 2 shape / (2 shape/m + y + sqrt(y^2 + 4 shape y / m))
    small = 2.0 * shape / (root + math.sqrt(square * square + 4.0 * shape * square * inverse_mean))
    if generator.random() * (1.0 + small * inverse_mean) <= 1.0:
        ratio = small
    else:
        ratio = 1.0 / (inverse_mean * inverse_mean * small)
    return ratio / (1.0 + ratio)


@kernel
def _lag_behind(gap, part, noise, generator):
    # What the belt gains on a block that first reaches its velocity after `part`: the area under a Bessel bridge, the
    # length of a three-dimensional Brownian bridge from (gap, 0, 0) to 0. From its middle, with weights that give the
    # mean area both without noise and without gap.
    spread = math.sqrt(0.5 * noise * part)
    along = 0.5 * gap + spread * generator.standard_normal()
    across = spread * spread * (generator.standard_normal() ** 2 + generator.standard_normal() ** 2)
    return part * ((0.5 - math.pi / 8.0) * gap + 0.25 * math.pi * math.sqrt(along * along + across))
