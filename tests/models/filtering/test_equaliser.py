"""The equaliser: flat where it should be, bounded where nothing is asked, stable for whatever was measured."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import sosfreqz

from underfoot.errors import BadValue
from underfoot.models.filtering.equaliser import BAND_HZ, MOST_GAIN_DB, design, gain, level

RATE = 48_000.0
FREQUENCIES = np.geomspace(10.0, 3000.0, 1500)
SEEDS = (None, 3, 5)
"""Of the tiles that several tests judge: a nominal one, and two that scatter about it."""


def quadratic(frequency_hz, damping):
    """s^2 + 2 zeta w s + w^2 over w^2, at the frequencies of the tests."""
    s = 1j * FREQUENCIES / frequency_hz
    return s * s + 2.0 * damping * s + 1.0


def tile(seed=None):
    """A tile such as the thesis's: suspension, shaker, a coloured shaker, antiresonance and resonance of the plate."""
    random = np.random.default_rng(seed)

    def near(value, share=0.1):
        return value if seed is None else value * random.uniform(1.0 - share, 1.0 + share)

    mount, shaker = near(49.0, 0.15), near(70.0, 0.2)
    response = (FREQUENCIES / mount) ** 2 / quadratic(mount, near(0.08, 0.5))
    response = response * (FREQUENCIES / shaker) ** 2 / quadratic(shaker, near(0.25, 0.3))
    response = response * quadratic(near(380.0), near(0.06, 0.5)) / quadratic(near(390.0), near(0.08, 0.5))
    response = response * quadratic(near(790.0, 0.02), 0.02) / quadratic(near(1100.0), 0.02)
    return np.abs(response)


@cache
def designed(seed, order):
    """The equaliser of `tile(seed)`: several tests judge it."""
    return design(FREQUENCIES, tile(seed), RATE, order)


def corrected_db(magnitude, sections, frequencies_hz=FREQUENCIES):
    """What SciPy makes of the sections, over the level of the response itself."""
    _, through = sosfreqz(sections, frequencies_hz, fs=RATE)
    return 20.0 * np.log10(magnitude * np.abs(through) / level(frequencies_hz, magnitude))


def worst_db(magnitude, sections, low_hz=60.0, high_hz=700.0):
    f = FREQUENCIES
    inside = (f >= low_hz) & (f <= high_hz)
    return np.abs(corrected_db(magnitude, sections)[inside]).max()


def test_order_14_is_flat_within_a_decibel_and_order_10_nearly_so():
    for seed in SEEDS:
        assert worst_db(tile(seed), designed(seed, 14)) < 0.4
        assert worst_db(tile(seed), designed(seed, 10)) < 1.0


def test_at_the_ends_of_the_band_it_is_no_lower_than_in_the_thesis():
    for seed in SEEDS:
        found = corrected_db(tile(seed), designed(seed, 14))
        assert np.interp(BAND_HZ, FREQUENCIES, found).min() > -10.0


def test_a_resonance_that_sections_can_undo_is_undone():
    """The inverse of a pair of resonances within the band is of order 4: closed form."""
    magnitude = np.abs(quadratic(120.0, 0.2) / quadratic(150.0, 0.1) * quadratic(420.0, 0.1) / quadratic(350.0, 0.15))
    assert worst_db(magnitude, design(FREQUENCIES, magnitude, RATE, 4), 50.0, 750.0) < 0.1


@pytest.mark.parametrize("seed", [None, 3])
def test_a_higher_order_is_never_worse(seed):
    worst = [worst_db(tile(seed), designed(seed, order)) for order in range(2, 25, 2)]
    assert worst[0] > 1.0
    for lower, higher in pairwise(worst):
        assert higher <= lower + 0.05  # the design judges on its own grid, and the ends of the band besides


def test_outside_the_band_its_gain_falls_within_an_octave():
    outside = np.concatenate([np.geomspace(1.0, 25.0, 200), np.geomspace(1500.0, 23_900.0, 400)])
    for seed in SEEDS:
        for order in (10, 14, 20):
            assert 20.0 * np.log10(np.abs(gain(designed(seed, order), outside, RATE))).max() < 4.0


def test_the_gain_is_that_of_scipy():
    sections = designed(None, 10)
    _, through = sosfreqz(sections, FREQUENCIES, fs=RATE)
    np.testing.assert_allclose(gain(sections, FREQUENCIES, RATE), through, rtol=1e-9)


