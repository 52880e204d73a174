"""Tones, and their roughness."""

from underfoot.models.signals import waveshaping
from underfoot.parameters import Number, Numbers
from underfoot.patch.node import NEVER, Input, Output, frames, node, rest_kernel, run_kernel

_WORK = waveshaping.WORK_SHAPE[0] * waveshaping.WORK_SHAPE[1]


@node("tone", "Tones", "Waveshaped tone")
class Tone:
    """Harmonics of one frequency, by waveshaping (3.1, 3.2). Those at or above half the rate are left out.

    Amplitude is what no sample exceeds; at exactly 0 the node sleeps, and it wakes at the beginning of a period.
    """

    frequency = Number(50.0, 1.0, 5000.0, unit="Hz", scale="log", wire="audio", doc="of the first harmonic")
    harmonics = Numbers(
        (0.3, 0.4, 0.6, 0.9, 1.0, 0.8, 0.5, 0.3, 0.2, 0.1), -10.0, 10.0, most=64, doc="amplitude of each, 1st first"
    )
    amplitude = Number(5.0, 0.0, 100.0, wire="audio", doc="peak, in m/s^2")
    out = Output("m/s^2")
    state = waveshaping.STATE_SIZE
    tuning = _WORK
    muted_by = ("amplitude",)

    def prepare(values, rate):
        total = waveshaping.peak_bound(values["harmonics"]) or 1.0
        return [len(values["harmonics"]), *(a / total for a in values["harmonics"])]

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        amplitude, out = x[1], frames(y[0], n)
        harmonics = frames(d, 1 + int(d[0]))[1:]
        work = frames(t, _WORK).reshape(waveshaping.WORK_SHAPE)
        waveshaping.run(frames(s, waveshaping.STATE_SIZE), frames(x[0], n), harmonics, rate, work, out, n)
        for i in range(n):
            out[i] *= amplitude[i]

    @rest_kernel
    def rest(c, s, t, d):
        return NEVER


@node("roughness", "Tones")
class Roughness:
    """A signal times 1 + depth sin(2 pi f t): beats that feel rough (thesis: 25 Hz)."""

    signal = Input()
    depth = Number(0.5, 0.0, 1.0, wire="audio", doc="0 is smooth; at 1 it falls silent once a beat")
    frequency = Number(25.0, 0.1, 200.0, unit="Hz", scale="log", wire="audio", doc="of the beats")
    out = Output()
    state = waveshaping.STATE_SIZE
    muted_by = ("signal",)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        signal, depth, frequency = frames(x[0], n), frames(x[1], n), frames(x[2], n)
        waveshaping.roughen(frames(s, waveshaping.STATE_SIZE), signal, depth, frequency, rate, frames(y[0], n), n)
