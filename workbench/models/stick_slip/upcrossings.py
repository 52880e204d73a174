"""Upcrossing approximations of the thesis (8.2.1 to 8.3.2), corrected (docs/models.md#stick-slip), for comparison.

The density n1 of upcrossings of v_b without absorption, and the distribution of first upcrossings if they were
independent (8.12, 8.14). An upcrossing needs an acceleration, which white noise does not have: either it is averaged
over a step h, with variance 2 D / h, as in the thesis's simulations, or it gets a correlation time. Only the latter has
a limit as h goes to 0. `SlipDistribution.duration` is the exact distribution.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers
from underfoot.errors import require
from underfoot.models.stick_slip.oscillator import BlockOnBelt, require_slip, transition


@dataclass(frozen=True)
class Upcrossings:
    """Means and covariances of (x, v, a) of the free block, and the resulting upcrossings of the belt velocity.

    >>> block = BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, -1.0)
    >>> crossings = white_upcrossings(block, np.array([20.0]), step=0.002)
    >>> round(float(crossings.density[0]), 3)
    1.441
    """

    block: BlockOnBelt
    t: NDArray[np.float64]
    """Times, s [times]."""
    mean: NDArray[np.float64]
    """Means of x (m), v (m/s) and a (m/s^2), [times, 3]."""
    covariance: NDArray[np.float64]
    """Covariances, [times, 3, 3]."""

    @property
    def density(self) -> NDArray[np.float64]:
        """n1(t), upcrossings per second [times] (8.21; 8.46 in a simpler form)."""
        s = self.covariance
        gap = self.block.belt_velocity - self.mean[:, 1]
        mean = self.mean[:, 2] + s[:, 2, 1] / s[:, 1, 1] * gap
        variance = s[:, 2, 2] - s[:, 2, 1] ** 2 / s[:, 1, 1]
        return _normal_density(gap, s[:, 1, 1]) * _positive_part(mean, variance)

    def joint(self, x: ArrayLike) -> NDArray[np.float64]:
        """Return n1(x, t), upcrossings per second and metre, [times, positions] (8.20, 8.27 to 8.29).

        `x` are positions, m, [positions] or [times, positions].
        """
        s = self.covariance
        dx = np.broadcast_to(x, (self.t.size, np.shape(x)[-1])) - self.mean[:, :1]
        deviation = np.stack(np.broadcast_arrays(dx, self.block.belt_velocity - self.mean[:, 1:2]), axis=-1)
        inverse = np.linalg.inv(s[:, :2, :2])
        square = np.einsum("tki,tij,tkj->tk", deviation, inverse, deviation)
        density = np.exp(-0.5 * square) * np.sqrt(np.linalg.det(inverse))[:, None] / (2.0 * math.pi)
        regression = np.einsum("ti,tij->tj", s[:, 2, :2], inverse)
        mean = self.mean[:, 2:] + np.einsum("tj,tkj->tk", regression, deviation)
        variance = s[:, 2, 2] - np.einsum("ti,ti->t", regression, s[:, 2, :2])
        return density * _positive_part(mean, variance[:, None])

    @property
    def escaped(self) -> NDArray[np.float64]:
        """1 - exp(-int_0^t n1): the probability of an upcrossing by t, if they were independent [times]."""
        times, n1 = np.concatenate([[0.0], self.t]), np.concatenate([[0.0], self.density])
        return -np.expm1(-np.cumsum(0.5 * np.diff(times) * (n1[1:] + n1[:-1])))

    def durations(self) -> NDArray[np.float64]:
        """Return the density of the slip duration, 1/s [times], if upcrossings were independent (8.12)."""
        return self.density * (1.0 - self.escaped)

    def distances(self, d: ArrayLike) -> NDArray[np.float64]:
        """Return the density of the distance x0 - x at `d` m, 1/m, if upcrossings were independent (8.14, 8.16)."""
        density = self.joint(self.block.x0 - np.asarray(d, float)) * (1.0 - self.escaped)[:, None]
        return np.asarray(np.trapezoid(density, self.t, axis=0))

    def periods(self, periods: ArrayLike) -> NDArray[np.float64]:
        """Return the density of the period at `periods` s, 1/s, for independent upcrossings (8.14, 8.15 with v_b)."""
        survival = 1.0 - self.escaped
        found = []
        for period in np.atleast_1d(np.asarray(periods, float)):
            slip = self.t <= period
            positions = self.block.x0 - self.block.belt_velocity * (period - self.t)
            density = np.where(slip, self.joint(positions[:, None])[:, 0] * survival, 0.0)
            found.append(self.block.belt_velocity * np.trapezoid(density[slip], self.t[slip]))
        return np.array(found)


def white_upcrossings(block: BlockOnBelt, t: ArrayLike, step: float) -> Upcrossings:
    """Return the upcrossings with white noise averaged over `step` s: an acceleration of variance 2 D / step.

    `t` are rising times above 0, [times] s. The thesis prints the variance 2 D, which is that of step = 1 s, whatever
    the step of its simulations. `BadValue` for values out of range.

    >>> block = BlockOnBelt(1.0, 0.4, 0.5, 1.0, 0.0, 0.0)
    >>> rate = white_upcrossings(block, [200.0, 400.0], step=0.01).density  # that of the stationary block
    >>> bool(abs(rate[0] / rate[1] - 1.0) < 1e-9), bool(abs(rate[1] * escape_time(block, 0.01) - 1.0) < 1e-6)
    (True, True)
    """
    block, times = _checked(block, t)
    number("step", step, TINY, HUGE, "above 0 s")
    free = [transition(block.w0, block.zeta, block.noise, at) for at in times]
    mean = np.zeros((times.size, 3))
    mean[:, :2] = np.array([[[f.a_xx, f.a_xv], [f.a_vx, f.a_vv]] for f in free]) @ np.array([block.x0, block.v0])
    covariance = np.zeros((times.size, 3, 3))
    covariance[:, :2, :2] = [[[f.s_xx, f.s_xv], [f.s_xv, f.s_vv]] for f in free]
    to_acceleration = np.array([-block.w0 * block.w0, -block.zeta])
    mean[:, 2] = mean[:, :2] @ to_acceleration
    covariance[:, 2, :2] = covariance[:, :2, 2] = covariance[:, :2, :2] @ to_acceleration
    covariance[:, 2, 2] = covariance[:, 2, :2] @ to_acceleration + 2.0 * block.noise / step
    return Upcrossings(block, times, mean, covariance)


def coloured_upcrossings(block: BlockOnBelt, t: ArrayLike, correlation_time: float) -> Upcrossings:
    """Return upcrossings with an Ornstein-Uhlenbeck force of `correlation_time` s and variance D / correlation_time.

    The force starts in its stationary distribution. `t` as for `white_upcrossings`; zeta must be above 0. `BadValue`
    for values out of range.

    >>> block = BlockOnBelt(1.0, 0.4, 0.5, 1.0, 0.0, 0.0)
    >>> slow, fast = (coloured_upcrossings(block, [100.0], time_s).density[0] for time_s in (1.0, 0.01))
    >>> bool(slow < fast)  # slower changes of the force cross less often
    True
    """
    from scipy.linalg import solve_continuous_lyapunov

    block, times = _checked(block, t)
    number("zeta", block.zeta, TINY, HUGE, "above 0")
    number("correlation_time", correlation_time, TINY, HUGE, "above 0 s")
    power = block.noise / correlation_time
    motion = np.array([[0.0, 1.0, 0.0], [-block.w0 * block.w0, -block.zeta, 1.0], [0.0, 0.0, -1.0 / correlation_time]])
    stationary = solve_continuous_lyapunov(motion, -np.diag([0.0, 0.0, 2.0 * power / correlation_time]))
    lacking = stationary - np.diag([0.0, 0.0, power])
    to_acceleration = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], motion[1]])
    flow = _exponentials(motion, times)
    mean = flow @ np.array([block.x0, block.v0, 0.0]) @ to_acceleration.T
    covariance = stationary - flow @ lacking @ flow.transpose(0, 2, 1)
    return Upcrossings(block, times, mean, to_acceleration @ covariance @ to_acceleration.T)


def escape_time(block: BlockOnBelt, step: float) -> float:
    """Return the mean time between upcrossings of the stationary free block, T_R in s (8.47 for v instead of x).

    White noise is averaged over `step` s; the block's x0 and v0 have no effect. `BadValue` for values out of range.

    >>> block = BlockOnBelt(1.0, 0.11, 0.04, 1.0, 0.0, 0.0)
    >>> escape_time(block, step=1e-4) < escape_time(block, step=1e-2)
    True
    """
    require_slip(block, 1.0, 0.1)
    w0, zeta, noise, belt_velocity, _, _ = block
    number("zeta", zeta, TINY, HUGE, "above 0")
    number("step", step, TINY, HUGE, "above 0 s")
    variance = noise / zeta
    rate = _positive_part(np.array(-zeta * belt_velocity), np.array(2.0 * noise / step + w0 * w0 * variance))
    return float(1.0 / (_normal_density(np.array(belt_velocity), np.array(variance)) * rate))


def _checked(block: BlockOnBelt, t: ArrayLike) -> tuple[BlockOnBelt, NDArray[np.float64]]:
    times = numbers("t", t)
    rising = times.size > 0 and times[0] > 0.0 and bool(np.all(np.diff(times) > 0.0))
    require(rising, "t", t, "rising times above 0")
    block, _, _ = require_slip(block, float(times[-1]), 0.1)
    return block, times


def _exponentials(matrix: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return exp(matrix t) at each of the rising `times`, [times, n, n], by scaling and squaring of a power series."""
    halvings = max(0, 3 + math.ceil(math.log2(np.abs(matrix).sum(axis=1).max() * times[-1])))
    scaled = matrix * np.ldexp(times, -halvings)[:, None, None]
    identity = np.eye(len(matrix))
    flow = identity + scaled / 12.0
    for n in range(11, 0, -1):
        flow = identity + scaled @ flow / n
    for _ in range(halvings):
        flow = flow @ flow
    return flow


def _normal_density(distance: NDArray[np.float64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.exp(-0.5 * distance * distance / variance) / np.sqrt(2.0 * math.pi * variance)


def _positive_part(mean: NDArray[np.float64], variance: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return int_0^inf a N(a; mean, variance) da (8.28 with its sign corrected)."""
    from scipy.special import ndtr

    return variance * _normal_density(mean, variance) + mean * ndtr(mean / np.sqrt(variance))
