"""Second-order sections against scipy's designs, their bounds against simulation, and their stability while moving."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from underfoot.kernels import kernel
from underfoot.models.filtering import second_order
from underfoot.models.filtering.second_order import COEFFICIENTS, MOVING_STATE, STATE
from underfoot.models.signals import envelopes

RATE = 48000.0
KINDS = ("low", "high", "band")


def designed(kind, frequency_hz, q_or_width, rate=RATE):
    coefficients = COEFFICIENTS.zeros()
    design = {
        "low": second_order.design_low_pass,
        "high": second_order.design_high_pass,
        "band": second_order.design_band_pass,
    }[kind]
    design(frequency_hz, q_or_width, rate, coefficients)
    return coefficients


def at(x1, x2):
    state = STATE.zeros()
    state.x1, state.x2 = x1, x2
    return state


def filtered(coefficients, x, state=None, block=None):
    state = STATE.zeros() if state is None else state
    y = np.empty(x.size)
    block = block or max(x.size, 1)
    for first in range(0, x.size, block):
        part = slice(first, min(first + block, x.size))
        second_order.run(x[part], coefficients, state, y[part])
    return y


def scipy_design(kind, frequency_hz, q, rate):
    """The analogue second-order filter, prewarped, through scipy's bilinear transform."""
    w = 2 * rate * math.tan(math.pi * frequency_hz / rate)
    b = {"low": [w * w], "high": [1, 0, 0], "band": [w / q, 0]}[kind]
    return signal.bilinear(b, [1, w / q, w * w], rate)


@pytest.mark.parametrize("q", [0.5, second_order.BUTTERWORTH, 20.0])
@pytest.mark.parametrize("kind", ["low", "high"])
def test_sections_are_the_prewarped_bilinear_filters(kind, q):
    x = np.random.default_rng(1).normal(size=2000)
    for share, rate in product([0.0005, 0.02, 0.25, 0.49], [8000.0, 48000.0, 192000.0]):
        exact = signal.lfilter(*scipy_design(kind, share * rate, q, rate), x)
        y = filtered(designed(kind, share * rate, q, rate), x)
        assert np.abs(y - exact).max() < 1e-9 * np.abs(exact).max(), (share, rate)


@pytest.mark.parametrize("cutoff_hz", [50.0, 700.0, 15000.0])
@pytest.mark.parametrize("kind", ["low", "high"])
def test_the_default_q_is_butterworth(kind, cutoff_hz):
    x = np.random.default_rng(2).normal(size=2000)
    exact = signal.lfilter(*signal.butter(2, cutoff_hz, kind, fs=RATE), x)
    assert np.abs(filtered(designed(kind, cutoff_hz, second_order.BUTTERWORTH), x) - exact).max() < 1e-9


@pytest.mark.parametrize(("centre_hz", "width_hz"), [(300.0, 15.0), (60.0, 50.0), (12000.0, 4000.0), (20000.0, 100.0)])
def test_a_band_pass_has_its_centre_and_its_width(centre_hz, width_hz):
    x = np.random.default_rng(3).normal(size=20000)
    exact = signal.lfilter(*signal.iirpeak(centre_hz, centre_hz / width_hz, fs=RATE), x)
    assert np.abs(filtered(designed("band", centre_hz, width_hz), x) - exact).max() < 1e-9


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("block", [1, 7, 64, 1024])
def test_any_split_gives_the_same_bits(kind, block):
    x = np.random.default_rng(4).normal(size=5000)
    section = designed(kind, 321.0, 40.0 if kind == "band" else 2.0)
    np.testing.assert_array_equal(filtered(section, x, block=block), filtered(section, x))


def test_a_section_may_write_over_its_input():
    x = np.random.default_rng(5).normal(size=500)
    section, y = designed("low", 300.0, 1.0), x.copy()
    second_order.run(y, section, STATE.zeros(), y)
    np.testing.assert_array_equal(y, filtered(section, x))


rates = st.sampled_from([8000.0, 44100.0, 48000.0, 192000.0])
states = st.tuples(st.floats(-10, 10), st.floats(-10, 10))


@settings(max_examples=150)
@given(st.sampled_from(KINDS), rates, st.floats(1e-4, 0.49), st.floats(0.05, 100.0), states)
def test_the_tail_bounds_all_that_is_still_to_come(kind, rate, share, q, start):
    frequency = share * rate
    section = designed(kind, frequency, frequency / q if kind == "band" else q, rate)
    state = at(*start)
    bound = second_order.tail(state, section)
    y = filtered(section, np.zeros(3000), state)
    assert np.abs(y).max() <= bound * (1 + 1e-9) + 1e-300
    assert second_order.tail(state, section) <= bound * (1 + 1e-9)


@pytest.mark.parametrize("share", [0.001, 0.02, 0.1])
@pytest.mark.parametrize("kind", KINDS)
def test_the_worst_state_comes_within_half_of_the_bound(kind, share):
    section = designed(kind, share * RATE, 0.2 * share * RATE if kind == "band" else 5.0)
    angles = np.linspace(0, np.pi, 33)
    largest = [np.abs(filtered(section, np.zeros(2000), at(np.cos(a), np.sin(a)))).max() for a in angles]
    assert max(largest) > 0.5 * second_order.tail(at(1.0, 0.0), section)


