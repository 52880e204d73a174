"""The texture: its draws follow the law it was tabulated from, and no split or sleep changes its events."""

from itertools import pairwise

import numpy as np
import pytest

from workbench.errors import BadValue
from workbench.kernels import kernel
from workbench.models import friction_texture as texture
from workbench.models.friction import SlipLaw
from workbench.models.random import stream_key

RATE = 48_000.0
VALUES = (0.4, 0.5, 2.0, 0.0)
KEY = stream_key(1, "stick-slip", "t1")


@pytest.fixture(scope="module")
def table():
    return texture.slip_table(*VALUES)


@pytest.fixture(scope="module")
def law():
    zeta, noise, x0, v0 = VALUES
    return SlipLaw.solve(1.0, zeta, noise, 1.0, x0, v0, 100.0, error=1e-4)


def tuned(table, w0=600.0, strength=1.0):
    tuning = np.zeros(texture.tuning_size())
    texture.tune(tuning, table, RATE, w0, strength)
    return tuning


def play(tuning, drive, splits=(), start=0):
    state, events = np.zeros(texture.state_size()), []
    edges = [0, *splits, drive.size]
    for begin, end in pairwise(edges):
        out = np.full(3 * (end - begin), np.nan)
        count = texture.run(state, tuning, KEY, start + begin, drive[begin:end], out)
        events.append(out[: 3 * count].reshape(-1, 3))
    return np.concatenate(events), state


@kernel
def draw_many(tuning, key, out):
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1] = texture.draw(tuning, key, i)


def test_draws_follow_the_tabulated_law(table, law):
    count = 400_000
    drawn = np.empty((count, 2))
    draw_many(tuned(table), KEY, drawn)
    risen = np.arange(1, count + 1) / count
    ended = 1.0 - law.remaining
    # The sample's own noise is 1.6e-3 at most; the table's error is asked as 1e-3.
    for found, values in ((law.duration, drawn[:, 0]), (law.distance, drawn[:, 1])):
        at = np.sort(values)
        assert np.abs(np.interp(at, found.at, found.cdf) / ended - risen).max() < 3.5e-3
    period = np.sort((drawn[:, 0] + drawn[:, 1])[drawn[:, 1] >= 0.0])
    exact = np.interp(period, law.period.t, law.period.cdf) / ended
    assert np.abs(exact - np.arange(1, period.size + 1) / count).max() < 3.5e-3


@pytest.mark.parametrize("block", [1, 7, 64, 1024])
def test_no_split_changes_the_events(table, block):
    drive = np.abs(np.sin(np.arange(9000) / 900.0))
    drive[4000:4300] = 0.0
    tuning = tuned(table)
    whole, state = play(tuning, drive, start=10**9)
    parts, end = play(tuning, drive, range(block, drive.size, block), start=10**9)
    assert len(whole) > 10
    assert np.array_equal(whole, parts)
    assert np.array_equal(state, end)


def test_events_are_sorted_and_at_most_one_a_frame(table):
    # So fast that most periods are shorter than a frame.
    events, _ = play(tuned(table, w0=5e5), np.ones(5000))
    assert len(events) > 2500
    assert np.all(np.diff(np.floor(events[:, 0])) >= 1.0)
    assert np.all(np.isfinite(events))
    assert events[0, 0] >= 0.0
    assert events[-1, 0] < 5000.0


def test_it_sleeps_without_a_drive_and_wakes_as_if_new(table):
    tuning = tuned(table)
    drive = np.ones(12_000)
    drive[:6000] = 0.0
    events, _ = play(tuning, drive)
    late, _ = play(tuning, np.ones(6000), start=6000)
    assert np.array_equal(events, late)
    nothing, state = play(tuning, np.array([1.0, 1.0, 0.0]))
    assert nothing.size == 0
    assert not state.any()
    assert texture.rest(state, tuning) == 0.0
    for silent in (np.zeros(500), np.full(500, np.nan), np.full(500, -3.0)):
        events, state = play(tuning, silent)
        assert events.size == 0
        assert not state.any()


def test_strengths_go_with_the_drive_and_average_to_the_one_asked(table):
    soft, _ = play(tuned(table, strength=0.25), np.full(480_000, 1.0))
    hard, _ = play(tuned(table, strength=0.25), np.full(480_000, 3.0))
    assert np.array_equal(soft[:, [0, 2]], hard[:, [0, 2]])
    assert hard[:, 1] == pytest.approx(3.0 * soft[:, 1])
    assert soft[:, 1].mean() == pytest.approx(0.25, rel=0.05)


def test_a_cycle_is_a_slip_and_the_stick_after_it(table, law):
    events, _ = play(tuned(table, w0=600.0), np.ones(2_000_000))
    cycles = np.diff(events[:, 0]) / RATE * 600.0
    mean = np.trapezoid(law.duration.t * law.duration.density, law.duration.t)
    stick = np.trapezoid(np.maximum(law.distance.at, 0.0) * law.distance.density, law.distance.at)
    assert cycles.mean() == pytest.approx(mean + stick, rel=0.03)
    assert events[:, 2].mean() * 600.0 == pytest.approx(mean, rel=0.05)


def test_a_table_without_slips_is_refused():
    with pytest.raises(BadValue, match=r"^noise is 1e-06"):
        texture.slip_table(0.4, 1e-6, 0.2, 0.0)
