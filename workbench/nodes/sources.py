"""Where vibration begins: noise, texture, and sound files."""

from pathlib import Path

import numpy as np

from underfoot.errors import BadFile
from underfoot.models.signals import noise
from underfoot.parameters import Choice, FilePath, Number
from underfoot.patch.node import NEVER, Input, Output, frames, moved, node, rest_kernel, run_kernel


@node("noise", "Sources", "Noise")
class Noise:
    """White noise between two frequencies. Amplitude is its RMS; at exactly 0 the node sleeps."""

    low = Number(noise.LOW_HZ, 1.0, 10_000.0, unit="Hz", scale="log", wire="span", doc="lower edge of the band")
    high = Number(noise.HIGH_HZ, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="upper edge of the band")
    amplitude = Number(1.0, 0.0, 100.0, unit="", wire="audio", doc="RMS, in m/s^2")
    out = Output("m/s^2")
    state = noise.BAND_STATE
    tuning = 2 + noise.BAND_TUNING
    muted_by = ("amplitude",)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        amplitude, out = x[0], y[0]
        band = frames(t, 2 + noise.BAND_TUNING)[2:]
        if moved(c, t, 2):
            noise.tune_band(band, c[0], c[1], rate)
        noise.run_band(frames(s, noise.BAND_STATE), band, key, frame, frames(out, n), n)
        for i in range(n):
            out[i] *= amplitude[i]

    @rest_kernel
    def rest(c, s, t, d):
        return NEVER


@node("texture", "Sources", "Texture")
class Texture:
    """Short noise bursts at random moments through a narrow band: the grain of gravel under a moving foot.

    Amplitude is its RMS over time; at exactly 0 the node sleeps.
    """

    interval = Number(
        noise.MEAN_INTERVAL_S, 1e-3, 1.0, unit="s", scale="log", wire="span", doc="mean time from burst to burst"
    )
    burst = Number(noise.BURST_S, 1e-4, 0.1, unit="s", scale="log", doc="length of a burst")
    centre = Number(noise.CENTRE_HZ, 10.0, 5000.0, unit="Hz", scale="log", wire="span", doc="middle of the band")
    width = Number(noise.WIDTH_HZ, 1.0, 5000.0, unit="Hz", scale="log", wire="span", doc="width of the band at -3 dB")
    amplitude = Number(1.0, 0.0, 100.0, unit="", wire="audio", doc="RMS over time, in m/s^2")
    out = Output("m/s^2")
    state = noise.TEXTURE_STATE
    tuning = 4 + noise.TEXTURE_TUNING
    muted_by = ("amplitude",)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        amplitude, out = x[0], y[0]
        grain = frames(t, 4 + noise.TEXTURE_TUNING)[4:]
        if moved(c, t, 4):
            noise.tune_texture(grain, c[0], c[1], c[2], c[3], rate)
        noise.run_texture(frames(s, noise.TEXTURE_STATE), grain, key, frame, frames(out, n), n)
        for i in range(n):
            out[i] *= amplitude[i]

    @rest_kernel
    def rest(c, s, t, d):
        return NEVER


@node("wav-player", "Sources", "WAV player")
class WavPlayer:
    """A sound file as vibration: round and round from the start, or once from its beginning at each event."""

    file = FilePath("", doc="a sound file (WAV, FLAC, ...); its first channel is played at its own pitch")
    mode = Choice("loop", options=("loop", "at events"), doc="when it plays")
    amplitude = Number(5.0, 0.0, 100.0, unit="", wire="audio", doc="m/s^2 at the file's full scale")
    start = Input(kind="event", doc="plays it from the beginning, at the event's strength")
    out = Output("m/s^2")
    state = 2  # next sample + 1 (0: not playing), strength
    muted_by = ("amplitude",)

    def prepare(values, rate):
        return _samples(values["file"], rate)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        amplitude, out, start = x[0], y[0], e[0]
        count = int(d[0])
        loops = c[0] == 0.0
        event = 0
        for i in range(n):
            if event < start[0] and start[3 * event + 1] < frame + i + 1:
                s[0], s[1] = 1.0, start[3 * event + 2]
                event += 1
            if loops and s[0] == 0.0:
                s[0], s[1] = 1.0, 1.0
            at = int(s[0])
            if at == 0 or count == 0:
                out[i] = 0.0
                continue
            out[i] = d[at] * s[1] * amplitude[i]
            s[0] = at + 1.0 if at < count else 0.0

    @rest_kernel
    def rest(c, s, t, d):
        return NEVER if s[0] != 0.0 or (c[0] == 0.0 and d[0] > 0.0) else 0.0


def _samples(path: str, rate: float) -> np.ndarray:
    """How many samples, then the samples: the first channel of the file at `rate`, band-limited if it has another."""
    if not path:
        return np.zeros(1)
    import soundfile

    try:
        sound, own_rate = soundfile.read(path, dtype="float64", always_2d=True)
    except (soundfile.LibsndfileError, OSError, TypeError) as error:
        raise BadFile(f"{Path(path)} cannot be played: {str(error).rstrip('.')}") from None
    sound = sound[:, 0]
    if not np.isfinite(sound).all():
        raise BadFile(f"{Path(path)} cannot be played: it has samples that are not finite")
    if own_rate != rate and sound.size:
        count = max(1, round(sound.size * rate / own_rate))
        sound = np.fft.irfft(np.fft.rfft(sound), count) * (count / sound.size)
    return np.concatenate([[sound.size], sound])
