"""Choice of a panel's grid of positions: its range, its spacing and whether it moves with the belt."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadValue
from underfoot.models.stick_slip.boundary_integral import Grid
from underfoot.models.stick_slip.free_crossings import Crossing, FreeCrossings
from underfoot.models.stick_slip.panels import GAUSS_NODES

WIDTH_TO_SPACING = 1.1
"""Standard deviation of a component over the spacing: wide enough to interpolate, narrow enough to invert."""

_MOST_POINTS = 600


class PanelGrids:
    """Chooses the grids of one solution, panel after panel. `error` is the asked largest CDF difference."""

    def __init__(self, crossings: FreeCrossings, error: float) -> None:
        self._crossings, self._error = crossings, error
        w0, _, noise, belt_velocity, _, _ = crossings.block
        # Where the deceleration on the line changes sign, the density varies over the distance that the belt covers
        # until noise and deceleration balance: sqrt(2 D t) = w0^2 v_b t^2 / 2.
        self._shortest_length = belt_velocity * (8.0 * noise / (w0**4 * belt_velocity * belt_velocity)) ** (1.0 / 3.0)
        self._last: Grid | None = None
        self.spacing_ratio = 0.7
        """Spacing over the shortest length on which the density varies."""

    def choose(self, time: float, length: float) -> Grid | None:
        """Return a grid for the panel from `time` s on, `length` s long; None if the probability is negligible."""
        times = [time, *(time + 0.5 * length * (1.0 + GAUSS_NODES)), time + length]
        crossings = [self._crossings.at(at) for at in times]
        speed = self._speed(time, crossings[len(crossings) // 2].deviation)
        low, high = math.inf, -math.inf
        for at, crossing in zip(times, crossings, strict=True):
            if crossing.reach > 0.0:
                mean = crossing.mean - speed * (at - time)
                low = min(low, mean - crossing.reach * crossing.deviation)
                high = max(high, mean + crossing.reach * crossing.deviation)
        if high < low:
            return None
        self._last = self._covering(low, high, speed, self._spacing(crossings), time)
        return self._last

    def adapt(self, aliasing: float) -> None:
        """Refine or coarsen later grids, by the `aliasing` of a solved panel."""
        if aliasing > 0.1 * self._error:
            octaves = 0.125 if aliasing <= self._error else 0.25 if aliasing < 10.0 * self._error else 0.5
            self.spacing_ratio *= 2.0**-octaves
        elif aliasing < 1e-3 * self._error:
            self.spacing_ratio = min(self.spacing_ratio * 2.0**0.125, 0.9)

    def _speed(self, time: float, deviation: float) -> float:
        """Return the grid's speed: the belt's while the density is narrower than the distance the belt has covered."""
        _, zeta, _, belt_velocity, _, _ = self._crossings.block
        damped = 2.0 * belt_velocity / zeta if zeta > 0.0 else math.inf
        covered = min(belt_velocity * time, self._shortest_length, damped)
        return belt_velocity if deviation < 0.4 * covered else 0.0

    def _spacing(self, crossings: list[Crossing]) -> float:
        """Return a spacing, rounded down to quarters of an octave, so that neighbouring panels often share a grid."""
        spacing = self.spacing_ratio * min(self._shortest_length, *(crossing.deviation for crossing in crossings))
        return float(2.0 ** (math.floor(4.0 * math.log2(spacing)) / 4.0))

    def _covering(self, low: float, high: float, speed: float, spacing: float, time: float) -> Grid:
        """Return a grid from `low` to `high` m: the last one if it fits, as its equations are solved already."""
        step = 3.0 * spacing
        edge = math.floor(low / step) - 1
        points = 3 * (math.ceil(high / step) + 1 - edge) + 1
        if points > _MOST_POINTS:
            raise too_much_work(self._crossings.t_end, time)
        last = self._last
        if last is not None and last.spacing == spacing and speed == last.speed == 0.0 and points > 0.75 * last.points:
            end = last.first + (last.points - 1) * spacing
            if last.first <= low - spacing and high + spacing <= end:
                return last
        return Grid(edge * step, spacing, WIDTH_TO_SPACING * spacing, points, speed)


def aliasing_of(density: NDArray[np.float64], spacing: float, length: float) -> float:
    """Return the part of a panel's `density` [node, point] that its grid does not resolve, as a probability.

    `spacing` is that of the points in m, `length` that of the panel in s.

    >>> x = np.linspace(-6.0, 6.0, 65)
    >>> wide, narrow = (np.exp(-0.5 * (x / width) ** 2)[None, :] for width in (1.0, 0.1))
    >>> aliasing_of(wide, 12.0 / 64, 0.1) < 1e-9, aliasing_of(narrow, 12.0 / 64, 0.1) > 1e-4
    (True, True)
    """
    spectrum = np.abs(np.fft.rfft(density, axis=1))
    # The components mistake a wave at this part of the highest wavenumber for its alias, by this share.
    part = 2.0 * np.arange(spectrum.shape[1]) / density.shape[1]
    share = 1.0 / (1.0 + np.exp(2.0 * math.pi**2 * WIDTH_TO_SPACING**2 * (1.0 - part)))
    return math.sqrt(2.0) * length * spacing * float(np.sqrt(((spectrum * share) ** 2).sum(axis=1)).max())


def too_much_work(t_end: float, time: float) -> BadValue:
    """Return the error for slips whose observation beyond `time` s would take an excessive amount of work."""
    return BadValue(f"t_end is {t_end!r}; allowed for these values: up to {time:.3g}, or a larger error")
