"""Sources of vibration: noise, texture and sound files."""

import math
from pathlib import Path

import numpy as np

from underfoot.errors import BadFile
from underfoot.kernels import Floats
from underfoot.layouts import Layout
from underfoot.models.signals import noise
from underfoot.models.signals.breakpoints import GLIDE_S
from underfoot.parameters import Choice, FilePath, Number
from underfoot.patch.node import Input, Output, node, prepared

LOOP = 0
"""Index of "loop" in the options of a player's `mode`."""
_LEAST_RATE_HZ, _MOST_RATE_HZ = 100, 1_000_000
"""Sample rates of a file: below them there is nothing to feel, and a damaged header could mean hours of sound, or of
the second of silence that resampling adds.
"""


@node("noise", "Sources", "Noise")
class Noise:
    """White noise in a band. Amplitude is its RMS; at exactly 0 the node sleeps."""

    also_called = "hiss, wind, rand, pink, brown"
    accuracy = "exact in distribution, by Kolmogorov-Smirnov at 0.1 %; filters as SciPy's, to 1e-9"
    low = Number(noise.LOW_HZ, 1.0, 10_000.0, unit="Hz", scale="log", wire="span", doc="lower edge of the band")
    high = Number(noise.HIGH_HZ, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="upper edge of the band")
    amplitude = Number(1.0, 0.0, 100.0, scale="amplitude", wire="audio", doc="RMS, in m/s^2")
    out = Output("m/s^2")
    state, coefficients = noise.BAND_STATE, noise.BAND_COEFFICIENTS
    muted_by = ("amplitude",)
    tail = math.inf

    def design(low, high, rate, coefficients):
        noise.design_band(low, high, rate, coefficients)

    def run(amplitude, key, frame, coefficients, state, out):
        noise.run_band(key, frame, coefficients, state, out)
        for i in range(out.size):
            out[i] *= amplitude[i]


@node("texture", "Sources", "Texture")
class Texture:
    """Short noise bursts at random times through a band-pass: the grain of gravel under a moving foot.

    Amplitude is the RMS over time; at exactly 0 the node sleeps.
    """

    also_called = "granular, dust, sand"
    accuracy = "exact in distribution, by Kolmogorov-Smirnov at 0.1 %; filters as SciPy's, to 1e-9"
    interval = Number(
        noise.MEAN_INTERVAL_S, 1e-3, 1.0, unit="s", scale="log", wire="span", doc="mean time between bursts"
    )
    burst = Number(noise.BURST_S, 1e-4, 0.1, unit="s", scale="log", doc="length of a burst")
    centre = Number(
        noise.CENTRE_HZ, 10.0, 5000.0, unit="Hz", scale="log", wire="span", doc="centre frequency of the band-pass"
    )
    width = Number(noise.WIDTH_HZ, 1.0, 5000.0, unit="Hz", scale="log", wire="span", doc="bandwidth at -3 dB")
    amplitude = Number(1.0, 0.0, 100.0, scale="amplitude", wire="audio", doc="RMS over time, in m/s^2")
    out = Output("m/s^2")
    state, coefficients = noise.TEXTURE_STATE, noise.TEXTURE_COEFFICIENTS
    muted_by = ("amplitude",)
    tail = math.inf

    def distributions(values):
        from underfoot.models.signals.interval_drawings import interval_drawings

        return interval_drawings(values["interval"])

    def design(interval, burst, centre, width, rate, coefficients):
        noise.design_texture(interval, burst, centre, width, rate, coefficients)

    def run(amplitude, key, frame, coefficients, state, out):
        noise.run_texture(key, frame, coefficients, state, out)
        for i in range(out.size):
            out[i] *= amplitude[i]


