"""What a sweep tells of a known system, and which recordings are turned away."""

import math

import numpy as np
import pytest
from scipy.signal import bilinear_zpk, butter, sosfilt, sosfreqz, zpk2sos

from underfoot.calibration.science.sweep import exponential, find_passes, growth_s, train
from underfoot.calibration.science.tones import harmonics
from underfoot.calibration.science.transfer_function import measure
from underfoot.errors import BadMeasurement, BadValue
from underfoot.floor.layout import LOADS, default_floor
from underfoot.floor.simulated_tile import SimulatedTile

RATE = 16_000.0
LATE = 517


def roots(frequency_hz, damping):
    w = 2.0 * math.pi * frequency_hz
    return np.roots([1.0, 2.0 * damping * w, w * w])


def system():
    """Suspension, shaker, antiresonance and plate, as SciPy's sections."""
    zeros = np.concatenate([np.zeros(4), roots(775.0, 0.02)])
    poles = np.concatenate([roots(49.0, 0.1), roots(70.0, 0.25), roots(1100.0, 0.02)])
    return zpk2sos(*bilinear_zpk(zeros, poles, 0.3, RATE))


PLATE = system()
ONE = exponential(20.0, 2000.0, 2.0, RATE, 0.4)
SWEEP = train(ONE, 2, RATE)
DEAF = butter(2, 250.0, output="sos", fs=RATE)


def heard(sweep, noise=1e-4, late=LATE, square=0.0, cube=0.0, seed=1):
    """What comes back of a sweep: bent, through the plate, late, with noise and an offset."""
    out = sosfilt(PLATE, sweep + square * sweep**2 + cube * sweep**3)
    whole = np.concatenate([np.zeros(late), out, np.zeros(800)])
    return whole + noise * np.random.default_rng(seed).standard_normal(whole.size) + 0.01


def truth(frequencies_hz):
    return np.abs(sosfreqz(PLATE, frequencies_hz, fs=RATE)[1])


def error_db(found, low=40.0, high=740.0):
    inside = (found.frequencies_hz > low) & (found.frequencies_hz < high)
    return np.abs(20.0 * np.log10(found.magnitude / truth(found.frequencies_hz)))[inside].max()


def test_a_sweep_rises_by_equal_factors_in_equal_times():
    phase = np.unwrap(np.angle(np.fft.ifft(np.fft.fft(ONE) * (np.fft.fftfreq(ONE.size) > 0.0) * 2.0)))
    hz = np.gradient(phase) * RATE / (2.0 * np.pi)
    time_s = np.arange(ONE.size) / RATE
    middle = slice(4_000, 28_000)
    np.testing.assert_allclose(hz[middle], 20.0 * 100.0 ** (time_s[middle] / 2.0), rtol=0.05)
    assert np.abs(ONE).max() <= 0.4
    assert growth_s(ONE, RATE) == pytest.approx(2.0 / math.log(100.0), rel=1e-3)


@pytest.mark.parametrize("late", [0, LATE, 9_000])
@pytest.mark.parametrize("passes", [1, 3])
def test_it_finds_the_transfer_function_and_the_delay(late, passes):
    sweep = train(ONE, passes, RATE)
    found = measure(sweep, heard(sweep, late=late), RATE)
    assert error_db(found) < 0.15
    assert found.passes == passes
    assert found.latency_s == pytest.approx(late / RATE, abs=0.0007)
    assert found.noise_rms == pytest.approx(1e-4, rel=0.1)
    assert np.isnan(found.spread_db).all() == (passes == 1)
    assert found.coherence[(found.frequencies_hz > 40.0) & (found.frequencies_hz < 700.0)].min() > 0.999


@pytest.mark.parametrize(("late", "echo", "later"), [(0, 0.3, 0), (7, 0.37, 0), (700, 0.43, 60)])
def test_the_delay_ends_at_the_first_arrival_not_at_the_flank_before_it(late, echo, later):
    """A pulse of 2 kHz rises over several frames: a tile that answers at once seemed to answer before it was asked.

    What is less than half as high as an echo is not taken for the arrival.
    """
    sweep = train(ONE, 2, RATE)
    direct = np.concatenate([np.zeros(late), sweep, np.zeros(800 - late)])
    found = measure(sweep, 0.2 * direct + echo * np.roll(direct, 60), RATE)
    assert found.latency_s * RATE == pytest.approx(late + later, abs=1e-6)


