"""The texture: its cycles have the distribution, its signal moves the block by its events, and no split shows."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from event_rows import rows_of

from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key
from underfoot.models.stick_slip import texture
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.quantile_table import slip_table
from underfoot.models.stick_slip.slip_distribution import SlipDistribution

RATE = 48_000.0
VALUES = (0.4, 0.5, 2.0, 0.0)
KEY = stream_key(1, "stick-slip", "t1")


@cache
def table():
    return slip_table(*VALUES)


def designed(w0=600.0):
    coefficients = texture.COEFFICIENTS.zeros()
    texture.design(w0, RATE, coefficients)
    return coefficients


def play(coefficients, drive, splits=(), start=0):
    """Acceleration [frames], events [events, 3], and the state that is left."""
    state, signal, found = texture.STATE.zeros(), np.full(drive.size, np.nan), []
    for begin, end in pairwise([0, *splits, drive.size]):
        events = event_list(room=end - begin)
        texture.run(drive[begin:end], table(), KEY, start + begin, coefficients, state, signal[begin:end], events)
        found.append(rows_of(events))
    return signal, np.concatenate(found), state.values


@pytest.mark.parametrize("block", [1, 7, 64, 1024])
def test_no_split_changes_anything(block):
    drive = np.abs(np.sin(np.arange(2000) / 300.0))
    drive[1000:1100] = 0.0
    whole, events, state = play(designed(w0=3000.0), drive, start=10**9)
    parts, as_many, end = play(designed(w0=3000.0), drive, range(block, drive.size, block), start=10**9)
    assert len(events) > 10
    assert whole.tobytes() == parts.tobytes()
    assert np.array_equal(events, as_many)
    assert np.array_equal(state, end)


def test_events_are_sorted_and_at_most_one_a_frame():
    # So fast that most periods are shorter than a frame.
    signal, events, _ = play(designed(w0=5e5), np.ones(5000))
    assert len(events) > 2500
    assert np.all(np.diff(np.floor(events[:, 0])) >= 1.0)
    assert np.all(np.isfinite(events))
    assert np.all(np.isfinite(signal))
    assert events[0, 0] >= 0.0
    assert events[-1, 0] < 5000.0


def test_it_sleeps_without_a_drive_and_wakes_as_if_new():
    drive = np.ones(12_000)
    drive[:6000] = 0.0
    signal, events, _ = play(designed(), drive)
    late, late_events, _ = play(designed(), np.ones(6000), start=6000)
    assert not signal[:6000].any()
    assert signal[6000:].tobytes() == late.tobytes()
    assert np.array_equal(events, late_events)
    for silent in (np.zeros(500), np.full(500, np.nan), np.full(500, -3.0)):
        signal, events, state = play(designed(), silent)
        assert events.size == 0
        assert not signal.any()
        assert not state.any()


def test_all_goes_with_the_drive():
    soft, few, _ = play(designed(), np.full(48_000, 1.0))
    hard, many, _ = play(designed(), np.full(48_000, 3.0))
    assert np.array_equal(few[:, [0, 2]], many[:, [0, 2]])
    assert many[:, 1] == pytest.approx(3.0 * few[:, 1])
    assert hard == pytest.approx(3.0 * soft)


def test_an_event_of_mean_distance_has_strength_one():
    _, events, _ = play(designed(), np.ones(480_000))
    assert events[:, 1].mean() == pytest.approx(1.0, rel=0.05)


def test_the_signal_takes_the_block_back_by_each_slip_and_leaves_it_at_the_belt_velocity():
    w0 = 200.0
    signal, events, _ = play(designed(w0), np.ones(200_000))
    velocity = np.concatenate([[0.0], np.cumsum(signal)]) / RATE  # less v_b, in its units, at the frames' edges
    ends = events[:, 0] + events[:, 2] * RATE
    whole = ends < 199_000
    assert whole.sum() > 50
    for k in np.flatnonzero(whole[:-1]):
        begin, end, onset = int(events[k, 0]), int(np.ceil(ends[k])), int(events[k + 1, 0])
        if onset <= end:
            continue
        assert velocity[end] == pytest.approx(0.0, abs=1e-9)
        assert not signal[end + 1 : onset].any()
        # Distance in units of v_b/w0: what the belt goes in the slip, less what the block does (to the frame's square).
        way = -velocity[begin : end + 1].sum() / RATE * w0
        distance = way - events[k, 2] * w0
        stick = (events[k + 1, 0] - ends[k]) / RATE * w0
        assert distance == pytest.approx(stick, abs=1e-3 * max(1.0, way))


def test_a_cycle_is_a_slip_and_the_stick_after_it():
    zeta, noise, x0, v0 = VALUES
    slip = SlipDistribution.solve(BlockOnBelt(1.0, zeta, noise, 1.0, x0, v0), 100.0, error=1e-4)
    _, events, _ = play(designed(w0=600.0), np.ones(2_000_000))
    cycles = np.diff(events[:, 0]) / RATE * 600.0
    mean = np.trapezoid(slip.duration.points * slip.duration.density, slip.duration.points)
    stick = np.trapezoid(np.maximum(slip.distance.points, 0.0) * slip.distance.density, slip.distance.points)
    assert cycles.mean() == pytest.approx(mean + stick, rel=0.03)
    assert events[:, 2].mean() * 600.0 == pytest.approx(mean, rel=0.05)
    begins = range(0, 300_000, 1000)
    first = [play(designed(w0=600.0), np.ones(8000), start=k)[1][0, 0] - k for k in begins]
    assert np.mean(first) / RATE * 600.0 == pytest.approx(stick, rel=0.1)  # a contact begins with a complete stick
