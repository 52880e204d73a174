"""Checks that a recording is that of the sound played: silence, clipping, and other signals are refused."""

import math
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import BadMeasurement, require
from underfoot.kernels import Floats

_LEAST_SIGNAL = 1e-5
"""Largest sample, in full scale, of a silent recording."""
_EXPLAINED, _STRANGE = 0.3, 0.5
"""Smallest share of the power that the sweep must explain, and largest unexplained share in an octave."""
_UNLIKE, _MOST_UNLIKE_PERCENT = 0.3, 5.0
"""Deviation of passes, as a share of their mean, that no response varies by, and the share of the band, %, that may."""
_DISPERSED_FROM_HZ, _MOST_DISPERSED_MS = 100.0, 30.0
_HEARD = 2.0
"""Least power of a band whose arrival counts, as a multiple of that of its noise."""
_LATER_MS = 0.4
"""Step of the delays of bands from pass to pass that tells of lost samples. Clocks that drift apart make no step."""
_IN_PHASE, _SURE = 0.7, 3.0
"""Least share of a band's cells that arrive together, else it is noise; and standard deviations within which they do.
"""


def signal_of(name: str, given: ArrayLike) -> Floats:
    """Return one channel of finite samples (frames,); `BadValue` for anything else."""
    signal = np.asarray(given, dtype=np.float64)
    require(signal.ndim == 1 and signal.size > 0, name, signal.shape, "one channel, shape (frames,)")
    require(bool(np.isfinite(signal).all()), name, "a signal with values that are not finite", "finite samples")
    return signal


def require_not_silent(recording: Floats) -> None:
    """Raise `BadMeasurement` for a silent recording."""
    largest = float(np.abs(recording - recording.mean()).max(initial=0.0))
    if largest < _LEAST_SIGNAL:
        raise BadMeasurement(
            f"no signal: the largest sample is {largest:.2g} of full scale; is the accelerometer connected?"
        )


def require_noise(silence: Floats) -> None:
    """Raise `BadMeasurement` for recorded silence without any noise, of which a converter always has some."""
    if float(np.ptp(silence)) == 0.0:
        raise BadMeasurement(
            f"no noise: every sample of the silence is {silence[0]:.2g} of full scale, as of an input that is muted; "
            "is the accelerometer plugged into this input?"
        )


def require_not_clipped(recording: Floats) -> None:
    """Raise `BadMeasurement` for a clipped recording: runs of equal samples at its own extremes."""
    for extreme in (float(recording.max()), float(recording.min())):
        at = np.flatnonzero(recording == extreme)
        steps = np.abs(np.diff(recording))
        finest = float(steps[steps > 0.0].min(initial=math.inf))
        # Coarsely quantised samples stay on one value at every peak of a slow sine: that is not clipping.
        if at.size < 8 or abs(extreme) < 300.0 * finest:
            continue
        runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
        if sum(run.size >= 3 for run in runs) >= 3:
            raise BadMeasurement(
                f"the recording is clipped: {at.size} samples lie at {extreme:.3g} of full scale; turn the input down"
            )


def require_explained(f: Floats, recording: Floats, left: Floats, noise: Floats) -> None:
    """Raise `BadMeasurement` for a recording that its sweep does not explain.

    `recording`, `left` and `noise` (n,) are the power recorded, left unexplained, and of noise, at frequencies `f`
    (n,). Judged octave by octave, since one resonance can have nearly all the power; where all in all it explains
    enough, the octave with most of what is left is named. Unknown noise (NaN) counts as 0.
    """
    share = 1.0 - float(left.sum() / max(recording.sum(), 1e-300))
    edges = np.flatnonzero(np.diff(np.floor(np.log2(f / f[0])), prepend=-1.0))
    whole, strange = (np.add.reduceat(p, edges) for p in (recording, left - 1.5 * np.nan_to_num(noise)))
    bad = (whole >= 1e-4 * whole.max()) & (strange > _STRANGE * whole)
    if share < _EXPLAINED or bad.any():
        where = ""
        if share >= _EXPLAINED:
            most = int(np.argmax(np.where(bad, strange, 0.0)))
            share = 1.0 - float(strange[most] / whole[most])
            where = f"from {f[edges[most]]:.0f} to {f[np.append(edges[1:], f.size)[most] - 1]:.0f} Hz "
        percent = 100.0 * max(share, 0.0)
        if float(np.nan_to_num(noise).sum()) > 0.5 * float(left.sum()):
            why = "the rest is hum or noise, heard without the sweep, too; is the amplifier on, and this the channel?"
        else:
            why = "another channel or sweep, an amplifier that clips, lost samples, or a signal close to the noise?"
        raise BadMeasurement(
            f"sweep and recording do not fit: {where}the sweep explains {percent:.0f} % of what was heard; {why}"
        )