@pytest.mark.parametrize("load", LOADS)
def test_a_simulated_tile_answers_at_once_and_not_before(load):
    sweep = train(ONE, 1, RATE)
    found = measure(sweep, SimulatedTile(default_floor().tiles[0]).respond(sweep, RATE, load), RATE)
    assert 0.0 <= found.latency_s < 1e-4


def test_a_recording_may_begin_in_the_silence_before_the_sweep_and_end_with_it():
    begun_later = heard(SWEEP, late=0)[int(0.4 * RATE) :]
    found = measure(SWEEP, begun_later, RATE)
    assert error_db(found) < 0.15
    assert found.latency_s == pytest.approx(-0.4, abs=0.0007)
    with pytest.raises(BadMeasurement, match=r"does not hold the whole sweep: .* from -0\.10 to"):
        measure(SWEEP, heard(SWEEP, late=0)[int(0.7 * RATE) :], RATE)
    no_silence = heard(ONE, late=80)[: ONE.size + 80]
    assert error_db(measure(ONE, no_silence, RATE)) < 0.15


def test_spread_and_noise_are_those_of_the_recording():
    """The spread over passes, and the noise told from the silence, agree: both are the same noise."""
    sweep = train(ONE, 12, RATE)
    found = measure(sweep, heard(sweep, noise=3e-3), RATE)
    inside = (found.frequencies_hz > 80.0) & (found.frequencies_hz < 600.0)
    by_noise = 8.686 * found.noise[inside] * math.sqrt(12.0) / found.magnitude[inside] / math.sqrt(2.0)
    ratio = np.sqrt(np.mean(found.spread_db[inside] ** 2) / np.mean(by_noise**2))
    assert 0.7 < ratio < 1.4
    assert found.snr_db(60.0, 700.0) == pytest.approx(
        20.0 * math.log10(np.median((found.magnitude / found.noise)[inside])), abs=3.0
    )


@pytest.mark.parametrize("ppm", [-150.0, 100.0])
def test_clocks_that_drift_apart_and_samples_lost_between_sweeps_change_nothing(ppm):
    """The passes cancelled one another in their mean, by up to all of it, and their levels agreed all the same."""
    sweep = train(ONE, 3, RATE)
    whole = heard(sweep)
    places = np.arange(whole.size)
    drifting = measure(sweep, np.interp(places * (1.0 + 1e-6 * ppm), places, whole), RATE)
    assert error_db(drifting) < 0.15
    assert drifting.latency_s == pytest.approx(LATE / RATE, abs=0.001)
    gap = round(5.5 * RATE)
    assert error_db(measure(sweep, np.delete(whole, slice(gap, gap + 40)), RATE)) < 0.15
    with pytest.raises(BadMeasurement, match=r"^the sweeps differ from one another in \d\d % of their band: samples"):
        measure(sweep, np.delete(whole, slice(gap - 18_000, gap - 17_700)), RATE)


@pytest.mark.parametrize(("at_s", "lost"), [(4.0, 20), (4.0, -20)])
def test_samples_that_are_lost_or_repeated_within_one_of_several_sweeps_are_noticed(at_s, lost):
    sweep = train(ONE, 3, RATE)
    whole, at = heard(sweep), round(at_s * RATE)
    spoilt = np.delete(whole, slice(at, at + lost)) if lost > 0 else np.insert(whole, at, whole[at + lost : at])
    with pytest.raises(BadMeasurement, match=r"^within a sweep some octaves come \d.* ms later .* samples were lost"):
        measure(sweep, spoilt, RATE)


