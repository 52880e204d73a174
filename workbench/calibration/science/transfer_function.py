"""Measurement of a transfer function with an exponential sweep (Farina, AES 2000).

The recording's spectrum divided by that of the sweep gives the impulse response. The k-th harmonic of the tile's
distortion appears as a separate response, earlier by L ln k, where L is the time in which the sweep rises by a factor
e: one sweep separates the linear response and each order of distortion.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.calibration.science.recording_checks import (
    require_alike,
    require_explained,
    require_not_clipped,
    require_not_silent,
    require_same_sweep,
    require_whole,
    signal_of,
)
from underfoot.calibration.science.sweep import find_passes, growth_s
from underfoot.errors import BadMeasurement, require
from underfoot.kernels import Floats

POINTS_AN_OCTAVE = 96
"""Points per octave of a measured response."""
ORDERS = (2, 3, 4, 5)
"""Harmonics whose distortion is measured."""
LEAST_SNR_DB = 10.0
"""Smallest signal-to-noise ratio, in the middle of its band, of an accepted recording."""

_SLACK_S = 0.01
"""Longest time by which a recording may begin after the sweep, or end before it."""
_BEFORE_S, _AFTER_S = 0.005, 0.5
"""Parts of the impulse response that are kept, before and after its arrival."""
_STEADY_FRAMES = 0.2
"""Difference of the passes' delays, in frames, that changes no response."""
_LOOPBACK_DB, _LOOPBACK_FROM_HZ = 0.1, 40.0  # below that a sound card's own high-pass shows


@dataclass(frozen=True)
class SweepMeasurement:
    """Transfer function at `frequencies_hz` (n,), in recorded units per played unit, with measures of its reliability.

    `transfer` (n,) complex is the mean over `passes`, with its delay of `latency_s` removed; `spread_db` (n,) its
    standard deviation over the passes, NaN for one; `noise` (n,) the magnitude that noise alone would give, NaN if the
    recording has no quiet part; `coherence` (n,) the share of the recorded power that the sweep explains, 0 to 1.
    `distortion[k]` (n,) is the k-th harmonic's magnitude, relative to the fundamental, while the sweep is at that
    frequency; NaN if not measured. `noise_rms` is that of the recording's quiet parts; NaN without any. `swept_hz` are
    the lowest and the highest frequency of the sweep: its power, and `frequencies_hz`, end a little beyond.
    """

    frequencies_hz: Floats
    transfer: NDArray[np.complex128]
    spread_db: Floats
    noise: Floats
    coherence: Floats
    distortion: dict[int, Floats]
    latency_s: float
    passes: int
    peak: float
    noise_rms: float
    swept_hz: tuple[float, float]

    @property
    def magnitude(self) -> Floats:
        """Modulus of the transfer function."""
        return np.abs(self.transfer)

    def snr_db(self, low_hz: float, high_hz: float) -> float:
        """Return the median signal-to-noise ratio in a band, dB."""
        inside = within(self.frequencies_hz, (low_hz, high_hz))
        return 20.0 * math.log10(float(np.median(self.magnitude[inside] / np.maximum(self.noise[inside], 1e-300))))


def within(frequencies_hz: Floats, band_hz: tuple[float, float]) -> NDArray[np.bool_]:
    """Return which of `frequencies_hz` (n,) lie in a band, its ends included.

    >>> within(np.array([50.0, 60.0, 700.0]), (60.0, 700.0))
    array([False,  True,  True])
    """
    return (frequencies_hz >= band_hz[0]) & (frequencies_hz <= band_hz[1])


def measure(sweep: ArrayLike, recorded: ArrayLike, rate_hz: float) -> SweepMeasurement:
    """Return the transfer function from `sweep` (frames,) to `recorded` (frames,), both at `rate_hz`.

    `sweep` is all that was played: one pass, or several equal ones separated by silence. The recording may begin up to
    its own length before it, or in the initial silence of the sweep; its latency is determined. Raises `BadMeasurement`
    for an implausible recording, and `BadValue` for values that are no signals.

    >>> from underfoot.calibration.science.sweep import exponential, train
    >>> sweep = train(exponential(20.0, 2000.0, 1.0, 8000.0), 1, 8000.0)
    >>> late = 0.25 * np.roll(sweep, 40) + 0.1 * np.roll(sweep, 48)
    >>> found = measure(sweep, late, 8000.0)
    >>> round(found.latency_s, 3), round(float(np.interp(25.0, found.frequencies_hz, found.magnitude)), 2)
    (0.005, 0.35)
    """
    played, recording = signal_of("sweep", sweep), signal_of("recorded", recorded)
    require(rate_hz >= 1000.0, "rate_hz", rate_hz, "at least 1000 Hz")
    starts, one = find_passes(played, rate_hz)
    require_not_silent(recording)
    require_not_clipped(recording)
    lag = _lag(played, recording, int(starts[0]), int(starts[-1]) + one.size, rate_hz)
    found = _measure_passes(one, starts + lag, recording - recording.mean(), rate_hz)
    return replace(found, latency_s=found.latency_s + lag / rate_hz)


