"""Solver of the first-passage density of a slip, panel by panel, to a requested error without further parameters.

A panel is tried at a length, judged by the decay of its Legendre coefficients (time) and of its spectrum (position),
and kept or halved. Once the hazard rate is constant, an exponential tail replaces the rest. Finally the solution is
checked with an equation that was not used to find it (`subtract_exceedance`); if that misses the requested error, the
solution is repeated at a tighter tolerance.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadValue
from underfoot.models.stick_slip.boundary_integral import (
    Grid,
    add_history_term,
    add_source_term,
    collocation_matrix,
    subtract_exceedance,
)
from underfoot.models.stick_slip.exponential_tail import append_exponential, constant_hazard
from underfoot.models.stick_slip.free_crossings import Crossing, FreeCrossings, exceedance, shortest_time
from underfoot.models.stick_slip.oscillator import BlockOnBelt, require_slip
from underfoot.models.stick_slip.panel_buffer import PanelBuffer
from underfoot.models.stick_slip.panel_grid import WIDTH_TO_SPACING, PanelGrids, aliasing_of, too_much_work
from underfoot.models.stick_slip.panels import GAUSS_NODES, NODES_PER_PANEL, TO_LEGENDRE, Panels

_MOST_WEIGHTS = 60_000
_MOST_STEPS = 100_000
_MOST_TRIALS = 60
_LEAST_SPACING_RATIO = 0.03
_ERROR_TO_RESIDUAL = 10.0
"""Assumed ratio of CDF error to largest residual; it was 1 to 10 in all sets tried."""

_TOLERANCE_TO_ERROR = 4.0
"""Tolerance of a panel's Legendre coefficients over the requested error, which is then met 2 to 50 times over."""


def solve(block: BlockOnBelt, t_end: float, error: float) -> Panels:
    """Solve for the first-passage density up to `t_end` s, to `error` (largest CDF difference; 1e-6 to 0.1).

    `BadValue` for values out of range, and if the work would be excessive.

    >>> panels = solve(BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, -1.0), 20.0, 1e-2)
    >>> panels.rates.shape == (len(panels.table), NODES_PER_PANEL)
    True
    """
    block, t_end, error = require_slip(block, t_end, error)
    target = error
    for left in reversed(range(4)):
        solver = _Solver(block, t_end, target)
        panels, residual = solver.run()
        # The growth in a tail is a worst case: a reason to try again, but not to refuse.
        growth = solver.growth_in_tail if left else 1.0
        if _ERROR_TO_RESIDUAL * residual * growth <= error:
            return Panels(panels.table.copy(), panels.weights.copy(), panels.rates.copy())
        target *= 0.25
    raise BadValue(f"error is {error!r}; allowed for these values: above {_ERROR_TO_RESIDUAL * residual:.1e}")


