"""Drawn modal banks: the distributions they are drawn from, and that they ring as the sum of their modes."""

import numpy as np
import pytest
from scipy import stats

from underfoot.models.modal import drawn_modes
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.patch.program import Program

RATE = 48_000


def drawn(draw=1, modes=200, low=100.0, high=5_000.0, alpha=0.0, rolloff=0.0, quality=10.0, damping=1.0):
    """Frequencies, decays and amplitudes of a bank with these parameters."""
    draws = drawn_modes.draws(modes, draw)
    table = np.zeros((3, modes))
    drawn_modes.place(draws, low, high, alpha, rolloff, quality, damping, table)
    return table


def ring(tiles=("t1",), frames=4_800, **parameters):
    """What each tile's bank rings when frame 100 strikes it."""
    patch = Patch().add("strike", REGISTRY).add("drawn-bank", REGISTRY, **parameters)
    patch = patch.connect("strike.out", "drawn-bank.strike", REGISTRY)
    program = Program(patch, REGISTRY, tiles, rate=RATE, block=frames, scopes=["drawn-bank.out"])
    for tile in tiles:
        program.strike("", tile, 100.0, 1.0)
    program.run(0, frames)
    return program.scope["drawn-bank.out"]


@pytest.mark.parametrize("alpha", [-3.0, -1.0, -0.5, 0.0, 2.0])
def test_frequencies_are_drawn_from_their_power_law(alpha):
    frequencies = np.concatenate([drawn(draw, alpha=alpha)[0] for draw in range(10)])

    def share_below(f):
        power = alpha + 1.0
        if power == 0.0:
            return np.log(f / 100.0) / np.log(50.0)
        return (f**power - 100.0**power) / (5_000.0**power - 100.0**power)

    assert stats.kstest(frequencies, share_below).pvalue > 0.01
    other = stats.loguniform(100.0, 5_000.0) if alpha != -1.0 else stats.uniform(100.0, 4_900.0)
    assert stats.kstest(frequencies, other.cdf).pvalue < 1e-6


@pytest.mark.parametrize("rolloff", [0.0, 0.5, 2.0])
def test_amplitudes_fall_by_6_02_r_db_an_octave(rolloff):
    frequencies, _, amplitudes = drawn(rolloff=rolloff)
    slope = np.polyfit(np.log2(frequencies), 20.0 * np.log10(amplitudes), 1)[0]
    assert slope == pytest.approx(-20.0 * np.log10(2.0) * rolloff, abs=1e-9)
    assert (amplitudes**2).sum() == pytest.approx(1.0)


def test_the_spectrum_of_what_rings_falls_as_fast():
    bank = {"draw": 11, "modes": 6, "low": 200.0, "high": 6_000.0, "alpha": -1.0, "quality": 50.0, "damping": 0.0}
    heard = ring(frames=48_000, rolloff=1.5, **bank)
    frequencies, decays, _ = drawn(**bank)
    assert np.diff(frequencies).min() > 50.0 * decays.max() / np.pi, "modes too close to be measured one by one"
    spectrum = np.abs(np.fft.rfft(heard[0], 8 * RATE))
    peaks = [spectrum[int(8 * f) - 40 : int(8 * f) + 41].max() for f in frequencies]
    slope = np.polyfit(np.log2(frequencies), 20.0 * np.log10(peaks), 1)[0]
    assert slope == pytest.approx(-6.02 * 1.5, abs=0.4)


def test_decays_follow_the_quality_and_its_law():
    frequencies, decays, _ = drawn(quality=12.0, damping=1.0)
    assert np.allclose(np.pi * frequencies / decays, 12.0)
    frequencies, decays, _ = drawn(quality=12.0, damping=0.0)
    assert np.allclose(decays, np.pi * 100.0 / 12.0)
    frequencies, decays, _ = drawn(damping=2.0)
    assert np.polyfit(np.log(frequencies), np.log(decays), 1)[0] == pytest.approx(2.0)


def test_it_rings_as_the_sum_of_its_modes_from_the_event_on():
    heard = ring(modes=40, rolloff=0.7, quality=15.0, damping=0.8, draw=7, level=3.0)[0]
    frequencies, decays, amplitudes = drawn(7, 40, 150.0, 1_200.0, 0.0, 0.7, 15.0, 0.8)
    time = np.arange(4_700)[:, None] / RATE
    expected = 3.0 * (amplitudes * np.exp(-decays * time) * np.sin(2.0 * np.pi * frequencies * time)).sum(axis=1)
    assert not heard[:100].any()
    assert np.abs(heard[100:] - expected).max() < 40 * 3.0 * 1e-5  # modes are let go below 1e-5 m/s^2
    assert np.abs(heard[100:400] - expected[:300]).max() < 1e-11


def test_all_tiles_have_the_same_modes_and_another_draw_has_others():
    heard = ring(("t1", "t2"))
    assert heard[0].tobytes() == heard[1].tobytes()
    assert heard[0].tobytes() == ring()[0].tobytes()
    assert np.abs(ring(draw=2)[0] - heard[0]).max() > 0.1


def test_a_band_whose_high_edge_is_below_its_low_one_rings_at_the_low_one():
    frequencies = drawn(modes=5, low=400.0, high=300.0)[0]
    assert np.allclose(frequencies, 400.0)
