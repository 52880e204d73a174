"""The thesis's stimulus sets, measured as it measured them: by the accelerometer of a tile that a step loads."""

import numpy as np
import pytest
from scipy.signal import butter, correlate, sosfilt
from table_6_1 import TABLE_6_1

from underfoot.engine.commands import Play, equalisers_of
from underfoot.engine.levels import SECONDS, Level, levels_of
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.preview import one_step
from underfoot.models.signals.rhythm import RHYTHMS, STEPS
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch

RATE = 48_000
TACTONS = [f"{family}{k}" for family in ("ws", "it") for k in range(1, 9)]


def load(name):
    return Patch.load(preset_files.patches()[name], REGISTRY)


def measured(name, profile=None):
    """What the accelerometer measures of the first bars."""
    force_n, source = one_step(SECONDS, float(RATE))
    equalisers = equalisers_of({"t1": profile}) if profile else ()
    loop = Loop(load(name), REGISTRY, source, LoopOptions(plates=("accelerometer",), equalisers=equalisers))
    loop.send(Play(True), 0)
    return loop.play_all(len(force_n))["accelerometer"][:, 0].astype(np.float64)


def centre_hz(signal):
    """The mean frequency of the energy."""
    power = np.abs(np.fft.rfft(signal)) ** 2
    return (np.fft.rfftfreq(signal.size, 1.0 / RATE) * power).sum() / power.sum()


def db(ratio):
    return 20.0 * np.log10(ratio)


@pytest.mark.parametrize("name", TABLE_6_1)
def test_the_nine_have_the_levels_of_table_6_1_and_half_of_them_at_half_the_amplitude(name):
    peak, rms = TABLE_6_1[name]
    full, half = (levels_of(load(f"stimulus-{name}{end}")) for end in ("", "-half"))
    for found, amplitude in ((full, 1.0), (half, 0.5)):
        assert db(found.measured.peak_m_s2 / (amplitude * peak)) == pytest.approx(0.0, abs=1.0)
        assert db(found.measured.rms_m_s2 / (amplitude * rms)) == pytest.approx(0.0, abs=1.0)
    assert half.commanded.peak_m_s2 == pytest.approx(0.5 * full.commanded.peak_m_s2, rel=1e-6)
    assert full.headroom_db > 0.05


def test_two_rows_of_table_6_1_are_of_no_normal_noise():
    """Noise of 50 to 700 Hz, made and measured by SciPy: no stretch of it has that much RMS for its peak."""
    shares = []
    for seed in range(20):
        noise = np.random.default_rng(seed).normal(size=2 * RATE)
        for edge, kind in ((50.0, "highpass"), (700.0, "lowpass")):
            noise = sosfilt(butter(2, edge, kind, fs=RATE, output="sos"), noise)
        stretch = noise[RATE:]
        peak = np.median(np.abs(stretch).reshape(100, -1).max(axis=1))
        shares.append(np.sqrt(np.mean(stretch**2)) / peak)
    for name in ("wc", "wd"):
        peak, rms = TABLE_6_1[name]
        assert db(rms / peak / max(shares)) > 2.0


def test_x_is_the_plate_alone():
    assert levels_of(load("stimulus-x")).measured.level_db is None


@pytest.mark.parametrize("name", TACTONS)
def test_a_tacton_plays_its_rhythm_with_its_energy_near_250_hz(name, profile):
    rhythm, node = RHYTHMS[int(name[-1]) - 1], load(f"tacton-{name}").node("rhythm").parameters
    assert [tuple(note) for note in node["notes"]] == [(n.step, n.length, n.amplitude) for n in rhythm.notes]
    assert (node["bar"], node["repeats"]) == (rhythm.bar_s, rhythm.repeats)
    for tile in (None, profile):
        assert 200.0 < centre_hz(measured(f"tacton-{name}", tile)) < 300.0


def test_waveshaped_notes_have_ten_harmonics_of_30_to_70_hz_and_impacts_two_modes():
    notes = [load(f"tacton-ws{k}") for k in range(1, 9)]
    knocks = [load(f"tacton-it{k}").node("knock").parameters for k in range(1, 9)]
    tones = [patch.node("tone").parameters for patch in notes]
    assert all(30.0 <= tone["frequency"] <= 70.0 and len(tone["harmonics"]) == 10 for tone in tones)
    assert all(patch.node("rough").parameters["frequency"] == 25.0 for patch in notes)
    assert all(len(knock["modes"]) == 2 for knock in knocks)
    assert len({tone["frequency"] for tone in tones}) == len({knock["stiffness"] for knock in knocks}) == 8


def test_tactons_are_equally_loud_and_no_two_are_alike():
    found = {name: measured(f"tacton-{name}") for name in TACTONS}
    peaks = [Level.of(signal.astype(np.float32), float(RATE)).peak_m_s2 for signal in found.values()]
    assert max(peaks) < 1.1 * min(peaks)
    onset = RATE // 20 + RATE * 4 // STEPS  # within the first note, whose waveform is to be told apart
    for i, a in enumerate(TACTONS):
        for b in TACTONS[i + 1 :]:
            one, other = (found[name][:onset] / np.linalg.norm(found[name][:onset]) for name in (a, b))
            assert np.abs(correlate(one, other, method="fft")).max() < 0.98, f"{a} and {b}"
