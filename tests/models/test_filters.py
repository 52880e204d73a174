"""Sections and DC block against scipy's designs, their bounds against simulation, and their stability while moving."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from underfoot.kernels import kernel
from underfoot.models.filtering import second_order
from underfoot.models.filtering.second_order import DC_BLOCK_STATE, DC_BLOCK_TUNING, SECTION_STATE, SECTION_TUNING

RATE = 48000.0
KINDS = ("low", "high", "band")


def tuned(kind, frequency_hz, q_or_width, rate=RATE):
    t = np.zeros(SECTION_TUNING)
    tune = {
        "low": second_order.tune_low_pass,
        "high": second_order.tune_high_pass,
        "band": second_order.tune_band_pass,
    }[kind]
    tune(t, frequency_hz, q_or_width, rate)
    return t


def filtered(t, x, s=None, block=None):
    s = np.zeros(SECTION_STATE) if s is None else s
    y = np.empty(x.size)
    block = block or max(x.size, 1)
    for first in range(0, x.size, block):
        part = slice(first, min(first + block, x.size))
        second_order.run(s, t, x[part], y[part], part.stop - part.start)
    return y


def scipy_design(kind, frequency_hz, q, rate):
    """The analogue second-order filter, prewarped, through scipy's bilinear transform."""
    w = 2 * rate * math.tan(math.pi * frequency_hz / rate)
    b = {"low": [w * w], "high": [1, 0, 0], "band": [w / q, 0]}[kind]
    return signal.bilinear(b, [1, w / q, w * w], rate)


@pytest.mark.parametrize("rate", [8000.0, 48000.0, 192000.0])
@pytest.mark.parametrize("share", [0.0005, 0.02, 0.25, 0.49])
@pytest.mark.parametrize("q", [0.5, second_order.BUTTERWORTH, 20.0])
@pytest.mark.parametrize("kind", ["low", "high"])
def test_sections_are_the_prewarped_bilinear_filters(kind, q, share, rate):
    x = np.random.default_rng(1).normal(size=2000)
    exact = signal.lfilter(*scipy_design(kind, share * rate, q, rate), x)
    y = filtered(tuned(kind, share * rate, q, rate), x)
    assert np.abs(y - exact).max() < 1e-9 * np.abs(exact).max()


@pytest.mark.parametrize("cutoff_hz", [50.0, 700.0, 15000.0])
@pytest.mark.parametrize("kind", ["low", "high"])
def test_the_default_q_is_butterworth(kind, cutoff_hz):
    x = np.random.default_rng(2).normal(size=2000)
    exact = signal.lfilter(*signal.butter(2, cutoff_hz, kind, fs=RATE), x)
    assert np.abs(filtered(tuned(kind, cutoff_hz, second_order.BUTTERWORTH), x) - exact).max() < 1e-9


@pytest.mark.parametrize(("centre_hz", "width_hz"), [(300.0, 15.0), (60.0, 50.0), (12000.0, 4000.0), (20000.0, 100.0)])
def test_a_band_pass_has_its_centre_and_its_width(centre_hz, width_hz):
    x = np.random.default_rng(3).normal(size=20000)
    exact = signal.lfilter(*signal.iirpeak(centre_hz, centre_hz / width_hz, fs=RATE), x)
    assert np.abs(filtered(tuned("band", centre_hz, width_hz), x) - exact).max() < 1e-9


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("block", [1, 7, 64, 1024])
def test_any_split_gives_the_same_bits(kind, block):
    x = np.random.default_rng(4).normal(size=5000)
    t = tuned(kind, 321.0, 40.0 if kind == "band" else 2.0)
    np.testing.assert_array_equal(filtered(t, x, block=block), filtered(t, x))


def test_a_section_may_write_over_its_input():
    x = np.random.default_rng(5).normal(size=500)
    t, y = tuned("low", 300.0, 1.0), x.copy()
    second_order.run(np.zeros(SECTION_STATE), t, y, y, y.size)
    np.testing.assert_array_equal(y, filtered(t, x))


