"""Modal banks against closed forms and scipy's filters."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter

from underfoot.errors import BadValue
from underfoot.models.modal import bank, driven_bank, phasors, struck_bank
from underfoot.models.signals.events import event_list

RATE = 48_000.0


def closed_form(frequencies, decays, amplitudes, frames, rate=RATE):
    """Equation 3.4 at whole frames; the phase is reduced before it is rounded."""
    frames = np.asarray(frames)
    out = np.zeros(frames.shape)
    for f, b, a in zip(frequencies, decays, amplitudes, strict=True):
        turns = np.array([f * int(n) % rate for n in frames]) / rate
        out += np.where(frames >= 0, a * np.exp(-b * frames / rate) * np.sin(2 * np.pi * turns), 0.0)
    return out


def some_modes(count, seed=0, lowest=20.0, highest=20_000.0, slowest=0.2, quickest=50.0):
    draw = np.random.default_rng(seed)
    frequencies = np.exp(draw.uniform(np.log(lowest), np.log(highest), count))
    return frequencies, np.sort(draw.uniform(slowest, quickest, count)), draw.normal(size=count)


class Struck:
    """A row of `struck_bank`."""

    def __init__(self, modes, floor=1e-15, rate=RATE):
        sizes = phasors.sizes(len(modes[0]))
        self.coefficients, self.state = (
            struck_bank.COEFFICIENTS.zeros(**sizes),
            struck_bank.STATE.zeros(row=sizes["row"]),
        )
        self.design(modes, floor, rate)

    def design(self, modes, floor=1e-15, rate=RATE):
        struck_bank.design(np.array(modes, dtype=float), 1.0, 1.0, rate, floor, self.coefficients)

    def ring(self, signal, first, out):
        """Ring from frame `first` on, struck where `signal` is not 0."""
        frames = np.flatnonzero(signal)
        struck = event_list(*np.column_stack([first + frames + 0.5, signal[frames]]))
        struck_bank.ring(struck, first, self.coefficients, self.state, out)

    def tail(self):
        return struck_bank.tail(self.state, self.coefficients)


class Driven:
    """A row of `driven_bank`."""

    def __init__(self, modes, floor=1e-15, rate=RATE):
        sizes = driven_bank.sizes(len(modes[0]))
        self.coefficients, self.state = driven_bank.COEFFICIENTS.zeros(**sizes), driven_bank.STATE.zeros(**sizes)
        self.design(modes, floor, rate)

    def design(self, modes, floor=1e-15, rate=RATE):
        driven_bank.design(np.array(modes, dtype=float), rate, floor, self.coefficients)

    def ring(self, signal, first, out):
        """Ring from frame `first` on, driven by `signal`."""
        driven_bank.ring(signal.copy(), first, self.coefficients, self.state, out)

    def tail(self):
        return driven_bank.tail(self.state, self.coefficients)


def ring(row, signal, cuts=()):
    """Ring through `signal`, cut into calls at `cuts`."""
    out = np.empty(signal.size)
    for first, last in pairwise([0, *cuts, signal.size]):
        row.ring(signal[first:last], first, out[first:last])
    return out


def sparse_signal(size, count, seed=0):
    draw = np.random.default_rng(seed)
    signal = np.zeros(size)
    signal[draw.choice(size, count, replace=False)] = draw.normal(size=count)
    return signal


@pytest.mark.parametrize("count", [1, 7, 10, 64])
@pytest.mark.parametrize("strikes", [3, 900])  # events, then every frame
def test_ring_is_the_sum_of_scipys_resonators(count, strikes):
    frequencies, decays, amplitudes = some_modes(count)
    signal = sparse_signal(900, strikes)
    expected = np.zeros(signal.size)
    for f, b, a in zip(frequencies, decays, amplitudes, strict=True):
        pole = np.exp((-b + 2j * np.pi * f) / RATE)
        expected += lfilter([0, a * pole.imag], [1, -2 * pole.real, abs(pole) ** 2], signal)
    np.testing.assert_allclose(
        bank.ring(frequencies, decays, amplitudes, signal, RATE), expected, atol=1e-10 * np.abs(expected).max()
    )


@pytest.mark.parametrize("form", [Struck, Driven])
@pytest.mark.parametrize("rate", [8_000.0, 48_000.0, 192_000.0])
def test_exact_after_ten_seconds(form, rate):
    modes = some_modes(30, lowest=rate / 9_600, highest=0.45 * rate, quickest=1.0)
    modes[0][0], modes[0][1] = 0.25 * rate, rate / 64
    signal = np.zeros(round(10 * rate) + 2_000)
    signal[3] = 1.0
    last = np.arange(signal.size - 2_000, signal.size)
    expected = closed_form(*modes, last - 3, rate)
    error = np.linalg.norm(ring(form(modes, rate=rate), signal)[last] - expected)
    assert error < 1e-9 * np.linalg.norm(expected)


@pytest.mark.parametrize("form", [Struck, Driven])
@pytest.mark.parametrize("count", [1, 12, 37])
def test_the_same_bytes_however_the_frames_are_split(form, count):
    modes = some_modes(count, quickest=2_000.0)
    signal = sparse_signal(2_400, 120)
    signal[800:1_400] = 0.0
    signal[1_600:2_000] = sparse_signal(400, 320)
    whole = form(modes, 1e-4)
    expected = ring(whole, signal)
    draw = np.random.default_rng(1)
    for step in (1, 7, 64, 100, 1_024):
        cuts = range(step, signal.size, step)
        parts = form(modes, 1e-4)
        assert ring(parts, signal, cuts).tobytes() == expected.tobytes()
        assert parts.tail() == whole.tail()
    cuts = np.unique(draw.integers(1, signal.size, 80))
    assert ring(form(modes, 1e-4), signal, cuts).tobytes() == expected.tobytes()


@pytest.mark.parametrize("strikes", [40, 2_500])
def test_both_forms_agree(strikes):
    modes = some_modes(20)
    signal = sparse_signal(3_000, strikes)
    np.testing.assert_allclose(ring(Struck(modes), signal), ring(Driven(modes), signal), atol=1e-11)


@pytest.mark.parametrize("form", [Struck, Driven])
def test_what_has_died_away_is_exactly_zero(form):
    modes = some_modes(10, slowest=100.0, quickest=300.0)
    row = form(modes, 1e-6)
    signal = np.zeros(20_000)
    signal[5] = 1.0
    out = ring(row, signal)
    expected = closed_form(*modes, np.arange(signal.size) - 5)
    assert np.abs(out - expected).max() < 10 * 1e-6
    assert not out[15_000:].any()
    assert not row.state.values.any()
    assert row.tail() == 0.0


def test_the_floor_lets_weak_excitation_build_a_mode_up():
    modes = ([1_000.0], [1.0], [1.0])
    signal = 1e-5 * np.sin(2 * np.pi * 1_000.0 * np.arange(9_600) / RATE)
    for form in (Struck, Driven):
        assert np.abs(ring(form(modes, 1e-3), signal)).max() > 0.03


@pytest.mark.parametrize("form", [Struck, Driven])
@pytest.mark.parametrize("stop", [1, 63, 64, 200, 2_000])
@pytest.mark.parametrize("strikes", [500, 5_000])
def test_the_tail_bounds_what_is_still_to_come(form, stop, strikes):
    modes = some_modes(10, quickest=20.0)
    signal = sparse_signal(6_000, strikes)
    signal[stop:] = 0.0
    row = form(modes)
    ring(row, signal[:stop])
    bound = row.tail()
    out = np.empty(4_000)
    row.ring(np.zeros(4_000), stop, out)
    assert np.abs(out).max() <= bound <= 30 * np.abs(signal[:stop]).sum()


@pytest.mark.parametrize("form", [Struck, Driven])
def test_new_modes_go_on_with_what_rings(form):
    before, after = ([500.0], [0.0], [1.0]), ([700.0], [0.0], [1.0])
    row = form(before)
    signal = np.zeros(960)  # whole turns of 500 Hz from frame 0 on
    signal[0] = 1.0
    ring(row, signal)
    row.design(after)
    out = np.empty(960)
    row.ring(np.zeros(960), 960, out)
    if form is Driven:
        assert np.abs(out).max() == pytest.approx(1.0, rel=0.05)
    else:
        np.testing.assert_allclose(out, closed_form(*after, np.arange(960)), atol=1e-9)


def test_what_was_struck_in_every_frame_rings_at_its_own_pitch_until_there_are_new_modes():
    row, signal = Struck(([500.0], [0.0], [1.0])), sparse_signal(960, 960)
    ring(row, signal)
    row.design(([700.0], [0.0], [1.0]))
    out = np.empty(960)
    row.ring(np.zeros(960), 960, out)
    turns = np.arange(960) / RATE
    phasor = (signal * np.exp(2j * np.pi * 500.0 * turns[::-1])).sum() * np.exp(2j * np.pi * 500.0 / RATE)
    np.testing.assert_allclose(out, (phasor * np.exp(2j * np.pi * 700.0 * turns)).imag, atol=1e-9)


@pytest.mark.parametrize("count", [1, 37])
def test_new_modes_amid_a_block_take_what_was_struck_in_every_frame_as_they_take_each_strike(count):
    def heard(signal):
        row, out = Struck(before), np.empty(signal.size)
        row.ring(signal[:96], 0, out[:96])
        row.design(after)
        row.ring(signal[96:], 96, out[96:])
        return out

    before, after = some_modes(count, highest=2_000.0), some_modes(count, seed=1, highest=2_000.0)
    signal = sparse_signal(192, 192)
    each = sum(heard(np.where(np.arange(192) == frame, signal, 0.0)) for frame in range(192))
    np.testing.assert_allclose(heard(signal), each, atol=1e-11 * np.abs(each).max())


def test_an_event_acts_from_the_frame_its_time_lies_in_and_a_late_one_at_once():
    modes = ([12_000.0], [0.0], [1.0])
    for time, first in ((7.999, 7), (8.0, 8), (-3.0, 0)):
        row, out = Struck(modes), np.empty(16)
        struck_bank.ring(event_list((time, 2.0)), 0, row.coefficients, row.state, out)
        np.testing.assert_allclose(out, 2 * closed_form(*modes, np.arange(16) - first), atol=1e-12)


def test_modes_at_or_above_half_the_rate_are_left_out():
    signal = np.zeros(200)
    signal[0] = 1.0
    for excitation in (signal, signal + 1e-3):
        with_them = bank.ring([300.0, 24_000.0, 30_000.0], [5.0] * 3, [1.0] * 3, excitation, RATE)
        without = bank.ring([300.0], [5.0], [1.0], excitation, RATE)
        np.testing.assert_allclose(with_them, without, atol=1e-14)


def test_nothing_in_nothing_out():
    assert bank.ring([300.0], [5.0], [1.0], [], RATE).size == 0
    assert not bank.ring([300.0], [5.0], [1.0], np.zeros(1_000), RATE).any()
    assert not bank.ring([0.0], [0.0], [1.0], np.ones(1_000), RATE).any()


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"frequencies_hz": [-1.0, 2.0]}, "frequencies_hz"),
        ({"frequencies_hz": [np.nan, 2.0]}, "frequencies_hz"),
        ({"frequencies_hz": []}, "frequencies_hz"),
        ({"frequencies_hz": 100.0}, "frequencies_hz"),
        ({"frequencies_hz": "low"}, "frequencies_hz"),
        ({"decays_per_s": [1.0]}, "decays_per_s"),
        ({"decays_per_s": [-1.0, 1.0]}, "decays_per_s"),
        ({"amplitudes": [1.0, np.inf]}, "amplitudes"),
        ({"amplitudes": [[1.0, 2.0]]}, "amplitudes"),
        ({"excitation": [[1.0, 2.0]]}, "excitation"),
        ({"excitation": [1.0, np.nan]}, "excitation"),
        ({"excitation": None}, "excitation"),
        ({"rate": 0.0}, "rate"),
        ({"rate": np.nan}, "rate"),
        ({"rate": "fast"}, "rate"),
    ],
)
def test_bad_parameters_are_named(change, name):
    good = {
        "frequencies_hz": [100.0, 200.0],
        "decays_per_s": [1.0, 2.0],
        "amplitudes": [1.0, 1.0],
        "excitation": [1.0, 0.0],
        "rate": RATE,
    }
    with pytest.raises(BadValue, match=f"^{name} is .*; allowed: ") as error:
        bank.ring(**{**good, **change})
    assert "\n" not in str(error.value)
