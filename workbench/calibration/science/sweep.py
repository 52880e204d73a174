"""Measuring a transfer function by an exponential sweep (Farina, AES 2000), and what speaks against a recording.

Dividing the recording's spectrum by the sweep's gives the impulse response. What the tile distorts to the k-th harmonic
arrives as a response of its own, earlier by L ln k, L being the time in which the sweep rises by a factor e: one sweep
tells the linear response and each order of distortion apart.
"""

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.calibration.procedures.procedure import Refused
from underfoot.errors import require

Array = NDArray[np.float64]

POINTS_AN_OCTAVE = 96
"""Points of a measured response."""
ORDERS = (2, 3, 4, 5)
"""Harmonics whose distortion a sweep tells."""
LEAST_SNR_DB = 10.0
"""A recording whose signal is nearer to its noise than this, in the middle of its band, is refused."""

_LEAST_SIGNAL = 1e-5
_LEAST_GAP_S = 0.05
_QUIET_S = 0.1
_SLACK_S = 0.01
_BEFORE_S, _AFTER_S = 0.005, 0.5
_EXPLAINED, _STRANGE = 0.3, 0.5
_LOOPBACK_DB, _LOOPBACK_FROM_HZ = 0.1, 40.0  # below that a sound card's own high-pass tells
_DISPERSED_FROM_HZ, _MOST_DISPERSED_MS = 100.0, 30.0


@dataclass(frozen=True)
class Measured:
    """What a sweep tells, at `frequencies_hz` (n,): everything is in recorded units a played unit.

    `transfer` (n,) complex, the mean over `passes`, its delay of `latency_s` taken out; `spread_db` (n,) its standard
    deviation over the passes, NaN for one; `noise` (n,) the magnitude that noise alone would have given, NaN where the
    recording has no quiet part; `coherence` (n,) the share of what was heard that the sweep explains, 0 to 1.
    `distortion[k]` (n,) is the k-th harmonic's magnitude while the sweep is at that frequency, of the fundamental's;
    NaN where it was not measured. `noise_rms` is of the recording's quiet parts; NaN where it has none.
    """

    frequencies_hz: Array
    transfer: NDArray[np.complex128]
    spread_db: Array
    noise: Array
    coherence: Array
    distortion: dict[int, Array]
    latency_s: float
    passes: int
    peak: float
    noise_rms: float

    @property
    def magnitude(self) -> Array:
        """The modulus of the transfer function."""
        return np.abs(self.transfer)

    def snr_db(self, low_hz: float, high_hz: float) -> float:
        """The median of signal over noise in a band, dB."""
        inside = (self.frequencies_hz >= low_hz) & (self.frequencies_hz <= high_hz)
        return 20.0 * math.log10(float(np.median(self.magnitude[inside] / np.maximum(self.noise[inside], 1e-300))))