class _Solver:
    """One pass through time, from slip onset to `t_end` or until all slips have ended."""

    def __init__(self, block: BlockOnBelt, t_end: float, error: float) -> None:
        self.block, self.t_end, self.error = block, t_end, error
        self.tolerance = _TOLERANCE_TO_ERROR * error
        self.buffer = PanelBuffer(negligible=0.03 * error)
        self.crossings = FreeCrossings(block, t_end, self.buffer.negligible)
        self.grids = PanelGrids(self.crossings, error)
        self.equation: _PanelEquation | None = None
        self.shortest_lag = shortest_time(block)
        self.growth = 32.0
        """Expected growth of the last Legendre coefficients when a panel is doubled in length."""
        self.growth_in_tail = 1.0
        """Growth of an error of the hazard rate during the exponential tail."""

    def run(self) -> tuple[Panels, float]:
        """Return the panels, and the largest residual, a probability."""
        time = self.crossings.earliest()
        length = 0.5 * time
        steps = 0
        while time < self.t_end * (1.0 - 1e-12) and 1.0 - self.buffer.ended > self.buffer.negligible:
            steps += 1
            if self.buffer.weight_count > _MOST_WEIGHTS or steps > _MOST_STEPS:
                raise too_much_work(self.t_end, time)
            crossing = self.crossings.at(time)
            if skipped := self.negligible_time(time, crossing):
                time += skipped
                length = min(0.5 * time, crossing.time_scale)
                continue
            length = min(length, 2.5 * crossing.time_scale, time, 1.5 / self.block.w0)
            time, length = self.advance(time, length)
            if hazard := constant_hazard(self.buffer, self.block, time, self.t_end, self.error):
                residual = self.residual()
                lasts = min(math.exp(-1.0) / hazard, self.t_end - time)
                self.growth_in_tail = max(1.0, self.block.w0 * lasts * (1.0 - self.buffer.ended))
                append_exponential(self.buffer, time, self.t_end, hazard)
                return self.buffer.panels(), residual
        return self.buffer.panels(), self.residual()

    def negligible_time(self, time: float, crossing: Crossing) -> float:
        """Return how long, from `crossing` at `time` on, crossings are negligible, s; 0 if they are not."""
        if crossing.reach >= 0.0:
            return 0.0
        most = min(0.5 * time, 0.3 / self.block.w0, self.t_end - time)
        skipped = min(max(0.3 * crossing.time_scale, crossing.negligible_for), most)
        return skipped if self.crossings.at(time + skipped).reach < 0.0 else 0.0

    def advance(self, time: float, length: float) -> tuple[float, float]:
        """Append one panel at `time` s, about `length` s long; return its end and a length for the next."""
        left = self.t_end - time
        trial = left if left < 1.4 * length else 0.5 * left if left < 2.0 * length else length
        for _ in range(_MOST_TRIALS):
            truncation, aliasing = self.try_panel(time, trial)
            if truncation <= self.tolerance and aliasing <= self.error:
                longer = truncation * self.growth < self.tolerance
                self.growth = max(0.8 * self.growth, 32.0)
                return time + trial, 2.0 * trial if longer else trial
            if truncation > self.tolerance:
                trial *= 0.5
                self.growth = max(4.0 * self.growth, 1e3)
            if self.grids.spacing_ratio < _LEAST_SPACING_RATIO:
                break
        raise BadValue(f"error is {self.error!r}; allowed for these values: larger (it stalls at {time:.3g} s)")

    def try_panel(self, time: float, length: float) -> tuple[float, float]:
        """Solve one panel and append it if it is accurate enough; return its truncation and aliasing errors.

        Both are probabilities: of the last two Legendre coefficients, and of what the grid does not resolve.
        """
        grid = self.grids.choose(time, length)
        if grid is None:
            return 0.0, 0.0
        shortest_lag = self.shortest_lag_on(grid)
        self.shortest_lag = min(self.shortest_lag, shortest_lag)
        times = time + 0.5 * length * (1.0 + GAUSS_NODES)
        known = np.zeros((NODES_PER_PANEL, grid.points))
        add_source_term(self.block, grid, time, times, known)
        add_history_term(self.block, self.buffer.panels(), shortest_lag, grid, time, times, known)
        if self.equation is None or not self.equation.holds_for(grid, length):
            self.equation = _PanelEquation(self.block, grid, length, shortest_lag)
        good = 1e-3 * self.buffer.negligible / (length * grid.points * grid.spacing)
        weights, density = self.equation.solve(known, good)

        truncation = float(np.abs(TO_LEGENDRE[-2:] @ density).sum()) * grid.spacing * length
        aliasing = aliasing_of(density, grid.spacing, length)
        if truncation <= self.tolerance and aliasing <= self.error:
            self.buffer.append(time, length, grid, weights)
        self.grids.adapt(aliasing)
        return truncation, aliasing

    def shortest_lag_on(self, grid: Grid) -> float:
        """Return the lag, s, below which the kernel on `grid` is a power series in the square root of the lag."""
        w0, zeta, noise, belt_velocity, _, _ = self.block
        ends = (grid.first, grid.first + grid.points * grid.spacing)
        deceleration = max(abs(w0 * w0 * x + zeta * belt_velocity) for x in ends)
        return 0.5 * min(shortest_time(self.block), 4.0 * noise / (deceleration * deceleration))

    def residual(self) -> float:
        """Return the largest difference of P(v > v_b) of the free motion, directly and from the solved slips."""
        panels = self.buffer.panels()
        start, length = panels.table["start"], panels.table["length"]
        times = np.sort(np.concatenate([start + 0.5 * length, start + length]))
        left = np.array([exceedance(self.block, time) for time in times])
        subtract_exceedance(self.block, panels, self.shortest_lag, times, left)
        return float(np.abs(left).max(initial=0.0))


class _PanelEquation:
    """Integral equation on one panel, for any known terms from before it."""

    def __init__(self, block: BlockOnBelt, grid: Grid, length: float, shortest_lag: float) -> None:
        self._grid, self._length = grid, length
        matrix = np.empty((NODES_PER_PANEL, grid.points, NODES_PER_PANEL, grid.points))
        collocation_matrix(block, grid, length, shortest_lag, matrix)
        self._matrix = matrix.reshape(NODES_PER_PANEL * grid.points, -1)
        apart = np.subtract.outer(np.arange(grid.points), np.arange(grid.points)) / WIDTH_TO_SPACING
        self._to_weights = np.linalg.inv(np.exp(-0.5 * apart * apart) / (math.sqrt(2.0 * math.pi) * grid.width))

    def holds_for(self, grid: Grid, length: float) -> bool:
        """Return whether this is the equation of a panel on `grid` that is `length` s long."""
        return (self._grid, self._length) == (grid, length)

    def solve(self, known: NDArray[np.float64], good: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return weights and density, both [node, point], by fixed-point iteration until the change is below `good`."""
        density = known
        for _ in range(60):
            weights = density @ self._to_weights
            next_density = known + (weights.ravel() @ self._matrix).reshape(known.shape)
            if np.abs(next_density - density).max() <= good:
                break
            density = next_density
        return weights, next_density
