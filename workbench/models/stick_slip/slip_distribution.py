"""Distributions of a stick-slip cycle: duration, distance, period (8.2 to 8.4, 8.15, 8.16)."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from underfoot.arguments import number
from underfoot.kernels import allocating, kernel
from underfoot.models.stick_slip.exponential_tail import relaxation_time
from underfoot.models.stick_slip.first_passage import solve
from underfoot.models.stick_slip.mixture import NormalMixture, density_and_cdf, normal_cdf, normal_density
from underfoot.models.stick_slip.oscillator import BlockOnBelt, require_slip, transition
from underfoot.models.stick_slip.panels import (
    GAUSS_NODES,
    GAUSS_WEIGHTS,
    NODES_PER_PANEL,
    TO_LEGENDRE,
    TO_LEGENDRE_OF_INTEGRAL,
    Panels,
    lagrange_basis,
)
from underfoot.models.stick_slip.tabulated import Distribution, tabulate


@dataclass(frozen=True, repr=False)
class SlipDistribution:
    """Joint distribution F(x, t) of position and time of a slip's end, and its marginal distributions.

    `error` is the largest CDF difference; `t_end` the observation time, s.

    >>> slip = SlipDistribution.solve(BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, -1.0), 20.0, 1e-2)
    >>> round(float(slip.duration.cdf_at(3.0)), 2)
    0.81
    """

    block: BlockOnBelt
    t_end: float
    error: float
    panels: Panels

    def __repr__(self) -> str:
        return f"<SlipDistribution of {self.block}, followed {self.t_end:g} s, within {self.error:g}>"

    @classmethod
    def solve(cls, block: BlockOnBelt, t_end: float, error: float = 1e-4) -> "SlipDistribution":
        """Solve for the first passage of the slips of `block` through the belt's velocity.

        `t_end` is the observation time, s; `error` the largest CDF difference, 1e-6 to 0.1. `BadValue` for values out
        of range, and if this error would take an excessive amount of work. Solves the Fokker-Planck equation 8.5 with
        the boundary condition 8.6, both corrected (docs/models.md#stick-slip), without a choice of grid, step or range
        (see `boundary_integral`).
        """
        block, t_end, error = require_slip(block, t_end, error)
        return cls(block, t_end, error, solve(block, t_end, error))

    @property
    def survival(self) -> float:
        """Probability that the slip still lasts at `t_end`."""
        return max(0.0, float(1.0 - self._ended[-1]))

    @cached_property
    def duration(self) -> Distribution:
        """Distribution of the slip's duration, s (8.3)."""
        starts = self.panels.table["start"]
        return tabulate(self._duration, (0.0, self.t_end), starts, 0.25 * self.error, self.survival, "duration, s")

    @cached_property
    def distance(self) -> Distribution:
        """Distribution of the slip's distance d = x0 - x, m (8.4, 8.16); negative where it ends ahead of its start."""
        return self._distance_of(self._components[1], self.survival)

    @cached_property
    def distance_in_the_end(self) -> Distribution:
        """Distribution of the distance of all slips, m; slips that still last at `t_end` are taken to end then."""
        both = zip(self._components[1], self.lasting_positions(), strict=True)
        return self._distance_of(NormalMixture(*map(np.concatenate, both)), 0.0)

    def _distance_of(self, positions: NormalMixture, unobserved: float) -> Distribution:
        distances = positions._replace(means=self.block.x0 - positions.means)
        means, widths, weights = distances
        ends = (float((means - 6.0 * widths).min()), float((means + 6.0 * widths).max())) if means.size else (0.0, 0.0)
        return tabulate(
            lambda points: density_and_cdf(distances, points),
            ends,
            _quantiles(means, weights),
            0.25 * self.error,
            unobserved,
            "distance, m",
        )

    @cached_property
    def period(self) -> Distribution:
        """Distribution of the cycle's period, s: slip, then stick for (x0 - x)/v_b (8.2, 8.15 with the factor v_b).

        Slips that end ahead of x0 have no period: they are `unobserved`, like those longer than `t_end`.
        """
        times, (means, widths, weights) = self._components
        belt_velocity = self.block.belt_velocity
        periods = times + (self.block.x0 - means) / belt_velocity
        table = self.panels.table
        # Not the last node: a tail's panel extends far beyond it.
        last = float((table["start"] + table["length"]).max(initial=0.0))
        high = last + float((self.block.x0 - means + 6.0 * widths).max(initial=0.0)) / belt_velocity
        return tabulate(
            lambda points: _period_density_and_cdf(self.panels, belt_velocity, self.block.x0, points),
            (0.0, high),
            _quantiles(periods, weights),
            0.25 * self.error,
            self.survival + self.negative_stick,
            "period, s",
        )

    @cached_property
    def negative_stick(self) -> float:
        """Probability that a slip ends ahead of x0: its stick time (x0 - x)/v_b would be negative, so no period."""
        _, positions = self._components
        up_to_start = density_and_cdf(positions, np.array([self.block.x0]))[1, 0]
        return max(0.0, float(positions.weights.sum() - up_to_start))

    def end_positions(self, t: float) -> NormalMixture:
        """Return F(., t): end positions of slips at `t` s, 0 to t_end. The weights are densities in time, 1/s.

        No components if nothing ends then.
        """
        number("t", t, 0.0, self.t_end, "0 to t_end")
        nothing = NormalMixture(np.empty(0), np.empty(0), np.empty(0))
        index = int(np.searchsorted(self.panels.table["start"], t, side="right")) - 1
        if index < 0:
            return nothing
        panel = self.panels.table[index]
        elapsed = t - panel["start"]
        z = 2.0 * elapsed / panel["length"] - 1.0
        if z > 1.0 + 1e-9:
            return nothing
        basis = np.empty(NODES_PER_PANEL)
        lagrange_basis(z, basis)
        count = int(panel["components"])
        means = panel["first"] + panel["speed"] * elapsed + panel["spacing"] * np.arange(count)
        return NormalMixture(means, np.full(count, panel["width"]), basis @ self._weights(panel))

    def lasting_positions(self) -> NormalMixture:
        """Return the positions at `t_end` of blocks that still slip; the weights sum to `survival`.

        These are the positions of all blocks under free motion, less those of blocks whose slip has ended.
        """
        w0, zeta, noise, belt_velocity, x0, v0 = self.block
        free = transition(w0, zeta, noise, self.t_end)
        mean = free.a_xx * x0 + free.a_xv * v0
        resolved_s = min(2.0 * math.pi / w0, relaxation_time(self.block))
        remembered_s = 8.0 * relaxation_time(self.block)  # stops before that leave blocks where all free ones are
        times, (means, widths, weights) = self._components_of(self.t_end - remembered_s, resolved_s)
        known, place = np.unique(times, return_inverse=True)
        later = [transition(w0, zeta, noise, max(self.t_end - time, 1e-12 / w0)) for time in known]
        a_xx, a_xv, s_xx = (np.array([getattr(one, name) for one in later])[place] for name in ("a_xx", "a_xv", "s_xx"))
        return NormalMixture(
            np.append(mean, a_xx * means + a_xv * belt_velocity),
            np.sqrt(np.append(free.s_xx, s_xx + (a_xx * widths) ** 2)),
            np.append(1.0, -weights),
        )

    def _weights(self, panel: np.void) -> NDArray[np.float64]:
        """Return the weights of a panel, [node, component]."""
        size = NODES_PER_PANEL * panel["components"]
        return self.panels.weights[panel["offset"] :][:size].reshape(NODES_PER_PANEL, -1)

    @cached_property
    def _ended(self) -> NDArray[np.float64]:
        """Return the probability that the slip has ended at each panel's start, and at the end, [panels + 1]."""
        lengths = self.panels.table["length"]
        return np.concatenate([[0.0], np.cumsum(0.5 * lengths * (self.panels.rates @ GAUSS_WEIGHTS))])

    @cached_property
    def _components(self) -> tuple[NDArray[np.float64], NormalMixture]:
        """Return the times of all nodes' components, and the components; the weights are probabilities."""
        return self._components_of(math.inf, math.inf)

    def _components_of(self, since: float, longest: float) -> tuple[NDArray[np.float64], NormalMixture]:
        """Return `_components`, with panels in parts of at most `longest` s where they are later than `since` s."""
        pieces = []
        for panel in self.panels.table:
            length, speed = float(panel["length"]), float(panel["speed"])
            parts, width = _subdivision(speed * length, panel["width"])
            halves = np.full(parts, 0.5 * length / parts)
            z = ((2.0 * np.arange(parts)[:, None] + 1.0 + GAUSS_NODES) / parts - 1.0).ravel()
            early = min(max((since - float(panel["start"])) / length, 0.0), 1.0)
            late = math.ceil((1.0 - early) * length / longest)
            if late > parts:
                halves = np.append(early * halves, np.full(late, 0.5 * length * (1.0 - early) / late))
                middles = 2.0 * np.cumsum(halves) - halves
                z = ((middles[:, None] + halves[:, None] * GAUSS_NODES) / (0.5 * length) - 1.0).ravel()
            basis = np.eye(NODES_PER_PANEL)
            if halves.size > 1:
                basis = np.empty((z.size, NODES_PER_PANEL))
                for row, at in zip(basis, z, strict=True):
                    lagrange_basis(at, row)
            else:
                z = GAUSS_NODES
            elapsed = 0.5 * length * (1.0 + z)[:, None]
            means = panel["first"] + speed * elapsed + panel["spacing"] * np.arange(panel["components"])
            weights = (halves[:, None] * GAUSS_WEIGHTS).ravel()[:, None] * (basis @ self._weights(panel))
            pieces.append(np.broadcast_arrays(panel["start"] + elapsed, means, width, weights))
        times, *mixture = (np.concatenate([np.empty(0)] + [piece[i].ravel() for piece in pieces]) for i in range(4))
        return times, NormalMixture(*mixture)

    def _duration(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return density and CDF of the duration at `points` s, [2, points]."""
        table, _, rates = self.panels
        found = np.zeros((2, points.size))
        if len(table) == 0:
            return found
        index = np.searchsorted(table["start"], points, side="right") - 1
        inside = index >= 0
        index = index[inside]
        z = 2.0 * (points[inside] - table["start"][index]) / table["length"][index] - 1.0
        beyond = z > 1.0
        legendre = np.polynomial.legendre.legvander(np.minimum(z, 1.0), NODES_PER_PANEL)
        density = (legendre[:, :-1] @ TO_LEGENDRE * rates[index]).sum(axis=1)
        integral = ((legendre @ TO_LEGENDRE_OF_INTEGRAL) * rates[index]).sum(axis=1)
        found[0, inside] = np.where(beyond, 0.0, density)
        found[1, inside] = self._ended[index] + 0.5 * table["length"][index] * integral
        return found


def _quantiles(values: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return values with about half a per cent of the weight between neighbours."""
    order = np.argsort(values)
    cumulated = np.cumsum(np.maximum(weights[order], 0.0))
    if cumulated.size == 0 or cumulated[-1] <= 0.0:
        return np.empty(0)
    return values[order][np.searchsorted(cumulated, np.linspace(0.0, cumulated[-1], 201)[:-1])]


@kernel
def _subdivision(travel: float, width: float) -> tuple[int, float]:
    """Return into how many parts to divide a panel whose grid moves by `travel`, and the width of their components.

    Widening them to 1/128 of the travel blurs a density that is spread evenly over it by some 1e-5.
    """
    parts = min(32, 1 + int(travel / (4.0 * width)))
    return parts, max(width, travel / (4.0 * parts))


@allocating
@kernel
def _period_density_and_cdf(
    panels: Panels, belt_velocity: float, x0: float, points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return density and CDF of the period at `points` s, [2, points].

    A slip that ended at time s and position x has the period s + (x0 - x)/v_b: up to the period T count the positions
    from x0 - v_b (T - s) to x0. The panel that contains T is integrated up to T only.
    """
    found = np.empty((2, points.size))
    basis = np.empty(NODES_PER_PANEL)
    for i in range(points.size):
        density = 0.0
        cdf = 0.0
        for panel in panels.table:
            within = min(panel.length, points[i] - panel.start)
            if within <= 0.0:
                break
            parts, wide = _subdivision(panel.speed * within, panel.width)
            # On a grid at rest, the lowest position moves over the density instead.
            covered = (belt_velocity - panel.speed) * within
            parts = max(parts, 1 + int(covered / (0.3 * panel.components * panel.spacing)))
            for m in range(NODES_PER_PANEL * parts):
                node = m % NODES_PER_PANEL
                elapsed = within * (m // NODES_PER_PANEL + 0.5 * (1.0 + GAUSS_NODES[node])) / parts
                lagrange_basis(2.0 * elapsed / panel.length - 1.0, basis)
                lowest = x0 - belt_velocity * (points[i] - panel.start - elapsed)
                for q in range(panel.components):
                    mean = panel.first + panel.speed * elapsed + q * panel.spacing
                    low = (lowest - mean) / panel.width
                    high = (x0 - mean) / wide
                    if low < 8.0 and high > -8.0:
                        weight = 0.0
                        for n in range(NODES_PER_PANEL):
                            weight += basis[n] * panels.weights[panel.offset + n * panel.components + q]
                        weight *= 0.5 * within / parts * GAUSS_WEIGHTS[node]
                        if low > -8.0:
                            density += weight * belt_velocity * normal_density(low) / panel.width
                        up_to_low = normal_cdf(low) if low > -8.0 else 0.0
                        cdf += weight * ((normal_cdf(high) if high < 8.0 else 1.0) - up_to_low)
        found[0, i] = density
        found[1, i] = cdf
    return found