def exponential(
    low_hz: float, high_hz: float, seconds: float, rate_hz: float, level: float = 0.5, fade_s: float = 0.02
) -> Array:
    """One sweep whose frequency rises by equal factors in equal times, faded in and out: shape (frames,).

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


def train(sweep: ArrayLike, passes: int, rate_hz: float, quiet_s: float = 0.6) -> Array:
    """A quiet stretch, then `passes` sweeps, each with a quiet stretch behind it: shape (frames,).

    >>> len(train([0.5, 0.5], 2, 10.0, 0.3))
    13
    """
    require(1 <= passes <= 100, "passes", passes, "1 to 100")
    gap = np.zeros(round(quiet_s * rate_hz))
    return np.concatenate([gap, np.tile(np.concatenate([np.asarray(sweep, dtype=np.float64), gap]), passes)])


def measure(sweep: ArrayLike, recorded: ArrayLike, rate_hz: float) -> Measured:
    """What `recorded` (frames,) tells of the way that `sweep` (frames,) took, both at `rate_hz`.

    `sweep` is all that was played: one pass or several equal ones with silence between. The recording may begin up to
    the whole of its own length before it, or in the silence that the sweep begins with; its latency is found. Raises
    `Refused` for a recording that cannot be right, and `BadValue` for values that are no signals.

    >>> sweep = train(exponential(20.0, 2000.0, 1.0, 8000.0), 1, 8000.0)
    >>> late = 0.25 * np.roll(sweep, 40) + 0.1 * np.roll(sweep, 48)
    >>> found = measure(sweep, late, 8000.0)
    >>> round(found.latency_s, 3), round(float(np.interp(25.0, found.frequencies_hz, found.magnitude)), 2)
    (0.005, 0.35)
    """
    played, heard = _signal("sweep", sweep), _signal("recorded", recorded)
    require(rate_hz >= 1000.0, "rate_hz", rate_hz, "at least 1000 Hz")
    starts, one = passes_of(played, rate_hz)
    refuse_silence(heard)
    refuse_clipping(heard)
    lag = _lag(played, heard, int(starts[0]), int(starts[-1]) + one.size, rate_hz)
    return replace(_measured(one, starts + lag, heard - heard.mean(), rate_hz), latency_s=lag / rate_hz)


def passes_of(played: Array, rate_hz: float) -> tuple[NDArray[np.int64], Array]:
    """Where the passes of a sweep begin, and one of them; several only where all are the same and silence parts them.

    >>> starts, one = passes_of(train(np.ones(800), 2, 8000.0), 8000.0)
    >>> starts.tolist(), one.size
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


def refuse_silence(heard: Array) -> None:
    """Raise `Refused` for a recording of nothing."""
    largest = float(np.abs(heard - heard.mean()).max(initial=0.0))
    if largest < _LEAST_SIGNAL:
        raise Refused(f"no signal: the largest sample is {largest:.2g} of full scale; is the accelerometer connected?")


def refuse_clipping(heard: Array) -> None:
    """Raise `Refused` for a recording whose peaks are cut off: many runs of equal samples at its own extremes."""
    for extreme in (float(heard.max()), float(heard.min())):
        at = np.flatnonzero(heard == extreme)
        steps = np.abs(np.diff(heard))
        finest = float(steps[steps > 0.0].min(initial=math.inf))
        # Coarse samples stay on one value at every peak of a slow sine: that is no clipping.
        if at.size < 8 or abs(extreme) < 300.0 * finest:
            continue
        runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
        if sum(run.size >= 3 for run in runs) >= 3:
            raise Refused(
                f"the recording is clipped: {at.size} samples lie at {extreme:.3g} of full scale; turn the input down"
            )


def harmonics(recorded: ArrayLike, frequency_hz: float, rate_hz: float, orders: int = 10) -> Array:
    """Amplitudes of a steady tone and its harmonics, by least squares: shape (orders,); 0 above 0.45 of the rate.

    >>> time_s = np.arange(4800) / 48000.0
    >>> tone = np.sin(2.0 * np.pi * 300.0 * time_s) + 0.05 * np.sin(2.0 * np.pi * 600.0 * time_s)
    >>> harmonics(tone, 300.0, 48000.0, 3).round(6)
    array([1.  , 0.05, 0.  ])
    """
    heard = _signal("recorded", recorded)
    time_s = np.arange(heard.size) / rate_hz
    kept = [k for k in range(1, orders + 1) if k * frequency_hz <= 0.45 * rate_hz]
    angle = 2.0 * math.pi * frequency_hz * np.outer(time_s, kept)
    columns = np.concatenate([np.cos(angle), np.sin(angle), np.ones((heard.size, 1))], axis=1)
    # Normal equations: harmonics are all but orthogonal, and lstsq would hold the interpreter for 100 ms.
    found = np.linalg.solve(columns.T @ columns, columns.T @ heard)
    amplitudes = np.zeros(orders)
    amplitudes[: len(kept)] = np.hypot(found[: len(kept)], found[len(kept) : 2 * len(kept)])
    return amplitudes