def test_scale_order_of_points_and_noise_make_no_difference():
    magnitude = tile(2)
    plain = designed(2, 8)
    np.testing.assert_allclose(design(FREQUENCIES, 1e-7 * magnitude, RATE, 8), plain, rtol=1e-3, atol=1e-3)
    shuffled = np.random.default_rng(1).permutation(FREQUENCIES.size)
    np.testing.assert_array_equal(design(FREQUENCIES[shuffled], magnitude[shuffled], RATE, 8), plain)
    frequencies = np.fft.rfftfreq(96_000, 1.0 / RATE)[1:6000]
    many = np.interp(frequencies, FREQUENCIES, magnitude)
    noisy = many * np.exp(0.1 * np.random.default_rng(2).standard_normal(many.size))
    inside = (frequencies > 60.0) & (frequencies < 700.0)
    found = corrected_db(many, design(frequencies, noisy, RATE, 14), frequencies)
    assert np.abs(found[inside] - np.median(found[inside])).max() < 1.5


def test_a_notch_is_filled_only_so_far():
    magnitude = tile() * np.where(np.abs(FREQUENCIES - 300.0) < 20.0, 1e-4, 1.0)
    found = 20.0 * np.log10(np.abs(gain(design(FREQUENCIES, magnitude, RATE, 14), FREQUENCIES, RATE)))
    assert found.max() < MOST_GAIN_DB + 8.0


def test_a_curve_of_few_points_is_enough():
    """A tone every 100 Hz: what lies between is taken for smooth."""
    tones = np.arange(0.0, 1001.0, 100.0)
    magnitude = 10.0 / (1.0 + (tones / 400.0) ** 2)
    sections = design(tones, magnitude, RATE, 6)
    at = tones[1:8]
    found = 20.0 * np.log10(magnitude[1:8] * np.abs(gain(sections, at, RATE)))
    assert np.ptp(found) < 0.5


@pytest.mark.parametrize("rate_hz", [2_000.0, 192_000.0])
def test_other_rates(rate_hz):
    magnitude = tile()
    sections = design(FREQUENCIES, magnitude, rate_hz, 14)
    inside = (FREQUENCIES >= 60.0) & (FREQUENCIES <= 700.0)
    found = 20.0 * np.log10(magnitude * np.abs(gain(sections, FREQUENCIES, rate_hz)) / level(FREQUENCIES, magnitude))
    assert np.abs(found[inside]).max() < 0.5


@settings(max_examples=15)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["tile", "walk", "sparse", "noise", "zeros"]),
    st.sampled_from([2, 4, 8, 14, 24]),
)
def test_it_is_stable_for_whatever_was_measured(seed, kind, order):
    random = np.random.default_rng(seed)
    frequencies = FREQUENCIES
    if kind == "tile":
        magnitude = tile(seed) * 10.0 ** random.uniform(-9.0, 9.0)
    elif kind == "walk":
        magnitude = np.exp(np.cumsum(0.2 * random.standard_normal(FREQUENCIES.size)))
    elif kind == "sparse":
        frequencies = np.geomspace(40.0, 900.0, 12)
        magnitude = 10.0 ** random.uniform(-3.0, 3.0, 12)
    else:
        magnitude = np.exp(3.0 * random.standard_normal(FREQUENCIES.size))
        if kind == "zeros":
            magnitude *= random.uniform(size=magnitude.size) > 0.3
    sections = design(frequencies, magnitude, RATE, order)
    assert sections.shape == (order // 2, 6)
    assert np.isfinite(sections).all()
    for section in sections:
        assert section[3] == 1.0
        for quadratic_of in (section[:3], section[3:]):
            # A pole or zero is at least as damped as a resonance 2 Hz wide; a double one is known to the root of 1e-16.
            assert np.abs(np.roots(quadratic_of)).max() < 1.0 - 0.9 * np.pi * 2.0 / RATE
    everywhere = np.abs(gain(sections, np.geomspace(1.0, 23_900.0, 2000), RATE))
    assert 20.0 * np.log10(everywhere.max()) < 60.0


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"order": 7}, "order is 7"),
        ({"order": 0}, "order is 0"),
        ({"order": 26}, "order is 26"),
        ({"order": 3.5}, "order is 3.5"),
        ({"band_hz": (750.0, 50.0)}, "band_hz"),
        ({"band_hz": (50.0, 23_000.0)}, "band_hz"),
        ({"band_hz": (5.0, 750.0)}, "frequencies_hz"),
        ({"rate_hz": 0.0}, "rate_hz"),
        ({"rate_hz": 1000.0}, "band_hz"),
        ({"magnitude": np.zeros(1500)}, "magnitude"),
        ({"magnitude": -np.ones(1500)}, "magnitude"),
        ({"magnitude": np.full(1500, np.nan)}, "magnitude"),
        ({"magnitude": np.ones(7)}, "magnitude is 7;"),
        ({"frequencies_hz": np.geomspace(80.0, 3000.0, 1500)}, "frequencies_hz"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(change, word):
    given_values = {"frequencies_hz": FREQUENCIES, "magnitude": tile(), "rate_hz": RATE, "order": 4} | change
    with pytest.raises(BadValue) as error:
        design(**given_values)
    assert word in str(error.value)
    assert "allowed" in str(error.value)
    assert "\n" not in str(error.value)