def test_no_sample_is_lost_where_an_accelerometer_hears_only_noise():
    """Noise above a tile's band comes at any time."""
    sweep = train(ONE, 2, RATE)
    whole = sosfilt(DEAF, heard(sweep, 0.0))
    whole += 0.03 * np.random.default_rng(1).standard_normal(whole.size)
    assert measure(sweep, whole, RATE).passes == 2


def test_noise_neither_moves_sweeps_nor_passes_for_lost_samples():
    """What lies above the sweep's band gave each pass a delay of its own, by seconds."""
    sweep = train(ONE, 3, RATE)
    found = measure(sweep, heard(sweep, noise=0.08), RATE)
    assert found.snr_db(60.0, 700.0) == pytest.approx(18.0, abs=1.0)
    assert found.latency_s == pytest.approx(LATE / RATE, abs=0.0007)
    with pytest.raises(BadMeasurement, match=r"^the signal is only \d dB above the noise"):
        measure(sweep, heard(sweep, noise=0.3), RATE)


def test_distortion_is_told_by_order():
    """A square and a cube in front of the plate make known amounts of the second and third harmonic."""
    found = measure(SWEEP, heard(SWEEP, square=0.02, cube=0.03), RATE)
    for hz in (100.0, 200.0, 300.0):
        second = 0.02 * 0.4 / 2.0 * truth([2.0 * hz])[0] / truth([hz])[0]
        third = 0.03 * 0.4**2 / 4.0 * truth([3.0 * hz])[0] / truth([hz])[0]
        assert np.interp(hz, found.frequencies_hz, found.distortion[2]) == pytest.approx(second, rel=0.15, abs=1e-4)
        assert np.interp(hz, found.frequencies_hz, found.distortion[3]) == pytest.approx(third, rel=0.15, abs=1e-4)
    clean = measure(SWEEP, heard(SWEEP, noise=1e-6), RATE)
    assert np.interp(200.0, clean.frequencies_hz, clean.distortion[2]) < 5e-4


def test_any_other_broad_signal_serves_as_well_but_tells_no_distortion():
    random = np.random.default_rng(4)
    linear = np.arange(3 * 16_000) / RATE
    chirp = 0.3 * np.sin(2.0 * np.pi * (10.0 * linear + 0.5 * 600.0 * linear**2))
    for signal in (chirp, 0.1 * random.standard_normal(48_000)):
        sweep = np.concatenate([np.zeros(8_000), signal, np.zeros(12_000)])
        found = measure(sweep, heard(sweep), RATE)
        assert error_db(found) < 0.5
        assert np.isnan(found.distortion[2]).all()


def test_passes_are_told_apart_by_the_silence_between_them():
    starts, one = find_passes(train(ONE, 3, RATE, 0.2), RATE)
    assert len(starts) == 3
    assert one.size == pytest.approx(ONE.size, abs=30)  # its ends are faded to nothing
    unequal = np.concatenate([ONE, np.zeros(8_000), 0.5 * ONE])
    starts, one = find_passes(unequal, RATE)
    assert len(starts) == 1
    assert one.size == pytest.approx(unequal.size, abs=30)


def test_harmonics_are_those_that_were_put_in():
    time_s = np.arange(4_000) / RATE
    tone = 0.2 + sum(a * np.cos(2.0 * np.pi * 300.0 * k * time_s + k) for k, a in ((1, 0.7), (2, 0.03), (5, 0.01)))
    np.testing.assert_allclose(harmonics(tone, 300.0, RATE, 6), [0.7, 0.03, 0.0, 0.0, 0.01, 0.0], atol=1e-9)


OTHER = {f"another sweep of {s:g} s": train(exponential(20.0, 2000.0, s, RATE, 0.4), 2, RATE) for s in (1.5, 1.95, 2.3)}


