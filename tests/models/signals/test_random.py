"""Counter-based draws: their distributions, and that neighbouring counters and neighbouring keys are unrelated."""

import numpy as np
import pytest
from scipy import stats

from underfoot.kernels import kernel
from underfoot.models.signals.random import exponential, normal, open_unit, stream_key, uniform

COUNT = 100_000
DRAWS = [uniform, exponential, normal]


@kernel
def fill(which, key, first, step, out):
    """By its number in `DRAWS`: a draw among the arguments would be compiled again in each process."""
    for i in range(out.size):
        counter = first + step * i
        if which == 0:
            out[i] = uniform(key, counter)
        elif which == 1:
            out[i] = exponential(key, counter)
        else:
            out[i] = normal(key, counter)


@kernel
def fill_across_keys(key, step, counter, out):
    for i in range(out.size):
        out[i] = uniform(key + np.uint64(i) * step, counter)


def draws(draw, key=1, first=0, step=1, count=COUNT):
    out = np.empty(count)
    fill(DRAWS.index(draw), np.uint64(key), first, step, out)
    return out


@pytest.mark.parametrize("key", [0, 1, 2**63, 2**64 - 1, int(stream_key(1, "noise", "t1"))])
def test_uniform_draws_are_uniform(key):
    assert stats.kstest(draws(uniform, key), "uniform").pvalue > 1e-3


@pytest.mark.parametrize("step", [2, 32, 1 << 16, 1 << 32])
def test_draws_at_a_stride_of_counters_are_uniform(step):
    assert stats.kstest(draws(uniform, 7, step=step), "uniform").pvalue > 1e-3


@pytest.mark.parametrize("step", [1, 2, 1 << 32, 1 << 63, 0x9E3779B97F4A7C15])
def test_draws_across_neighbouring_keys_are_uniform_and_unrelated(step):
    out = np.empty(COUNT)
    fill_across_keys(np.uint64(3), np.uint64(step), 5, out)
    if step == 1 << 63:
        out = out[:2]
        assert out[0] != out[1]
        return
    assert stats.kstest(out, "uniform").pvalue > 1e-3
    assert abs(np.corrcoef(out[:-1], out[1:])[0, 1]) < 4.5 / np.sqrt(COUNT)


def test_exponential_and_normal_draws_follow_their_distributions():
    assert stats.kstest(draws(exponential, 11), "expon").pvalue > 1e-3
    assert stats.kstest(draws(normal, 12), "norm").pvalue > 1e-3


@pytest.mark.parametrize("lag", [1, 2, 3, 31, 32, 48, 64, 1024])
def test_neighbouring_counters_are_uncorrelated(lag):
    for draw in (uniform, normal):
        x = draws(draw, 13)
        assert abs(np.corrcoef(x[:-lag], x[lag:])[0, 1]) < 4.5 / np.sqrt(COUNT)


@pytest.mark.parametrize("other", [1 ^ 2**32, 0, 2, 1 + 0x9E3779B97F4A7C15, 1 ^ 2**63])
def test_streams_of_related_keys_are_uncorrelated_at_any_small_shift(other):
    a, b = draws(uniform, 1), draws(uniform, other % 2**64)
    for shift in range(-3, 4):
        x, y = a[10 + shift : COUNT - 10 + shift], b[10 : COUNT - 10]
        assert abs(np.corrcoef(x, y)[0, 1]) < 4.5 / np.sqrt(x.size)


def test_consecutive_pairs_fill_the_square_evenly():
    x = draws(uniform, 17).reshape(-1, 2)
    counts, _, _ = np.histogram2d(x[:, 0], x[:, 1], bins=32, range=[[0, 1], [0, 1]])
    assert stats.chisquare(counts.ravel()).pvalue > 1e-3


def test_each_of_the_upper_bits_is_fair():
    bits = (draws(uniform, 19) * 2.0**32).astype(np.uint64)
    for bit in range(32):
        ones = int(((bits >> np.uint64(bit)) & np.uint64(1)).sum())
        assert abs(ones - COUNT / 2) < 4.5 * np.sqrt(COUNT / 4)


def test_extreme_bits_stay_inside_the_open_interval():
    assert open_unit(np.uint64(0)) == 2.0**-53
    assert open_unit(np.uint64(2**64 - 1)) == 1.0 - 2.0**-53


def test_negative_and_huge_counters_are_draws_like_others():
    for first in (-COUNT // 2, 2**62):
        assert stats.kstest(draws(uniform, 23, first=first), "uniform").pvalue > 1e-3


def test_names_make_different_keys_also_where_their_text_joins_alike():
    keys = {int(stream_key(*names)) for names in [("a", "b"), ("ab",), ("a", "b", ""), ("b", "a"), (1, 23), (12, 3)]}
    assert len(keys) == 6
