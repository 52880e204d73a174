"""Noise and texture: spectra and distributions against scipy's, and that only the position decides what sounds."""

import numpy as np
import pytest
from event_rows import rows_of
from scipy import signal, stats

from underfoot.models.signals import noise
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key

RATE = 48000.0
KEY = stream_key(1, "noise", "t1")
OTHER_KEY = stream_key(1, "noise", "t2")
SPLITS = (1, 7, 32, 64, 1024)
START = 123_456_789


def white(frames, key=KEY, start=START, block=None):
    y = np.empty(frames)
    for first, count in stretches(frames, block):
        noise.white(key, start + first, y[first : first + count])
    return y


def designed_band(low_hz=50.0, high_hz=700.0, rate=RATE):
    coefficients = noise.BAND_COEFFICIENTS.zeros()
    noise.design_band(low_hz, high_hz, rate, coefficients)
    return coefficients


def band(frames, low_hz=50.0, high_hz=700.0, rate=RATE, key=KEY, block=None):
    coefficients, state, y = designed_band(low_hz, high_hz, rate), noise.BAND_STATE.zeros(), np.empty(frames)
    for first, count in stretches(frames, block):
        noise.run_band(key, START + first, coefficients, state, y[first : first + count])
    return y


def designed_texture(mean_s=0.02, burst_s=0.001, centre_hz=300.0, width_hz=15.0, rate=RATE):
    coefficients = noise.TEXTURE_COEFFICIENTS.zeros()
    noise.design_texture(mean_s, burst_s, centre_hz, width_hz, rate, coefficients)
    return coefficients


def texture(frames, coefficients, key=KEY, block=None):
    state, y = noise.TEXTURE_STATE.zeros(), np.empty(frames)
    for first, count in stretches(frames, block):
        noise.run_texture(key, START + first, coefficients, state, y[first : first + count])
    return y


def impulses(frames, mean_s=0.02, key=KEY, start=START, block=None):
    found = []
    events = event_list(room=min(block or frames, frames))
    for first, count in stretches(frames, block):
        events.count = 0.0
        noise.impulses(key, mean_s, RATE, start + first, start + first + count, events)
        if events.count:
            found.append(rows_of(events))
    return np.concatenate(found)


def stretches(frames, block):
    block = block or frames
    return [(first, min(block, frames - first)) for first in range(0, frames, block)]


@pytest.mark.parametrize("make", [white, band, lambda n, block=None: texture(n, designed_texture(), block=block)])
def test_any_split_gives_the_same_bits(make):
    for block in SPLITS:
        np.testing.assert_array_equal(make(5000, block=block), make(5000))


def test_white_noise_is_white_and_of_unit_variance():
    y = white(480_000)
    assert y.mean() == pytest.approx(0.0, abs=4.5 / np.sqrt(y.size))
    assert y.var() == pytest.approx(1.0, abs=4.5 * np.sqrt(0.8 / y.size))
    assert stats.kstest(y, "uniform", (-np.sqrt(3), 2 * np.sqrt(3))).pvalue > 1e-3
    _, power = signal.welch(y, RATE, nperseg=512)
    assert 10 * np.log10(power[2:-2] * RATE / 2) == pytest.approx(0.0, abs=0.7)


def test_noise_is_read_by_position_and_rows_are_unrelated():
    np.testing.assert_array_equal(white(1000, start=START + 500)[:500], white(1000)[500:])
    a, b = white(100_000), white(100_000, key=OTHER_KEY)
    assert abs(np.corrcoef(a, b)[0, 1]) < 4.5 / np.sqrt(a.size)


def test_the_band_is_that_of_two_butterworth_filters_with_unit_rms():
    x = white(96_000)
    exact = signal.lfilter(*signal.butter(2, 50.0, "high", fs=RATE), x)
    exact = signal.lfilter(*signal.butter(2, 700.0, "low", fs=RATE), exact)
    y = band(96_000)
    gain = float(y @ exact / (exact @ exact))
    assert np.abs(y - gain * exact).max() < 1e-10
    assert gain == pytest.approx(1 / root_power(50.0, 700.0, RATE), rel=1e-9)


@pytest.mark.parametrize("rate", [8000.0, 48000.0, 192000.0])
@pytest.mark.parametrize(("low_hz", "high_hz"), [(50.0, 700.0), (200.0, 250.0), (1000.0, 3900.0), (300.0, 306.0)])
def test_band_limited_noise_has_unit_rms_at_any_rate(rate, low_hz, high_hz):
    assert designed_band(low_hz, high_hz, rate).gain * root_power(low_hz, high_hz, rate) == pytest.approx(1.0, rel=1e-7)


