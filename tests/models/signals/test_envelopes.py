"""Envelopes against their closed forms and scipy's bilinear transform."""

import numpy as np
import pytest
from event_rows import within
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import signal

from underfoot.errors import BadValue
from underfoot.models.filtering import second_order
from underfoot.models.signals import envelopes
from underfoot.models.signals.envelopes import attack_decay
from underfoot.models.signals.events import event_list

RATE = 48000.0
SPLITS = (1, 7, 32, 64, 1024)


def note(attack_s=0.01, decay_s=0.03, duration_s=0.1, amplitude=1.0):
    coefficients = envelopes.NOTE_COEFFICIENTS.zeros()
    envelopes.design_note(attack_s, decay_s, duration_s, amplitude, RATE, coefficients)
    return coefficients


def notes(events, coefficients, frames, block=None, state=None, start=0):
    """Run the note kernel in blocks, giving each block the events of its own frames."""
    state = envelopes.NOTE_STATE.zeros() if state is None else state
    y = np.empty(frames)
    events = np.asarray(events, dtype=np.float64).reshape(-1, 3)
    for first in range(0, frames, block or frames):
        count = min(block or frames, frames - first)
        mine = event_list(*within(events, start + first, start + first + count))
        envelopes.run_note(mine, RATE, start + first, coefficients, state, y[first : first + count])
    return y


@pytest.mark.parametrize("onset", [100.0, 100.25, 100.999])
def test_a_note_is_the_closed_form_to_the_fraction_of_a_frame(onset):
    y = notes([onset, 0.8, 0.2], note(amplitude=1.5), 20000)
    exact = attack_decay(np.arange(20000) / RATE, onset / RATE, 0.2, 1.2, 0.01, 0.03)
    assert np.abs(y - exact).max() < 1e-9
    assert np.flatnonzero(y)[0] == 101


def test_the_closed_form_has_its_times():
    t = np.array([-1.0, 0.0, 0.005, 0.01, 0.05, 0.07, 0.085, 0.1, 1.0])
    exact = [0.0, 0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 0.0, 0.0]
    np.testing.assert_allclose(attack_decay(t, 0.0, 0.1, 2.0, 0.01, 0.03), exact, atol=1e-12)


def test_attack_and_decay_of_0_take_half_a_millisecond():
    exact = attack_decay(np.arange(6000) / RATE, 0.0, 0.1, 1.0, 0.5e-3, 0.5e-3)
    np.testing.assert_allclose(notes([0.0, 1.0, 0.1], note(0.0, 0.0), 6000), exact, atol=1e-9)


def test_segments_that_do_not_fit_are_shortened_in_proportion():
    y = notes([0.0, 1.0, 0.02], note(0.03, 0.01), 2000)
    assert y.argmax() == round(0.015 * RATE)
    assert y[960:].max() == 0.0
    exact = attack_decay(np.arange(2000) / RATE, 0.0, 0.02, 1.0, 0.03, 0.01)
    assert np.abs(y - exact).max() < 1e-9


def test_an_event_of_unknown_duration_takes_the_designed_one():
    short = note(duration_s=0.05)
    np.testing.assert_array_equal(notes([3.0, 1.0, 0.0], short, 5000), notes([3.0, 1.0, 0.05], short, 5000))


@pytest.mark.parametrize("block", SPLITS)
def test_any_split_gives_the_same_bits(block):
    events = [10.5, 1.0, 0.1, 1000.25, 0.3, 0.0, 1003.0, 2.0, 0.01, 3000.0, 0.5, 0.02]
    coefficients, start = note(), 10**9
    shifted = np.array(events)
    shifted[::3] += start
    ask_nothing, in_blocks = envelopes.NOTE_STATE.zeros(), envelopes.NOTE_STATE.zeros()
    whole = notes(shifted, coefficients, 8192, state=ask_nothing, start=start)
    np.testing.assert_array_equal(notes(shifted, coefficients, 8192, block, in_blocks, start), whole)
    np.testing.assert_array_equal(in_blocks.values, ask_nothing.values)


@settings(max_examples=60)
@given(
    st.lists(st.tuples(st.floats(0, 4000), st.floats(0, 2), st.floats(0, 0.05)), min_size=1, max_size=8),
    st.floats(0, 0.02),
    st.floats(0, 0.02),
)
@example([(0.0, 2.0, 0.0), (6.5, 0.0, 0.0)], 0.0, 0.0)  # begun behind a frame, from where the first one is by then
def test_retriggering_never_clicks_and_the_tail_bounds_what_follows(raw, attack_s, decay_s):
    events = [event for i, event in enumerate(sorted(raw)) if i == 0 or event[0] - sorted(raw)[i - 1][0] >= 1.0]
    c, state = note(attack_s, decay_s, 0.02), envelopes.NOTE_STATE.zeros()
    y = notes(np.array(events).ravel(), c, 4096, state=state)
    # The steepest raised cosine: pi/2 of its height in the shortest segment, itself no shorter than one frame.
    lengths = [max((d or 0.02) * RATE, 2.0) for _, _, d in events]
    shortest = min(min(24.0, length * min(c.attack, c.decay) / (c.attack + c.decay)) for length in lengths)
    assert np.abs(np.diff(y)).max() <= min(1.0, np.pi / 2 / shortest) * 2.0 + 1e-12
    bound = envelopes.tail_note(state)
    tail = notes([], c, 6000, state=state, start=4096)
    assert np.abs(tail).max() <= bound + 1e-15
    assert tail[-1] == 0.0
    assert not state.values.any()
    assert envelopes.tail_note(state) == 0.0