def _signal(name: str, given: ArrayLike) -> Array:
    signal = np.asarray(given, dtype=np.float64)
    require(signal.ndim == 1 and signal.size > 0, name, signal.shape, "one channel, shape (frames,)")
    require(bool(np.isfinite(signal).all()), name, "a signal with values that are not finite", "finite samples")
    return signal


def _lag(played: Array, heard: Array, begins: int, ends: int, rate_hz: float) -> int:
    """By how many frames the recording is late: where their correlation, whitened over the sweep's band, begins.

    Frames `begins` to `ends` of what was played sound, and must be in the recording.
    """
    size, slack = _room(played.size + heard.size), round(_SLACK_S * rate_hz)
    whole = np.abs(np.fft.irfft(np.fft.rfft(heard, size) * _inverse(np.fft.rfft(played, size)), size))
    # From the earliest lag on that there can be, of a recording that begins when the sweep is over.
    response = np.concatenate([whole[size - ends :], whole[: heard.size]])
    first, last = max(ends - begins - slack, 0), heard.size + slack
    peak = int(np.argmax(response))
    inside = first + int(np.argmax(response[first : last + 1])) if first <= last else peak
    if not first <= peak <= last and (inside == peak or response[peak] > 3.0 * response[inside]):
        raise Refused(
            f"the recording does not hold the whole sweep: it lasts {heard.size / rate_hz:.2f} s, and the sweep goes "
            f"from {(peak - ends + begins) / rate_hz:.2f} to {peak / rate_hz:.2f} s of it"
        )
    early = response[max(inside - 1000, first) : inside + 1]
    return max(inside - 1000, first) + int(np.argmax(early >= 0.5 * early[-1])) - ends


def _room(frames: int) -> int:
    return 1 << max(frames - 1, 1).bit_length()


def _inverse(spectrum: NDArray[np.complex128]) -> NDArray[np.complex128]:
    power = np.abs(spectrum) ** 2
    return np.asarray(spectrum.conj() / (power + 1e-6 * power.max()))


def _band(spectrum: NDArray[np.complex128], rate_hz: float) -> tuple[float, float]:
    """The band in which a sweep has power: within 30 dB of its strongest part, counted by octaves."""
    f = np.fft.rfftfreq(2 * (spectrum.size - 1), 1.0 / rate_hz)
    edges = np.geomspace(2.0, 0.45 * rate_hz, 12 * 12)
    cell = np.digitize(f, edges)
    power = np.bincount(cell, np.abs(spectrum) ** 2 * f, edges.size + 1) / np.maximum(np.bincount(cell), 1)
    strong = np.flatnonzero(power[1:-1] >= 1e-3 * power[1:-1].max())
    return float(edges[strong[0]]), float(edges[strong[-1] + 1])


