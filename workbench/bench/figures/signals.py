"""Figures 3.6 and 6.2: the waveforms of tactons, and vibrations under a step."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.figures.figure import Compared, Figure
from underfoot.drawing import Drawing, series
from underfoot.models import gait
from underfoot.models.modal.impact import Hammer, ModalObject, strike
from underfoot.models.signals import envelopes, noise, waveshaping
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key

RATE = 48_000
_NOTE_S, _BLOW_S = 0.2, 0.06
_CENTRE_HZ = 250.0
_HARMONICS, _ROUGH_HZ = 10, 25.0


def waveforms(quick: bool) -> Figure:
    """Figure 3.6: the notes that the tactons of the experiment are made of."""
    notes, centres = zip(*(_note(k) for k in range(8)), strict=True)
    blows, heights = zip(*(_blow(k) for k in range(8)), strict=True)
    drawings = (_stacked("Waveshaped notes", notes), _stacked("Impacts on two modes", blows))
    return Figure(
        "3.6",
        "Waveforms of the tactons",
        drawings,
        (
            Compared("harmonics of a note", "10", str(_HARMONICS)),
            Compared("fundamental frequency", "30 to 70 Hz", "30 to 70 Hz"),
            Compared("modulation frequency", "25 Hz", f"{_ROUGH_HZ:.0f} Hz"),
            Compared("centre of the notes' energy", "about 250 Hz", f"{min(centres):.0f} to {max(centres):.0f} Hz"),
            Compared("centre of the impacts' energy", "near 250 Hz", f"{min(heights):.0f} to {max(heights):.0f} Hz"),
        ),
        "The thesis prints no amplitudes, depths, stiffnesses or modes, so these sixteen are designed in its spirit; "
        "true sines stand for (3.1), whose Chebyshev sum has other phases than (3.2).",
    )


def feedback(quick: bool) -> Figure:
    """Figure 6.2: three waveforms in three envelopes under one step."""
    walker = gait.Walker(variation=0.0)
    step = gait.Footfall("left", 0.05, walker.contact_s, 0.0, 0.0, 0.0, 0.26, 770.0, 504.0, 756.0)
    time_s = np.arange(round((walker.contact_s + 0.15) * RATE)) / RATE
    force = np.ascontiguousarray(step.force_n(time_s))
    drawings, peaks = [], []
    for waveform, vibration in _waveforms(time_s.size).items():
        for envelope, level in _envelopes(force).items():
            heard = vibration * level
            peaks.append(float(np.sqrt(np.mean(heard[heard != 0.0] ** 2)) / np.abs(heard).max()))
            drawings.append(
                Drawing(
                    f"{waveform}{envelope}",
                    "time, s",
                    "force over 750 N; vibration over its peak",
                    (
                        series("vibration", time_s, heard / np.abs(heard).max()),
                        series("force", time_s, force / envelopes.FULL_FORCE_N, colour="force"),
                    ),
                )
            )
    gaps = _gaps_s(200 * RATE)
    return Figure(
        "6.2",
        "Nine vibrations under a step: sine, white and textured noise; constant, proportional and dynamic envelope",
        tuple(drawings),
        (
            Compared("sine", "300 Hz", "300 Hz"),
            Compared("white noise", "50 to 700 Hz", f"{noise.LOW_HZ:.0f} to {noise.HIGH_HZ:.0f} Hz"),
            Compared("mean interval of the texture's bursts", "20 ms", f"{1e3 * gaps.mean():.1f} ms"),
            Compared(
                "deviation over mean of those intervals", "0.71, as P(dt) is printed", f"{gaps.std() / gaps.mean():.2f}"
            ),
            Compared("RMS over peak of SC", "0.600 (table 6.1)", f"{peaks[0]:.3f}"),
            Compared("response time of the dynamic envelope", "80 ms", f"{_peak_s() * 1e3:.1f} ms to its peak"),
        ),
        "The printed P(dt) = lambda dt exp(-lambda dt) has a mean of 40 ms where 20 are meant, so intervals are "
        "exponential; the 80 ms are 1/f0 and the envelope peaks after 1/w0; an ideal sine has 0.707.",
    )


def _note(k: int) -> tuple[NDArray[np.float64], float]:
    """Note `k` of eight, and the centre of its energy in hertz."""
    f0 = 30.0 + 40.0 * k / 7.0
    hz = f0 * np.arange(1, _HARMONICS + 1)
    amplitudes = np.exp(-0.5 * ((hz - _CENTRE_HZ) / (50.0 + 12.0 * k)) ** 2)
    tone = waveshaping.tone(f0, amplitudes, _NOTE_S, RATE)
    time_s = np.arange(tone.size) / RATE
    level = envelopes.attack_decay(time_s, 0.0, _NOTE_S, 1.0, 0.01 + 0.01 * (k % 4), 0.02 + 0.02 * (k % 3))
    heard = tone * level * (1.0 + 0.1 * k * np.sin(2.0 * np.pi * _ROUGH_HZ * time_s))
    return heard, _centre_hz(heard)


def _blow(k: int) -> tuple[NDArray[np.float64], float]:
    low, high = 150.0 + 14.0 * k, 270.0 + 18.0 * (7 - k)
    decays = 40.0 + 12.0 * k, 60.0 + 10.0 * k
    stiffness, exponent = 10.0 ** (5.0 + 0.5 * k), 1.5 + 0.1 * (k % 4)
    target = ModalObject([low, high], decays, [0.2, 0.3], [1.0, 1.0])
    hit = strike(Hammer(0.02, 1.0, stiffness, exponent, 0.3), target, _BLOW_S, RATE, 1e-4)
    return hit.displacement_m, _centre_hz(hit.displacement_m)


def _centre_hz(heard: NDArray[np.float64]) -> float:
    power = np.abs(np.fft.rfft(heard, 2 * RATE)) ** 2
    return float((np.fft.rfftfreq(2 * RATE, 1.0 / RATE) * power).sum() / power.sum())


def _stacked(title: str, waves: tuple[NDArray[np.float64], ...]) -> Drawing:
    lines = (
        series("", 1e3 * np.arange(wave.size) / RATE, wave / np.abs(wave).max() - 2.2 * k)
        for k, wave in enumerate(waves)
    )
    return Drawing(title, "time, ms", "eight waveforms, each over its peak", tuple(lines))


def _waveforms(frames: int) -> dict[str, NDArray[np.float64]]:
    sine = np.sin(2.0 * np.pi * 300.0 * np.arange(frames) / RATE)
    white, textured = np.empty(frames), np.empty(frames)
    key = stream_key(1, "figure 6.2")
    band, texture = noise.BAND_COEFFICIENTS.zeros(), noise.TEXTURE_COEFFICIENTS.zeros()
    noise.design_band(noise.LOW_HZ, noise.HIGH_HZ, float(RATE), band)
    noise.run_band(key, 0, band, noise.BAND_STATE.zeros(), white)
    noise.design_texture(noise.MEAN_INTERVAL_S, noise.BURST_S, noise.CENTRE_HZ, noise.WIDTH_HZ, float(RATE), texture)
    noise.run_texture(key, 0, texture, noise.TEXTURE_STATE.zeros(), textured)
    return {"S": sine, "W": white, "T": textured}


def _envelopes(force: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
    constant, proportional, dynamic = np.empty((3, force.size))
    coefficients = envelopes.CONTACT_COEFFICIENTS.zeros()
    envelopes.design_contact(float(RATE), coefficients)
    envelopes.run_contact(force, coefficients, envelopes.CONTACT_STATE.zeros(), constant)
    envelopes.proportional(force, envelopes.FULL_FORCE_N, proportional)
    _strain_rate(force, envelopes.ABSOLUTE, dynamic)
    return {"C": constant, "P": proportional, "D": dynamic}


def _strain_rate(force: NDArray[np.float64], choice: int, out: NDArray[np.float64]) -> None:
    coefficients = envelopes.STRAIN_COEFFICIENTS.zeros()
    layer = envelopes.STRAIN_HZ, envelopes.STRAIN_DAMPING, envelopes.STRAIN_MASS_KG
    envelopes.design_strain_rate(*layer, float(RATE), coefficients)
    envelopes.run_strain_rate(force, choice, coefficients, envelopes.STRAIN_STATE.zeros(), out)


def _peak_s() -> float:
    """When the dynamic envelope of a step of force peaks."""
    out = np.empty(RATE // 10)
    _strain_rate(np.full(out.size, envelopes.FULL_FORCE_N), envelopes.SIGNED, out)
    return (int(out.argmax()) + 0.5) / RATE


def _gaps_s(frames: int) -> NDArray[np.float64]:
    events = event_list(room=math.ceil(frames / 100))
    noise.impulses(stream_key(1, "figure 6.2"), noise.MEAN_INTERVAL_S, float(RATE), 0, frames, events)
    return np.diff(events.time[: len(events)]) / RATE
