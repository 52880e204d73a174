"""What came of commands, held against SciPy's estimates and against responses that are known."""

import numpy as np
import pytest
from scipy.signal import csd, lfilter, welch

from underfoot.errors import BadValue
from underfoot.floor.tile_response import ResponseMonitor, response_of
from underfoot.models.sole import BAND_HZ

RATE = 48_000.0


def noise(seconds=2.0, seed=1):
    return np.random.default_rng(seed).standard_normal(round(seconds * RATE))


def test_the_gain_in_each_band_is_the_filter_s():
    """A known filter; the gain of a third octave is its mean power gain there."""
    given = noise(10.0)
    found = response_of(given, lfilter([0.3], [1.0, -0.7], given), RATE)
    for band_hz, gain_db in zip(BAND_HZ, found.transfer_db, strict=True):
        f = np.linspace(band_hz * 2 ** (-1 / 6), band_hz * 2 ** (1 / 6), 50)
        h = 0.3 / (1.0 - 0.7 * np.exp(-2j * np.pi * f / RATE))
        assert gain_db == pytest.approx(10.0 * np.log10(np.mean(np.abs(h) ** 2)), abs=0.4)
    assert found.unexplained < 0.05


def test_what_no_response_explains_is_scipy_s_incoherent_power():
    given = noise(10.0)
    done = given + 0.5 * noise(10.0, seed=2)
    size = round(0.1 * RATE)
    how = {"fs": RATE, "window": "hann", "nperseg": size, "noverlap": size // 2, "detrend": False}
    power, cross = welch(given, **how)[1], csd(given, done, **how)[1]
    total = welch(done, **how)[1]
    expected = np.sqrt(1.0 - np.sum(np.abs(cross) ** 2 / power) / np.sum(total))
    assert response_of(given, done, RATE).unexplained == pytest.approx(expected, abs=1e-2)


@pytest.mark.parametrize("seconds", [0.3, 1.0])
def test_of_what_has_nothing_to_do_with_the_command_nothing_is_explained(seconds):
    assert response_of(noise(seconds), noise(seconds, seed=2), RATE).unexplained == pytest.approx(1.0, abs=0.02)


def test_a_tile_is_off_its_command_when_it_is_told_enough_for_long_enough():
    watch = ResponseMonitor(4, RATE)
    told = np.outer(noise(), [1.0, 1.0, 0.001, 0.0])
    done = told * [1.2, 0.3, 0.1, 0.0]
    watch.feed(told[:4800], done[:4800])
    assert not watch.deviates().any()
    for at in range(0, len(told), 800):
        watch.feed(told[at : at + 800], done[at : at + 800])
    assert watch.deviates().tolist() == [False, True, False, False]
    assert watch.rms(1) == pytest.approx((1.0, 0.3), rel=0.05)


def test_two_signals_must_be_alike_and_long_enough():
    with pytest.raises(BadValue, match="the shape of commanded"):
        response_of(np.zeros(20_000), np.zeros(10), RATE)
    with pytest.raises(BadValue, match="at least 9600 samples"):
        response_of(np.zeros(100), np.zeros(100), RATE)
