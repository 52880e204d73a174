"""The shaker, held against SciPy's filter of the same zeros and poles, and against what the thesis measured."""

import math

import numpy as np
import pytest
from scipy.signal import freqs

from underfoot.models.tile.shaker import Shaker

FREQUENCIES_HZ = np.geomspace(5.0, 20_000.0, 300)


def force_of(shaker):
    """Moving mass, case and coil as one ratio of polynomials."""

    def pair(hz, damping):
        own = 2.0 * math.pi * hz
        return np.array([1.0, 2.0 * damping * own, own**2])

    coil = 2.0 * math.pi * shaker.corner_hz
    top = np.polymul([1.0, 0.0, 0.0], pair(shaker.colour_hz, shaker.colour_damping * shaker.colour))
    bottom = np.polymul(pair(shaker.resonance_hz, shaker.damping), pair(shaker.colour_hz, shaker.colour_damping))
    over = np.polymul(bottom, [1.0, coil])
    return freqs(shaker.force_n * coil * top, over, worN=2.0 * math.pi * FREQUENCIES_HZ)[1]


@pytest.mark.parametrize(
    "shaker", [Shaker(), Shaker(colour=3.0, damping=0.7), Shaker(colour=20.0, colour_damping=0.45)]
)
def test_the_force_is_that_of_a_moving_mass_a_case_and_a_coil(shaker):
    np.testing.assert_allclose(shaker.transfer(FREQUENCIES_HZ), force_of(shaker), rtol=1e-8)


@pytest.mark.parametrize("apart", [0.0, 1e-13, -1e-6])
def test_the_case_may_resonate_as_the_moving_mass_does(apart):
    shaker = Shaker(resonance_hz=100.0, damping=0.3, colour_hz=100.0 * (1.0 + apart), colour_damping=0.3)
    np.testing.assert_allclose(shaker.transfer(FREQUENCIES_HZ), force_of(shaker), rtol=1e-5)


def test_it_reaches_40_newtons_throughout_the_band_and_errs_by_5_percent_at_30():
    shaker = Shaker()
    asked = np.abs(shaker.transfer(np.linspace(50.0, 750.0, 701)))
    assert shaker.compressed_n(asked).min() > 40.0
    sine = np.sin(2.0 * math.pi * np.arange(1000) / 1000)
    fundamental = 2.0 * np.mean(shaker.compressed_n(30.0 * sine) * sine)
    assert 0.05 < 1.0 - fundamental / 30.0 < 0.06


def test_small_forces_pass_and_harmonics_grow_as_their_order_says():
    """h2 grows with the force, h3 with its square (the quotients to the fundamental)."""
    shaker, sine = Shaker(), np.sin(2.0 * math.pi * np.arange(1024) / 1024)

    def harmonics(force_n):
        lines = np.abs(np.fft.rfft(shaker.compressed_n(force_n * sine)))
        return lines[1] / 512.0 / force_n, lines[2] / lines[1], lines[3] / lines[1]

    small, twice = harmonics(0.5), harmonics(1.0)
    assert small[0] == pytest.approx(1.0, abs=1e-4)
    assert twice[1] / small[1] == pytest.approx(2.0, rel=1e-3)
    assert twice[2] / small[2] == pytest.approx(4.0, rel=1e-3)
    assert harmonics(40.0)[2] == pytest.approx(0.02, abs=0.01)


def test_without_bias_there_are_no_even_harmonics():
    sine = np.sin(2.0 * math.pi * np.arange(1024) / 1024)
    lines = np.abs(np.fft.rfft(Shaker(bias=0.0).compressed_n(50.0 * sine)))
    assert lines[2::2].max() < 1e-12 * lines[1]
    assert lines[3] > 0.01 * lines[1]
