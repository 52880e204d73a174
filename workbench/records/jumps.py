"""Jumps: times in which a floor is empty between two loads, with their height by flight time and by impulse.

The height is that of the body's centre above where it was at take-off. See Linthorne, Analysis of standing vertical
jumps using a force platform, Am. J. Phys. 69, 1198 (2001); Moir, Three different methods of calculating vertical jump
height from force platform data in men and women, Meas. Phys. Educ. Exerc. Sci. 12, 207 (2008).
"""

import math
from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.floor.contacts import GAP_S
from underfoot.floor.footsteps import LEAST_N
from underfoot.floor.tracking import ON_N
from underfoot.number_parsing import STANDARD_GRAVITY
from underfoot.quantities import fixed
from underfoot.records.recording import Recording
from underfoot.records.standing import STILL, standing_phase
from underfoot.records.survey import ContactSpan, RecordedForces, Survey

SHORTEST_S, LONGEST_S = 0.1, 1.0
"""Shortest and longest flight: heights of 12 mm and 1.2 m."""
BEFORE_S = 5.0
"""Before take-off, the weight is looked for: errors of the weight add up to the velocity from there on."""
WEIGHED_S = 1.0
"""Time for which somebody stands still to be weighed (Owen and others, J. Strength Cond. Res. 28, 1552, 2014)."""
NOISES = 5.0
"""Standard deviations of what is read in the flight that a load exceeds (Owen and others 2014)."""
LANDING_S = 0.5
"""Time after landing in which its peak is."""
LEAST_PEAK = 1.3
"""Share of the weight that a push and a landing reach at least; who steps off, or leans on the floor, stays below."""


class Jump(Struct, frozen=True):
    """A jump of one person. Measures that cannot be determined are NaN.

    `flight_ms` is the time from take-off to landing, which are where the load's last and first samples point to that
    reach `ON_N` and `NOISES` of the flight. `flight_height_mm` follows if the body lands as it took off: with legs bent
    more it is too high.
    `contact_ms` is how long there was a load before, up to `BEFORE_S`. `push_peak_n` and `landing_peak_n` are the
    largest loads in the `BEFORE_S` before and the `LANDING_S` after. `weight_n` is the mean of the stillest `WEIGHED_S`
    in the `BEFORE_S`; where nobody stands still, the last three are not known. `velocity_m_s` at take-off follows from
    the impulse from there on, and `impulse_height_mm` from it.
    """

    take_off_s: float
    flight_ms: float
    flight_height_mm: float
    contact_ms: float
    push_peak_n: float
    landing_peak_n: float
    weight_n: float = math.nan
    velocity_m_s: float = math.nan
    impulse_height_mm: float = math.nan

    def is_of(self, weight_n: float) -> bool:
        """Return whether somebody of this weight can have pushed off and landed so."""
        return min(self.push_peak_n, self.landing_peak_n) >= LEAST_PEAK * weight_n

    def __str__(self) -> str:
        flight = f"jump {fixed(self.flight_height_mm)} mm by flight of {fixed(self.flight_ms)} ms"
        known = math.isfinite(self.impulse_height_mm)
        return f"{flight}, {fixed(self.impulse_height_mm)} mm by impulse" if known else flight


def jumps_in(recording: Recording, surveyed: Survey, from_s: float = -math.inf, to_s: float = math.inf) -> list[Jump]:
    """Return the jumps of a recording, by its survey, that begin and end in a stretch.

    Of who did not stand still before, the weight is that which is noted of all, that of a standing phase, or that
    before the first flight that has one; where there is none, each flight is a jump.
    """
    forces, found = RecordedForces(recording), []
    weights_n = [one.weight_n for one in recording.body_weights() if not one.person]
    for begin_s, take_off_s, landing_s, tiles in _flights(surveyed.contacts):
        if from_s <= take_off_s and landing_s <= to_s:
            ends = (forces.frame_at(max(begin_s, take_off_s - BEFORE_S)), forces.frame_at(landing_s + LANDING_S))
            rows = recording.force_samples_between(*ends)
            load_n = rows[:, 2:].reshape(len(rows), -1, 4)[:, tiles].sum(axis=(1, 2))
            known = np.isfinite(load_n)
            time_s = (rows[known, 0] - forces.first) / forces.rate
            jump = jump_of(time_s, load_n[known], (take_off_s, landing_s))
            found += [jump] if jump else []
    if (phase := standing_phase(surveyed.balance)) is not None:
        weights_n.append(phase.weight_n)
    weights_n += [one.weight_n for one in found if math.isfinite(one.weight_n)]
    otherwise_n = weights_n[0] if weights_n else 0.0
    return [one for one in found if one.is_of(otherwise_n if math.isnan(one.weight_n) else one.weight_n)]


