"""Spectra and spectrograms of the preview."""

import numpy as np
import pytest

from underfoot.widgets.design.analysis import Scale, quantised_levels, spectrogram_db, spectrum_db


@pytest.mark.parametrize("hz", [45.0, 250.0, 990.0, 1800.0])
@pytest.mark.parametrize("log", [True, False])
def test_levels_of_a_sine_stand_at_its_frequency_and_amplitude(hz, log):
    scale = Scale(log, 20.0 if log else 0.0)
    time_s = np.arange(43_200) / 48_000.0
    signal = 0.1 * np.sin(2 * np.pi * hz * time_s)
    line = spectrum_db(signal, 48_000.0, scale)
    picture = spectrogram_db(signal, 48_000.0, scale)
    assert line.max() == pytest.approx(-20.0, abs=0.3)
    assert picture[:, 180].max() == pytest.approx(-20.0, abs=0.3)
    rows = scale.rows_hz(len(line))
    assert rows[line.argmax()] == pytest.approx(hz, rel=0.02, abs=4.0)


def test_what_is_above_the_picture_does_not_fold_into_it():
    signal = np.sin(2 * np.pi * 7000.0 * np.arange(43_200) / 48_000.0)
    assert spectrogram_db(signal, 48_000.0, Scale())[:, 20:-20].max() < -60.0
    assert spectrum_db(signal, 48_000.0, Scale()).max() < -60.0


def test_levels_become_colours_between_the_ends_of_the_range():
    shown = quantised_levels(np.array([-100.0, -60.0, -30.0, 0.0, 20.0], np.float32), 0.0, 60.0)
    assert shown.tolist() == [0, 0, 127, 255, 255]


@pytest.mark.parametrize("signal", [np.zeros(0), np.zeros(1), np.zeros(500), np.full(2000, np.nan)])
def test_silence_and_nonsense_are_drawn_as_silence(signal):
    assert np.isfinite(spectrogram_db(signal, 48_000.0, Scale())).all()
    assert np.isfinite(spectrum_db(signal, 48_000.0, Scale())).all()
