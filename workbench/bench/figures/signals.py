"""Figures 3.5 to 3.7 and 6.2, from the presets: rhythms and waveforms of tactons, vibrations under a step."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.figures.figure import Compared, Figure
from underfoot.drawing import Drawing, Series, series
from underfoot.engine.commands import Play
from underfoot.engine.levels import SECONDS, Level
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.preview import one_step
from underfoot.engine.simulated_step import STEP_S
from underfoot.models.filtering import second_order
from underfoot.models.signals import envelopes, noise
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key
from underfoot.models.signals.rhythm import STEPS
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

RATE = 48_000
_NOTE_S, _BLOW_S = 0.2, 0.06
_CENTRE_HZ, _NEAR_HZ = 250.0, 10.0
_EIGHT = range(1, 9)
_STIMULI = ("SC", "SP", "SD", "WC", "WP", "WD", "TC", "TP", "TD")
_PEAKS = (2.9, 3.7, 6.8, 17.4, 18.4, 18.2, 3.3, 4.6, 6.8)
_RMS = (1.74, 2.4, 4.4, 10.9, 8.5, 10.9, 1.2, 1.75, 2.4)
_TABLE_6_1 = dict(zip(_STIMULI, zip(_PEAKS, _RMS, strict=True), strict=True))
"""Peak and RMS acceleration of the nine stimuli at A = 1, m/s^2."""


def rhythms(quick: bool) -> Figure:
    """Draw figure 3.5: the eight rhythms of both sets of tactons."""
    bars = [_values(f"tacton-ws{k}", "rhythm") for k in _EIGHT]
    same = sum(_values(f"tacton-it{k}", "rhythm") == bar for k, bar in zip(_EIGHT, bars, strict=True))
    lines = [line for k, bar in enumerate(bars) for line in _notes(bar["notes"], 8 - k)]
    lengths = sorted(bar["bar"] for bar in bars)
    repeats = sorted({bar["repeats"] for bar in bars})
    return Figure(
        "3.5",
        "Rhythms of the tactons",
        (
            Drawing(
                "R1 at the top to R8 at the bottom",
                "step of the bar",
                "notes, as high as their amplitudes",
                tuple(lines),
            ),
        ),
        (
            Compared("steps of a bar", "24", str(STEPS)),
            Compared("length of a bar", "450 to 750 ms", f"{1e3 * lengths[0]:.0f} to {1e3 * lengths[-1]:.0f} ms"),
            Compared("repetitions", "3 or 4", " or ".join(map(str, repeats))),
            Compared("rhythms that both sets share", "8", str(same)),
        ),
        "The thesis shows its rhythms only as a picture; these are others, designed in its spirit.",
    )


def waveforms(quick: bool) -> Figure:
    """Draw figure 3.6: the waveforms of the tactons, each the first note of a preset."""
    notes = {f"WS{k}": _first(f"tacton-ws{k}", _NOTE_S) for k in _EIGHT}
    blows = {f"IT{k}": _first(f"tacton-it{k}", _BLOW_S) for k in _EIGHT}
    tones = [_values(f"tacton-ws{k}", "tone") for k in _EIGHT]
    pitches = [tone["frequency"] for tone in tones]
    rough = {_values(f"tacton-ws{k}", "rough")["frequency"] for k in _EIGHT}
    centres = {name: centre for name, (_, centre) in {**notes, **blows}.items()}
    return Figure(
        "3.6",
        "Waveforms of the tactons",
        (_stacked("Waveshaped notes", notes), _stacked("Impacts on two modes", blows)),
        (
            Compared("harmonics of a note", "10", str(max(len(tone["harmonics"]) for tone in tones))),
            Compared("fundamental frequency", "30 to 70 Hz", f"{min(pitches):.0f} to {max(pitches):.0f} Hz"),
            Compared("modulation frequency", "25 Hz", ", ".join(f"{hz:.0f} Hz" for hz in sorted(rough))),
            Compared("centre of the notes' energy, measured", "about 250 Hz", _between(centres, "WS")),
            Compared("centre of the impacts' energy, measured", "near 250 Hz", _between(centres, "IT")),
        ),
        "The thesis prints no amplitudes, depths, stiffnesses or modes, so these sixteen are designed in its spirit; "
        f"true sines stand for (3.1), whose Chebyshev sum has other phases than (3.2). {_missed(centres)}",
    )


def example(quick: bool) -> Figure:
    """Draw figure 3.7: the first impact on the first rhythm."""
    rhythm = _values("tacton-it1", "rhythm")
    _, commanded, measured = _played("tacton-it1", STEP_S + rhythm["bar"] * rhythm["repeats"] + 0.2)
    time_s = np.arange(commanded.size) / RATE
    drawn = [
        Drawing(title, "time, s", "acceleration, m/s²", (series("", time_s, signal),))
        for title, signal in (("IT1, commanded", commanded), ("IT1, measured on a tile that a step loads", measured))
    ]
    knocks = len(rhythm["notes"]) * rhythm["repeats"]
    return Figure(
        "3.7",
        "A tacton: the first impact on the first rhythm",
        tuple(drawn),
        (Compared("knocks", "those of R1, 3 or 4 times", f"{knocks} in {rhythm['bar'] * rhythm['repeats']:.2f} s"),),
        "The thesis shows the stimulus without a scale; which of its rhythms is R1 is only in a picture.",
    )


def feedback(quick: bool) -> Figure:
    """Draw figure 6.2: three waveforms in three envelopes under one step, and their peaks beside table 6.1."""
    drawings, compared, level = [], [], {}
    for name, (peak, rms) in _TABLE_6_1.items():
        force_n, commanded, measured = _played(f"stimulus-{name.lower()}", SECONDS)
        time_s = np.arange(commanded.size) / RATE
        level[name] = Level.of(measured.astype(np.float32), float(RATE))
        found = level[name].peak_m_s2, level[name].rms_m_s2
        compared.append(Compared(f"measured peak and RMS of {name}, m/s²", _pair(peak, rms), _pair(*found)))
        lines = (
            series("vibration", time_s, commanded / np.abs(commanded).max()),
            series("force", time_s, force_n / envelopes.FULL_FORCE_N, colour="force"),
        )
        drawings.append(Drawing(name, "time, s", "force over 750 N; vibration over its peak", lines))
    white, textured = _values("stimulus-wc", "white"), _values("stimulus-tc", "textured")
    gaps = _gaps_s(200 * RATE, textured["interval"])
    shape, peak = level["SC"].rms_m_s2 / level["SC"].peak_m_s2, peak_ms(strain_rate_of_step())
    return Figure(
        "6.2",
        "Nine vibrations under a step: sine, white and textured noise; constant, proportional and dynamic envelope",
        tuple(drawings),
        (
            *compared,
            Compared("sine", "300 Hz", f"{_values('stimulus-sc', 'sine')['frequency']:.0f} Hz"),
            Compared("white noise", "50 to 700 Hz", f"{white['low']:.0f} to {white['high']:.0f} Hz"),
            Compared("mean interval of the texture's bursts", "20 ms", f"{1e3 * gaps.mean():.1f} ms"),
            Compared(
                "deviation over mean of those intervals", "0.71, as P(dt) is printed", f"{gaps.std() / gaps.mean():.2f}"
            ),
            Compared("RMS over peak of SC", "0.600 (table 6.1)", f"{shape:.3f}"),
            Compared("RMS over peak of WC", "0.626 (table 6.1)", f"{level['WC'].rms_m_s2 / level['WC'].peak_m_s2:.3f}"),
            Compared("response time of the dynamic envelope", "80 ms", f"{peak:.1f} ms to its peak"),
        ),
        "The printed P(dt) = lambda dt exp(-lambda dt) has a mean of 40 ms where 20 are meant, so intervals are "
        "exponential; the 80 ms are 1/f0 and the envelope peaks after 1/w0. Peak and RMS, the latter over the loudest "
        "0.12 s, are both within 1 dB. Normal noise has not the ratios of WC and WD, 0.63 and 0.60: it has 0.41. They "
        "have clipped noise, and seeds that were chosen for this.",
    )


def _pair(peak_m_s2: float, rms_m_s2: float) -> str:
    return f"{peak_m_s2:.1f}, {rms_m_s2:.2f}"


def _values(preset: str, node: str) -> dict[str, Any]:
    """Return all parameters of a node of a preset."""
    placed = Patch.load(preset_files.patches()[preset], REGISTRY).node(node)
    return REGISTRY[placed.type].values(placed.parameters)


def _played(preset: str, seconds: float) -> tuple[NDArray[np.float64], ...]:
    """Return force (N), commanded and measured acceleration (m/s^2) of a preset under a step: (frames,) each."""
    force_n, source = one_step(seconds, float(RATE))
    patch = Patch.load(preset_files.patches()[preset], REGISTRY)
    loop = Loop(patch, REGISTRY, source, LoopOptions(plates=("accelerometer",)))
    loop.send(Play(True), 0)
    tiles = loop.play_all(len(force_n))
    return tuple(part.astype(np.float64) for part in (force_n, tiles["commanded"][:, 0], tiles["accelerometer"][:, 0]))


def _first(preset: str, seconds: float) -> tuple[NDArray[np.float64], float]:
    """Return what a tacton commands in its first note, and the spectral centroid of its measured energy in hertz."""
    rhythm = _values(preset, "rhythm")
    length_s = rhythm["notes"][0][1] / STEPS * rhythm["bar"]
    _, commanded, measured = _played(preset, SECONDS)
    onset = int(np.flatnonzero(commanded)[0])
    power = np.abs(np.fft.rfft(measured)) ** 2
    centre_hz = float((np.fft.rfftfreq(measured.size, 1.0 / RATE) * power).sum() / power.sum())
    return commanded[onset : onset + round(min(seconds, length_s) * RATE)], centre_hz


def _between(centres: dict[str, float], family: str) -> str:
    found = [hz for name, hz in centres.items() if name.startswith(family)]
    return f"{min(found):.0f} to {max(found):.0f} Hz"


def _missed(centres: dict[str, float]) -> str:
    """Return a sentence on which tactons miss 250 Hz."""
    missed = [f"{name} at {hz:.0f} Hz" for name, hz in centres.items() if abs(hz - _CENTRE_HZ) > _NEAR_HZ]
    if not missed:
        return f"All lie within {_NEAR_HZ:.0f} Hz of {_CENTRE_HZ:.0f} Hz."
    return (
        f"Of the centres {len(missed)} miss {_CENTRE_HZ:.0f} Hz by more than {_NEAR_HZ:.0f} Hz: {', '.join(missed)}. "
        "They are set between a tile that is calibrated and this one that is not, which adds 9 dB at 70 Hz."
    )


def _notes(notes: Iterable[tuple[float, float, float]], row: int) -> list[Series]:
    """Draw a rhythm on its row: each note with its length, and its amplitude as height."""
    x: list[float] = []
    y: list[float] = []
    for step, length, amplitude in notes:
        x += [step, step, step + length, step + length, math.nan]
        y += [row, row + 0.7 * amplitude, row + 0.7 * amplitude, row, math.nan]
    return [series("", x, y), series("", [0.0, float(STEPS)], [float(row)] * 2, colour="muted")]


def _stacked(title: str, waves: dict[str, tuple[NDArray[np.float64], float]]) -> Drawing:
    lines = (
        series("", 1e3 * np.arange(wave.size) / RATE, wave / np.abs(wave).max() - 2.2 * k)
        for k, (wave, _) in enumerate(waves.values())
    )
    return Drawing(title, "time, ms", "eight waveforms, each over its peak", tuple(lines))


def strain_rate_of_step() -> NDArray[np.float64]:
    """Return the strain rate in the first second of a step of force."""
    coefficients, out = second_order.COEFFICIENTS.zeros(), np.empty(RATE)
    layer = envelopes.STRAIN_HZ, envelopes.STRAIN_DAMPING, envelopes.STRAIN_MASS_KG
    envelopes.design_strain_rate(*layer, float(RATE), coefficients)
    step = np.full(RATE, envelopes.FULL_FORCE_N)
    second_order.run(step, coefficients, second_order.STATE.zeros(), out)
    return out


def peak_ms(response: NDArray[np.float64]) -> float:
    """Return when a response peaks, in ms; frame 0 is half a frame after the step."""
    return 1e3 * (int(response.argmax()) + 0.5) / RATE


def _gaps_s(frames: int, interval_s: float) -> NDArray[np.float64]:
    events = event_list(room=math.ceil(frames / 100))
    noise.impulses(stream_key(1, "figure 6.2"), interval_s, float(RATE), 0, frames, events)
    return np.diff(events.time[: len(events)]) / RATE
