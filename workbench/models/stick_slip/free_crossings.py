"""Crossings of the belt velocity by the free motion (without absorption): an upper bound of the first passage.

The state of the free motion is Gaussian at any time. The bounds tell which times and positions the solution needs, and
how fast it can change there.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from underfoot.models.stick_slip.oscillator import BlockOnBelt, transition


class Crossing(NamedTuple):
    """Crossing of the belt velocity by the free motion at one time."""

    mean: float
    """Mean of x, given v = v_b, m."""
    deviation: float
    """Standard deviation of x, given v = v_b, m."""
    reach: float
    """Half-width of the relevant range of x, in standard deviations; negative: the crossing is negligible."""
    time_scale: float
    """Time in which the mean velocity can change by one of its standard deviations, s."""
    negligible_for: float
    """Time for which the crossing stays negligible, s."""


@dataclass(frozen=True)
class FreeCrossings:
    """Bounds for a block that is observed for `t_end` s, where a probability of `negligible` does not matter."""

    block: BlockOnBelt
    t_end: float
    negligible: float

    def earliest(self) -> float:
        """Return a time, s, before which no crossing matters."""
        w0, zeta, noise, belt_velocity, x0, v0 = self.block
        gap = belt_velocity - v0
        diffusing = gap * gap / (4.0 * noise) / (2.0 * math.log(1.0 / self.negligible) + 10.0)
        moving = _time_to_cover(0.05 * gap, abs(w0 * w0 * x0 + zeta * v0), w0 * w0 * abs(v0))
        return min(diffusing, moving, 0.02 * shortest_time(self.block), 0.01 * self.t_end)

    def at(self, time: float) -> Crossing:
        """Return the crossing at `time` s."""
        w0, zeta, noise, belt_velocity, x0, v0 = self.block
        free = transition(w0, zeta, noise, time)
        mean_x = free.a_xx * x0 + free.a_xv * v0
        mean_v = free.a_vx * x0 + free.a_vv * v0
        gap = belt_velocity - mean_v
        deviation = math.sqrt(free.s_xx - free.s_xv * free.s_xv / free.s_vv)
        mean = mean_x + free.s_xv / free.s_vv * gap
        # Velocities within the diffusion's boundary layer count as at the belt velocity.
        layer = math.sqrt(noise * min(time, shortest_time(self.block)))
        distance = max(0.0, gap - layer) if gap > 0.0 else -gap
        spread = math.sqrt(free.s_vv)
        flux = abs(w0 * w0 * mean + zeta * belt_velocity) + 2.0 * noise / layer + 3.0 * w0 * w0 * deviation
        most = flux * min(self.t_end, 1.0 / w0 + time) / math.sqrt(2.0 * math.pi * free.s_vv)
        log_ratio = math.log(most / self.negligible)
        excess = log_ratio - 0.5 * (distance / spread) ** 2
        reach = math.sqrt(2.0 * excess) + 0.3 if excess > 0.0 else -1.0
        # In a time t the mean velocity changes by at most about |a| t + w0^2 |v| t^2; its deviation grows ever slower.
        acceleration = abs(w0 * w0 * mean_x + zeta * mean_v)
        jerk = w0 * w0 * abs(mean_v)
        needed = math.sqrt(2.0 * max(log_ratio, 0.0))
        negligible_for = _time_to_cover(
            0.5 * (distance - needed * spread), acceleration + needed * noise / spread, jerk
        )
        return Crossing(mean, deviation, reach, _time_to_cover(spread, acceleration, jerk), negligible_for)


def shortest_time(block: BlockOnBelt) -> float:
    """Return the shorter of the oscillator's two time constants, 1/w0 and 1/zeta, s.

    >>> shortest_time(BlockOnBelt(20.0, 50.0, 0.4, 1.0, 0.0, 0.0))
    0.02
    """
    return 1.0 / max(block.w0, block.zeta)


def exceedance(block: BlockOnBelt, time: float) -> float:
    """Return the probability that the velocity of the free motion is above the belt's at `time` s.

    >>> round(exceedance(BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, 0.0), 100.0), 3)
    0.309
    """
    free = transition(block.w0, block.zeta, block.noise, time)
    gap = block.belt_velocity - free.a_vx * block.x0 - free.a_vv * block.v0
    return 0.5 * math.erfc(gap / math.sqrt(2.0 * free.s_vv))


def _time_to_cover(distance: float, speed: float, acceleration: float) -> float:
    """Return the time t in which speed t + acceleration t^2 reaches `distance`; 0 if that is negative."""
    if distance <= 0.0:
        return 0.0
    root = speed + math.sqrt(speed * speed + 4.0 * acceleration * distance)
    return 2.0 * distance / root if root > 0.0 else math.inf