def _measured(one: Array, starts: NDArray[np.int64], heard: Array, rate_hz: float) -> Measured:
    before, longest = round(_BEFORE_S * rate_hz), round(_AFTER_S * rate_hz)
    # Up to the next pass. What rings on beyond the recording's end is that of the last frequencies only.
    after = longest
    kept = int(np.diff(starts).min(initial=one.size + after))
    size = _room(2 * one.size + longest + before)
    parts = np.array([_cut(heard, start - before, before + kept, size) for start in starts])
    x = np.fft.rfft(one, size)
    heard_spectra = np.fft.rfft(parts)
    responses = np.fft.irfft(heard_spectra * _inverse(x), size)
    stretches = responses[:, : before + after] * _window(before, after)
    low, high = _band(x, rate_hz)
    f: Array = np.fft.rfftfreq(size, 1.0 / rate_hz).astype(np.float64)
    inside = (f >= low) & (f <= high)
    quiet = _quiet(heard, starts, one.size + longest, before)
    density = _density(quiet, before + after, f, rate_hz)
    left = heard_spectra - np.fft.rfft(stretches, size) * x
    power, unexplained = (np.mean(np.abs(part[:, inside]) ** 2, axis=0) for part in (heard_spectra, left))
    _refuse_stranger(f[inside], power, unexplained, density[inside] * (before + kept))
    _refuse_another(stretches.mean(axis=0), low, high, rate_hz)
    grid = np.geomspace(low, high, max(round(POINTS_AN_OCTAVE * math.log2(high / low)), 2))
    each = np.array([_spectrum(stretch, before, grid, rate_hz) for stretch in stretches])
    transfer, passes = each.mean(axis=0), len(starts)
    noise = np.sqrt(np.interp(grid, f, density) * (before + after) / passes) / np.interp(grid, f, np.abs(x))
    scatter = np.zeros(grid.size) if passes == 1 else np.abs(each - transfer).std(axis=0)
    power, other = np.abs(transfer) ** 2, np.nan_to_num(noise) ** 2 + scatter**2
    found = Measured(
        frequencies_hz=grid,
        transfer=transfer,
        spread_db=np.full(grid.size, np.nan) if passes == 1 else (20.0 * np.log10(np.abs(each))).std(axis=0, ddof=1),
        noise=noise,
        coherence=power / np.maximum(power + other, 1e-300),
        distortion=_distortion(responses.mean(axis=0), one, np.abs(transfer), grid, before, rate_hz),
        latency_s=0.0,
        passes=passes,
        peak=float(np.abs(heard).max()),
        noise_rms=float(quiet.std()) if quiet.size else math.nan,
    )
    middle = (grid > max(1.2 * low, _LOOPBACK_FROM_HZ)) & (grid < high / 1.2)
    if float(np.std(20.0 * np.log10(found.magnitude[middle]))) < _LOOPBACK_DB:
        raise Refused("the recording is the sweep itself, not what an accelerometer makes of it: another channel?")
    snr_db = found.snr_db(1.2 * low, high / 1.2)
    if snr_db < LEAST_SNR_DB:
        raise Refused(
            f"the signal is only {snr_db:.0f} dB above the noise; at least {LEAST_SNR_DB:g} dB: play it louder"
        )
    return found


def _cut(signal: Array, first: int, frames: int, size: int) -> Array:
    """Frames `first` to `first + frames` of a signal, zero where it has none, in an array of `size`."""
    part = np.zeros(size)
    begin, end = max(first, 0), min(first + frames, signal.size)
    part[begin - first : end - first] = signal[begin:end]
    return part