def _lag(played: Floats, recording: Floats, begins: int, ends: int, rate_hz: float) -> int:
    """Return the delay of the recording in frames: the first peak of the correlation, whitened over the sweep's band.

    A peak is as wide as the band allows: its flank lies before the delay. The first one is more than half as high as
    the largest, which may be a resonance.

    Frames `begins` to `ends` of the played signal are not silent, and must be in the recording.
    """
    size, slack = _fft_size(played.size + recording.size), round(_SLACK_S * rate_hz)
    whole = np.abs(np.fft.irfft(np.fft.rfft(recording, size) * _inverse(np.fft.rfft(played, size)), size))
    # From the earliest possible lag on, of a recording that begins when the sweep is over.
    response = np.concatenate([whole[size - ends :], whole[: recording.size]])
    first, last = max(ends - begins - slack, 0), recording.size + slack
    peak = int(np.argmax(response))
    inside = first + int(np.argmax(response[first : last + 1])) if first <= last else peak
    if not first <= peak <= last and (inside == peak or response[peak] > 3.0 * response[inside]):
        raise BadMeasurement(
            f"the recording does not hold the whole sweep: it lasts {recording.size / rate_hz:.2f} s, and the sweep "
            f"goes from {(peak - ends + begins) / rate_hz:.2f} to {peak / rate_hz:.2f} s of it"
        )
    return _first_peak(response, inside, first) - ends


def _first_peak(response: Floats, largest: int, first: int) -> int:
    """Return the frame of the first peak, from `first` on, that is half as high as that at frame `largest`."""
    begin = max(largest - 1000, first)
    early = response[begin : largest + 2]
    is_peak = (early[1:-1] >= 0.5 * response[largest]) & (early[1:-1] >= early[:-2]) & (early[1:-1] >= early[2:])
    return begin + 1 + int(np.argmax(is_peak)) if is_peak.any() else largest


def _fft_size(frames: int) -> int:
    """Return the next power of two."""
    return 1 << max(frames - 1, 1).bit_length()


