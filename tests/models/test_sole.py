"""What the sole feels, held against the figures of the papers and the thesis that it is made of."""

import json
import math
from importlib.resources import files

import numpy as np
import pytest

from underfoot.engine.loop import LoopOptions
from underfoot.engine.preview import previewed
from underfoot.engine.render import render_source
from underfoot.errors import BadValue
from underfoot.floor.layout import default_floor
from underfoot.models import sole
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

RATE = 48_000.0


def sine(peak, frequency_hz, seconds=1.0):
    return peak * np.sin(2.0 * np.pi * frequency_hz * np.arange(round(seconds * RATE)) / RATE)


def displacement_um(frequency_hz):
    return 1e6 * sole.threshold_m_s2(frequency_hz) / (2.0 * np.pi * np.asarray(frequency_hz)) ** 2


def test_the_threshold_is_flat_to_40_hz_and_u_shaped_to_250_and_1_2_um_at_200():
    """Gu and Griffin 2011; Kowalzik et al. 1996."""
    assert np.ptp(displacement_um([20.0, 25.0, 31.5, 40.0])) < 1e-9
    over = displacement_um([40.0, 80.0, 125.0, 200.0, 250.0])
    assert (np.diff(over[:4]) < 0.0).all()
    assert over[4] > over[3]
    assert over[3] == pytest.approx(1.2)


def test_walkers_in_hard_shoes_notice_the_thesis_s_stimulus_at_its_threshold():
    """TD, in a step, so loud that the median of its 10 ms peaks is 0.46 m/s^2 on the plate (6.4.2)."""
    patch = Patch.loads(files("underfoot.presets").joinpath("patches/stimulus-td.json").read_bytes(), REGISTRY)
    _, signals, _ = previewed(patch, (), default_floor().tiles[0], 0.9, RATE, measures=True)
    measured = signals["measured"].astype(np.float64)
    measured *= 0.46 / sole.windowed_peak(measured, RATE)
    found = sole.felt(measured, RATE)
    assert abs(found.level_db["shoe"]) < 1.0
    assert found.noticed == pytest.approx(0.5, abs=0.1)


@pytest.mark.parametrize("frequency_hz", [31.5, 63.0, 100.0, 250.0])
def test_a_sine_is_as_far_over_the_threshold_as_its_amplitude_is(frequency_hz):
    peak = 10.0 * float(sole.threshold_m_s2(frequency_hz))
    assert sole.felt(sine(peak, frequency_hz), RATE).level_db["barefoot"] == pytest.approx(20.0, abs=0.7)


def test_bands_add_up_to_the_power_of_noise():
    """White noise of 1 m/s^2 RMS between 0 and 24 kHz: a third of an octave around f holds 0.2316 f of 24,000."""
    noise = np.random.default_rng(1).standard_normal(round(60 * RATE))
    found = np.array([sole.band_levels(noise[i : i + 9600], RATE) for i in range(0, noise.size, 9600)])
    width = np.array(sole.BAND_HZ) * (2 ** (1 / 6) - 2 ** (-1 / 6)) / 24_000.0
    # The largest of three windows that overlap: somewhat above the mean, less where a band is wide.
    ratio = (found**2).mean(axis=0) / (2.0 * width)
    assert (ratio[4:] > 0.9).all()
    assert (ratio[10:] < 1.5).all()


def test_the_share_in_band_is_that_from_50_to_750_hz():
    tones = sum(sine(1.0, frequency_hz) for frequency_hz in (47.0, 53.0, 747.0, 753.0))
    assert sole.share_in_band(tones, RATE) == pytest.approx(0.5)


def test_who_notices_what_is_half_at_the_mean_and_a_sixth_one_deviation_below():
    """0.46 m/s^2, with 0.18 m/s^2 (6.4.2)."""
    low = 20.0 * math.log10((0.46 - 0.18) / 0.46)
    assert sole.chance_noticed(0.0) == 0.5
    assert sole.chance_noticed(low) == pytest.approx(0.1587, abs=1e-4)
    assert sole.felt(np.zeros(4800), RATE).noticed == 0.0


def test_a_plate_feels_softer_with_vibration_as_table_6_3_says_and_no_further():
    felt = [sole.felt_stiffness_n_mm(peak) for peak in (0.0, 0.43, 0.86)]
    assert felt == pytest.approx([90.0, 90.0 * 100.8 / 134.5, 90.0 * 100.8 / 151.6])
    assert sole.felt_stiffness_n_mm(0.87) is None


def test_bad_values_are_refused_in_one_line():
    with pytest.raises(BadValue, match="footwear is 'clog'; allowed: barefoot, shoe"):
        sole.threshold_m_s2(100.0, "clog")


@pytest.mark.parametrize("measure", [sole.felt, sole.band_levels, sole.windowed_peak, sole.share_in_band])
def test_a_vibration_is_of_one_tile_finite_or_refused(measure):
    two_tiles = np.stack([sine(1.0, 200.0), sine(2.0, 900.0)], axis=1)
    for bad in (two_tiles, [0.0, math.nan], [math.inf], 1.0, "loud"):
        with pytest.raises(BadValue, match=r"^acceleration_m_s2 is .*; allowed: finite numbers in one dimension$"):
            measure(bad, RATE)
    measure([], RATE)


def test_a_rendering_says_what_is_felt():
    from underfoot.devices.simulated_floor import SimulatedFloor

    patch = Patch.loads(files("underfoot.presets").joinpath("patches/tacton-impact.json").read_bytes(), REGISTRY)
    options = LoopOptions(plates=("accelerometer",))
    summary = render_source(patch, SimulatedFloor(default_floor(1, 1)), 1.0, options).summary()
    found = json.loads(json.dumps(summary))["accelerometer"]
    assert found["share_50_to_750_hz"] > 0.9
    assert found["level_shoe_db"] > found["level_barefoot_db"] > -10.0