def require_alike(scatter: Floats, magnitude: Floats, noise: Floats) -> None:
    """Raise `BadMeasurement` if the passes of a sweep differ by as much as their mean over a part of its band.

    `scatter` is their RMS deviation from the mean, `magnitude` that of the mean, and `noise` that of a pass, all (n,);
    unknown noise (NaN) counts as 0. They differ so from the moment on at which samples were lost, even if each pass is
    as loud as the others.
    """
    percent = 100.0 * float(np.mean(scatter > _UNLIKE * magnitude + 2.0 * np.nan_to_num(noise)))
    if percent > _MOST_UNLIKE_PERCENT:
        raise BadMeasurement(
            f"the sweeps differ from one another in {percent:.0f} % of their band: samples were lost on the way, or "
            "something moved; take it again"
        )


def require_same_sweep(response: Floats, rate_hz: float, grid_hz: Floats, noise: Floats) -> None:
    """Raise `BadMeasurement` if some octaves of an impulse response (frames,) arrive much later than others.

    The recording is then of a sweep of another speed, or at another rate. `grid_hz` (n,) spans the sweep's band, and
    `noise` (n,) is the magnitude of noise alone; unknown noise (NaN) counts as 0. A band that holds only noise, as
    above the own band of a tile, arrives at any time, and is left out.
    """
    low, high = float(grid_hz[0]), float(grid_hz[-1])
    if high < 4.0 * _DISPERSED_FROM_HZ:
        return
    size = 2 * response.size  # a low band's envelope begins before the response; its peak may be there
    spectrum, f = np.fft.fft(response, size), np.fft.fftfreq(size, 1.0 / rate_hz)
    times_ms = np.fft.fftfreq(size, rate_hz / size / 1000.0)
    arrivals = []
    for begin, end in pairwise(np.geomspace(max(low, _DISPERSED_FROM_HZ), high, 5)):
        inside = (f >= begin) & (f < end)
        heard = float(np.sum(np.abs(spectrum[inside]) ** 2))
        if heard > _HEARD * float(np.sum(np.interp(f[inside], grid_hz, np.nan_to_num(noise)) ** 2)):
            envelope = np.abs(np.fft.ifft(np.where(inside, spectrum, 0.0)))
            arrivals.append(float(times_ms[np.argmax(envelope)]))
    apart_ms = max(arrivals, default=0.0) - min(arrivals, default=0.0)
    if apart_ms > _MOST_DISPERSED_MS:
        raise BadMeasurement(
            f"sweep and recording do not fit: some octaves arrive {apart_ms:.0f} ms later than others; "
            "another sweep, or recorded at another rate?"
        )


def require_whole(responses: Floats, low: float, high: float, rate_hz: float) -> None:
    """Raise `BadMeasurement` if samples were lost or repeated within a sweep: later bands then come early or late.

    `responses` (passes, frames) are compared with the first one: of a single one nothing tells a loss from a tile that
    delays some bands. `low` to `high` is the sweep's band, Hz, which has to be wide.
    """
    if low > 0.6 * _DISPERSED_FROM_HZ or high < 6.0 * _DISPERSED_FROM_HZ:
        return
    size = 1 << responses.shape[1].bit_length() + 1
    spectra: NDArray[np.complex128] = np.fft.rfft(responses, size)
    f: Floats = np.fft.rfftfreq(size, 1.0 / rate_hz).astype(np.float64)
    edges = np.geomspace(0.5 * _DISPERSED_FROM_HZ, high, 6)
    cells, widths = np.histogram(f, edges)[0], np.diff(edges)
    others = spectra[1:] * spectra[0].conj()
    for other in others / np.maximum(np.abs(others), 1e-300):
        envelopes = [np.abs(np.fft.ifft(np.where((f >= a) & (f < b), other, 0.0), size)) for a, b in pairwise(edges)]
        late = np.fft.fftfreq(size, rate_hz / size / 1000.0)[np.argmax(envelopes, axis=1)]
        share = np.clip(np.max(envelopes, axis=1) * size / cells, 1e-9, 1.0)
        # The phase of normal deviation s has this share exp(-s^2 / 2); a line fitted to it has that deviation.
        turn = np.sqrt(-2.0 * np.log(share) * rate_hz / (responses.shape[1] * widths))
        unsure_ms = _SURE * 1000.0 * turn * math.sqrt(12.0) / (2.0 * math.pi * widths)
        kept = share > _IN_PHASE
        step_ms = _step_ms(late[kept], unsure_ms[kept])
        if step_ms > _LATER_MS:
            raise BadMeasurement(
                f"within a sweep some octaves come {step_ms:.2g} ms later than others: samples were lost on the way, "
                "or something moved; take it again"
            )


def _step_ms(late_ms: Floats, unsure_ms: Floats) -> float:
    """Return the largest step for certain in the delays of rising bands (n,); 0 or less if there is none."""
    least, most = late_ms - unsure_ms, late_ms + unsure_ms
    places = range(1, late_ms.size)
    return max((max(least[:k].min() - most[k:].max(), least[k:].min() - most[:k].max()) for k in places), default=0.0)
