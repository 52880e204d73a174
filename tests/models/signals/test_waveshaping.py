"""Harmonic tones against direct sums of sines, in extended precision where that is the question."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from underfoot.errors import BadValue
from underfoot.kernels import kernel
from underfoot.models.signals import waveshaping
from underfoot.models.signals.waveshaping import PHASE, STATE, next_phase, tone

RATE = 48000.0
TEN = np.array([0.3, -0.8, 0.5, 1.0, -0.2, 0.7, 0.1, -0.6, 0.4, 0.9])
SPLITS = (1, 7, 32, 64, 1024)


def sum_of_sines(turns, amplitudes):
    """The direct sum, in the machine's longest floats; `turns` is the fundamental's phase."""
    turns = np.asarray(turns, dtype=np.longdouble)
    pi = 4 * np.arctan(np.longdouble(1))
    return sum(a * np.sin(2 * pi * np.remainder(k * turns, 1)) for k, a in enumerate(amplitudes, 1))


def exact_turns(f0_hz, frames, rate):
    """Phase of whole frames, with no rounding before the last: division of integers rounds once."""
    turn = Fraction(f0_hz) / Fraction(rate)
    return [np.longdouble(turn.numerator * int(i) % turn.denominator / turn.denominator) for i in frames]


def run_split(f0_hz, amplitudes, n, block, phase=0.0):
    state, y = STATE.zeros(), np.empty(n)
    state.values[:] = np.nan  # what is there to work with means nothing
    state.phase.high, state.phase.low = phase, 0.0
    for first in range(0, n, block):
        count = min(block, n - first)
        f0 = f0_hz[first : first + count] if f0_hz.size > 1 else f0_hz
        waveshaping.run(f0, amplitudes, RATE, state, y[first : first + count])
    return y


@pytest.mark.parametrize("f0_hz", [30.0, 47.3, 70.0])
@pytest.mark.parametrize("amplitudes", [TEN, TEN[:1], TEN[:3], np.tile(TEN, 5)])
def test_a_tone_is_its_sum_of_sines(f0_hz, amplitudes):
    y = tone(f0_hz, amplitudes, 0.5, RATE)
    exact = sum_of_sines(exact_turns(f0_hz, range(y.size), RATE), amplitudes)
    assert np.abs(y - exact).max() < 1e-12


def test_accuracy_holds_beside_multiples_of_pi():
    offsets = np.concatenate([[0.0], 10.0 ** np.arange(-300, 0, 5), 10.0 ** -np.linspace(1, 17, 60)])
    for centre in (0.0, 0.25, 0.5, -0.25, -0.5):
        for offset in offsets:
            phase = RATE * (centre - np.copysign(offset, centre))
            y = run_split(np.array([1.0]), TEN, 1, 1, phase)
            assert abs(y[0] - sum_of_sines(np.longdouble(phase) / RATE, TEN)) < 1e-13


@settings(max_examples=100)
@given(st.floats(-0.5, 0.5))
def test_sine_and_cosine_of_any_turn(turns):
    pi = 4 * np.arctan(np.longdouble(1))
    sine, cosine = waveshaping.sin_cos(turns)
    assert abs(sine - np.sin(2 * pi * np.longdouble(turns))) < 3e-16
    assert abs(cosine - np.cos(2 * pi * np.longdouble(turns))) < 3e-16


@kernel
def advance(high, low, frequency_hz, rate, n):
    for _ in range(n):
        high, low = next_phase(high, low, frequency_hz, rate)
    return high, low


@pytest.mark.parametrize("f0_hz", [43.7, 999.9])
def test_the_phase_is_right_after_an_hour(f0_hz):
    frames = 3600 * 48000
    high, low = advance(0.0, 0.0, f0_hz, RATE, frames)
    error = Fraction(high) + Fraction(low) - Fraction(f0_hz) * frames
    error -= round(error / 48000) * 48000
    assert abs(2 * np.pi * float(error) / RATE) < 1e-9


@pytest.mark.parametrize("block", SPLITS)
def test_any_split_gives_the_same_bits(block):
    n = 5000
    ramp = np.linspace(30.0, 4000.0, n)
    for f0 in (np.array([53.1]), ramp):
        np.testing.assert_array_equal(run_split(f0, TEN, n, block), run_split(f0, TEN, n, n))


def test_a_ramp_of_pitch_glides():
    n = 24000
    f0 = np.linspace(30.0, 70.0, n)
    turns = np.concatenate([[0.0], np.cumsum(f0.astype(np.longdouble))[:-1]]) / RATE
    assert np.abs(run_split(f0, TEN, n, 64) - sum_of_sines(turns, TEN)).max() < 1e-11


@pytest.mark.parametrize(("f0_hz", "left"), [(2400.0, 9), (2399.9, 10), (23999.0, 1), (24000.0, 0), (1e308, 0)])
def test_harmonics_at_half_the_rate_and_above_are_left_out(f0_hz, left):
    y = tone(f0_hz, TEN, 0.01, RATE)
    exact = sum_of_sines(exact_turns(f0_hz, range(y.size), RATE), TEN[:left]) if left else np.zeros(y.size)
    assert np.abs(y - exact).max() < 1e-12


def test_a_pitch_that_crosses_the_limits_keeps_only_what_is_audible():
    f0 = np.linspace(1000.0, 30000.0, 400)
    y = run_split(f0, TEN, f0.size, 64)
    turns = np.cumsum(np.where(f0 < 24000.0, f0, 0.0).astype(np.longdouble)) / RATE
    turns = np.concatenate([[0.0], turns[:-1]])
    kept = [sum(k * f < RATE / 2 for k in range(1, 11)) for f in f0]
    exact = [float(sum_of_sines(p, TEN[:k])) if k else 0.0 for p, k in zip(turns, kept, strict=True)]
    assert np.abs(y - exact).max() < 1e-12


def test_harsh_pitches_stay_finite():
    f0 = np.array([0.0, -50.0, 1e-310, 1e308, -1e308, np.inf, 23999.999, 50.0] * 8)
    assert np.isfinite(run_split(f0, TEN, f0.size, 7)).all()


@pytest.mark.parametrize("block", SPLITS)
def test_roughness_multiplies_by_its_sine(block):
    n = 4000
    x = np.random.default_rng(1).normal(size=n)
    y, phase = np.empty(n), PHASE.zeros()
    depth, frequency = np.array([0.7]), np.array([25.0])
    for first in range(0, n, block):
        part = slice(first, min(first + block, n))
        waveshaping.roughen(x[part], depth, frequency, RATE, phase, y[part])
    exact = x * (1 + 0.7 * np.sin(2 * np.pi * 25.0 * np.arange(n) / RATE))
    assert np.abs(y - exact).max() < 1e-13


def test_no_sample_passes_the_bound():
    y = tone(41.0, TEN, 1.0, RATE)
    assert np.abs(y).max() <= waveshaping.peak_bound(TEN)
    all_at_once = tone(50.0, [0.0, 1.0], 1.0, RATE)
    assert np.abs(all_at_once).max() > 0.999 * waveshaping.peak_bound([0.0, 1.0])


def test_there_is_no_dc():
    assert abs(tone(50.0, TEN, 0.02, RATE).sum()) < 1e-10


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        ((0.0, TEN, 1.0, RATE), "f0_hz"),
        ((np.nan, TEN, 1.0, RATE), "f0_hz"),
        ((50.0, TEN, 1.0, -1.0), "rate"),
        ((50.0, TEN, -1.0, RATE), "seconds"),
        ((50.0, [], 1.0, RATE), "amplitudes"),
        ((50.0, [[1.0]], 1.0, RATE), "amplitudes"),
        ((50.0, [np.inf], 1.0, RATE), "amplitudes"),
    ],
)
def test_bad_values_are_named(arguments, name):
    with pytest.raises(BadValue, match=f"^{name} is "):
        tone(*arguments)
