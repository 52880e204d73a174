"""The running spectrum, of signals whose picture is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from underfoot.widgets.monitor.running_spectrum import FLOOR_DB, HIGH_HZ, LOW_HZ, ROWS, RunningSpectrum
from underfoot.widgets.monitor.spectrogram_plot import SpectrogramPlot

RATE = 48_000.0


def _sine(hz, seconds=1.0, size=1.0):
    return (size * np.sin(2 * np.pi * hz / RATE * np.arange(int(RATE * seconds)))).astype(np.float32)


@pytest.mark.parametrize(("hz", "size"), [(50.0, 1.0), (250.0, 0.1), (1000.0, 0.01)])
def test_a_sine_is_seen_at_its_frequency_and_level(hz, size):
    spectrum = RunningSpectrum(RATE, 1.0)
    spectrum.feed(0, _sine(hz, size=size))
    column = spectrum.levels()[:, 50]
    rows_hz = np.geomspace(LOW_HZ, HIGH_HZ, ROWS)
    assert abs(rows_hz[column.argmax()] - hz) <= 7.0
    level_db = FLOOR_DB * (1.0 - column.max() / 255.0)
    assert level_db == pytest.approx(20 * np.log10(size), abs=1.5)


@settings(max_examples=30)
@given(st.lists(st.integers(1, 9000), min_size=1, max_size=12))
def test_a_picture_does_not_depend_on_how_the_samples_come(lengths):
    samples = np.random.default_rng(1).normal(size=sum(lengths)).astype(np.float32)
    whole, pieces = RunningSpectrum(RATE, 0.5), RunningSpectrum(RATE, 0.5)
    whole.feed(0, samples)
    at = 0
    for length in lengths:
        pieces.feed(at, samples[at : at + length])
        at += length
    np.testing.assert_array_equal(whole.levels(), pieces.levels())
    assert whole.end_frame == pieces.end_frame


def test_missing_samples_are_dark_and_later_ones_stand_in_their_place():
    spectrum, gapless = RunningSpectrum(RATE, 1.0), RunningSpectrum(RATE, 1.0)
    samples = _sine(250.0)
    gapless.feed(0, samples)
    spectrum.feed(0, samples[:12_000])
    spectrum.feed(36_000, samples[36_000:])
    assert spectrum.end_frame == gapless.end_frame
    assert not spectrum.levels()[:, 45:55].any()
    np.testing.assert_array_equal(spectrum.levels()[:, -5:], gapless.levels()[:, -5:])


def test_silence_looks_alike_at_every_level(qtbot):
    plot, spectrum = SpectrogramPlot(), RunningSpectrum(RATE, 8.0)
    qtbot.addWidget(plot)
    plot.resize(400, 200)
    spectrum.feed(0, np.zeros(int(8.0 * RATE), np.float32))
    pictures = []
    for top_db in (0.0, -60.0):
        plot.set_top(top_db)
        plot.show_spectrum(spectrum, 8.0 * RATE, RATE)
        pictures.append(plot.grab().toImage())
    assert pictures[0] == pictures[1]
