"""Posturography: the sway of somebody who stands, by the centre of pressure of all that is on the floor.

The measures are those of Prieto and others, Measures of postural steadiness, IEEE Trans. Biomed. Eng. 43, 956 (1996).
"""

import math

import numpy as np
from msgspec import Struct

from underfoot.errors import BadValue
from underfoot.floor.footsteps import LEAST_N, LONGEST_S
from underfoot.quantities import fixed
from underfoot.records.balance import PLACES_S, loaded_times
from underfoot.records.standing import STILL_S, standing_phase

CUTOFF_HZ = 5.0
"""Of the low-pass through which the centre of pressure goes, Butterworth's of order 4 without delay (Prieto)."""
_TWICE = (math.sqrt(2.0) - 1.0) ** 0.25
"""A filter of order 2 that runs forwards and backwards has its -3 dB at this share of its own cut-off (Winter), at
40 Hz at 5.1 Hz."""


class Sway(Struct, frozen=True):
    """The sway from one second of a recording to another, with the mean load, N.

    `path_mm` is the length of the way of the centre of pressure, `velocity_mm_s` that by the time. `ellipse_95_mm2` is
    the area of the ellipse that holds 95 % of its places, if these are normally distributed. `rms_x_mm` and `rms_y_mm`
    are its standard deviations along the floor's axes, `range_x_mm` and `range_y_mm` its extents.
    """

    from_s: float
    to_s: float
    load_n: float
    path_mm: float
    velocity_mm_s: float
    ellipse_95_mm2: float
    rms_x_mm: float
    rms_y_mm: float
    range_x_mm: float
    range_y_mm: float

    def __str__(self) -> str:
        speed = f"{fixed(self.path_mm)} mm, {fixed(self.velocity_mm_s, 1)} mm/s"
        return f"sway path {speed}, 95 % ellipse {fixed(self.ellipse_95_mm2)} mm²"


def sway_of(balance: bytearray, from_s: float, to_s: float) -> Sway:
    """Return the sway in a stretch; `BadValue` if it is below `STILL_S`, or nobody stands throughout.

    >>> from underfoot.floor.contacts import ContactRows
    >>> from underfoot.records.balance import BalanceMeans
    >>> t = np.arange(0.0, 30.0, 0.01)
    >>> way_m = 0.3 + 0.01 * np.array([np.cos(2.0 * np.pi * 0.2 * t), np.sin(2.0 * np.pi * 0.2 * t)])
    >>> rows = ContactRows(t, t.astype(int), *way_m, 700.0 + 0.0 * t, np.ones((3000, 1), bool))
    >>> print(sway_of(bytearray(BalanceMeans().take(rows)), 5.0, 25.0))
    sway path 251 mm, 12.6 mm/s, 95 % ellipse 942 mm²
    """
    from scipy.signal import butter, sosfiltfilt  # half a second

    stood = next(
        (one for one in loaded_times(balance) if one.begin_s - PLACES_S <= from_s and to_s <= one.end_s + PLACES_S),
        None,
    )
    if stood is None or not to_s - from_s > STILL_S - 1e-6:
        raise _refusal(from_s, to_s)
    first, end = math.ceil((from_s - stood.begin_s) / PLACES_S - 1e-6), round((to_s - stood.begin_s) / PLACES_S)
    places = stood.places[max(first, 0) : end]
    if places[:, 2].min() < LEAST_N:
        raise _refusal(from_s, to_s)
    low_pass = butter(2, CUTOFF_HZ / _TWICE, fs=1.0 / PLACES_S, output="sos")
    way_mm = sosfiltfilt(low_pass, 1e3 * places[:, :2].T)
    path_mm, variances = float(np.hypot(*np.diff(way_mm)).sum()), np.cov(way_mm)
    return Sway(
        from_s,
        to_s,
        float(places[:, 2].mean()),
        path_mm,
        path_mm / (PLACES_S * (len(places) - 1)),
        -2.0 * math.pi * math.log(0.05) * math.sqrt(max(float(np.linalg.det(variances)), 0.0)),
        *np.sqrt(variances.diagonal()).tolist(),
        *np.ptp(way_mm, axis=1).tolist(),
    )


def standing_stretches(balance: bytearray) -> list[tuple[float, float]]:
    """Return beginnings and ends, in seconds, of where somebody stands still for longer than a step may last."""
    phase = standing_phase(balance)
    begins_s = np.array(phase.all_s if phase else [])
    parts = np.split(begins_s, np.flatnonzero(np.diff(begins_s) > STILL_S - 0.5 * PLACES_S) + 1)
    ends = [(round(float(part[0]), 3), round(float(part[-1]) + STILL_S, 3)) for part in parts if len(part)]
    return [(from_s, to_s) for from_s, to_s in ends if to_s - from_s > LONGEST_S]


def _refusal(from_s: float, to_s: float) -> BadValue:
    allowed = f"a stretch of {STILL_S:g} s or more throughout which somebody stands"
    return BadValue(f"the sway is that from {from_s:.10g} to {to_s:.10g} s; allowed: {allowed}")
