"""Requirements on tones, noise, texture, envelopes and rhythms."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from underfoot.bench import naive
from underfoot.bench.accuracy import relative_error
from underfoot.bench.figures.signals import peak_ms, strain_rate_of_step
from underfoot.bench.requirements.requirement import Requirement
from underfoot.bench.timing import timed
from underfoot.models.signals import envelopes, noise, rhythm, waveshaping
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key

RATE = 48_000
_HARMONICS = 10
_HOUR_S = 3600


def requirements(quick: bool) -> Iterable[Requirement]:
    """Yield the rows of tones, noise and texture, envelopes, and rhythms."""
    yield from _tones()
    yield from of_noises(20 if quick else 200)
    yield from of_envelopes()
    yield from of_rhythms()


def _tones() -> Iterator[Requirement]:
    amplitudes = 1.0 / np.arange(1.0, _HARMONICS + 1.0)
    turns = 50 * np.arange(RATE)[:, None] * np.arange(1, _HARMONICS + 1) % RATE / RATE
    truth = np.sin(2.0 * np.pi * turns) @ amplitudes
    tone = waveshaping.tone(50.0, amplitudes, 1.0, RATE)
    yield Requirement("tones", "error of 10 harmonics, 1 s", relative_error(tone, truth), high=1e-12)
    ours = timed(lambda: waveshaping.tone(50.0, amplitudes, 1.0, RATE)).at_best
    direct = timed(lambda: naive.sum_of_sines(50.0, amplitudes, RATE, RATE)).at_best
    yield Requirement("tones", "a direct sum of 10 sines takes longer by", direct / ours, "times", low=_HARMONICS)
    yield Requirement("tones", "phase error after an hour", _phase_error(), "rad", high=1e-9)


def _phase_error() -> float:
    """Return the error of a 31.7 Hz tone in the last tenth of a second of an hour, against an exactly reduced phase."""
    state, pitch, one = waveshaping.STATE.zeros(), np.array([31.7]), np.ones(1)
    heard = np.empty(RATE // 10)
    for _ in range(_HOUR_S * 10):
        waveshaping.run(pitch, one, float(RATE), state, heard)
    frames = np.arange(_HOUR_S * RATE - heard.size, _HOUR_S * RATE)
    angle = 2.0 * np.pi * (317 * frames % (10 * RATE) / (10 * RATE))
    sine, cosine = np.linalg.lstsq(np.column_stack([np.sin(angle), np.cos(angle)]), heard)[0]
    return abs(math.atan2(cosine, sine))


def of_noises(seconds: int) -> Iterator[Requirement]:
    """Yield the band edges of `seconds` of noise, its independence of blocks, and texture's intervals and band."""
    from scipy import signal, stats

    heard = _noise(seconds * RATE, seconds * RATE)
    hz, power = signal.welch(heard, RATE, nperseg=RATE // 2)
    for edge in (noise.LOW_HZ, noise.HIGH_HZ):
        ratio = 10.0 * math.log10(power[np.argmin(abs(hz - edge))] / np.median(power[(hz > 150.0) & (hz < 350.0)]))
        yield Requirement("noise", f"level at the band's edge of {edge:.0f} Hz", ratio, "dB", -4.0, -2.0)
    differing = sum(int(np.count_nonzero(_noise(RATE, n) != heard[:RATE])) for n in (7, 64, 1024))
    yield Requirement("noise", "frames that another block size changes", differing, high=0)
    found = event_list(room=100 * seconds + 100)
    noise.impulses(stream_key(1, "bench"), noise.MEAN_INTERVAL_S, float(RATE), 0, seconds * RATE, found)
    gaps = np.diff(found.time[: len(found)]) / RATE
    off = 4.0 * noise.MEAN_INTERVAL_S / math.sqrt(gaps.size)
    yield Requirement(
        "texture", "mean interval of impulses", 1e3 * float(gaps.mean()), "ms", 1e3 * (0.02 - off), 1e3 * (0.02 + off)
    )
    shape = float(stats.kstest(gaps, stats.expon(scale=noise.MEAN_INTERVAL_S).cdf).pvalue)
    yield Requirement("texture", "chance of such intervals, if exponential", shape, low=1e-3)
    at, response = _texture_response()
    centre = at[np.argmax(response)]
    wide = np.ptp(at[response > 0.5 * response.max()])
    yield Requirement("texture", "centre of its band-pass", float(centre), "Hz", 299.0, 301.0)
    yield Requirement("texture", "width of its band-pass at -3 dB", float(wide), "Hz", 14.5, 15.5)


def _noise(frames: int, block: int) -> NDArray[np.float64]:
    coefficients, state, out = noise.BAND_COEFFICIENTS.zeros(), noise.BAND_STATE.zeros(), np.empty(frames)
    noise.design_band(noise.LOW_HZ, noise.HIGH_HZ, float(RATE), coefficients)
    for at in range(0, frames, block):
        noise.run_band(stream_key(1, "bench"), at, coefficients, state, out[at : at + block])
    return out


def _texture_response() -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """Return frequencies and power response of the texture's filter, from its impulse response."""
    from underfoot.models.filtering import second_order

    coefficients, answer = noise.TEXTURE_COEFFICIENTS.zeros(), np.eye(1, 4 * RATE)[0].copy()
    noise.design_texture(
        noise.MEAN_INTERVAL_S, noise.BURST_S, noise.CENTRE_HZ, noise.WIDTH_HZ, float(RATE), coefficients
    )
    second_order.run(answer, coefficients.band_pass, second_order.STATE.zeros(), answer)
    return np.fft.rfftfreq(answer.size, 1.0 / RATE), np.abs(np.fft.rfft(answer)) ** 2


def of_envelopes() -> Iterator[Requirement]:
    """Yield when the strain rate's response to a step peaks, in ms, and its error against t exp(-w0 t)."""
    w0 = 2.0 * math.pi * envelopes.STRAIN_HZ
    out = strain_rate_of_step()
    time_s = (np.arange(RATE) + 0.5) / RATE  # the bilinear step is between two frames
    truth = math.e * w0 * time_s * np.exp(-w0 * time_s)
    yield Requirement("envelopes", "a step's response peaks after", peak_ms(out), "ms", 12.71, 12.75)
    yield Requirement("envelopes", "error against t exp(-w0 t)", relative_error(out, truth), high=1e-5)


def of_rhythms() -> Iterator[Requirement]:
    """Test the onsets of an hour of notes, in one-second stretches."""
    one = rhythm.RHYTHMS[4]
    table, bar, found = one.table(), one.bar_s * RATE, []
    for second in range(_HOUR_S):
        events = event_list(room=100)
        rhythm.play(table, bar, 0, 0.25, second * RATE, (second + 1) * RATE, float(RATE), events)
        found.append(events.time[: len(events)])
    onsets = np.concatenate(found)
    notes = len(one.notes)
    steps = np.array([note.step for note in one.notes])
    index = np.arange(onsets.size)
    exact = 0.25 + (24 * (index // notes) + steps[index % notes]) * (bar / 24.0)
    yield Requirement(
        "rhythms", "largest error of an onset in an hour", float(np.abs(onsets - exact).max()), "frames", high=1e-6
    )
    yield Requirement("rhythms", "notes lost or doubled in an hour", abs(onsets.size - _expected(one)), high=0)


def _expected(one: rhythm.Rhythm) -> int:
    """Count the notes that begin within an hour, one by one."""
    return sum(
        0.25 + (bar + note.step / 24.0) * one.bar_s * RATE < _HOUR_S * RATE
        for bar in range(int(_HOUR_S / one.bar_s) + 2)
        for note in one.notes
    )
