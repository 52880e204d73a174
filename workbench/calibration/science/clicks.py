"""Delay measurement with clicks."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, integer, number
from underfoot.calibration.science.recording_checks import signal_of
from underfoot.errors import BadMeasurement, require
from underfoot.kernels import Floats
from underfoot.models.signals.random import stream_key, uniform

CLICK_S = 0.001
"""Length of a click, a raised cosine."""
NEAREST_S, FURTHEST_S = 0.018, 0.030
"""Range of the random intervals between clicks: no other alignment fits the whole train."""
_BEFORE_S, _AFTER_S = 0.002, 0.012
_SEARCH_S = 0.003
_REACHED = 0.1
"""Share of its peak at which a response begins."""
_CLEAR = 5.0
"""Times the noise that is not noise any more."""
_LOST = 0.25
"""A click is lost if this share of the mean response is not in the recording."""


@dataclass(frozen=True)
class ClickDelays:
    """`delay_s` (n,) of the clicks received, `played_s` (n,) when they were played, and the number of `lost` ones."""

    delay_s: Floats
    played_s: Floats
    lost: int


def click_train(count: int, rate_hz: float, level: float, seed: int = 1) -> tuple[Floats, NDArray[np.int64]]:
    """Return `count` clicks of peak `level` with half a second of silence at both ends, and their start frames.

    >>> train, onsets = click_train(3, 48000.0, 0.5)
    >>> float(train.max()), len(onsets), int(onsets[0])
    (0.5, 3, 24000)
    """
    count = integer("count", count, 1, 100_000, "1 to 100000")
    number("rate_hz", rate_hz, 1000.0, HUGE, "at least 1000 Hz")
    number("level", level, TINY, 1.0, "above 0, at most 1")
    key = stream_key("clicks", seed)
    steps_s = [NEAREST_S + (FURTHEST_S - NEAREST_S) * uniform(key, k) for k in range(count)]
    onsets = np.round(rate_hz * (0.5 + np.cumsum([0.0, *steps_s[:-1]]))).astype(np.int64)
    pulse = level * np.hanning(round(CLICK_S * rate_hz) + 2)[1:-1]
    pulse *= level / pulse.max()
    train = np.zeros(int(onsets[-1]) + round(0.5 * rate_hz))
    for onset in onsets:
        train[onset : onset + len(pulse)] = pulse
    return train, onsets


def click_onsets(played: ArrayLike, rate_hz: float) -> NDArray[np.int64]:
    """Return the start frames of a recorded train of clicks; `BadMeasurement` if there are none.

    >>> train, onsets = click_train(5, 48000.0, 0.3)
    >>> bool((click_onsets(train, 48000.0) == onsets).all())
    True
    """
    signal = np.abs(np.asarray(played, dtype=np.float64))
    loud = np.flatnonzero(signal > 1e-3 * signal.max(initial=0.0))
    if loud.size == 0:
        raise BadMeasurement("there is no click in what was played")
    return loud[np.diff(loud, prepend=-(10**9)) > 0.5 * NEAREST_S * rate_hz]


def click_delays(played: ArrayLike, onsets: NDArray[np.int64], recording: ArrayLike, rate_hz: float) -> ClickDelays:
    """Return when each click was received: the start of its response, from the mean of all responses.

    `BadMeasurement` if nothing of the train is in the recording, or less than half of the clicks were received.

    >>> train, onsets = click_train(20, 48000.0, 0.5)
    >>> found = click_delays(train, onsets, np.roll(0.1 * train, 480), 48000.0)
    >>> found.delay_s.round(5)[:2], found.lost
    (array([0.01, 0.01]), 0)
    """
    sent, received = signal_of("played", played), signal_of("recording", recording)
    onsets = np.asarray(onsets)
    is_frames = onsets.ndim == 1 and onsets.size > 0 and np.issubdtype(onsets.dtype, np.integer)
    within = is_frames and onsets[0] >= 0 and bool((np.diff(onsets) > 0).all())
    require(within, "onsets", onsets, "rising frames, from 0: the starts of the clicks")
    lag = _lag(sent, received)
    before, after, search = (round(s * rate_hz) for s in (_BEFORE_S, _AFTER_S, _SEARCH_S))
    starts = onsets + lag - before - search
    whole = (starts >= 0) & (starts + before + after + 2 * search <= len(received))
    windows = np.array([received[a : a + before + after + 2 * search] for a in starts[whole]])
    if len(windows) < len(onsets) / 2:
        raise BadMeasurement(f"of {len(onsets)} clicks {len(windows)} are in the recording; is it long enough?")
    shift, match = np.zeros(len(windows)), np.ones(len(windows))
    for _ in range(3):  # the mean of unaligned responses is smeared
        mean = _mean(windows, shift, match > _LOST, search)
        shift, match = _aligned(windows, mean, search)
    back = match > _LOST
    if back.sum() < len(onsets) / 2:
        raise BadMeasurement(f"of {len(onsets)} clicks {int(back.sum())} came back; is the output looped to the input?")
    early = windows[back, : search // 4]  # before every response
    noise = float(early.std()) / math.sqrt(back.sum())
    begin = _begin(mean, noise) - before - _begin(sent[onsets[0] : onsets[0] + before + after], 0.0)
    delays = (lag + begin + shift[back]) / rate_hz
    return ClickDelays(delays, onsets[whole][back] / rate_hz, int(len(onsets) - back.sum()))


def _mean(windows: Floats, shift: Floats, used: NDArray[np.bool_], search: int) -> Floats:
    """Return the mean of responses, each shifted back with linear interpolation; its rest at 0."""
    at = np.arange(search, windows.shape[1] - search, dtype=np.float64)
    places = np.arange(windows.shape[1])
    moved = [np.interp(at + by, places, one) for one, by in zip(windows[used], shift[used], strict=True)]
    mean = np.mean(moved, axis=0)
    return np.asarray(mean - mean[: search // 4].mean())  # before every response


def _aligned(windows: Floats, mean: Floats, search: int) -> tuple[Floats, Floats]:
    """Return the delay of each response behind the mean, in samples, and the share of the mean in it."""
    offsets, energy = np.arange(-search, search + 1), float(mean @ mean)
    found = [_peak(np.correlate(window, mean) / energy, offsets) for window in windows]
    shift, match = np.array(found).T
    return shift, match


def _lag(sent: Floats, received: Floats) -> int:
    """Return the best shift of the recording in samples; `BadMeasurement` if it has nothing of the played signal."""
    size = 1 << (len(sent) + len(received) - 1).bit_length()
    cross = np.fft.irfft(np.conj(np.fft.rfft(sent, size)) * np.fft.rfft(received, size), size)[: len(received)]
    lag = int(np.argmax(np.abs(cross)))
    scale = math.sqrt(float(sent @ sent) * float(received @ received))
    if scale == 0.0 or abs(cross[lag]) < 0.02 * scale:
        raise BadMeasurement("nothing of the clicks is in the recording; is the output looped to the input?")
    return lag


def _peak(values: Floats, offsets: NDArray[np.int64]) -> tuple[float, float]:
    """Return position and height of the maximum, interpolated by a parabola."""
    k = int(np.argmax(values))
    if 0 < k < len(values) - 1:
        low, mid, high = values[k - 1 : k + 2]
        bend = low - 2.0 * mid + high
        return float(offsets[k]) + (0.5 * float(low - high) / float(bend) if bend else 0.0), float(mid)
    return float(offsets[k]), float(values[k])


def _begin(response: Floats, noise: float) -> float:
    """Return where a response first reaches a tenth of its peak, interpolated linearly; `noise` is its RMS before.

    Noise may reach that much earlier: then it is the last time before the response exceeds the noise by far.
    """
    size = np.abs(response)
    least, clear = _REACHED * size.max(), _CLEAR * noise
    if clear > 0.5 * size.max():
        raise BadMeasurement(
            f"the clicks are only {size.max() / max(noise, 1e-300):.1f} times as large as the noise, all of them "
            "together; play them louder"
        )
    k = int(np.argmax(size >= max(least, clear)))
    while k > 0 and size[k - 1] >= least:
        k -= 1
    return float(k) if k == 0 else k - 1 + float((least - size[k - 1]) / (size[k] - size[k - 1]))
