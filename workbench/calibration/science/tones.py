"""Distortion over level: tones of rising level, and the harmonics of each in a recording."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from underfoot.arguments import HUGE, TINY, number
from underfoot.calibration.science.recording_checks import signal_of
from underfoot.kernels import Floats

TONE_HZ = 300.0
"""Frequency at which distortion over level is measured (thesis 4.5.1)."""
LEVELS_DB = tuple(range(-30, 1, 3))
"""Levels of the tones, relative to the loudest."""
_TONE_S, _GAP_S = 0.5, 0.2


@dataclass(frozen=True)
class DistortionOverLevel:
    """Distortion of tones: `drive` in full scale, `acceleration` of the fundamental in m/s^2, `thd` as a share."""

    drive: Floats
    acceleration: Floats
    thd: Floats


def tone_series(level: float, rate_hz: float, quiet_s: float) -> Floats:
    """Return tones of rising level up to `level`, each faded in and out, after `quiet_s`, with silence between.

    >>> tones = tone_series(0.5, 8000.0, 0.25)
    >>> round(len(tones) / 8000.0, 3), round(float(np.abs(tones).max()), 3)
    (7.95, 0.5)
    """
    number("level", level, TINY, 1.0, "above 0, at most 1")
    number("rate_hz", rate_hz, 1000.0, HUGE, "at least 1000 Hz")
    number("quiet_s", quiet_s, 0.0, HUGE, "0 s or more")
    frames, gap = round(_TONE_S * rate_hz), np.zeros(round(_GAP_S * rate_hz))
    time_s = np.arange(frames) / rate_hz
    fade = np.clip(np.minimum(time_s, time_s[::-1]) / 0.05, 0.0, 1.0)
    tone = np.sin(2.0 * math.pi * TONE_HZ * time_s) * 0.5 * (1.0 - np.cos(math.pi * fade))
    parts = [np.zeros(round(quiet_s * rate_hz))]
    for db in LEVELS_DB:
        parts += [level * 10.0 ** (db / 20.0) * tone, gap]
    return np.concatenate(parts)


def distortion_over_level(
    recorded: Floats, level: float, rate_hz: float, begins_s: float, sensitivity: float
) -> DistortionOverLevel:
    """Return the distortion of each tone of a `tone_series` in its recording, whose first tone begins at `begins_s`.

    `sensitivity` is the acceleration of a full-scale sample of the recording, m/s^2.
    """
    drive, acceleration, thd = [], [], []
    for k, db in enumerate(LEVELS_DB):
        # The middle of each tone, where it is steady.
        begin = round((begins_s + k * (_TONE_S + _GAP_S) + 0.4 * _TONE_S) * rate_hz)
        amplitudes = harmonics(recorded[begin : begin + round(0.5 * _TONE_S * rate_hz)], TONE_HZ, rate_hz)
        drive.append(level * 10.0 ** (db / 20.0))
        acceleration.append(sensitivity * amplitudes[0])
        thd.append(math.sqrt(float(np.sum(amplitudes[1:] ** 2))) / max(float(amplitudes[0]), 1e-300))
    return DistortionOverLevel(np.array(drive), np.array(acceleration), np.array(thd))


def harmonics(recorded: ArrayLike, frequency_hz: float, rate_hz: float, orders: int = 10) -> Floats:
    """Return the amplitudes of a steady tone and its harmonics, by least squares: shape (orders,); 0 above 0.45 rate.

    >>> time_s = np.arange(4800) / 48000.0
    >>> tone = np.sin(2.0 * np.pi * 300.0 * time_s) + 0.05 * np.sin(2.0 * np.pi * 600.0 * time_s)
    >>> harmonics(tone, 300.0, 48000.0, 3).round(6)
    array([1.  , 0.05, 0.  ])
    """
    recording = signal_of("recorded", recorded)
    number("rate_hz", rate_hz, TINY, HUGE, "above 0 Hz")
    number("frequency_hz", frequency_hz, TINY, 0.45 * rate_hz, "above 0, at most 0.45 of the rate")
    time_s = np.arange(recording.size) / rate_hz
    kept = [k for k in range(1, orders + 1) if k * frequency_hz <= 0.45 * rate_hz]
    angle = 2.0 * math.pi * frequency_hz * np.outer(time_s, kept)
    columns = np.concatenate([np.cos(angle), np.sin(angle), np.ones((recording.size, 1))], axis=1)
    # Normal equations: harmonics are nearly orthogonal, and lstsq would hold the interpreter for 100 ms.
    found = np.linalg.solve(columns.T @ columns, columns.T @ recording)
    amplitudes = np.zeros(orders)
    amplitudes[: len(kept)] = np.hypot(found[: len(kept)], found[len(kept) : 2 * len(kept)])
    return amplitudes