rates = st.sampled_from([8000.0, 44100.0, 48000.0, 192000.0])
states = st.tuples(st.floats(-10, 10), st.floats(-10, 10))


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(KINDS), rates, st.floats(1e-4, 0.49), st.floats(0.05, 100.0), states)
def test_rest_bounds_all_that_is_still_to_come(kind, rate, share, q, state):
    frequency = share * rate
    t = tuned(kind, frequency, frequency / q if kind == "band" else q, rate)
    s = np.array(state)
    bound = second_order.rest(s, t)
    y = filtered(t, np.zeros(3000), s)
    assert np.abs(y).max() <= bound * (1 + 1e-9) + 1e-300
    assert second_order.rest(s, t) <= bound * (1 + 1e-9)


@pytest.mark.parametrize("share", [0.001, 0.02, 0.1])
@pytest.mark.parametrize("kind", KINDS)
def test_the_worst_state_comes_within_half_of_the_bound(kind, share):
    t = tuned(kind, share * RATE, 0.2 * share * RATE if kind == "band" else 5.0)
    angles = np.linspace(0, np.pi, 33)
    largest = [np.abs(filtered(t, np.zeros(2000), np.array([np.cos(a), np.sin(a)]))).max() for a in angles]
    assert max(largest) > 0.5 * second_order.rest(np.array([1.0, 0.0]), t)


@kernel
def wander(s, frequencies, qs, rate, x, y, t):
    for i in range(x.size):
        second_order.tune_low_pass(t, frequencies[i], qs[i], rate)
        second_order.run(s, t, x[i : i + 1], y[i : i + 1], 1)


@pytest.mark.parametrize("rate", [8000.0, 48000.0, 192000.0])
def test_coefficients_thrown_about_at_every_frame_never_add_energy(rate):
    draw = np.random.default_rng(6)
    n = 20000
    frequencies = rate * 10.0 ** draw.uniform(-5, np.log10(0.49), n)
    qs = 10.0 ** draw.uniform(-1, 3, n)
    t, s, y = np.zeros(SECTION_TUNING), np.array([1.0, -2.0]), np.empty(n)
    energy = float(s @ s)
    for first in range(0, n, 500):
        part = slice(first, first + 500)
        wander(s, frequencies[part], qs[part], rate, np.zeros(500), y[part], t)
        assert s @ s <= energy * (1 + 1e-12)
        energy = float(s @ s)
    assert np.abs(y).max() <= math.sqrt(5.0) * (1 + 1e-12)


def test_a_sweep_moves_the_output_without_a_click():
    n = 4800
    x = np.sin(2 * np.pi * 200.0 * np.arange(n) / RATE)
    t, s, y = np.zeros(SECTION_TUNING), np.zeros(SECTION_STATE), np.empty(n)
    wander(s, np.where(np.arange(n) < n // 2, 100.0, 2000.0), np.full(n, 0.7), RATE, x, y, t)
    steps = np.abs(np.diff(y))
    assert steps[n // 2 - 1] < 4.0 * 2 * np.pi * 200.0 / RATE


@pytest.mark.parametrize("frequency_hz", [0.0, -1.0, 1e-300, 1e9, 1e308])
@pytest.mark.parametrize("kind", KINDS)
def test_frequencies_outside_the_range_are_held_inside(kind, frequency_hz):
    for second in (0.0, 1.0, 1e300):
        t = tuned(kind, frequency_hz, second)
        assert np.isfinite(t).all()
        assert np.isfinite(filtered(t, np.random.default_rng(7).normal(size=3000) * 1e6)).all()


@pytest.mark.parametrize("cutoff_hz", [0.5, 20.0, 5000.0])
def test_the_dc_block_is_scipys_first_order_high_pass_and_its_bound_is_exact(cutoff_hz):
    x = np.random.default_rng(8).normal(size=3000) + 5.0
    t, s, y = np.zeros(DC_BLOCK_TUNING), np.zeros(DC_BLOCK_STATE), np.empty(3000)
    second_order.tune_dc_block(t, cutoff_hz, RATE)
    for first in range(0, 3000, 7):
        part = slice(first, min(first + 7, 3000))
        second_order.run_dc_block(s, t, x[part], y[part], part.stop - part.start)
    assert np.abs(y - signal.lfilter(*signal.butter(1, cutoff_hz, "high", fs=RATE), x)).max() < 1e-11
    bound = second_order.rest_dc_block(s, t)
    tail = np.zeros(1000)
    second_order.run_dc_block(s, t, tail, tail, 1000)
    assert np.abs(tail).max() == pytest.approx(bound, rel=1e-12)
