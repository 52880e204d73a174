"""Sample paths of slips: exact Gaussian steps, with a Brownian bridge for the crossing within a step."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.arguments import integer, seed_of
from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.stick_slip.oscillator import BlockOnBelt, require_slip, transition

_MOST_STEPS = 1e8
"""Largest `t_end`, in shortest steps."""

_STEP = np.dtype(
    [
        *(("length", np.float64), ("a_xx", np.float64), ("a_xv", np.float64), ("a_vx", np.float64)),
        *(("a_vv", np.float64), ("v_deviation", np.float64), ("x_with_v", np.float64), ("x_alone", np.float64)),
        ("clearance", np.float64),
    ],
    align=True,
)
"""A step of `length` s: propagator; standard deviation of v; for x, the part correlated with v and the independent
part. At least `clearance` m/s below the belt velocity, the noise cannot reach it in one step."""


class Paths(NamedTuple):
    """Sample of slips, one entry per slip."""

    duration: NDArray[np.float64]
    """Duration, s; inf if the slip still lasts at t_end."""
    position: NDArray[np.float64]
    """x at the end, m; nan if the slip still lasts."""


def paths(block: BlockOnBelt, t_end: float, count: int, error: float = 1e-4, seed: int = 0) -> Paths:
    """Draw `count` slips: durations and end positions. The same `seed` gives the same slips.

    `t_end` is the observation time, s. `error` is that of the method (largest CDF difference of an infinite sample),
    1e-6 to 0.1, and determines the step; the sampling noise is about 1/sqrt(count) for any step. `BadValue` for values
    out of range.

    >>> drawn = paths(BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, -1.0), 20.0, count=2000, seed=1)
    >>> bool(abs(np.mean(drawn.duration < 3.0) - 0.814) < 0.04)
    True
    """
    block, t_end, error = require_slip(block, t_end, error)
    count = integer("count", count, 0, 2**31, "0 to 2^31")
    shortest = _shortest_step(block, error)
    require(t_end <= _MOST_STEPS * shortest, "t_end", t_end, f"for these values: up to {_MOST_STEPS * shortest:.3g}")
    steps = max(1, math.ceil(t_end / shortest))
    longest = max(1, min(steps, int(steps / (t_end * (block.w0 + block.zeta)))))
    lengths = [t_end / steps * 2.0**level for level in range(int(math.log2(longest)) + 1)]
    drawn = Paths(np.full(count, math.inf), np.full(count, math.nan))
    _draw(block, steps, _steps(block, lengths), np.random.default_rng(seed_of(seed)), drawn)
    return drawn


def _steps(block: BlockOnBelt, lengths: list[float]) -> NDArray[np.void]:
    """Return the coefficients for steps of these `lengths`, each twice the one before: [lengths] of `_STEP`."""
    steps = np.empty(len(lengths), _STEP)
    for i, length in enumerate(lengths):
        free = transition(block.w0, block.zeta, block.noise, length)
        deviation = math.sqrt(free.s_vv)
        with_v = free.s_xv / deviation
        alone = math.sqrt(max(0.0, free.s_xx - with_v * with_v))
        steps[i] = length, free.a_xx, free.a_xv, free.a_vx, free.a_vv, deviation, with_v, alone, 6.0 * deviation
    return steps


def _shortest_step(block: BlockOnBelt, error: float) -> float:
    """Return the step near the belt velocity, s, from the bias measured against `SlipDistribution` with 2e6 slips.

    Drift that changes within a step costs 0.12 (max(w0, zeta) h)^2. Drawing the positions of survivors without regard
    to the belt velocity costs 0.06 (2 D h / gap^2)^1.3. An acceleration whose effect in a step exceeds that of the
    noise changes by a share of max(w0, zeta) h, and shifts the crossing by some 0.2 of that in deviations of the noise.
    """
    w0, zeta, noise, belt_velocity, x0, v0 = block
    gap = belt_velocity - v0
    acceleration = w0 * w0 * abs(x0) + max(w0, zeta) * abs(v0)
    fastest = max(w0, zeta)
    drifting = math.sqrt(error / 0.12) / fastest
    spreading = (error / 0.06) ** (1.0 / 1.3) * gap * gap / (2.0 * noise)
    if acceleration == 0.0:
        return min(drifting, spreading)
    accelerated = (error * math.sqrt(2.0 * noise) / (0.2 * fastest * acceleration)) ** (2.0 / 3.0)
    return min(drifting, spreading, max(accelerated, 2.0 * noise / (acceleration * acceleration)))


@kernel
def _draw(
    block: BlockOnBelt, count: int, steps: NDArray[np.record], generator: np.random.Generator, drawn: Paths
) -> None:
    w0, zeta, noise, belt_velocity = block.w0, block.zeta, block.noise, block.belt_velocity
    for i in range(drawn.duration.size):
        x = block.x0
        v = block.v0
        done = 0
        level = 0
        while done < count:
            acceleration = w0 * w0 * abs(x) + zeta * abs(v)
            # The longest step, of 1, 2, 4, ... short ones, that cannot reach the belt velocity, or else a short one.
            level = min(level + 1, steps.size - 1)
            while level > 0:
                length = steps[level].length
                drift = (acceleration + w0 * w0 * abs(v) * length) * length
                if done + (1 << level) <= count and belt_velocity - v > drift + steps[level].clearance:
                    break
                level -= 1
            step = steps[level]
            first = generator.standard_normal()
            next_v = step.a_vx * x + step.a_vv * v + step.v_deviation * first
            next_x = step.a_xx * x + step.a_xv * v + step.x_with_v * first + step.x_alone * generator.standard_normal()
            gap = belt_velocity - v
            next_gap = belt_velocity - next_v
            crossed = next_gap <= 0.0
            if not crossed:
                exponent = gap * next_gap / (noise * step.length)
                crossed = exponent < 40.0 and generator.random() < math.exp(-exponent)
            if crossed:
                part = step.length * _bridge_crossing(gap, abs(next_gap), 2.0 * noise * step.length, generator)
                drawn.duration[i] = steps[0].length * done + part
                drawn.position[i] = x + belt_velocity * part - _bridge_area(gap, part, noise, generator)
                break
            x = next_x
            v = next_v
            done += 1 << level


@kernel
def _bridge_crossing(gap: float, next_gap: float, variance: float, generator: np.random.Generator) -> float:
    """Return the share of the step at which the bridge first crosses the belt velocity.

    It is r / (1 + r), with r inverse Gaussian of mean gap / next_gap and shape gap^2 / variance (algorithm of Michael,
    Schucany and Haas, with the root written without cancellation).
    """
    if gap <= 1e-12 * next_gap:
        return 0.0
    shape = gap * gap / variance
    square = generator.standard_normal() ** 2
    # As next_gap goes to 0 the distribution becomes Levy's: r = shape / square.
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
def _bridge_area(gap: float, part: float, noise: float, generator: np.random.Generator) -> float:
    """Return the distance that the belt gains on a block that first reaches its velocity after `part` s.

    It is the area under a Bessel bridge, the length of a three-dimensional Brownian bridge from (gap, 0, 0) to 0,
    computed from its midpoint, with weights that give the mean area both without noise and without gap.
    """
    spread = math.sqrt(0.5 * noise * part)
    along = 0.5 * gap + spread * generator.standard_normal()
    across = spread * spread * (generator.standard_normal() ** 2 + generator.standard_normal() ** 2)
    return part * ((0.5 - math.pi / 8.0) * gap + 0.25 * math.pi * math.sqrt(along * along + across))