@pytest.mark.parametrize(
    ("sweep", "recorded", "reason"),
    [
        (SWEEP, np.zeros(SWEEP.size), "no signal"),
        (SWEEP, np.full(SWEEP.size, 0.3), "no signal"),
        (SWEEP, np.clip(3.0 * heard(SWEEP), -0.1, 0.1), "clipped"),
        (SWEEP, np.round(np.clip(3.0 * heard(SWEEP), -0.1, 0.1) * 32768.0) / 32768.0, "clipped"),
        (SWEEP, 0.01 * np.random.default_rng(2).standard_normal(SWEEP.size), "do not fit"),
        (SWEEP, 0.2 * np.sin(0.02 * np.arange(SWEEP.size)), "do not fit"),
        (SWEEP, heard(SWEEP)[: SWEEP.size // 2], "does not hold the whole sweep"),
        (SWEEP, heard(SWEEP)[int(0.8 * RATE) :], "do not fit|does not hold"),
        (SWEEP, heard(SWEEP)[::2], "do not fit|does not hold"),
        (
            SWEEP,
            np.interp(np.arange(0, 90_000, 48.0 / 44.1), np.arange(90_000), heard(SWEEP)[:90_000]),
            "do not fit|hold",
        ),
        (SWEEP, 0.5 * SWEEP, "the sweep itself"),
        (SWEEP, heard(SWEEP, noise=0.5), "do not fit|above the noise"),
        *((sweep, heard(SWEEP), "not fit: .*(lost samples|octaves arrive)|not hold") for sweep in OTHER.values()),
    ],
)
def test_what_cannot_be_right_is_refused_with_the_reason(sweep, recorded, reason):
    with pytest.raises(BadMeasurement, match=reason) as error:
        measure(sweep, recorded, RATE)
    assert "\n" not in str(error.value)


def test_strong_hum_is_named_where_the_sweep_does_not_explain_the_recording():
    recorded = 0.02 * heard(SWEEP)
    recorded += 0.05 * np.sin(2.0 * np.pi * 50.0 * np.arange(recorded.size) / RATE)
    with pytest.raises(BadMeasurement, match=r"explains \d+ % .* the rest is hum or noise, .* is the amplifier on"):
        measure(SWEEP, recorded, RATE)


def test_where_one_octave_is_not_the_sweep_it_is_named():
    """Of a recording of which the sweep explains nearly all, it was said to explain 0 % of what was heard."""
    recorded = heard(SWEEP)
    recorded += 0.1 * np.sin(2.0 * np.pi * 50.0 * np.arange(recorded.size) / RATE)
    with pytest.raises(BadMeasurement, match=r"fit: from 16 to 32 Hz the sweep explains \d+ % .* is hum or noise"):
        measure(SWEEP, recorded, RATE)


def test_coarse_samples_hum_and_strong_distortion_are_measured_all_the_same():
    coarse = np.round(0.1 * heard(SWEEP) * 32768.0) / 32768.0
    found = measure(SWEEP, coarse, RATE)
    assert np.abs(np.log(10.0 * found.magnitude / truth(found.frequencies_hz))[200:500]).max() < 0.02
    hum = heard(SWEEP)
    hum += 0.02 * np.sin(2.0 * np.pi * 50.0 * np.arange(hum.size) / RATE)
    assert error_db(measure(SWEEP, hum, RATE), 80.0) < 0.5
    assert error_db(measure(SWEEP, heard(SWEEP, cube=0.5), RATE), 80.0) < 1.0


@pytest.mark.parametrize(
    "values",
    [
        {"sweep": np.zeros(1000)},
        {"sweep": np.ones((10, 2))},
        {"recorded": np.ones((10, 2))},
        {"recorded": np.full(1000, np.nan)},
        {"rate_hz": 0.0},
        {"sweep": np.ones(10)},
    ],
)
def test_what_is_no_signal_is_a_bad_value(values):
    with pytest.raises(BadValue):
        measure(**{"sweep": SWEEP, "recorded": SWEEP, "rate_hz": RATE} | values)


@pytest.mark.parametrize(
    "values", [{"high_hz": 9_000.0}, {"low_hz": 0.0}, {"seconds": 0.0}, {"level": 1.5}, {"fade_s": 3.0}]
)
def test_a_sweep_that_cannot_be_is_a_bad_value(values):
    with pytest.raises(BadValue):
        exponential(**{"low_hz": 20.0, "high_hz": 2000.0, "seconds": 1.0, "rate_hz": RATE} | values)
