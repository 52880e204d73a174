"""What the law of the slip's end says of a stick-slip cycle: durations, distances, periods (8.2 to 8.4, 8.15, 8.16)."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from underfoot.arguments import number
from underfoot.kernels import kernel
from underfoot.models.stick_slip.boundary_integral import INSTANTS, NODES, WEIGHTS, shares
from underfoot.models.stick_slip.first_passage import TO_LEGENDRE, Panels, solve


@dataclass(frozen=True)
class Law:
    """A law of one quantity, tabulated so finely that straight lines between the points keep the asked error.

    `at`: the points, rising (s or m); `density`: per s or m, at the points; `cdf`: of all slips, so that it ends at one
    less `missing`, the share that has no value (still slipping at `t_end`; for periods also `negative_stick`).
    """

    at: np.ndarray
    density: np.ndarray
    cdf: np.ndarray
    missing: float

    @property
    def t(self) -> np.ndarray:
        """`at`, for laws of a time in s."""
        return self.at


@dataclass(frozen=True)
class SlipLaw:
    """The joint law F(x, t) of where and when a slip ends, solved to `error` (largest CDF difference) up to `t_end` s.

    >>> law = SlipLaw.solve(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 20.0, 1e-2)
    >>> round(float(np.interp(3.0, law.duration.t, law.duration.cdf)), 2)
    0.81
    """

    belt_velocity: float
    x0: float
    t_end: float
    error: float
    panels: Panels

    @classmethod
    def solve(
        cls,
        w0: float,
        zeta: float,
        noise: float,
        belt_velocity: float,
        x0: float,
        v0: float,
        t_end: float,
        error: float = 1e-4,
    ) -> "SlipLaw":
        """Solve for slips that start at (`x0` m, `v0` m/s); see `friction.first_passage` for the parameters."""
        panels = solve(w0, zeta, noise, belt_velocity, x0, v0, t_end, error)
        return cls(float(belt_velocity), float(x0), float(t_end), float(error), panels)

    @property
    def remaining(self) -> float:
        """The share of slips that still last at `t_end`."""
        return max(0.0, float(1.0 - self._ended[-1]))

    @cached_property
    def duration(self) -> Law:
        """Law of the slip's duration, s (8.3)."""
        starts = self.panels.table[:, 0]
        return self._tabulate(self._durations, [0.0, self.t_end], starts, self.remaining)

    @cached_property
    def distance(self) -> Law:
        """Law of the slip's distance d = x0 - x, m (8.4, 8.16); negative where the block ends ahead of its start."""
        _, middles, widths, masses = self._atoms
        at = self.x0 - middles

        def law(points):
            out = np.empty((2, points.size))
            mixture(points, at, widths, masses, out)
            return out

        ends = [(at - 6.0 * widths).min(), (at + 6.0 * widths).max()] if at.size else [0.0, 0.0]
        return self._tabulate(law, ends, _quantiles(at, masses), self.remaining)

    @cached_property
    def period(self) -> Law:
        """Law of the cycle's period, slip and then stick (x0 - x)/v_b, s (8.2, 8.15 with the errata's factor v_b)."""
        times, middles, widths, masses = self._atoms
        at = times + (self.x0 - middles) / self.belt_velocity
        table, flat, _, _ = self.panels

        def law(points):
            out = np.empty((2, points.size))
            _periods(points, table, flat, self.belt_velocity, self.x0, out)
            return out

        high = float((at + 6.0 * widths / self.belt_velocity).max(initial=0.0))
        return self._tabulate(law, [0.0, high], _quantiles(at, masses), self.remaining + self.negative_stick)

    @cached_property
    def negative_stick(self) -> float:
        """The share of slips that end ahead of x0, where the stick time (x0 - x)/v_b would be negative: no period."""
        _, middles, widths, masses = self._atoms
        out = np.empty((2, 1))
        mixture(np.array([self.x0]), middles, widths, masses, out)
        return max(0.0, float(masses.sum() - out[1, 0]))

    def places(self, t: float) -> tuple[np.ndarray, np.ndarray, float]:
        """F(., t) as normal densities: their middles [packets] m, masses [packets] 1/s and common width m.

        `t` in s, 0 to t_end; no packets where nothing ends.
        """
        number("t", t, 0.0, self.t_end, "0 to t_end")
        index = int(np.searchsorted(self.panels.table[:, 0], t, side="right")) - 1
        if index < 0:
            return np.empty(0), np.empty(0), 1.0
        start, length, first, spacing, width, speed, count, place = self.panels.table[index]
        z = 2.0 * (t - start) / length - 1.0
        if z > 1.0 + 1e-9:
            return np.empty(0), np.empty(0), 1.0
        share = np.empty(INSTANTS)
        shares(z, share)
        packets = int(count)
        masses = self.panels.masses[int(place) : int(place) + INSTANTS * packets].reshape(INSTANTS, packets)
        middles = first + speed * (t - start) + spacing * np.arange(packets)
        return middles, share @ masses, float(width)

    @cached_property
    def _ended(self) -> np.ndarray:
        """[panels + 1]: the share ended at each panel's start, and in the end."""
        lengths = self.panels.table[:, 1]
        return np.concatenate([[0.0], np.cumsum(0.5 * lengths * (self.panels.rates @ WEIGHTS))])

    @cached_property
    def _atoms(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Time, middle, width and mass (a probability) of every packet at every instant."""
        pieces = []
        share = np.empty(INSTANTS)
        for start, length, first, spacing, width, speed, count, place in self.panels.table:
            packets = int(count)
            held = self.panels.masses[int(place) : int(place) + INSTANTS * packets].reshape(INSTANTS, packets)
            cuts, width = _reading(speed * length, width)
            if cuts > 1:
                z = ((2.0 * np.arange(cuts)[:, None] + 1.0 + NODES) / cuts - 1.0).ravel()
                split = np.empty((z.size, INSTANTS))
                for row, at in zip(split, z, strict=True):
                    shares(at, share)
                    row[:] = share
            else:
                z, split = NODES, np.eye(INSTANTS)
            within = 0.5 * length * (1.0 + z)[:, None]
            middles = first + speed * within + spacing * np.arange(packets)
            masses = 0.5 * length / cuts * np.tile(WEIGHTS, cuts)[:, None] * (split @ held)
            pieces.append(np.broadcast_arrays(start + within, middles, width, masses))
        times, middles, widths, masses = (
            np.concatenate([np.empty(0)] + [p[i].ravel() for p in pieces]) for i in range(4)
        )
        return times, middles, widths, masses

    def _durations(self, points: np.ndarray) -> np.ndarray:
        table, _, rates, _ = self.panels
        out = np.zeros((2, points.size))
        if len(table) == 0:
            return out
        index = np.searchsorted(table[:, 0], points, side="right") - 1
        inside = index >= 0
        index = index[inside]
        z = 2.0 * (points[inside] - table[index, 0]) / table[index, 1] - 1.0
        beyond = z > 1.0
        z = np.minimum(z, 1.0)
        vander = np.polynomial.legendre.legvander(z, INSTANTS)
        values = (vander[:, :-1] @ TO_LEGENDRE * rates[index]).sum(axis=1)
        integral = vander @ np.polynomial.legendre.legint(TO_LEGENDRE, lbnd=-1)
        out[0, inside] = np.where(beyond, 0.0, values)
        out[1, inside] = self._ended[index] + 0.5 * table[index, 1] * (integral * rates[index]).sum(axis=1)
        return out

    def _tabulate(self, law: Callable[[np.ndarray], np.ndarray], ends, seeds, missing: float) -> Law:
        """Points between which the CDF is straight to a quarter of the error, by halving."""
        low, high = ends
        points = np.unique(np.concatenate([np.linspace(low, high, 65), np.clip(seeds, low, high)]))
        least = 1e-12 * max(abs(low), abs(high))
        points = points[np.diff(points, prepend=-np.inf) > least]
        values = law(points)
        for _ in range(12 if points.size > 1 else 0):
            halves = 0.5 * (points[1:] + points[:-1])
            between = law(halves)
            bent = np.abs(between[1] - 0.5 * (values[1, 1:] + values[1, :-1])) > 0.25 * self.error
            # Neighbours too: a curve that turns in its middle looks straight there.
            bent = (np.convolve(bent, np.ones(3), mode="same") > 0.0) & (np.diff(points) > 2.0 * least)
            if not bent.any():
                break
            points = np.concatenate([points, halves[bent]])
            order = np.argsort(points)
            points = points[order]
            values = np.concatenate([values, between[:, bent]], axis=1)[:, order]
        density = np.maximum(values[0], 0.0)
        cdf = np.clip(np.maximum.accumulate(values[1]), 0.0, 1.0)
        return Law(points, density, cdf, missing)


def _quantiles(at: np.ndarray, masses: np.ndarray) -> np.ndarray:
    """Points that hold about half a per cent of the mass between neighbours."""
    order = np.argsort(at)
    risen = np.cumsum(np.maximum(masses[order], 0.0))
    if risen.size == 0 or risen[-1] <= 0.0:
        return np.empty(0)
    return at[order][np.searchsorted(risen, np.linspace(0.0, risen[-1], 201)[:-1])]


@kernel
def _reading(way, width):
    # How often, in eights, to read a panel whose lattice travels over `way`, and how wide to take its packets. Widening
    # them to 1/128 of the way blurs what lies as evenly over it as a panel's law does by some 1e-5 of it.
    cuts = min(32, 1 + int(way / (4.0 * width)))
    return cuts, max(width, way / (4.0 * cuts))


@kernel
def mixture(points, middles, widths, masses, out):
    """Density and cdf at `points` of a mixture of normal laws, to `out[0]` and `out[1]`; all arrays are [packets].

    >>> out = np.empty((2, 1))
    >>> mixture(np.array([1.0]), np.array([1.0, 9.0]), np.array([0.5, 0.5]), np.array([0.3, 0.7]), out)
    >>> round(float(out[1, 0]), 3)
    0.15
    """
    for i in range(points.size):
        density = 0.0
        below = 0.0
        for a in range(middles.size):
            z = (points[i] - middles[a]) / widths[a]
            if z > 8.0:
                below += masses[a]
            elif z > -8.0:
                density += masses[a] * _bell(z) / widths[a]
                below += masses[a] * _under(z)
        out[0, i] = density
        out[1, i] = below


@kernel
def _periods(points, table, masses, belt, x0, out):
    # A slip that ended at time s and place x has period s + (x0 - x)/v_b: for the period T the places from
    # x0 - v_b (T - s) to x0 count. The panel that holds T is integrated up to T only.
    share = np.empty(INSTANTS)
    for i in range(points.size):
        density = 0.0
        below = 0.0
        for j in range(table.shape[0]):
            start, length, first, spacing, width, speed, count, place = table[j]
            packets = int(count)
            span = min(length, points[i] - start)
            if span <= 0.0:
                break
            cuts, wide = _reading(speed * span, width)
            # On a resting lattice the lowest place moves over the law instead.
            cuts = max(cuts, 1 + int((belt - speed) * span / (0.3 * packets * spacing)))
            for m in range(INSTANTS * cuts):
                within = span * (m // INSTANTS + 0.5 * (1.0 + NODES[m % INSTANTS])) / cuts
                shares(2.0 * within / length - 1.0, share)
                lowest = x0 - belt * (points[i] - start - within)
                for q in range(packets):
                    middle = first + speed * within + q * spacing
                    z = (lowest - middle) / width
                    top = (x0 - middle) / wide
                    if z < 8.0 and top > -8.0:
                        mass = 0.0
                        for n in range(INSTANTS):
                            mass += share[n] * masses[int(place) + n * packets + q]
                        mass *= 0.5 * span / cuts * WEIGHTS[m % INSTANTS]
                        if z > -8.0:
                            density += mass * belt * _bell(z) / width
                        below += mass * ((_under(top) if top < 8.0 else 1.0) - (_under(z) if z > -8.0 else 0.0))
        out[0, i] = density
        out[1, i] = below


@kernel
def _bell(z):
    return math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)


@kernel
def _under(z):
    return 0.5 * math.erfc(-z / math.sqrt(2.0))