def _window(before: int, after: int) -> Array:
    """1 about an arrival at frame `before`, faded in before it and out over the last fifth."""
    fade = max(after // 5, 1)
    rise = 0.5 - 0.5 * np.cos(math.pi * np.arange(before) / max(before, 1))
    fall = 0.5 + 0.5 * np.cos(math.pi * np.arange(fade) / fade)
    return np.concatenate([rise, np.ones(after - fade), fall])


def _spectrum(stretch: Array, before: int, grid: Array, rate_hz: float) -> NDArray[np.complex128]:
    """The spectrum of a stretch at frequencies of a grid, time counted from its frame `before`."""
    size = _room(max(stretch.size, round(2.0 * rate_hz)))
    f = np.fft.rfftfreq(size, 1.0 / rate_hz)
    spectrum = np.fft.rfft(stretch, size) * np.exp(2j * math.pi * f * before / rate_hz)
    return np.asarray(np.interp(grid, f, spectrum.real) + 1j * np.interp(grid, f, spectrum.imag))


def _refuse_stranger(f: Array, heard: Array, left: Array, noise: Array) -> None:
    """Refuse what the sweep does not explain, from the power heard, left unexplained, and of noise, at frequencies f.

    Octave by octave, since one resonance can have nearly all the power; where noise is not known (NaN) it counts as 0.
    """
    share = 1.0 - float(left.sum() / max(heard.sum(), 1e-300))
    edges = np.flatnonzero(np.diff(np.floor(np.log2(f / f[0])), prepend=-1.0))
    whole, strange = (np.add.reduceat(p, edges) for p in (heard, left - 1.5 * np.nan_to_num(noise)))
    octaves = whole >= 1e-4 * whole.max()
    most = float(np.max(strange[octaves] / whole[octaves], initial=0.0))
    if share < _EXPLAINED or most > _STRANGE:
        percent = 100.0 * max(min(share, 1.0 - most), 0.0)
        raise Refused(
            f"sweep and recording do not fit: the sweep explains {percent:.0f} % of what was heard; "
            "another channel, another sweep, or much too little above the noise?"
        )


def _refuse_another(response: Array, low: float, high: float, rate_hz: float) -> None:
    """Refuse a recording of a sweep of another speed, or at another rate: some octaves arrive later than others."""
    if high < 4.0 * _DISPERSED_FROM_HZ:
        return
    spectrum, f = np.fft.fft(response), np.fft.fftfreq(response.size, 1.0 / rate_hz)
    arrivals = []
    for begin, end in pairwise(np.geomspace(max(low, _DISPERSED_FROM_HZ), high, 5)):
        envelope = np.abs(np.fft.ifft(np.where((f >= begin) & (f < end), spectrum, 0.0)))
        arrivals.append(1000.0 * float(np.argmax(envelope)) / rate_hz)
    apart_ms = max(arrivals) - min(arrivals)
    if apart_ms > _MOST_DISPERSED_MS:
        raise Refused(
            f"sweep and recording do not fit: some octaves arrive {apart_ms:.0f} ms later than others; "
            "another sweep, or recorded at another rate?"
        )


def _quiet(heard: Array, starts: NDArray[np.int64], sounds: int, before: int) -> Array:
    """The longest stretch of a recording in which nothing plays, its mean taken off; empty where it is too short."""
    begins = np.append(0, starts + sounds)
    ends = np.append(starts - before, heard.size)
    longest = int(np.argmax(ends - begins))
    stretch = heard[begins[longest] : max(ends[longest], begins[longest])]
    return stretch - stretch.mean() if stretch.size >= 20 * before else np.zeros(0)


def _density(quiet: Array, frames: int, f: Array, rate_hz: float) -> Array:
    """The power of `quiet` a frame, at frequencies f, from stretches of so many frames; NaN where there is none."""
    if not quiet.size:
        return np.full(f.size, np.nan)
    length = min(quiet.size, frames)
    window = np.hanning(length)
    hops = range(0, quiet.size - length + 1, max(length // 2, 1))
    power = np.mean([np.abs(np.fft.rfft(quiet[h : h + length] * window)) ** 2 for h in hops], axis=0)
    return np.array(np.interp(f, np.fft.rfftfreq(length, 1.0 / rate_hz), power / np.sum(window**2)))


def growth_s(one: Array, rate_hz: float) -> float:
    """The time in which a sweep's frequency rises by a factor e, by its zero crossings; NaN if it is not exponential.

    >>> round(growth_s(exponential(20.0, 2000.0, math.log(100.0), 48000.0), 48000.0), 3)
    1.0
    """
    at = np.flatnonzero(np.signbit(one[:-1]) != np.signbit(one[1:]))
    if at.size < 20:
        return math.nan
    crossing_s = (at + one[at] / (one[at] - one[at + 1])) / rate_hz
    hz = 1.0 / np.diff(crossing_s[::2])
    middle_s = 0.5 * (crossing_s[::2][1:] + crossing_s[::2][:-1])
    kept = hz < rate_hz / 8.0
    if kept.sum() < 8:
        return math.nan
    slope, start = np.polyfit(middle_s[kept], np.log(hz[kept]), 1)
    straight = float(np.std(np.log(hz[kept]) - start - slope * middle_s[kept])) < 0.1
    return float(1.0 / slope) if straight and slope > 0.0 else math.nan


def _distortion(
    response: Array, one: Array, magnitude: Array, grid: Array, before: int, rate_hz: float
) -> dict[int, Array]:
    """Each harmonic's magnitude of the fundamental's, at the frequency that was played."""
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