def jump_of(time_s: NDArray[np.float64], load_n: NDArray[np.float64], flight_s: tuple[float, float]) -> Jump | None:
    """Return the jump of who is in the air from about one second to another, of what all sensors read; None where
    samples are missing.

    `time_s` and `load_n` (n,) begin with the load before. What is read in the flight is zero.

    >>> time_s = np.arange(0.0, 4.0, 0.001)
    >>> knots_s = [0.0, 2.0, 2.2, 2.5, 2.8, 2.81, 3.29, 3.3, 3.5, 4.0]
    >>> load_n = np.interp(time_s, knots_s, [700.0, 700.0, 200.0, 1350.0, 1350.0, 0.0, 0.0, 2500.0, 700.0, 700.0])
    >>> print(jump_of(time_s, load_n + 12.0, (2.81, 3.29)))
    jump 282 mm by flight of 480 ms, 280 mm by impulse
    """
    flown_s = 0.5 * (flight_s[0] + flight_s[1])
    at = int(np.searchsorted(time_s, flown_s))
    middle = abs(time_s - flown_s) < 0.25 * (flight_s[1] - flight_s[0])
    if not middle.any():
        return None
    load_n = load_n - np.median(load_n[middle])
    on = np.flatnonzero(load_n >= max(ON_N, NOISES * float(load_n[middle].std())))
    after = int(np.searchsorted(on, at))
    if not 0 < after < len(on):
        return None
    last, first = int(on[after - 1]), int(on[after])
    if np.diff(time_s[last : first + 1]).max() > GAP_S:
        return None
    take_off_s = _unloaded(time_s, load_n, last, max(last - 1, 0), last + 1)
    landing_s = _unloaded(time_s, load_n, first, min(first + 1, len(time_s) - 1), first - 1)
    flown_s = landing_s - take_off_s
    landed = (time_s >= landing_s) & (time_s <= landing_s + LANDING_S)
    return Jump(
        take_off_s,
        1e3 * flown_s,
        1e3 * STANDARD_GRAVITY * flown_s**2 / 8.0,
        1e3 * (take_off_s - float(time_s[0])),
        float(load_n[: last + 1].max()),
        float(load_n[landed].max()),
        *_by_impulse(np.append(time_s[: last + 1], take_off_s), np.append(load_n[: last + 1], 0.0)),
    )


def _unloaded(time_s: NDArray[np.float64], load_n: NDArray[np.float64], at: int, further: int, empty: int) -> float:
    """Return when the line through the loads of two samples is 0, between the first of them and an empty sample."""
    falls_n, apart_s = load_n[further] - load_n[at], time_s[at] - time_s[further]
    found_s = time_s[at] + apart_s * load_n[at] / falls_n if falls_n > 0.0 else time_s[empty]
    return float(np.clip(found_s, *sorted((time_s[at], time_s[empty]))))


def _by_impulse(time_s: NDArray[np.float64], load_n: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return weight, velocity at take-off and height of a load that ends there; NaN if nobody stands still before."""
    count = max(round(WEIGHED_S / float(np.median(np.diff(time_s)))), 2)
    if len(time_s) <= count:
        return math.nan, math.nan, math.nan
    sums = np.cumsum([np.append(0.0, load_n), np.append(0.0, load_n**2)], axis=1)
    mean_n, square = (sums[:, count:] - sums[:, :-count]) / count
    share = np.sqrt(np.maximum(square - mean_n**2, 0.0)) / np.maximum(mean_n, 1.0)
    broken = np.cumsum(np.append(0, np.diff(time_s) > GAP_S))
    share[(mean_n < LEAST_N) | (broken[: len(share)] < broken[-1])] = math.inf
    at = int(np.argmin(share))
    if not share[at] <= STILL:
        return math.nan, math.nan, math.nan
    weight_n, rest = float(mean_n[at]), slice(at + count - 1, None)
    velocity_m_s = STANDARD_GRAVITY * float(np.trapezoid(load_n[rest] / weight_n - 1.0, time_s[rest]))
    return weight_n, velocity_m_s, 1e3 * max(velocity_m_s, 0.0) ** 2 / (2.0 * STANDARD_GRAVITY)


def _flights(contacts: Sequence[ContactSpan]) -> list[tuple[float, float, float, list[int]]]:
    """Return when the load before a flight began, when it ended and the next one began, and the tiles of both."""
    found, begin_s, end_s, tiles = list[tuple[float, float, float, list[int]]](), math.nan, math.nan, set[int]()
    contacts = sorted(contacts, key=lambda one: one.start_s)
    for at, contact in enumerate(contacts):
        if not contact.start_s - end_s < SHORTEST_S:  # who dips fast bears nothing for a moment
            if contact.start_s - end_s <= LONGEST_S:
                landed = bisect_right(contacts, contact.start_s + LANDING_S, at, key=lambda one: one.start_s)
                lands_on = {tile for one in contacts[at:landed] for tile in one.tiles}
                found.append((begin_s, end_s, contact.start_s, sorted(tiles | lands_on)))
            begin_s, end_s, tiles = contact.start_s, contact.end_s, set()
        end_s = max(end_s, contact.end_s)
        tiles |= set(contact.tiles)
    return found
