"""Binomial and Poisson counts against their distributions."""

import numpy as np
import pytest
from scipy import stats

from underfoot.kernels import kernel
from underfoot.models.fibre_bundle.counts import binomial, poisson

DRAWS = 60_000


@kernel
def binomials(trials, chance, key, out):
    for i in range(out.size):
        out[i] = binomial(key, i * 64, trials, chance)


@kernel
def poissons(mean, key, out):
    for i in range(out.size):
        out[i] = poisson(key, i * 64, mean)


def agreement(drawn, distribution):
    """The chi-square p-value of the counts `drawn` in about forty equally likely bins of `distribution`."""
    edges = np.unique(distribution.ppf(np.linspace(0.0, 1.0, 41)[1:-1]))
    wanted = np.diff(np.concatenate(([0.0], distribution.cdf(edges), [1.0]))) * drawn.size
    found = np.histogram(drawn, np.concatenate(([-np.inf], edges + 0.5, [np.inf])))[0]
    rare = wanted < 10.0
    wanted = np.append(wanted[~rare], wanted[rare].sum())
    found = np.append(found[~rare], found[rare].sum())
    keep = wanted > 0.0
    assert not found[~keep].any()
    return stats.chisquare(found[keep], wanted[keep]).pvalue


@pytest.mark.parametrize(
    ("trials", "chance"),
    [(1, 0.3), (3, 0.6), (21, 0.48), (40, 0.9), (5000, 0.3), (10**6, 4e-4), (10**7, 2e-7), (10**12, 0.2)],
)
def test_binomial_counts_follow_their_distribution(trials, chance):
    drawn = np.zeros(DRAWS)
    binomials(float(trials), chance, np.uint64(trials), drawn)
    assert agreement(drawn, stats.binom(trials, chance)) > 1e-3


@pytest.mark.parametrize("mean", [0.01, 0.9, 9.99, 10.01, 14.3, 300.0, 1e4, 1e9])
def test_poisson_counts_follow_their_distribution(mean):
    drawn = np.zeros(DRAWS)
    poissons(mean, np.uint64(7), drawn)
    assert agreement(drawn, stats.poisson(mean)) > 1e-3


def test_the_edges_need_no_draw():
    key = np.uint64(1)
    assert binomial(key, 0, 0.0, 0.5) == binomial(key, 0, -1.0, 0.5) == binomial(key, 0, 9.0, 0.0) == 0.0
    assert binomial(key, 0, 9.0, 1.0) == 9.0
    assert binomial(key, 0, 9.0, 1e-320) == 0.0
    assert poisson(key, 0, 0.0) == poisson(key, 0, -1.0) == 0.0


def test_the_same_key_and_counter_give_the_same_count():
    key = np.uint64(5)
    counts = [binomial(key, 640, 1e6, 0.3) for _ in range(3)]
    assert counts[0] == counts[1] == counts[2] != binomial(key, 704, 1e6, 0.3)