def _inverse(spectrum: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the inverse of a spectrum, regularised where it is far below its maximum."""
    power = np.abs(spectrum) ** 2
    return np.asarray(spectrum.conj() / (power + 1e-6 * power.max()))


def _band(spectrum: NDArray[np.complex128], rate_hz: float) -> tuple[float, float]:
    """Return the band in which a sweep has power: within 30 dB of its strongest part, counted by octaves."""
    f = np.fft.rfftfreq(2 * (spectrum.size - 1), 1.0 / rate_hz)
    edges = np.geomspace(2.0, 0.45 * rate_hz, 12 * 12)
    cell = np.digitize(f, edges)
    power = np.bincount(cell, np.abs(spectrum) ** 2 * f, edges.size + 1) / np.maximum(np.bincount(cell), 1)
    strong = np.flatnonzero(power[1:-1] >= 1e-3 * power[1:-1].max())
    return float(edges[strong[0]]), float(edges[strong[-1] + 1])


def _swept(power: Floats, f: Floats) -> tuple[float, float]:
    """Return the ends of a sweep, Hz, of its power by octaves (n,) at f (n,): there it is a tenth of the usual."""
    strong = f[power >= 0.1 * np.median(power)]
    return float(strong[0]), float(strong[-1])


def _measure_passes(one: Floats, starts: NDArray[np.int64], recording: Floats, rate_hz: float) -> SweepMeasurement:
    """Return the measurement, from one pass, the starts of the passes in the recording, and the recording.

    Its latency is the time from these starts on.
    """
    before, longest = round(_BEFORE_S * rate_hz), round(_AFTER_S * rate_hz)
    # Up to the next pass. Ringing beyond the recording's end belongs to the last frequencies only.
    after = longest
    kept = int(np.diff(starts).min(initial=one.size + after))
    size = _fft_size(2 * one.size + longest + before)
    parts = np.array([_cut(recording, start - before, before + kept, size) for start in starts])
    x = np.fft.rfft(one, size)
    low, high = _band(x, rate_hz)
    f: Floats = np.fft.rfftfreq(size, 1.0 / rate_hz).astype(np.float64)
    inside = (f >= low) & (f <= high)
    recording_spectra, later = _aligned(np.fft.rfft(parts), np.where(inside, _inverse(x), 0.0), size, before)
    responses = np.fft.irfft(recording_spectra * _inverse(x), size)
    stretches = responses[:, : before + after] * _window(before, after)
    quiet = _quiet(recording, starts, one.size + longest, before)
    density = _density(quiet, before + after, f, rate_hz)
    left = recording_spectra - np.fft.rfft(stretches, size) * x
    power, unexplained = (np.mean(np.abs(part[:, inside]) ** 2, axis=0) for part in (recording_spectra, left))
    require_explained(f[inside], power, unexplained, density[inside] * (before + kept))
    grid = np.geomspace(low, high, max(round(POINTS_AN_OCTAVE * math.log2(high / low)), 2))
    each = np.array([_spectrum(stretch, before, grid, rate_hz) for stretch in stretches])
    transfer, passes = each.mean(axis=0), len(starts)
    noise = np.sqrt(np.interp(grid, f, density) * (before + after) / passes) / np.interp(grid, f, np.abs(x))
    require_same_sweep(stretches.mean(axis=0), rate_hz, grid, noise)
    scatter = np.zeros(grid.size) if passes == 1 else np.abs(each - transfer).std(axis=0)
    power, other = np.abs(transfer) ** 2, np.nan_to_num(noise) ** 2 + scatter**2
    found = SweepMeasurement(
        frequencies_hz=grid,
        transfer=transfer,
        spread_db=np.full(grid.size, np.nan) if passes == 1 else (20.0 * np.log10(np.abs(each))).std(axis=0, ddof=1),
        noise=noise,
        coherence=power / np.maximum(power + other, 1e-300),
        distortion=_distortion(responses.mean(axis=0), one, np.abs(transfer), grid, before, rate_hz),
        latency_s=later / rate_hz,
        passes=passes,
        peak=float(np.abs(recording).max()),
        noise_rms=float(quiet.std()) if quiet.size else math.nan,
        swept_hz=_swept(np.abs(x[inside]) ** 2 * f[inside], f[inside]),
    )
    middle = (grid > max(1.2 * low, _LOOPBACK_FROM_HZ)) & (grid < high / 1.2)
    require_alike(scatter[middle], found.magnitude[middle], math.sqrt(passes) * noise[middle])
    if float(np.std(20.0 * np.log10(found.magnitude[middle]))) < _LOOPBACK_DB:
        raise BadMeasurement(
            "the recording is the sweep itself, not what an accelerometer makes of it: another channel?"
        )
    snr_db = found.snr_db(1.2 * low, high / 1.2)
    if snr_db < LEAST_SNR_DB:
        raise BadMeasurement(
            f"the signal is only {snr_db:.0f} dB above the noise; at least {LEAST_SNR_DB:g} dB: play it louder"
        )
    require_whole(stretches, *found.swept_hz, rate_hz)
    return found


def _aligned(
    spectra: NDArray[np.complex128], inverse: NDArray[np.complex128], size: int, before: int
) -> tuple[NDArray[np.complex128], int]:
    """Return the spectra of the passes (passes, n) at the time of the first one, and how much later that is, in frames.

    Cards with clocks of their own drift apart, and a card loses samples: passes that come at other times would cancel
    one another in their mean, and their delay is not that of any. Passes that come at equal times stay as they are.

    `inverse` (n,) is that of a pass, and 0 outside its band. Within it each frequency counts alike: noise above the
    band, or a resonance that moved between passes, would give a delay of its own.
    """
    cross = spectra * spectra[0].conj() * (inverse != 0.0)
    late = np.fft.irfft(cross / np.maximum(np.abs(cross), 1e-300), size)
    peaks = np.argmax(late, axis=1)
    left, at, right = (late[np.arange(len(late)), (peaks + k) % size] for k in (-1, 0, 1))
    delays = (peaks + 0.5 * (left - right) / np.minimum(left - 2.0 * at + right, -1e-300) + size // 2) % size
    delays -= delays[0]
    if np.abs(delays).max() < _STEADY_FRAMES:
        return spectra, 0
    # From half a turn before the arrival that all passes together seem to have.
    first = np.roll(np.abs(np.fft.irfft(spectra[0] * inverse, size)), size // 2 - before)
    later = _first_peak(first, int(np.argmax(first)), 0) - size // 2
    turn = 2j * math.pi * np.arange(spectra.shape[1]) / size
    return np.asarray(spectra * np.exp(turn * (delays + later)[:, None])), later


def _cut(signal: Floats, first: int, frames: int, size: int) -> Floats:
    """Return frames `first` to `first + frames` of a signal, padded with zeros, in an array of `size`."""
    part = np.zeros(size)
    begin, end = max(first, 0), min(first + frames, signal.size)
    part[begin - first : end - first] = signal[begin:end]
    return part


def _window(before: int, after: int) -> Floats:
    """Return a window that is 1 around frame `before`, faded in before it and out over the last fifth."""
    fade = max(after // 5, 1)
    rise = 0.5 - 0.5 * np.cos(math.pi * np.arange(before) / max(before, 1))
    fall = 0.5 + 0.5 * np.cos(math.pi * np.arange(fade) / fade)
    return np.concatenate([rise, np.ones(after - fade), fall])


def _spectrum(stretch: Floats, before: int, grid: Floats, rate_hz: float) -> NDArray[np.complex128]:
    """Return the spectrum of a stretch at frequencies of a grid, with time 0 at its frame `before`."""
    size = _fft_size(max(stretch.size, round(2.0 * rate_hz)))
    f = np.fft.rfftfreq(size, 1.0 / rate_hz)
    spectrum = np.fft.rfft(stretch, size) * np.exp(2j * math.pi * f * before / rate_hz)
    return np.asarray(np.interp(grid, f, spectrum.real) + 1j * np.interp(grid, f, spectrum.imag))


def _quiet(recording: Floats, starts: NDArray[np.int64], sounds: int, before: int) -> Floats:
    """Return the longest stretch of a recording in which nothing plays, without its mean; empty if too short."""
    begins = np.append(0, starts + sounds)
    ends = np.append(starts - before, recording.size)
    longest = int(np.argmax(ends - begins))
    stretch = recording[begins[longest] : max(ends[longest], begins[longest])]
    return stretch - stretch.mean() if stretch.size >= 20 * before else np.zeros(0)


def _density(quiet: Floats, frames: int, f: Floats, rate_hz: float) -> Floats:
    """Return the power of `quiet` per frame, at frequencies f, from stretches of `frames`; NaN if there are none."""
    if not quiet.size:
        return np.full(f.size, np.nan)
    length = min(quiet.size, frames)
    window = np.hanning(length)
    hops = range(0, quiet.size - length + 1, max(length // 2, 1))
    power = np.mean([np.abs(np.fft.rfft(quiet[h : h + length] * window)) ** 2 for h in hops], axis=0)
    return np.array(np.interp(f, np.fft.rfftfreq(length, 1.0 / rate_hz), power / np.sum(window**2)))


def _distortion(
    response: Floats, one: Floats, magnitude: Floats, grid: Floats, before: int, rate_hz: float
) -> dict[int, Floats]:
    """Return each harmonic's magnitude relative to the fundamental, at the frequency that was played."""
    growth = growth_s(one, rate_hz)
    found = {}
    for k in ORDERS:
        room_s = growth * math.log((k + 1) / k)
        if not room_s > 0.04:
            found[k] = np.full(grid.size, np.nan)
            continue
        early, late = round(0.2 * room_s * rate_hz), round(min(0.7 * room_s, _AFTER_S) * rate_hz)
        at = before - growth * math.log(k) * rate_hz
        first = math.floor(at) - early
        stretch = np.roll(response, -first)[: early + late] * _window(early, late)
        of_harmonic = np.abs(_spectrum(stretch, early, np.minimum(k * grid, 0.5 * rate_hz), rate_hz))
        found[k] = np.where(k * grid <= grid[-1], of_harmonic / np.maximum(magnitude, 1e-300), np.nan)
    return found