def root_power(low_hz, high_hz, rate):
    """RMS of filtered unit white noise: the root of the sum of the impulse response's squares, by scipy."""
    pulse = signal.unit_impulse(int(rate))
    high_passed = signal.sosfilt(signal.butter(2, low_hz, "high", fs=rate, output="sos"), pulse)
    both = signal.sosfilt(signal.butter(2, high_hz, "low", fs=rate, output="sos"), high_passed)
    return np.sqrt(both @ both)


def test_edges_the_wrong_way_round_or_too_high_stay_finite():
    for low_hz, high_hz in [(700.0, 50.0), (0.0, 1e9), (1e9, 1e9), (-5.0, 0.0)]:
        assert np.isfinite(band(2000, low_hz, high_hz)).all()


def test_impulses_are_a_poisson_process():
    found = impulses(48_000_000)
    times = found[:, 0]
    onsets = np.floor(times)
    assert ((onsets >= START) & (onsets < START + 48_000_000)).all()
    assert (np.diff(onsets) > 0).all()
    assert times.size == pytest.approx(50_000, abs=4.5 * np.sqrt(50_000))
    single = found[:, 1] == 1.0
    gaps = np.diff(times)[single[:-1] & single[1:]]
    # Two impulses in one frame are one event, so gaps begin at about a frame: judge those beyond two.
    assert stats.kstest(gaps[gaps > 2] - 2, "expon", (0, 960)).pvalue > 1e-3
    assert gaps.mean() / RATE == pytest.approx(0.020, rel=0.02)
    counts = np.histogram(times - START, bins=np.arange(0, 48_000_001, 4800))[0]
    assert counts.var() / counts.mean() == pytest.approx(1.0, abs=0.07)


@pytest.mark.parametrize("block", SPLITS)
def test_any_split_finds_the_same_impulses(block):
    for mean_s in (0.02, 0.0005):
        np.testing.assert_array_equal(impulses(20_000, mean_s, block=block), impulses(20_000, mean_s))


def test_impulses_in_one_frame_add_up():
    dense = impulses(48_000, mean_s=4 / RATE)
    assert (np.diff(np.floor(dense[:, 0])) > 0).all()
    assert dense[:, 1].max() >= 2.0
    assert dense[:, 1].sum() == pytest.approx(12_000, abs=5 * np.sqrt(12_000))


def test_bursts_of_a_millisecond_begin_at_the_impulses():
    y = np.empty(480_000)
    noise.bursts(KEY, START, designed_texture(), y)
    expected = np.zeros(y.size + 48, dtype=bool)
    for onset in np.floor(impulses(480_000 + 48, start=START - 48)[:, 0]).astype(int) - START:
        expected[max(onset, 0) : max(onset + 48, 0)] = True
    np.testing.assert_array_equal(y != 0.0, expected[: y.size])


def test_the_texture_is_its_bursts_through_the_band_pass():
    y = np.empty(96_000)
    noise.bursts(KEY, START, designed_texture(), y)
    exact = signal.lfilter(*signal.iirpeak(300.0, 300.0 / 15.0, fs=RATE), y)
    assert np.abs(texture(96_000, designed_texture()) - exact).max() < 1e-9


def test_a_texture_that_becomes_narrow_at_once_is_not_louder_on_its_way():
    wide, narrow = (designed_texture(0.002, 0.002, width_hz=width_hz) for width_hz in (1000.0, 10.0))
    loudest = {"before": 0.0, "after": 0.0}
    for key in range(20):
        state, y = noise.TEXTURE_STATE.zeros(), np.empty(4800)
        for time, frame, coefficients in (("before", 0, wide), ("after", 4800, narrow)):
            noise.run_texture(np.uint64(key), frame, coefficients, state, y)
            loudest[time] = max(loudest[time], np.abs(y).max())
    assert loudest["after"] < loudest["before"]


@pytest.mark.parametrize(("mean_s", "width_hz", "rate"), [(0.02, 15.0, 48000.0), (0.005, 60.0, 8000.0)])
def test_the_texture_has_unit_rms_in_its_band(mean_s, width_hz, rate):
    y = texture(2_000_000, designed_texture(mean_s=mean_s, width_hz=width_hz, rate=rate))
    assert y.std() == pytest.approx(1.0, rel=0.08)
    frequency, power = signal.welch(y, rate, nperseg=16384)
    assert frequency[power.argmax()] == pytest.approx(300.0, abs=width_hz / 2)
    near = np.abs(frequency - 300.0) < 2 * width_hz
    assert power[near].sum() > 0.8 * power.sum()


@pytest.mark.parametrize("arguments", [(0.0, 0.0, 0.0, 0.0), (1e9, 1e9, 1e9, 1e9), (1e-9, 0.01, 300.0, 15.0)])
def test_harsh_settings_stay_finite(arguments):
    assert np.isfinite(texture(2000, designed_texture(*arguments))).all()
