"""Exponential sweeps (Farina, AES 2000): generation and detection."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, number, numbers
from underfoot.errors import require
from underfoot.kernels import Floats

_LEAST_GAP_S = 0.05
"""Shortest silence between two passes."""


def exponential(
    low_hz: float, high_hz: float, seconds: float, rate_hz: float, level: float = 0.5, fade_s: float = 0.02
) -> Floats:
    """Return one sweep whose frequency rises exponentially with time, faded in and out: shape (frames,).

    >>> sweep = exponential(20.0, 2000.0, 1.0, 48000.0)
    >>> len(sweep), float(sweep[0]), bool(np.abs(sweep).max() <= 0.5)
    (48000, 0.0, True)
    """
    require(0.0 < low_hz < high_hz < 0.5 * rate_hz, "high_hz", high_hz, f"above {low_hz:g}, below half the rate")
    require(0.1 <= seconds <= 120.0, "seconds", seconds, "0.1 to 120")
    require(0.0 < level <= 1.0, "level", level, "above 0, at most 1")
    require(0.0 <= fade_s <= 0.25 * seconds, "fade_s", fade_s, "0 to a quarter of the sweep")
    frames = round(seconds * rate_hz)
    growth = seconds / math.log(high_hz / low_hz)
    time_s = np.arange(frames) / rate_hz
    sweep = level * np.sin(2.0 * math.pi * low_hz * growth * np.expm1(time_s / growth))
    fade = round(fade_s * rate_hz)
    ramp = 0.5 - 0.5 * np.cos(math.pi * np.arange(fade) / max(fade, 1))
    sweep[:fade] *= ramp
    sweep[frames - fade :] *= ramp[::-1]
    return sweep


def train(sweep: ArrayLike, passes: int, rate_hz: float, quiet_s: float = 0.6) -> Floats:
    """Return a silence, then `passes` sweeps, each followed by a silence: shape (frames,).

    >>> len(train([0.5, 0.5], 2, 10.0, 0.3))
    13
    """
    require(1 <= passes <= 100, "passes", passes, "1 to 100")
    one = numbers("sweep", sweep)
    gap = np.zeros(round(number("quiet_s", quiet_s, 0.0, HUGE, "0 s or more") * rate_hz))
    return np.concatenate([gap, np.tile(np.concatenate([one, gap]), passes)])


def find_passes(played: Floats, rate_hz: float) -> tuple[NDArray[np.int64], Floats]:
    """Return the start frames of the passes of a sweep, and one of them.

    There are several only if all are equal and separated by silence.

    >>> starts, sweep = find_passes(train(np.ones(800), 2, 8000.0), 8000.0)
    >>> starts.tolist(), sweep.size
    ([4800, 10400], 800)
    """
    on = np.flatnonzero(np.abs(played) > 1e-4 * np.abs(played).max(initial=0.0))
    require(on.size > 0, "sweep", "silence", "a sweep")
    edges = np.flatnonzero(np.diff(on) > _LEAST_GAP_S * rate_hz)
    begins = on[np.concatenate([[0], edges + 1])]
    ends = on[np.concatenate([edges, [on.size - 1]])] + 1
    length = int((ends - begins).max())
    parts = [played[b : b + length] for b in begins]
    scale = float(np.abs(played).max())
    same = all(p.size == length and np.abs(p - parts[0]).max() <= 1e-3 * scale for p in parts)
    if not same:
        begins, length = on[:1], int(on[-1] + 1 - on[0])
    require(length >= 0.05 * rate_hz, "sweep", f"{length / rate_hz:.3f} s of sound", "at least 0.05 s")
    return begins.astype(np.int64), played[begins[0] : begins[0] + length]


def growth_s(sweep: Floats, rate_hz: float) -> float:
    """Return the time in which a sweep's frequency rises by a factor e, by its zero crossings; NaN if not exponential.

    >>> round(growth_s(exponential(20.0, 2000.0, math.log(100.0), 48000.0), 48000.0), 3)
    1.0
    """
    at = np.flatnonzero(np.signbit(sweep[:-1]) != np.signbit(sweep[1:]))
    if at.size < 20:
        return math.nan
    crossing_s = (at + sweep[at] / (sweep[at] - sweep[at + 1])) / rate_hz
    hz = 1.0 / np.diff(crossing_s[::2])
    middle_s = 0.5 * (crossing_s[::2][1:] + crossing_s[::2][:-1])
    kept = hz < rate_hz / 8.0
    if kept.sum() < 8:
        return math.nan
    slope, start = np.polyfit(middle_s[kept], np.log(hz[kept]), 1)
    straight = float(np.std(np.log(hz[kept]) - start - slope * middle_s[kept])) < 0.1
    return float(1.0 / slope) if straight and slope > 0.0 else math.nan
