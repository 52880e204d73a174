"""The last stage before the shaker: whatever comes in, what goes out keeps to the limits."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import freqz, lfilter

from underfoot.clock import FADE, RAMP
from underfoot.engine.safety import DC_HZ, PANIC, RMS_SECONDS, Limits, Safety, limited

RATE = 48_000
USUAL = (Limits(),)
FULL = USUAL[0].acceleration_per_unit


def guarded(signal, blocks=(480,), limits=USUAL, channels=(0,), at_frame=None):
    """What comes out, float32 [frame, channel], for a signal of full scale, [row, frame]; calls what is `at_frame`."""
    with np.errstate(over="ignore"):
        signal = np.atleast_2d(np.asarray(signal, float)) * FULL
    safety = Safety(list(limits), list(channels), RATE, max(blocks), max(channels) + 1)
    safety.open(-FADE)
    out = np.empty((signal.shape[1], max(channels) + 1), np.float32)
    at = turn = 0
    calls = dict(at_frame or {})
    still = np.zeros(len(limits), np.uint8)
    while at < len(out):
        n = min([blocks[turn % len(blocks)], len(out) - at, *(f - at for f in calls if f > at)])
        if at in calls:
            calls[at](safety)
        block = np.ascontiguousarray(signal[:, at : at + n])
        still[:] = ~block.any(axis=1)
        safety.apply(block, still, at, 0, n)
        out[at : at + n] = safety.out[:n]
        at, turn = at + n, turn + 1
    guarded.safety = safety
    return out


def sine(height, hz=60.0, seconds=1.0):
    return height * np.sin(2.0 * np.pi * hz * np.arange(round(seconds * RATE)) / RATE)


def dc_block(signal):
    """The first-order high-pass that the stage is to be, from its definition."""
    pole = math.exp(-2.0 * math.pi * DC_HZ / RATE)
    return lfilter([1.0, -1.0], [1.0, -pole], signal)


def running_rms(out):
    """Exponential mean over the time of the limit, as a voice coil would average it."""
    share = 1.0 - math.exp(-1.0 / (RMS_SECONDS * RATE))
    return np.sqrt(lfilter([share], [1.0, share - 1.0], np.square(out, dtype=np.float64), axis=0))


def test_a_signal_within_the_limits_loses_its_dc_and_nothing_else():
    signal = 0.2 + sine(0.3) + sine(0.1, 400.0)
    np.testing.assert_allclose(guarded(signal)[:, 0], dc_block(signal), atol=1e-7)


def test_dc_is_blocked_and_what_is_felt_is_not():
    pole = math.exp(-2.0 * math.pi * DC_HZ / RATE)
    _, response = freqz([1.0, -1.0], [1.0, -pole], worN=[0.0, 5.0, 40.0], fs=RATE)
    assert abs(response[0]) == 0.0
    assert abs(response[1]) == pytest.approx(math.sqrt(0.5), abs=0.01)
    assert abs(response[2]) > 0.99
    out = guarded(np.full(RATE, 0.3))[:, 0]
    assert abs(out[-1]) < 1e-7


@settings(max_examples=60)
@given(
    st.lists(
        st.one_of(
            st.floats(-3.0, 3.0),
            st.floats(allow_nan=True, allow_infinity=True),
        ),
        min_size=1,
        max_size=200,
    ),
    st.floats(0.01, 1.0),
)
def test_nothing_exceeds_the_peak(values, peak):
    out = guarded(np.repeat(values, 5), limits=(Limits(peak=peak),))
    assert np.isfinite(out).all()
    assert np.abs(out).max() <= np.float32(peak)


@pytest.mark.parametrize("height", [0.7, 1.0, 20.0])
def test_the_mean_square_keeps_to_its_limit_from_the_first_moment_on(height):
    assert (Limits().peak, Limits().rms) == (0.95, 0.35), "docs/hardware.md says these"
    out = guarded(sine(height, seconds=4.0))[:, 0]
    rms = running_rms(out)
    assert rms.max() < 1.03 * Limits().rms
    assert rms[-RATE:].mean() == pytest.approx(Limits().rms, rel=0.01)


def test_a_short_burst_is_not_taken_for_lasting_power():
    signal = np.concatenate([sine(0.9, seconds=0.05), np.zeros(RATE)])
    np.testing.assert_allclose(guarded(signal)[:, 0], dc_block(signal), atol=1e-7)


def test_one_enormous_sample_does_not_switch_the_limits_off():
    signal = sine(20.0, seconds=12.0)
    signal[100] = 1e200
    out = guarded(signal)[:, 0]
    assert np.isfinite(out).all()
    assert np.abs(out[-RATE:]).max() > 0.0
    assert running_rms(out).max() < 1.03 * Limits().rms


def test_what_is_not_finite_is_silence_and_is_counted():
    signal = sine(0.2)
    signal[[500, 700, 900]] = math.nan, math.inf, -math.inf
    clean = signal.copy()
    clean[[500, 700, 900]] = 0.0
    assert guarded(signal).tobytes() == guarded(clean).tobytes()
    guarded(signal)
    assert guarded.safety.faults == 3


def test_ramps_are_straight_and_as_long_as_the_contracts_say():
    hum = np.where(np.arange(4800) % 2, 0.3, -0.3)  # far above the DC block, and its size is the gain
    plain = guarded(hum)[:, 0]
    for call, length, end in (
        (lambda safety: safety.level(0.25, 960), 240, 0.25),
        (lambda safety: safety.close(960), 480, 0.0),
        (lambda safety: safety.panic(960), 48, 0.0),
    ):
        gain = guarded(hum, at_frame={960: call})[:, 0] / plain
        line = np.interp(np.arange(4800), [960, 960 + length], [1.0, end])
        np.testing.assert_allclose(gain, line, atol=2e-3)
        if end == 0.0:
            assert not gain[960 + length :].any()
    turned = guarded(hum, at_frame={960: lambda s: s.level(0.0, 960), 1_080: lambda s: s.level(1.0, 1_080)})[:, 0]
    line = np.interp(np.arange(4800), [960, 1_080, 1_080 + RAMP], [1.0, 1.0 - 120 / RAMP, 1.0])
    np.testing.assert_allclose(turned / plain, line, atol=2e-3)


@pytest.mark.parametrize("rate_hz", [44_100, 96_000])
def test_a_peak_meter_halves_in_a_tenth_of_a_second_at_each_rate(rate_hz):
    safety = Safety([Limits()], [0], rate_hz, rate_hz // 10, 1)
    safety.open(-FADE)
    safety.apply(np.full((1, 1), 0.5 * FULL), np.zeros(1, np.uint8), 0, 0, 1)
    before = safety.peaks[0]
    safety.apply(np.zeros((1, rate_hz // 10)), np.ones(1, np.uint8), 1, 0, rate_hz // 10)
    assert safety.peaks[0] == pytest.approx(before / 2.0)
    for _ in range(50):
        safety.apply(np.zeros((1, rate_hz // 10)), np.ones(1, np.uint8), 1, 0, rate_hz // 10)
    assert safety.peak == 0.0, "it ended at the least number that float64 has"


def test_a_panic_is_not_slowed_by_the_stop_that_comes_with_it():
    hum = np.where(np.arange(2000) % 2, 0.3, -0.3)
    alone = guarded(hum, at_frame={960: lambda safety: safety.panic(960)})
    both = guarded(hum, at_frame={960: lambda s: s.panic(960), 970: lambda s: s.close(970)})
    assert alone.tobytes() == both.tobytes()
    assert guarded.safety.closed(960 + PANIC)
    assert not guarded.safety.closed(960 + PANIC - 1)


@pytest.mark.parametrize("gain", [0.1, 0.001])
def test_what_opens_at_a_level_is_at_no_moment_louder(gain):
    """At -60 dB the first 5 ms were once 127 times as loud as asked."""

    def begin(safety):
        safety.level(gain, 960)
        safety.open(960)

    hum, close = sine(0.3, 50.0, 0.2), {0: lambda safety: safety.close(0)}
    out = guarded(hum, at_frame={**close, 960: begin})[960:, 0]
    ask_nothing = guarded(gain * hum, at_frame={**close, 960: lambda safety: safety.open(960)})[960:, 0]
    np.testing.assert_allclose(out, ask_nothing, atol=1e-6 * gain)
    assert np.abs(out).max() <= 0.31 * gain


@pytest.mark.parametrize("gain", [math.nan, math.inf, -math.inf, -1.0, 0.0, 2.0])
def test_no_level_lets_more_through(gain):
    out = guarded(sine(20.0), at_frame={480: lambda safety: safety.level(gain, 480)})
    assert np.isfinite(out).all()
    assert np.abs(out).max() <= Limits().peak
    faint = guarded(sine(0.2), at_frame={480: lambda safety: safety.level(gain, 480)})
    assert np.abs(faint).max() <= np.abs(guarded(sine(0.2))).max()
    assert (np.abs(faint[-4800:]).max() > 1e-6) == (gain == 2.0), "what is no level is silence"


def test_any_block_size_gives_the_same_bytes():
    signal = np.concatenate([np.zeros(1000), sine(3.0, seconds=0.5), np.zeros(3 * RATE), sine(0.5, seconds=0.2)])
    calls = {2016: lambda safety: safety.level(0.5, 2016), 9600: lambda safety: safety.panic(9600)}
    whole = guarded(signal, [1024], at_frame=calls).tobytes()
    for blocks in ([64], [7, 1, 500]):
        assert whole == guarded(signal, blocks, at_frame=calls).tobytes()


def test_a_block_in_parts_gives_the_same_bytes_and_nothing_of_the_block_before():
    signal = np.concatenate([np.zeros(1200), sine(3.0, seconds=0.1), np.zeros(3 * RATE), sine(0.5, seconds=0.1)])
    safety, parts = Safety(list(USUAL), [0], RATE, 1200, 1), ((0, 300), (300, 400), (700, 500))
    safety.open(-FADE)
    heard = []
    for block in range(0, len(signal), 1200):
        for at, n in parts:
            part = FULL * signal[None, block + at : block + at + n]
            safety.apply(part, np.array([not part.any()], np.uint8), block + at, at, n)
        heard.append(safety.out.copy())
    assert np.concatenate(heard).tobytes() == guarded(signal, [1200]).tobytes()


def test_what_decays_in_silence_is_as_if_each_frame_had_been_looked_at():
    loud, silence = sine(3.0, seconds=1.5), np.zeros(90_000)
    faint = 1e-9 * (-1.0) ** np.arange(silence.size)
    still = guarded(np.concatenate([loud, silence, loud]))
    np.testing.assert_allclose(still, guarded(np.concatenate([loud, faint, loud])), atol=1e-6)
    for blocks in ((64,), (1000, 7, 4096)):
        assert guarded(np.concatenate([loud, silence, loud]), blocks).tobytes() == still.tobytes()


def test_rows_go_to_their_channels_and_add_where_they_share_one():
    rows = [sine(0.2, 50.0), sine(0.3, 90.0), sine(0.1, 130.0), sine(0.4, 170.0)]
    out = guarded(rows, limits=[Limits()] * 4, channels=(2, -1, 0, 0))
    alone = [guarded(row)[:, 0] for row in rows]
    np.testing.assert_array_equal(out[:, 2], alone[0])
    assert not out[:, 1].any()
    np.testing.assert_allclose(out[:, 0], alone[2] + alone[3], atol=1e-7)
    loud = guarded([sine(0.9)] * 3, limits=[Limits()] * 3, channels=(0, 0, 0))
    assert np.abs(loud).max() <= np.float32(Limits().peak)


@pytest.mark.parametrize("blocks", [(480,), (7,), (1, 64, 333)])
def test_full_scale_goes_to_its_new_acceleration_in_a_ramp(blocks):
    def turn(safety):
        safety.rescale(0, 2.0 * FULL, 4_800)

    tone = sine(0.2, 4_800.0, 0.3)  # so high that the DC block leaves the ramp as it is
    out = guarded(tone, blocks, at_frame={4_800: turn})[:, 0]
    gain = np.interp(np.arange(out.size), [4_800, 4_800 + FADE], [1.0, 0.5])
    np.testing.assert_allclose(out, dc_block(tone) * gain, atol=2e-4)
    assert out.tobytes() == guarded(tone, at_frame={4_800: turn})[:, 0].tobytes()


def test_a_measuring_signal_keeps_to_the_limits():
    tone = sine(0.4, 300.0)
    np.testing.assert_allclose(limited(tone, RATE), dc_block(tone), atol=1e-6)
    loud = limited(sine(5.0, 300.0, 3.0), RATE)
    assert np.abs(loud).max() <= np.float32(Limits().peak)
    assert running_rms(loud).max() < 1.03 * Limits().rms


def test_what_is_commanded_has_level_and_opening_and_is_nothing_where_nothing_can_play():
    safety = Safety([Limits()] * 3, [0, -1, 1], RATE, 600, 2)
    safety.open(100)
    safety.level(0.5, 100)
    given, out = np.full((3, 600), 2.0), np.full((650, 3), 9.0, np.float32)
    given[0, 300] = math.inf
    safety.commanded(given, np.array([0, 0, 1], np.uint8), out, 0, 50, 600)
    frames = np.arange(600)
    level, opening = np.interp(frames, [100, 100 + RAMP], [1.0, 0.5]), np.interp(frames, [100, 100 + FADE], [0.0, 1.0])
    np.testing.assert_allclose(out[50:, 0], np.where(frames == 300, 0.0, 2.0 * level * opening), rtol=1e-6)
    assert not out[50:, 1:].any(), "without a channel, or silent"
    assert (out[:50] == 9.0).all()


def test_what_is_told_of_the_outputs_is_of_the_tiles_and_not_of_sound():
    """The end of what a tile plays is where the recorder begins to write nothing."""
    safety, rows = Safety([Limits()] * 2, [0, 1], RATE, 480, 3, sound_channel=2), np.zeros((3, 480))
    safety.open(-FADE)
    rows[2] = 0.5
    safety.apply(rows, np.array([1, 1, 0], np.uint8), 0, 0, 480)
    assert safety.out[:, 2].any()
    assert (safety.sounding, safety.sounded_until, safety.peak) == (0, 0, 0.0)
    rows[1] = 0.25 * FULL
    safety.apply(rows, np.array([1, 0, 0], np.uint8), 480, 0, 480)
    assert (safety.sounding, safety.sounded_until, safety.peak) == (1, 960, pytest.approx(0.25))
    assert (safety.peaks.tolist(), safety.silent_since.tolist()) == ([0.0, pytest.approx(0.25)], [0, -1])
    rows[0] = 0.5 * FULL
    safety.apply(rows, np.zeros(3, np.uint8), 960, 0, 480)
    assert (safety.sounding, safety.peak) == (2, pytest.approx(0.5))


def test_many_rows_at_once_give_the_bits_of_one_sample_after_the_other():
    rng = np.random.default_rng(3)
    heights = np.geomspace(0.01, 60.0, 11)
    signal = np.repeat(rng.standard_normal((11, 333)) * heights[:, None], 4, axis=1)
    signal[2, :700], signal[4, 900:], signal[[7, 10], 500] = 0.0, 0.0, math.nan
    limits = [Limits(FULL, 0.9 - 0.05 * k, 0.1 + 0.03 * k) for k in range(11)]
    channels = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8, 2]  # a whole group of neighbours, and one row that adds to another
    out = guarded(signal, (300, 64, 7, 1024), limits, channels, {640: lambda safety: safety.level(0.3, 640)})
    level = 1.0 + (0.3 - 1.0) * np.clip((np.arange(signal.shape[1]) - 640.0) / RAMP, 0.0, 1.0)
    plain = np.zeros_like(out)
    for row, limit, channel in zip(signal * FULL, limits, channels, strict=True):
        _limit_plainly(row, limit, level.tolist(), plain[:, channel])
    assert out.tobytes() == plain.tobytes()


def _limit_plainly(acceleration, limit, level, out):
    """The stage's definition, sample by sample, added to float32 `out`."""
    pole = math.exp(-2.0 * math.pi * DC_HZ / RATE)
    burst_share, rms_share, release_share = (1.0 - math.exp(-1.0 / (s * RATE)) for s in (0.05, 0.5, 0.1))
    dc_in = dc_out = burst = mean = 0.0
    limiter = 1.0
    for i, asked in enumerate(acceleration.tolist()):
        now = asked * (1.0 / limit.acceleration_per_unit)
        now = min(max(now, -100.0), 100.0) * level[i] if math.isfinite(now) else 0.0
        if now == dc_in == dc_out == 0.0:
            continue
        y = now - dc_in + pole * dc_out
        dc_in, dc_out = now, y if abs(y) > 1e-12 else 0.0
        burst += burst_share * (y * y - burst)
        burst = burst if burst > 1e-12 else 0.0
        allowed = limit.rms**2 + max(limit.rms**2 - mean, 0.0) * (burst_share / rms_share - 1.0)
        if burst > allowed:
            y *= math.sqrt(allowed / burst)
        limiter = limiter + release_share * (1.0 - limiter)
        limiter = 1.0 if limiter > 1.0 - 1e-12 else limiter
        if abs(y) * limiter > limit.peak:
            limiter = limit.peak / abs(y)
        y *= limiter
        mean += rms_share * (y * y - mean)
        mean = mean if mean > 1e-12 else 0.0
        out[i] = min(max(y + float(out[i]), -limit.peak), limit.peak)
