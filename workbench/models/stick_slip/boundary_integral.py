"""First-passage density from a Volterra integral equation on the line v = v_b, one dimension less than Fokker-Planck.

Without absorption at the belt velocity, the state would have its free Gaussian density G. A path that reaches the
line at (x', s) would continue from there, so the density of paths still slipping at t is

    P(x, v, t) = G(x, v, t | start) - int ds dx' F(x', s) G(x, v, t - s | x', v_b).

F is the first-passage density, over time and position of the slip's end: the probability flux through the line
(8.6: F = -D dP/dv there, where P = 0). Twice the derivative of P on the line plus the deceleration
a = w0^2 x + zeta v_b times its value gives an equation of the second kind,

    F = R(start) + int F R,   R = -(2 D d/dv + a) G for the start, (2 D d/dv + a) G for the line,

whose kernel R goes to 0 as sqrt(t - s). (Fortet and Buonocore et al. have the equation for one dimension; here it is
used for two.)

F is represented as in `panels`. A normal component stays normal under the free motion, so R of a component is known in
closed form for any lag t - s.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import allocating, kernel
from underfoot.models.stick_slip.oscillator import BlockOnBelt, transition
from underfoot.models.stick_slip.panels import (
    GAUSS_NODES,
    GAUSS_WEIGHTS,
    NODES_PER_PANEL,
    Panels,
    interpolate_weights,
    lagrange_basis,
)

_LARGEST_LAG_RATIO = 3.0
"""Largest ratio of lags within a panel for which its own nodes are used; beyond, it is subdivided."""
_MOST_LAGS = 64 * NODES_PER_PANEL
_RESTART = 16
"""Components after which the recurrence of `_response` restarts."""


class Grid(NamedTuple):
    """Evenly spaced positions on the line, each the mean of a component; the grid may move."""

    first: float
    """Position of the first point, m."""
    spacing: float
    """m."""
    width: float
    """Standard deviation of the components, m."""
    points: int
    speed: float
    """m/s."""


class _Response(NamedTuple):
    """R of unit components, [component, point], and the memory that it is computed in, [point]."""

    values: NDArray[np.float64]
    density: NDArray[np.float64]
    ratio: NDArray[np.float64]


@kernel
def add_source_term(
    block: BlockOnBelt, grid: Grid, since: float, times: NDArray[np.float64], out: NDArray[np.float64]
) -> None:
    """Add R of the start to `out[time, point]` at `times`, on the points of `grid`, positioned at time `since`."""
    for i in range(times.size):
        free = transition(block.w0, block.zeta, block.noise, times[i])
        inverse = 1.0 / (free.s_xx * free.s_vv - free.s_xv * free.s_xv)
        dv = block.belt_velocity - free.a_vx * block.x0 - free.a_vv * block.v0
        for k in range(out.shape[1]):
            x = grid.first + grid.speed * (times[i] - since) + k * grid.spacing
            dx = x - free.a_xx * block.x0 - free.a_xv * block.v0
            relative = math.exp(
                -0.5 * inverse * (free.s_vv * dx * dx - 2.0 * free.s_xv * dx * dv + free.s_xx * dv * dv)
            )
            factor = (
                block.w0 * block.w0 * x
                + block.zeta * block.belt_velocity
                - 2.0 * block.noise * inverse * (free.s_xx * dv - free.s_xv * dx)
            )
            out[i, k] -= relative * math.sqrt(inverse) / (2.0 * math.pi) * factor


@allocating
@kernel
def add_history_term(
    block: BlockOnBelt,
    panels: Panels,
    shortest_lag: float,
    grid: Grid,
    since: float,
    times: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Add the integral of F R over `panels`, all before `times`, to `out[time, point]`.

    Below the lag `shortest_lag`, s, R is a power series in the square root of the lag. `grid` is positioned at time
    `since`.
    """
    most, points = _most_components(panels), out.shape[1]
    lags, lag_weights, basis = np.empty(_MOST_LAGS), np.empty(_MOST_LAGS), np.empty(NODES_PER_PANEL)
    source_weights = np.empty(most)
    response = _Response(np.empty((most, points)), np.empty(points), np.empty(points))
    for i in range(times.size):
        target = _moved(grid, times[i] - since)
        for j in range(panels.table.size):
            panel = panels.table[j]
            source = Grid(panel.first, panel.spacing, panel.width, panel.components, panel.speed)
            nearest, farthest = times[i] - panel.start - panel.length, times[i] - panel.start
            count = _lag_quadrature(nearest, farthest, shortest_lag, lags, lag_weights)
            for m in range(count):
                elapsed = times[i] - lags[m] - panel.start
                lagrange_basis(2.0 * elapsed / panel.length - 1.0, basis)
                interpolate_weights(panels, j, basis, source_weights)
                _response(block, lags[m], _moved(source, elapsed), target, response)
                for q in range(source.points):
                    weight = lag_weights[m] * source_weights[q]
                    for k in range(target.points):
                        out[i, k] += weight * response.values[q, k]


