"""The slip's end, solved panel by panel: lengths, lattices and ranges follow from the error asked for.

A panel is tried at a length, judged by how fast its Legendre terms (time) and its Fourier terms (place) fall off, and
taken or cut; what it takes is summed by the kernels of `boundary_integral`. When all is done the solution is held
against an equation that was not used to find it (`add_above` there); where that misses the asked error, all is done
again at a tighter tolerance.
"""

import math
from typing import NamedTuple

import numpy as np

from underfoot.errors import BadValue
from underfoot.models.stick_slip.boundary_integral import (
    INSTANTS,
    NODES,
    PANEL_FIELDS,
    WEIGHTS,
    add_above,
    add_panels,
    add_start,
    own_matrix,
)
from underfoot.models.stick_slip.oscillator import require_slip, transition

_vander = np.polynomial.legendre.legvander
TO_LEGENDRE = np.linalg.inv(_vander(NODES, INSTANTS - 1))
"""[term, instant]: values at the instants to Legendre terms."""

_TO_INTEGRAL = _vander(NODES, INSTANTS) @ np.polynomial.legendre.legint(TO_LEGENDRE, lbnd=-1)
"""[instant, instant]: values to their integrals from -1 to each instant."""

_PACKET_WIDTH = 1.1
"""Width of a packet over the lattice spacing: wide enough to interpolate, narrow enough to invert."""

_MOST_PACKETS = 60_000
_MOST_PLACES = 600
_MOST_STRIDES = 100_000
_MOST_TRIALS = 60
_FINEST = 0.03
_MISSED_TO_ERROR = 10.0
"""The largest CDF error was 1 to 10 times the largest residual in all sets tried; it is taken as 10."""

_LOOSENESS = 4.0
"""What one panel's Legendre terms may leave out, over the asked error; that is met 2 to 50 times over with it."""


class Panels(NamedTuple):
    """F(x, t), the law of the slip's end, as panels of packets (`boundary_integral`)."""

    table: np.ndarray
    """[panels, PANEL_FIELDS]."""
    masses: np.ndarray
    """Flat; the share of all slips a second that each packet of each instant holds."""
    rates: np.ndarray
    """[panels, INSTANTS]: density of the slip duration, 1/s."""
    missed: float
    """Largest residual, a probability."""


def solve(
    w0: float, zeta: float, noise: float, belt_velocity: float, x0: float, v0: float, t_end: float, error: float
) -> Panels:
    """Solve for the law of the slip's end up to `t_end` s, to `error` (largest CDF difference; 1e-6 to 0.1).

    w0 rad/s, zeta 1/s, noise m^2/s^3, belt_velocity m/s, start x0 m and v0 m/s < belt_velocity. `BadValue` for values
    out of range, and where the work would be out of all proportion.

    >>> panels = solve(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 20.0, 1e-2)
    >>> panels.missed < 1e-3
    True
    """
    w0, zeta, noise, belt_velocity, x0, v0, t_end, error = require_slip(
        w0, zeta, noise, belt_velocity, x0, v0, t_end, error
    )
    aim = error
    for _ in range(4):
        panels = _March((w0, zeta, noise, belt_velocity), x0, v0, t_end, aim).run()
        if _MISSED_TO_ERROR * panels.missed <= error:
            return panels
        aim *= 0.25
    raise BadValue(f"error is {error!r}; allowed for these values: above {_MISSED_TO_ERROR * panels.missed:.1e}")


class _Outlook(NamedTuple):
    """Where the free motion would end the slip at one time. Stopping at the belt only takes away, so it is a bound."""

    middle: float
    deviation: float
    reach: float
    """Half-width that matters, in deviations; negative: too little to matter."""
    patience: float
    """Time in which the mean velocity can move by one of its deviations, s."""
    clear: float
    """Time for which nothing can matter yet, s."""


class _Lattice(NamedTuple):
    first: float
    spacing: float
    places: int
    speed: float


