"""The thesis's expansions in upcrossings (8.2.1 to 8.3.2), as the errata correct them: a comparison, not the law.

The density n1 of upcrossings of v_b without stopping, and the law of first ones as if upcrossings were independent
(8.12, 8.14). An upcrossing needs an acceleration. White noise has none: either it is taken over a step h, with
variance 2 D / h, as the thesis's simulations do, or it gets a correlation time. Only the latter means something as
h goes to 0; `friction.first_passage` is the law itself.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers
from underfoot.errors import require
from underfoot.models.stick_slip.oscillator import require_slip, transition


@dataclass(frozen=True)
class Upcrossings:
    """Means and covariances of (x, v, a) of the free block at times `t` [times], and the upcrossings they imply.

    >>> crossings = white_upcrossings(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, np.array([20.0]), step=0.002)
    >>> round(float(crossings.density[0]), 3)
    1.441
    """

    belt_velocity: float
    x0: float
    t: NDArray[np.float64]
    mean: NDArray[np.float64]
    """[times, 3]: of x (m), v (m/s) and a (m/s^2)."""
    covariance: NDArray[np.float64]
    """[times, 3, 3]."""

    @property
    def density(self) -> NDArray[np.float64]:
        """n1(t), upcrossings a second [times] (8.21; 8.46 in the errata's simpler form)."""
        s = self.covariance
        missing = self.belt_velocity - self.mean[:, 1]
        pull = self.mean[:, 2] + s[:, 2, 1] / s[:, 1, 1] * missing
        variance = s[:, 2, 2] - s[:, 2, 1] ** 2 / s[:, 1, 1]
        return _normal(missing, s[:, 1, 1]) * _rising(pull, variance)

    def joint(self, x: ArrayLike) -> NDArray[np.float64]:
        """n1(x, t), upcrossings a second and metre, at places x m [places] or [times, places] (8.20, 8.27 to 8.29)."""
        s = self.covariance
        away = np.broadcast_to(x, (self.t.size, np.shape(x)[-1])) - self.mean[:, :1]
        missing = np.stack(np.broadcast_arrays(away, self.belt_velocity - self.mean[:, 1:2]), axis=-1)
        inverse = np.linalg.inv(s[:, :2, :2])
        square = np.einsum("tki,tij,tkj->tk", missing, inverse, missing)
        height = np.exp(-0.5 * square) * np.sqrt(np.linalg.det(inverse))[:, None] / (2.0 * math.pi)
        tie = np.einsum("ti,tij->tj", s[:, 2, :2], inverse)
        pull = self.mean[:, 2:] + np.einsum("tj,tkj->tk", tie, missing)
        variance = s[:, 2, 2] - np.einsum("ti,ti->t", tie, s[:, 2, :2])
        return height * _rising(pull, variance[:, None])

    @property
    def escaped(self) -> NDArray[np.float64]:
        """1 - exp(-int_0^t n1): the share with an upcrossing, if they were independent [times]."""
        times, n1 = np.concatenate([[0.0], self.t]), np.concatenate([[0.0], self.density])
        return -np.expm1(-np.cumsum(0.5 * np.diff(times) * (n1[1:] + n1[:-1])))

    def durations(self) -> NDArray[np.float64]:
        """Density of the slip duration, 1/s [times], if upcrossings were independent (8.12)."""
        return self.density * (1.0 - self.escaped)

    def distances(self, d: ArrayLike) -> NDArray[np.float64]:
        """Density of the slip distance x0 - x at `d` m, 1/m, if upcrossings were independent (8.14, 8.16)."""
        law = self.joint(self.x0 - np.asarray(d, float)) * (1.0 - self.escaped)[:, None]
        return np.asarray(np.trapezoid(law, self.t, axis=0))

    def periods(self, periods: ArrayLike) -> NDArray[np.float64]:
        """Density of the period at `periods` s, 1/s, if upcrossings were independent (8.14, 8.15 with v_b)."""
        left = 1.0 - self.escaped
        out = []
        for period in np.atleast_1d(np.asarray(periods, float)):
            slip = self.t <= period
            places = self.x0 - self.belt_velocity * (period - self.t)
            law = np.where(slip, self.joint(places[:, None])[:, 0] * left, 0.0)
            out.append(self.belt_velocity * np.trapezoid(law[slip], self.t[slip]))
        return np.array(out)


def white_upcrossings(
    w0: float,
    zeta: float,
    noise: float,
    belt_velocity: float,
    x0: float,
    v0: float,
    t: ArrayLike,
    step: float,
) -> Upcrossings:
    """Upcrossings with white noise seen over `step` s: an acceleration of variance 2 D / step.

    Parameters as for `friction.first_passage`; `t` rising, above 0, [times] s. The thesis prints the variance 2 D,
    which is step = 1 s whatever its simulations' step was. `BadValue` for values out of range.
    """
    times = _times(w0, zeta, noise, belt_velocity, x0, v0, t)
    number("step", step, TINY, HUGE, "above 0 s")
    moments = np.array([transition(w0, zeta, noise, at) for at in times])
    start = np.array([x0, v0])
    mean = np.zeros((times.size, 3))
    mean[:, :2] = moments[:, :4].reshape(-1, 2, 2) @ start
    covariance = np.zeros((times.size, 3, 3))
    covariance[:, :2, :2] = moments[:, [4, 5, 5, 6]].reshape(-1, 2, 2)
    pull = np.array([-w0 * w0, -zeta])
    mean[:, 2] = mean[:, :2] @ pull
    covariance[:, 2, :2] = covariance[:, :2, 2] = covariance[:, :2, :2] @ pull
    covariance[:, 2, 2] = covariance[:, 2, :2] @ pull + 2.0 * noise / step
    return Upcrossings(belt_velocity, x0, times, mean, covariance)


def coloured_upcrossings(
    w0: float,
    zeta: float,
    noise: float,
    belt_velocity: float,
    x0: float,
    v0: float,
    t: ArrayLike,
    correlation_time: float,
) -> Upcrossings:
    """Upcrossings with an Ornstein-Uhlenbeck force of `correlation_time` s and variance D / correlation_time.

    It starts in its own law. Parameters as for `white_upcrossings`, zeta above 0. `BadValue` for values out of range.
    """
    from scipy.linalg import solve_continuous_lyapunov

    times = _times(w0, zeta, noise, belt_velocity, x0, v0, t)
    number("zeta", zeta, TINY, HUGE, "above 0")
    number("correlation_time", correlation_time, TINY, HUGE, "above 0 s")
    power = noise / correlation_time
    motion = np.array([[0.0, 1.0, 0.0], [-w0 * w0, -zeta, 1.0], [0.0, 0.0, -1.0 / correlation_time]])
    settled = solve_continuous_lyapunov(motion, -np.diag([0.0, 0.0, 2.0 * power / correlation_time]))
    missing = settled - np.diag([0.0, 0.0, power])
    to_acceleration = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], motion[1]])
    flow = _exponentials(motion, times)
    mean = flow @ np.array([x0, v0, 0.0]) @ to_acceleration.T
    covariance = settled - flow @ missing @ flow.transpose(0, 2, 1)
    return Upcrossings(belt_velocity, x0, times, mean, to_acceleration @ covariance @ to_acceleration.T)