@node("wav-player", "Sources", "WAV player")
class WavPlayer:
    """Play a sound file as vibration: in a loop, or once from its start at each event.

    What a start cuts off goes to 0 in 5 ms, so that it does not click.
    """

    also_called = "sampler, audio, recording, sfplay, groove, buffer, tabread"
    accuracy = (
        "exact: at the file's own rate to 1e-12; otherwise band-limited resampling, to 0.2 % of a sine inside the "
        "file; a loop takes a whole number of frames"
    )
    file = FilePath(
        "",
        suffixes=(".wav", ".flac", ".ogg", ".mp3", ".aif", ".aiff"),
        doc="sound file (WAV, FLAC, ...); its first channel is played, at its original pitch",
    )
    mode = Choice("loop", options=("loop", "at events"), doc="loop, or once per event")
    amplitude = Number(
        5.0, 0.0, 100.0, scale="amplitude", wire="audio", doc="acceleration in m/s^2 at the file's full scale"
    )
    start = Input(kind="event", doc="plays from the start; strength scales the amplitude")
    out = Output("m/s^2")
    state = Layout("wav_player", "is_playing", "next_sample", "strength", "level", "left", "since")
    muted_by = ("amplitude",)

    def lasts(values):
        return math.inf if values["file"] else 0.0

    @prepared
    def samples(values, rate):
        return _samples(values["file"], rate, is_loop=values["mode"] == "loop")

    def run(samples, mode, amplitude, start, rate, frame, state, out):
        event, glide_frames = 0, GLIDE_S * rate
        for i in range(out.size):
            if event < len(start) and start.time[event] < frame + i + 1:
                state.is_playing, state.next_sample, state.strength = 1.0, 0.0, start.strength[event]
                state.left, state.since = state.level, 0.0
                event += 1
            if mode == LOOP and state.is_playing == 0.0:
                state.is_playing, state.next_sample, state.strength = 1.0, 0.0, 1.0
            state.level = 0.0
            if state.is_playing != 0.0 and samples.size > 0:
                at = int(state.next_sample)
                state.level = samples[at] * state.strength
                state.next_sample = at + 1.0
                state.is_playing = 1.0 if at + 1 < samples.size else 0.0
            if state.left != 0.0:
                state.since += 1.0
                fading = state.left * max(1.0 - state.since / glide_frames, 0.0)
                most = max(abs(state.level), abs(fading))  # not the sum, which grows where starts come fast
                state.level = min(max(state.level + fading, -most), most)
                state.left = state.left if fading != 0.0 else 0.0
            out[i] = state.level * amplitude[i]

    def tail(samples, mode, state):
        is_heard = state.is_playing != 0.0 or state.left != 0.0
        return math.inf if is_heard or (mode == LOOP and samples.size > 0) else 0.0


_MOST_SAMPLES = 1 << 28
"""Samples of all channels of a sound file as it is read, and of one at the session's rate: 2 GiB. A compressed file of
a megabyte can have a thousand times as many, and one that is resampled from 100 Hz 480 times.
"""


def _samples(path: str, rate: float, *, is_loop: bool) -> Floats:
    """Return the first channel of a sound file, resampled to `rate`; empty without a file.

    A loop is stretched to a whole number of frames, by at most half of one, because its end meets its beginning.
    """
    if not path:
        return np.zeros(0)
    import soundfile

    if not Path(path).is_file():  # opening a pipe would block
        raise _unplayable(path, "there is no such file")
    try:
        with soundfile.SoundFile(path) as file:
            own_rate = file.samplerate
            if not _LEAST_RATE_HZ <= own_rate <= _MOST_RATE_HZ:
                allowed = f"{_LEAST_RATE_HZ} to {_MOST_RATE_HZ} Hz"
                raise _unplayable(path, f"its header says {own_rate} Hz; allowed: {allowed}")
            samples = round(file.frames * max(file.channels, rate / own_rate))
            if samples > _MOST_SAMPLES:
                allowed = f"{_MOST_SAMPLES}, 90 minutes at 48 kHz"
                raise _unplayable(path, f"it is {samples} samples in memory; allowed: {allowed}")
            sound = file.read(dtype="float64", always_2d=True)
    except (soundfile.LibsndfileError, OSError, TypeError) as error:
        raise _unplayable(path, str(error).rstrip(".")) from None
    sound = sound[:, 0]
    if not np.isfinite(sound).all():
        raise _unplayable(path, "it has samples that are not finite")
    if own_rate != rate and sound.size:
        frames = sound.size * rate / own_rate
        if not is_loop:  # a second of silence or more, up to where a sample and a frame are at the same time:
            # otherwise what rings ahead of the beginning would sound at the end, because the transform is circular
            step = own_rate // math.gcd(own_rate, round(rate))
            sound = np.pad(sound, (0, own_rate + -(sound.size + own_rate) % step))
        count = max(1, round(sound.size * rate / own_rate))
        from scipy.signal import resample

        sound = resample(sound, count)[: math.ceil(frames)]
    return sound


def _unplayable(path: str, why: str) -> BadFile:
    return BadFile(f"{Path(path)} cannot be played: {why}")