@kernel
def wander(frequencies, qs, rate, x, coefficients, state, y):
    for i in range(x.size):
        second_order.design_low_pass(frequencies[i], qs[i], rate, coefficients)
        second_order.run(x[i : i + 1], coefficients, state, y[i : i + 1])


@pytest.mark.parametrize("rate", [8000.0, 48000.0, 192000.0])
def test_coefficients_thrown_about_at_every_frame_never_add_energy(rate):
    draw = np.random.default_rng(6)
    n = 20000
    frequencies = rate * 10.0 ** draw.uniform(-5, np.log10(0.49), n)
    qs = 10.0 ** draw.uniform(-1, 3, n)
    coefficients, state, y = COEFFICIENTS.zeros(), at(1.0, -2.0), np.empty(n)
    energy = state.x1**2 + state.x2**2
    for first in range(0, n, 500):
        part = slice(first, first + 500)
        wander(frequencies[part], qs[part], rate, np.zeros(500), coefficients, state, y[part])
        before, energy = energy, state.x1**2 + state.x2**2
        assert energy <= before * (1 + 1e-12)
    assert np.abs(y).max() <= math.sqrt(5.0) * (1 + 1e-12)


def test_a_sweep_moves_the_output_without_a_click():
    n = 4800
    x = np.sin(2 * np.pi * 200.0 * np.arange(n) / RATE)
    y, frequencies = np.empty(n), np.where(np.arange(n) < n // 2, 100.0, 2000.0)
    wander(frequencies, np.full(n, 0.7), RATE, x, COEFFICIENTS.zeros(), STATE.zeros(), y)
    steps = np.abs(np.diff(y))
    assert steps[n // 2 - 1] < 4.0 * 2 * np.pi * 200.0 / RATE


@pytest.mark.parametrize("frequency_hz", [0.0, -1.0, 1e-300, 1e9, 1e308])
@pytest.mark.parametrize("kind", KINDS)
def test_frequencies_outside_the_range_are_held_inside(kind, frequency_hz):
    for second in (0.0, 1.0, 1e300):
        section = designed(kind, frequency_hz, second)
        assert np.isfinite(section.values).all()
        assert np.isfinite(filtered(section, np.random.default_rng(7).normal(size=3000) * 1e6)).all()


@pytest.mark.parametrize("moved", [(250.0, 1000.0), (20.0, 10.0)])
def test_a_band_pass_that_becomes_wide_for_its_centre_lets_go_of_its_ringing_no_louder_than_it_was(moved):
    state, y = MOVING_STATE.zeros(), np.empty(9600)
    x = np.sin(2.0 * np.pi * 250.0 * np.arange(9600) / RATE)
    second_order.run_moving(x, designed("band", 250.0, 10.0), 0, state, y)
    assert np.abs(y).max() > 0.99
    then = designed("band", *moved)
    second_order.run_moving(np.zeros(9600), then, 9600, state, y)
    assert np.abs(y).max() <= 1.0
    np.testing.assert_array_equal(state.now.values, then.values)


@kernel
def thrown(centres, widths, is_strain, x, coefficients, state, y):
    for s in range(widths.size):
        if is_strain:
            envelopes.design_strain_rate(centres[s], 1.0, widths[s], RATE, coefficients)
        else:
            second_order.design_band_pass(centres[s], widths[s], RATE, coefficients)
        span = slice(32 * s, 32 * s + 32)
        second_order.run_moving(x[span], coefficients, 32 * s, state, y[span])


def moved(x, centres, widths, is_strain=False):
    y = np.empty(x.size)
    thrown(centres, widths, is_strain, x, COEFFICIENTS.zeros(), MOVING_STATE.zeros(), y)
    return y


def test_a_band_pass_keeps_its_level_however_it_moves():
    draw, n = np.random.default_rng(8), 6000
    centres, widths = np.full(n, 250.0), 10.0 ** draw.uniform(1, 3, n)
    sine = math.sqrt(2.0) * np.sin(2.0 * np.pi * 250.0 * np.arange(32 * n) / RATE)
    assert 0.97 < moved(sine, centres, widths)[9600:].std() < 1.03
    noise, centres, widths = draw.normal(size=32 * n), 10.0 ** draw.uniform(1.3, 3.7, n), np.full(n, 20.0)
    assert 0.8 < moved(noise, centres, widths).std() / moved(noise, np.full(n, 500.0), widths).std() < 1.2


@pytest.mark.parametrize("is_strain", [False, True])
def test_a_load_that_stands_is_not_felt_as_the_section_moves(is_strain):
    draw, n, still = np.random.default_rng(9), 3000, 1500
    centres, widths = 10.0 ** draw.uniform(1.3, 3, n), 10.0 ** draw.uniform(1, 3, n)
    centres[:still], widths[:still] = 100.0, 100.0
    assert np.abs(moved(np.full(32 * n, 800.0), centres, widths, is_strain)[32 * still :]).max() < 1e-6
