"""A cascade of sections against SciPy's, whatever it is cut into, and the bound on what remains in it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import butter, sosfilt

from underfoot.errors import BadValue
from underfoot.models.filtering.cascade import MAX_SECTIONS, STATE, at_rate, checked, coefficients, run, tail
from underfoot.models.filtering.equaliser import gain

RATE = 48_000.0
BAND = butter(7, [50.0, 750.0], "bandpass", fs=RATE, output="sos")
NOISE = np.random.default_rng(5).standard_normal(4800)


def at_rest():
    return np.zeros(1, STATE)[0]


def through(sections, signal, blocks=(4800,)):
    """The output of a cascade, run in these blocks in turn, and its state after that."""
    s, t, out = at_rest(), coefficients(sections), np.empty(signal.size)
    at = turn = 0
    while at < signal.size:
        n = min(blocks[turn % len(blocks)], signal.size - at)
        run(s, t, signal[at : at + n], out[at : at + n])
        at, turn = at + n, turn + 1
    return out, s, t


def test_it_is_scipys_filter():
    for sections in (BAND, BAND[:1], np.empty((0, 6))):
        expected = sosfilt(sections, NOISE) if len(sections) else NOISE
        np.testing.assert_allclose(through(sections, NOISE)[0], expected, rtol=1e-9, atol=1e-12)


def test_how_it_is_cut_makes_no_difference_to_the_bit():
    whole = through(BAND, NOISE)[0].tobytes()
    for blocks in ((7,), (64,), (1, 500, 33)):
        assert through(BAND, NOISE, blocks)[0].tobytes() == whole


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.integers(1, MAX_SECTIONS))
def test_the_tail_bounds_all_that_follows_and_is_no_empty_bound(seed, count):
    random = np.random.default_rng(seed)
    radius, angle = 1.0 - 10.0 ** random.uniform(-3.5, -0.5, count), random.uniform(0.0, np.pi, count)
    poles = np.stack([np.ones(count), -2.0 * radius * np.cos(angle), radius**2], axis=1)
    sections = np.concatenate([random.standard_normal((count, 3)), poles], axis=1)
    out, s, t = through(sections, NOISE[:600])
    bound = tail(s, t)
    silence = np.zeros(20_000)
    run(s, t, silence, out := np.empty(silence.size))
    assert np.abs(out).max() <= bound * (1.0 + 1e-9)
    assert tail(s, t) < bound
    assert tail(at_rest(), t) == 0.0


def test_at_another_rate_it_is_the_same_filter_where_it_matters():
    f = np.geomspace(20.0, 2000.0, 200)
    for rate in (44_100.0, 96_000.0, 192_000.0):
        moved = np.abs(gain(at_rate(BAND, RATE, rate), f, rate))
        np.testing.assert_allclose(moved, np.abs(gain(BAND, f, RATE)), rtol=0.03, atol=1e-3)
        np.testing.assert_allclose(at_rate(at_rate(BAND, RATE, rate), rate, RATE), BAND, atol=1e-9)


@pytest.mark.parametrize(
    "sections",
    [
        [[1.0, 0.0, 0.0, 1.0, -2.0, 1.0]],
        [[1.0, 0.0, 0.0, 1.0, 0.0, -1.1]],
        [[1.0, 0.0, 0.0, 2.0, 0.0, 0.0]],
        [[np.nan, 0.0, 0.0, 1.0, 0.0, 0.0]],
        [[1.0, 0.0, 0.0]],
        np.tile(BAND[0], (MAX_SECTIONS + 1, 1)),
    ],
)
def test_what_is_no_stable_cascade_is_refused(sections):
    with pytest.raises(BadValue, match="sections is"):
        checked(sections)
    with pytest.raises(BadValue, match="sections is"):
        coefficients(sections)


def test_a_pole_on_the_circle_is_the_edge_of_what_is_allowed():
    """The triangle of (a1, a2) against the roots themselves."""
    random = np.random.default_rng(3)
    for a1, a2 in random.uniform(-2.2, 2.2, (300, 2)):
        stable = np.abs(np.roots([1.0, a1, a2])).max() < 1.0
        try:
            checked([[1.0, 0.0, 0.0, 1.0, a1, a2]])
        except BadValue:
            assert not stable
        else:
            assert stable