class _March:
    """One way through time from the slip's start to its end, panel by panel."""

    def __init__(self, motion: tuple[float, float, float, float], x0: float, v0: float, t_end: float, error: float):
        self.motion = motion
        self.x0, self.v0, self.t_end = x0, v0, t_end
        w0, zeta, noise, belt = motion
        self.quickest = 1.0 / max(w0, zeta)
        self.error = error
        self.tolerance = _LOOSENESS * error
        self.negligible = 0.03 * error
        # Where the pull on the line changes sign the slip's end varies over what the belt covers while noise and pull
        # are even: sqrt(2 D t) = w0^2 v_b t^2 / 2.
        self.turning = belt * (8.0 * noise / (w0**4 * belt * belt)) ** (1.0 / 3.0)
        half = 0.5 * zeta
        slowest = half if half <= w0 else w0 * w0 / (half + math.sqrt(half * half - w0 * w0))
        self.memory = max(2.0 * math.pi / w0, 1.0 / slowest) if slowest > 0.0 else math.inf
        self.fineness = 0.7
        self.growth = 32.0
        self.finest = self.quickest
        self.table = np.zeros((64, PANEL_FIELDS))
        self.masses = np.zeros(1 << 14)
        self.rates: list[np.ndarray] = []
        self.hazards: list[np.ndarray] = []
        self.used = 0
        self.ended = 0.0
        self.own: tuple = (None, 0.0)

    def run(self) -> Panels:
        time = self.first_time()
        length = 0.5 * time
        strides = 0
        while time < self.t_end * (1.0 - 1e-12) and 1.0 - self.ended > self.negligible:
            strides += 1
            if self.used > _MOST_PACKETS or strides > _MOST_STRIDES:
                raise self.too_much(time)
            outlook = self.outlook(time)
            if outlook.reach < 0.0:
                stride = min(
                    max(0.3 * outlook.patience, outlook.clear), 0.5 * time, 0.3 / self.motion[0], self.t_end - time
                )
                if self.outlook(time + stride).reach < 0.0:
                    time += stride
                    length = min(0.5 * time, outlook.patience)
                    continue
            length = min(length, 2.5 * outlook.patience, time, 1.5 / self.motion[0])
            time, length = self.advance(time, length)
            if (rate := self.settled(time)) > 0.0:
                missed = self.missed()
                self.decay(time, rate)
                return self.panels(missed)
        return self.panels(self.missed())

    def too_much(self, time: float) -> BadValue:
        """What there is to say where the work is out of all proportion."""
        return BadValue(f"t_end is {self.t_end!r}; allowed for these values: up to {time:.3g}, or a larger error")

    def panels(self, missed: float) -> Panels:
        count = len(self.rates)
        rates = np.array(self.rates).reshape(count, INSTANTS)
        return Panels(self.table[:count].copy(), self.masses[: self.used].copy(), rates, missed)

    def first_time(self) -> float:
        """A time before which nothing that matters can have ended."""
        w0, zeta, noise, belt = self.motion
        gap = belt - self.v0
        diffusing = gap * gap / (4.0 * noise) / (2.0 * math.log(1.0 / self.negligible) + 10.0)
        falling = _time_for(0.05 * gap, abs(w0 * w0 * self.x0 + zeta * self.v0), w0 * w0 * abs(self.v0))
        return min(diffusing, falling, 0.02 * self.quickest, 0.01 * self.t_end)

    def outlook(self, time: float) -> _Outlook:
        w0, zeta, noise, belt = self.motion
        a_xx, a_xv, a_vx, a_vv, s_xx, s_xv, s_vv = transition(w0, zeta, noise, time)
        mean_x = a_xx * self.x0 + a_xv * self.v0
        mean_v = a_vx * self.x0 + a_vv * self.v0
        layer = math.sqrt(noise * min(time, self.quickest))
        missing = belt - mean_v
        distance = max(0.0, missing - layer) if missing > 0.0 else -missing
        deviation = math.sqrt(s_xx - s_xv * s_xv / s_vv)
        middle = mean_x + s_xv / s_vv * missing
        pull = abs(w0 * w0 * middle + zeta * belt) + 2.0 * noise / layer + 3.0 * w0 * w0 * deviation
        share = pull * min(self.t_end, 1.0 / w0 + time) / math.sqrt(2.0 * math.pi * s_vv)
        spread = math.sqrt(s_vv)
        weight = math.log(share / self.negligible)
        excess = weight - 0.5 * (distance / spread) ** 2
        reach = math.sqrt(2.0 * excess) + 0.3 if excess > 0.0 else -1.0
        # The mean's way in a time t is at most about |a| t + w0^2 |v| t^2; the deviation grows slower than now.
        steady = abs(w0 * w0 * mean_x + zeta * mean_v)
        turn = w0 * w0 * abs(mean_v)
        needed = math.sqrt(2.0 * max(weight, 0.0))
        clear = _time_for(0.5 * (distance - needed * spread), steady + needed * noise / spread, turn)
        return _Outlook(middle, deviation, reach, _time_for(spread, steady, turn), clear)

    def advance(self, time: float, length: float) -> tuple[float, float]:
        """Take one panel from `time` on, about `length` long; return where it ends and a length for the next."""
        left = self.t_end - time
        trial = left if left < 1.4 * length else 0.5 * left if left < 2.0 * length else length
        for _ in range(_MOST_TRIALS):
            late, aliased = self.panel(time, trial)
            if late <= self.tolerance and aliased <= self.error:
                longer = late * self.growth < self.tolerance
                self.growth = max(0.8 * self.growth, 32.0)
                return time + trial, 2.0 * trial if longer else trial
            if late > self.tolerance:
                trial *= 0.5
                self.growth = max(4.0 * self.growth, 1e3)
            if self.fineness < _FINEST:
                break
        raise BadValue(f"error is {self.error!r}; allowed for these values: larger (it stalls at {time:.3g} s)")

    def panel(self, time: float, length: float) -> tuple[float, float]:
        """Solve one panel, and keep it where it is good enough; choose the next lattice's fineness from it.

        Return the weight of its last two Legendre terms and of what its lattice is too coarse for, as probabilities.
        """
        lattice = self.lattice(time, length)
        if lattice is None:
            return 0.0, 0.0
        first, spacing, places, speed = lattice
        w0, zeta, noise, belt = self.motion
        pull = max(abs(w0 * w0 * x + zeta * belt) for x in (first, first + places * spacing))
        finest = 0.5 * min(self.quickest, 4.0 * noise / (pull * pull))
        self.finest = min(self.finest, finest)
        times = time + 0.5 * length * (1.0 + NODES)
        known = np.zeros((INSTANTS, places))
        earlier = (self.table, len(self.rates), self.masses, finest, times)
        add_start(self.motion, self.x0, self.v0, times, first, spacing, speed, time, known)
        add_panels(self.motion, *earlier, first, spacing, speed, time, known)
        masses, law = self.own_solution(lattice, length, finest, known)

        late = float(np.abs(TO_LEGENDRE[-2:] @ law).sum()) * spacing * length
        spectrum = np.abs(np.fft.rfft(law, axis=1))
        # A packet lattice takes a wave of this part of its highest for its alias, with this share.
        part = 2.0 * np.arange(spectrum.shape[1]) / places
        alias = 1.0 / (1.0 + np.exp(2.0 * math.pi**2 * _PACKET_WIDTH**2 * (1.0 - part)))
        aliased = math.sqrt(2.0) * length * spacing * float(np.sqrt(((spectrum * alias) ** 2).sum(axis=1)).max())
        if late <= self.tolerance and aliased <= self.error:
            self.keep(time, length, lattice, masses)
        if aliased > 0.1 * self.error:
            octaves = 0.125 if aliased <= self.error else 0.25 if aliased < 10.0 * self.error else 0.5
            self.fineness *= 2.0**-octaves
        elif aliased < 1e-3 * self.error:
            self.fineness = min(self.fineness * 2.0**0.125, 0.9)
        return late, aliased

    def lattice(self, time: float, length: float) -> _Lattice | None:
        times = (time, *(time + 0.5 * length * (1.0 + NODES)), time + length)
        outlooks = [self.outlook(at) for at in times]
        _, zeta, _, belt = self.motion
        halfway = outlooks[len(outlooks) // 2]
        # While the law is narrower than the belt's way so far, it goes with the belt; later it stands in space.
        way = min(belt * time, self.turning, 2.0 * belt / zeta if zeta > 0.0 else math.inf)
        speed = belt if halfway.deviation < 0.4 * way else 0.0
        low, high = math.inf, -math.inf
        for at, seen in zip(times, outlooks, strict=True):
            if seen.reach > 0.0:
                middle = seen.middle - speed * (at - time)
                low = min(low, middle - seen.reach * seen.deviation)
                high = max(high, middle + seen.reach * seen.deviation)
        if high < low:
            return None
        spacing = self.fineness * min(self.turning, *(seen.deviation for seen in outlooks))
        # Spacings and edges in steps, so that neighbours often share a lattice and with it their own matrix.
        spacing = 2.0 ** (math.floor(4.0 * math.log2(spacing)) / 4.0)
        step = 3.0 * spacing
        edge = math.floor(low / step) - 1
        places = 3 * (math.ceil(high / step) + 1 - edge) + 1
        if places > _MOST_PLACES:
            raise self.too_much(time)
        last = self.own[0]
        if last is not None and last.spacing == spacing and speed == last.speed == 0.0 and places > 0.75 * last.places:
            end = last.first + (last.places - 1) * spacing
            if last.first <= low - spacing and high + spacing <= end:
                return last
        return _Lattice(edge * step, spacing, places, speed)

    def own_solution(
        self, lattice: _Lattice, length: float, finest: float, known: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Masses and law on a panel, given what start and earlier panels add up to: a few substitutions."""
        first, spacing, places, speed = lattice
        if self.own[:2] != (lattice, length):
            width = _PACKET_WIDTH * spacing
            matrix = np.empty((INSTANTS, places, INSTANTS, places))
            own_matrix(self.motion, length, finest, first, spacing, width, speed, matrix)
            apart = np.subtract.outer(np.arange(places), np.arange(places)) / _PACKET_WIDTH
            inverse = np.linalg.inv(np.exp(-0.5 * apart * apart) / (math.sqrt(2.0 * math.pi) * width))
            self.own = (lattice, length, matrix.reshape(INSTANTS * places, -1), inverse)
        _, _, matrix, inverse = self.own
        good = 1e-3 * self.negligible / (length * places * spacing)
        law = known
        for _ in range(60):
            masses = law @ inverse
            better = known + (masses.ravel() @ matrix).reshape(known.shape)
            if np.abs(better - law).max() <= good:
                break
            law = better
        return masses, better

    def keep(self, time: float, length: float, lattice: _Lattice, masses: np.ndarray) -> None:
        """Append a panel, without the outer packets that hold next to nothing."""
        rates = masses.sum(axis=1)
        within = 0.5 * length * (rates @ _TO_INTEGRAL.T)
        self.hazards.append(rates / np.maximum(1.0 - self.ended - within, 0.1 * self.negligible))
        self.ended += 0.5 * length * float(WEIGHTS @ rates)
        weight = np.abs(masses).max(axis=0) * length
        begin = int(np.searchsorted(np.cumsum(weight), 0.01 * self.negligible))
        end = masses.shape[1] - int(np.searchsorted(np.cumsum(weight[::-1]), 0.01 * self.negligible))
        begin, end = (begin, end) if begin < end else (0, 1)
        count = len(self.rates)
        held = INSTANTS * (end - begin)
        if count == len(self.table):
            self.table = np.concatenate([self.table, np.zeros_like(self.table)])
        while self.used + held > self.masses.size:
            self.masses = np.concatenate([self.masses, np.zeros_like(self.masses)])
        width = _PACKET_WIDTH * lattice.spacing
        first = lattice.first + begin * lattice.spacing
        self.table[count] = time, length, first, lattice.spacing, width, lattice.speed, end - begin, self.used
        self.masses[self.used : self.used + held] = masses[:, begin:end].ravel()
        self.used += held
        self.rates.append(rates)

    def settled(self, time: float) -> float:
        """The rate of an exponential end, once the hazard has stood still for as long as the free motion remembers.

        Its means over two such stretches, tapered so that its swings cancel, must not differ by what would matter when
        most has ended; nor may what it still swings by matter within a swing.
        """
        count = len(self.rates)
        if time < 2.0 * self.memory or count == 0:
            return 0.0
        first = max(0, int(np.searchsorted(self.table[:count, 0], time - 2.0 * self.memory, side="right")) - 1)
        starts, lengths = self.table[first:count, 0, None], self.table[first:count, 1, None]
        if lengths.sum() < 1.99 * self.memory:  # nothing ended for a while
            return 0.0
        hazards = np.array(self.hazards[first:])
        ago = (time - starts - 0.5 * lengths * (1.0 + NODES)) / self.memory
        taper = np.sin(math.pi * ago) ** 2 * lengths * WEIGHTS
        rate, earlier = (np.average(hazards, weights=taper * part) for part in (ago < 1.0, ago >= 1.0))
        drift = abs(rate - earlier)
        swing = np.ptp((hazards @ WEIGHTS)[lengths.cumsum() > 0.5 * lengths.sum()])
        enough = 0.25 * self.error / (1.0 - self.ended)
        if rate <= 0.0 or drift > 0.05 * rate or 0.5 * swing > enough * self.motion[0]:
            return 0.0
        return float(rate) if drift * min(math.exp(-1.0) / rate, self.t_end - time) <= enough else 0.0

    def decay(self, time: float, rate: float) -> None:
        """Append resting panels of the place law at the last instant, its mass falling at `rate`."""
        _, length, first, spacing, _, speed, places, place = self.table[len(self.rates) - 1]
        last = self.masses[int(place) : self.used].reshape(INSTANTS, int(places))[-1]
        shape = last / last.sum()
        lattice = _Lattice(first + 0.5 * length * (1.0 + NODES[-1]) * speed, spacing, int(places), 0.0)
        while time < self.t_end * (1.0 - 1e-12) and 1.0 - self.ended > self.negligible:
            length = min(1.5 / rate, self.t_end - time)
            falling = rate * (1.0 - self.ended) * np.exp(-0.5 * rate * length * (1.0 + NODES))
            self.keep(time, length, lattice, np.outer(falling, shape))
            time += length

    def missed(self) -> float:
        """The largest residual: how likely the free block is faster than the belt, less what its ended slips say."""
        count = len(self.rates)
        start, length = self.table[:count, 0], self.table[:count, 1]
        times = np.sort(np.concatenate([start + 0.5 * length, start + length]))
        left = np.array([self.above(time) for time in times])
        add_above(self.motion, self.table, count, self.masses, self.finest, times, left)
        return float(np.abs(left).max(initial=0.0))

    def above(self, time: float) -> float:
        w0, zeta, noise, belt = self.motion
        _, _, a_vx, a_vv, _, _, s_vv = transition(w0, zeta, noise, time)
        return 0.5 * math.erfc((belt - a_vx * self.x0 - a_vv * self.v0) / math.sqrt(2.0 * s_vv))


def _time_for(way: float, speed: float, turn: float) -> float:
    """The time t in which speed t + turn t^2 comes to `way`; 0 where that lies behind."""
    if way <= 0.0:
        return 0.0
    root = speed + math.sqrt(speed * speed + 4.0 * turn * way)
    return 2.0 * way / root if root > 0.0 else math.inf