def test_a_louder_note_rises_from_the_present_value():
    y = notes([0.0, 0.5, 0.1, 2400.0, 1.0, 0.1], note(0.01, 0.01), 4000)
    assert y[2400] == 0.5
    assert (np.diff(y[2400:2880]) > 0).all()
    assert y[2880] == 1.0


@pytest.mark.parametrize(("arguments", "name"), [((0.0, 1, 0.1, 0.1), "duration_s"), ((1.0, 1, -1, 0.1), "attack_s")])
def test_bad_values_are_named(arguments, name):
    with pytest.raises(BadValue, match=f"^{name} is "):
        attack_decay([0.0], 0.0, *arguments)


@pytest.mark.parametrize("block", SPLITS)
def test_the_constant_envelope_ramps_in_five_milliseconds_and_ends_at_zero(block):
    force = np.where((np.arange(3000) >= 100) & (np.arange(3000) < 2000), 300.0, 0.0)
    coefficients, state = envelopes.CONTACT_COEFFICIENTS.zeros(), envelopes.CONTACT_STATE.zeros()
    y = np.empty(3000)
    envelopes.design_contact(RATE, coefficients)
    for first in range(0, 3000, block):
        part = slice(first, min(first + block, 3000))
        envelopes.run_contact(force[part], coefficients, state, y[part])
        if part.stop <= 2000 < part.stop + block:
            assert envelopes.tail_contact(state, coefficients) == pytest.approx(1.0 - 1 / 240)
    frames = np.arange(3000)
    exact = np.clip((frames - 99) / 240, 0, 1) * np.clip((2240 - 1 - frames) / 240, 0, 1)
    assert np.abs(y - exact).max() < 1e-12
    assert y[2240:].max() == 0.0
    assert envelopes.tail_contact(state, coefficients) == 0.0


def layer(mass_kg=1.0, damping=1.0):
    coefficients = second_order.COEFFICIENTS.zeros()
    envelopes.design_strain_rate(12.5, damping, mass_kg, RATE, coefficients)
    return coefficients


def strain_rate(force, choice=envelopes.SIGNED, mass_kg=1.0, damping=1.0, block=None, state=None):
    coefficients, y = layer(mass_kg, damping), np.empty(force.size)
    state = second_order.STATE.zeros() if state is None else state
    for first in range(0, force.size, block or force.size):
        part = slice(first, min(first + (block or force.size), force.size))
        second_order.run(force[part], coefficients, state, y[part])
        envelopes.take_part(choice, y[part])
    return y


@pytest.mark.parametrize("damping", [0.3, 1.0, 2.0])
def test_the_dynamic_envelope_is_the_bilinear_transform_of_the_layer(damping):
    force = np.random.default_rng(1).normal(size=20000)
    w0 = 2 * np.pi * 12.5
    exact = signal.lfilter(*signal.bilinear([1, 0], [1, 2 * damping * w0, w0 * w0], RATE), force)
    y = strain_rate(force, damping=damping)
    assert np.abs(y - exact).max() < 1e-9 * np.abs(exact).max()


def test_its_step_response_is_the_closed_form_and_peaks_at_12_73_ms():
    w0 = 2 * np.pi * 12.5
    y = strain_rate(np.ones(9600))
    # The bilinear transform sees a step as a ramp over the frame before it, so time runs from half a frame earlier.
    t = (np.arange(9600) + 0.5) / RATE
    assert np.abs(y - t * np.exp(-w0 * t)).max() < 1e-5 * y.max()
    assert t[y.argmax()] == pytest.approx(12.73e-3, abs=1 / RATE)
    assert 750.0 * strain_rate(np.ones(9600), mass_kg=envelopes.STRAIN_MASS_KG).max() == pytest.approx(1.0, rel=1e-5)


def test_a_steady_force_leaves_nothing():
    y = strain_rate(np.full(96000, 750.0))
    assert abs(y[-1]) < 1e-9


def test_absolute_and_positive_part_follow_the_signed_rate():
    force = 700.0 * np.sin(np.pi * np.arange(40000) / 30000).clip(0)
    signed = strain_rate(force)
    assert signed.min() < -0.5 * signed.max()
    np.testing.assert_array_equal(strain_rate(force, envelopes.ABSOLUTE), np.abs(signed))
    np.testing.assert_array_equal(strain_rate(force, envelopes.POSITIVE), np.maximum(signed, 0))
    for block in SPLITS[1:]:
        np.testing.assert_array_equal(strain_rate(force, block=block), signed)
