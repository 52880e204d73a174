"""Held against SciPy's matrix exponential and its responses of continuous systems."""

from decimal import Decimal

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.signal import freqs_zpk, lsim

from underfoot.errors import BadValue
from underfoot.models.filtering import poles
from underfoot.models.filtering.poles import Poles, of_biquads, of_outputs

RATE = 48_000.0


def played(system, given, rate=RATE, cuts=()):
    memory = system.at_rate(rate)
    out = np.empty_like(given)
    for a, b in zip((0, *cuts), (*cuts, len(given)), strict=True):
        poles.run(*memory, given[a:b], out[a:b])
    return out


def random_system(seed, n=6):
    """A stable system with complex and real poles, and a direct part."""
    rng = np.random.default_rng(seed)
    a = rng.standard_normal((n, n))
    a -= (np.linalg.eigvals(a).real.max() + 0.3) * np.eye(n)
    return 300.0 * a, rng.standard_normal(n), rng.standard_normal(n), float(rng.standard_normal())


@pytest.mark.parametrize("seed", range(5))
def test_a_drive_that_is_straight_between_samples_is_answered_exactly(seed):
    """The oracle steps the whole system with one matrix exponential, the drive's ramp among the states."""
    a, b, c, d = random_system(seed)
    given = np.random.default_rng(seed).standard_normal(400)
    n, step = len(b), 1.0 / 4000.0
    whole = np.zeros((n + 2, n + 2))
    whole[:n, :n], whole[:n, n], whole[n, n + 1] = a, b, 1.0
    ahead = expm(whole * step)
    x, before, expected = np.zeros(n), 0.0, []
    for now in given:
        x = (ahead @ np.concatenate([x, [before, (now - before) / step]]))[:n]
        expected.append(c @ x + d * now)
        before = now
    np.testing.assert_allclose(played(of_outputs(a, b, [(c, d)])[0], given, 4000.0), expected, rtol=0, atol=1e-11)


def test_scipy_says_the_same_of_a_ramp():
    system = of_biquads([0.0], [-50.0 + 900.0j, -50.0 - 900.0j, -200.0], 1e4)
    time = np.arange(2000) / RATE
    given = np.interp(time, [0.0, 0.01, 0.02, 0.05], [0.0, 1.0, -0.5, 0.2])
    expected = lsim(([0.0], [-50.0 + 900.0j, -50.0 - 900.0j, -200.0], 1e4), given, time)[1]
    np.testing.assert_allclose(played(system, given), expected, atol=1e-10)


@pytest.mark.parametrize("zeros", [[], [0.0, 0.0], [-10 + 500j, -10 - 500j, -30.0]])
def test_the_transfer_is_that_of_zeros_and_poles(zeros):
    own = np.array([-80 + 2000j, -80 - 2000j, -400.0])
    f = np.array([0.0, 3.0, 80.0, 318.0, 4000.0])
    expected = freqs_zpk(zeros, own, 7.0, worN=2 * np.pi * f)[1]
    np.testing.assert_allclose(of_biquads(zeros, own, 7.0).transfer(f), expected, rtol=1e-10, atol=1e-18)


def test_a_sine_comes_out_as_the_transfer_says():
    system = of_biquads([0.0, 0.0], [-30 + 400j, -30 - 400j], 2.0)
    time = np.arange(96_000) / RATE
    heard = played(system, np.sin(2.0 * np.pi * 300.0 * time))[48_000:]
    gain = 2.0 * np.mean(heard * np.exp(-2j * np.pi * 300.0 * time[48_000:])) * 1j
    expected = system.transfer(300.0)
    assert abs(gain / expected - 1.0) < 2e-4  # straight lines between samples take 1.3e-4 off a sine


@pytest.mark.parametrize("cuts", [(1, 2, 3), (7, 64, 71, 900), tuple(range(13, 1000, 13))])
def test_cuts_do_not_change_a_bit(cuts):
    a, b, c, d = random_system(3)
    (system,) = of_outputs(a, b, [(c, d)])
    given = np.random.default_rng(0).standard_normal(1000)
    assert played(system, given).tobytes() == played(system, given, cuts=cuts).tobytes()


def test_it_may_run_in_place():
    a, b, c, d = random_system(4)
    (system,) = of_outputs(a, b, [(c, d)])
    given = np.random.default_rng(0).standard_normal(300)
    expected = played(system, given)
    poles.run(*system.at_rate(RATE), given, given)
    assert given.tobytes() == expected.tobytes()


@pytest.mark.parametrize("speed", [1e-6, 1e-2, 0.29, 0.31, 5.0, 400.0])
def test_very_slow_and_very_fast_poles_are_exact_too(speed):
    """A lag with a pole of `speed` a sample; its step response, which begins as a ramp, has a closed form."""
    system = Poles(np.array([-speed * RATE + 0j]), np.array([speed * RATE + 0j]))
    found = played(system, np.ones(50))
    each = Decimal(speed)
    lead = (1 - (-each).exp()) / each
    expected = [float(1 - lead * (-each * n).exp()) for n in range(50)]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-15)


def test_what_is_neither_driven_nor_heard_is_left_out():
    a = np.diag([-1.0, -2.0, -3.0])
    (kept,) = of_outputs(a, np.array([1.0, 0.0, 1.0]), [(np.array([1.0, 1.0, 0.0]), 0.0)])
    np.testing.assert_allclose(kept.poles, [-1.0])


@pytest.mark.parametrize("bad", [1.0 + 0j, 0.0j, -1.0 - 2.0j])
def test_poles_that_cannot_be_are_refused(bad):
    with pytest.raises(BadValue, match="poles is"):
        Poles(np.array([bad]), np.array([1.0 + 0j]))


def test_more_zeros_than_poles_are_refused():
    with pytest.raises(BadValue, match="zeros is 2"):
        of_biquads([0.0, 0.0], [-1.0], 1.0)