def escape_time(w0: float, zeta: float, noise: float, belt_velocity: float, step: float) -> float:
    """The mean time between upcrossings of the settled free block, T_R in s (8.47 for v instead of x, errata).

    White noise seen over `step` s. `BadValue` for values out of range.

    >>> escape_time(1.0, 0.11, 0.04, 1.0, step=1e-4) < escape_time(1.0, 0.11, 0.04, 1.0, step=1e-2)
    True
    """
    require_slip(w0, zeta, noise, belt_velocity, 0.0, 0.0, 1.0, 0.1)
    number("zeta", zeta, TINY, HUGE, "above 0")
    number("step", step, TINY, HUGE, "above 0 s")
    level = noise / zeta
    rising = _rising(np.array(-zeta * belt_velocity), np.array(2.0 * noise / step + w0 * w0 * level))
    return float(1.0 / (_normal(np.array(belt_velocity), np.array(level)) * rising))


def _times(w0, zeta, noise, belt_velocity, x0, v0, t) -> NDArray[np.float64]:
    times = numbers("t", t)
    rising = times.size > 0 and times[0] > 0.0 and bool(np.all(np.diff(times) > 0.0))
    require(rising, "t", t, "rising times above 0")
    require_slip(w0, zeta, noise, belt_velocity, x0, v0, float(times[-1]), 0.1)
    return times


def _exponentials(matrix: NDArray[np.float64], times: NDArray[np.float64]) -> NDArray[np.float64]:
    """exp(matrix t) at each of the rising `times`, [times, n, n]: a power series at a share of them, doubled up."""
    halvings = max(0, 3 + math.ceil(math.log2(np.abs(matrix).sum(axis=1).max() * times[-1])))
    part = matrix * np.ldexp(times, -halvings)[:, None, None]
    unit = np.eye(len(matrix))
    flow = unit + part / 12.0
    for n in range(11, 0, -1):
        flow = unit + part @ flow / n
    for _ in range(halvings):
        flow = flow @ flow
    return flow


def _normal(distance, variance):
    return np.exp(-0.5 * distance * distance / variance) / np.sqrt(2.0 * math.pi * variance)


def _rising(mean, variance):
    """int_0^inf a N(a; mean, variance) da (8.28 with the sign of the errata)."""
    from scipy.special import ndtr

    return variance * _normal(mean, variance) + mean * ndtr(mean / np.sqrt(variance))