@allocating
@kernel
def collocation_matrix(
    block: BlockOnBelt, grid: Grid, length: float, shortest_lag: float, out: NDArray[np.float64]
) -> None:
    """Fill `out[source node, component, target node, point]` with the integral of F R over a panel up to its nodes."""
    lags, lag_weights, basis = np.empty(_MOST_LAGS), np.empty(_MOST_LAGS), np.empty(NODES_PER_PANEL)
    response = _Response(np.empty((grid.points, grid.points)), np.empty(grid.points), np.empty(grid.points))
    out[:] = 0.0
    for i in range(NODES_PER_PANEL):
        time = 0.5 * length * (1.0 + GAUSS_NODES[i])
        target = _moved(grid, time)
        count = _lag_quadrature(0.0, time, shortest_lag, lags, lag_weights)
        for m in range(count):
            elapsed = time - lags[m]
            lagrange_basis(2.0 * elapsed / length - 1.0, basis)
            _response(block, lags[m], _moved(grid, elapsed), target, response)
            for n in range(NODES_PER_PANEL):
                factor = lag_weights[m] * basis[n]
                for q in range(grid.points):
                    for k in range(grid.points):
                        out[n, q, i, k] += factor * response.values[q, k]


@allocating
@kernel
def subtract_exceedance(
    block: BlockOnBelt,
    panels: Panels,
    shortest_lag: float,
    times: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Subtract from `out` the probability that a slip ended before `times` and its free continuation is above v_b then.

    If `out` holds the probability that the free motion from the start is above v_b, the difference is the residual of
    an equation that F satisfies and that was not used to find it.
    """
    lags, lag_weights, basis = np.empty(_MOST_LAGS), np.empty(_MOST_LAGS), np.empty(NODES_PER_PANEL)
    source_weights = np.empty(_most_components(panels))
    for i in range(times.size):
        for j in range(panels.table.size):
            panel = panels.table[j]
            if panel.start >= times[i]:
                break
            nearest, farthest = max(0.0, times[i] - panel.start - panel.length), times[i] - panel.start
            count = _lag_quadrature(nearest, farthest, shortest_lag, lags, lag_weights)
            for m in range(count):
                elapsed = times[i] - lags[m] - panel.start
                lagrange_basis(2.0 * elapsed / panel.length - 1.0, basis)
                interpolate_weights(panels, j, basis, source_weights)
                free = transition(block.w0, block.zeta, block.noise, lags[m])
                scale = math.sqrt(2.0 * (free.s_vv + free.a_vx * free.a_vx * panel.width * panel.width))
                for q in range(panel.components):
                    mean = panel.first + panel.speed * elapsed + q * panel.spacing
                    dv = block.belt_velocity - free.a_vx * mean - free.a_vv * block.belt_velocity
                    out[i] -= lag_weights[m] * source_weights[q] * 0.5 * math.erfc(dv / scale)


@kernel
def _moved(grid: Grid, elapsed: float) -> Grid:
    return Grid(grid.first + grid.speed * elapsed, grid.spacing, grid.width, grid.points, grid.speed)


@kernel
def _most_components(panels: Panels) -> int:
    most = 0
    for panel in panels.table:
        most = max(most, panel.components)
    return most


@kernel
def _response(block: BlockOnBelt, lag: float, source: Grid, target: Grid, out: _Response) -> None:
    """Compute R of unit components on `source`, a lag earlier, at the points of `target`.

    From one component to the next the exponent has constant second differences, so the density is updated by two
    products. It is recomputed now and then, because a value that starts in underflow would stay 0.
    """
    density, ratio = out.density, out.ratio
    w0, zeta, noise, belt_velocity = block.w0, block.zeta, block.noise, block.belt_velocity
    a_xx, a_xv, a_vx, a_vv, s_xx, s_xv, s_vv = transition(w0, zeta, noise, lag)
    s_xx += a_xx * a_xx * source.width * source.width
    s_xv += a_xx * a_vx * source.width * source.width
    s_vv += a_vx * a_vx * source.width * source.width
    inverse = 1.0 / (s_xx * s_vv - s_xv * s_xv)
    c_xx = s_vv * inverse
    c_xv = -s_xv * inverse
    c_vv = s_xx * inverse
    norm = math.sqrt(inverse) / (2.0 * math.pi)
    step_x = -a_xx * source.spacing
    step_v = -a_vx * source.spacing
    second_difference = -(c_xx * step_x * step_x + 2.0 * c_xv * step_x * step_v + c_vv * step_v * step_v)
    ratio_of_ratios = math.exp(second_difference)
    factor_step = (w0 * w0 - 2.0 * noise * c_xv) * target.spacing
    for q in range(source.points):
        dx0 = target.first - a_xx * (source.first + q * source.spacing) - a_xv * belt_velocity
        dv = belt_velocity - a_vx * (source.first + q * source.spacing) - a_vv * belt_velocity
        if q % _RESTART == 0:
            for k in range(target.points):
                dx = dx0 + k * target.spacing
                exponent = -0.5 * (c_xx * dx * dx + 2.0 * c_xv * dx * dv + c_vv * dv * dv)
                if exponent < -600.0:
                    density[k] = 0.0
                    ratio[k] = 0.0
                else:
                    slope = -(c_xx * dx * step_x + c_xv * (dx * step_v + dv * step_x) + c_vv * dv * step_v)
                    density[k] = norm * math.exp(exponent)
                    ratio[k] = math.exp(slope + 0.5 * second_difference)
        factor = w0 * w0 * target.first + zeta * belt_velocity - 2.0 * noise * (c_vv * dv + c_xv * dx0)
        for k in range(target.points):
            out.values[q, k] = density[k] * (factor + factor_step * k)
            density[k] *= ratio[k]
            ratio[k] *= ratio_of_ratios


@kernel
def _lag_quadrature(
    nearest: float, farthest: float, shortest_lag: float, lags: NDArray[np.float64], weights: NDArray[np.float64]
) -> int:
    """Write the quadrature over the lags from nearest to farthest into `lags` and `weights`; return its length.

    Gauss-Legendre rules, each over at most a certain ratio of lags; in the square root of the lag if it starts at 0.
    """
    if farthest <= _LARGEST_LAG_RATIO * nearest:
        _gauss_rule(nearest, farthest, lags, weights)
        return NODES_PER_PANEL
    count = 0
    if nearest <= 0.0:
        nearest = min(farthest, shortest_lag)
        _gauss_rule(0.0, math.sqrt(nearest), lags, weights)
        for n in range(NODES_PER_PANEL):
            weights[n] *= 2.0 * lags[n]
            lags[n] *= lags[n]
        count = NODES_PER_PANEL
    while nearest < farthest * (1.0 - 1e-12) and count < lags.size:
        end = max(_LARGEST_LAG_RATIO * nearest, min(shortest_lag, 4.0 * _LARGEST_LAG_RATIO * nearest))
        if 1.3 * end > farthest or count + NODES_PER_PANEL == lags.size:
            end = farthest
        _gauss_rule(nearest, end, lags[count:], weights[count:])
        count += NODES_PER_PANEL
        nearest = end
    return count


@kernel
def _gauss_rule(low: float, high: float, points: NDArray[np.float64], weights: NDArray[np.float64]) -> None:
    for n in range(NODES_PER_PANEL):
        # From the far end on, so that the lags of a whole panel are those to its own nodes, in order.
        points[n] = high - 0.5 * (high - low) * (1.0 + GAUSS_NODES[n])
        weights[n] = 0.5 * (high - low) * GAUSS_WEIGHTS[n]
