"""Pairs: which come, what people with known answers tell, and the figures beside SciPy's."""

from collections import Counter

import numpy as np
import pytest
from made_studies import TD, made_protocol, trials, walked
from scipy import stats
from scipy.spatial import distance, procrustes

from underfoot.errors import BadValue
from underfoot.experiments.analysis.analyses import analysed, estimates_of_people
from underfoot.experiments.analysis.pairs import classical_scaling, d_prime_same_different
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.duration import usual_s
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.study import Study

GROUNDS = {"sand": TD, "snow": {**TD, "patch": "stimulus-wd"}, "ice": {**TD, "patch": "stimulus-sd"}}


def pairs(blocks=2, judged="dissimilarity", **stage):
    return made_protocol("pairs", {"blocks": blocks, "judged": judged}, GROUNDS, **stage)


def presented(protocol):
    found = trials(walked(Study(protocol, "P1")))
    return [(trial.block, *(one.stimulus for one in trial.intervals)) for trial in found]


def test_each_pair_comes_once_a_block_and_turned_in_the_next():
    blocks = [{(one, other) for of, one, other in presented(pairs()) if of == block} for block in (1, 2)]
    assert {frozenset(pair) for pair in blocks[0]} == {frozenset(p) for p in (("sand", "snow"), ("sand", "ice"),
                                                                              ("snow", "ice"))}  # fmt: skip
    assert blocks[1] == {pair[::-1] for pair in blocks[0]}
    assert usual_s(pairs(), pairs().stages[0]) == pytest.approx(6 * (2 * 0.3 + 0.5 + 2.5))


def test_half_are_the_same_and_who_is_told_reads_which_was_right():
    protocol = pairs(1, "same", feedback=True)
    counts = Counter(presented(protocol))
    assert {(pair[1] == pair[2], count) for pair, count in counts.items()} == {(True, 2), (False, 1)}
    assert len(counts) == 9
    assert usual_s(protocol, protocol.stages[0]) == pytest.approx(12 * (2 * 0.3 + 0.5 + 2.5))
    study = Study(protocol, "P1")
    told = [page.feedback for page in (*walked(study, lambda page: {"same": "yes"})[1:], study.page)]
    are_same = [len({one.stimulus for one in entry.trial.intervals}) == 1 for entry in study.entries]
    assert told == [f"The last one: {'right' if same else 'wrong'}." for same in are_same]


def test_d_prime_is_that_of_normal_differences_and_its_interval_ends_where_the_likelihood_does():
    truth, tolerance, root = 1.5, 1.2, np.sqrt(2.0)

    def rates(d, k):
        return [stats.norm.sf(k, far, root) + stats.norm.cdf(-k, far, root) for far in (d, 0.0)]

    of = 10**6
    large = d_prime_same_different("d'", *((round(rate * of), of) for rate in rates(truth, tolerance)))
    assert large.value == pytest.approx(truth, abs=0.01)
    found = d_prime_same_different("d'", (28, 40), (12, 40))
    k = np.linspace(0.01, 6.0, 2001)

    def likelihood(d):
        hits, false_alarms = rates(d, k)
        return np.max(28.5 * np.log(hits) + 12.5 * np.log(1 - hits) + 12.5 * np.log(false_alarms)
                      + 28.5 * np.log(1 - false_alarms))  # fmt: skip

    falls = [likelihood(found.value) - likelihood(end) for end in (found.low, found.high)]
    assert falls == pytest.approx([stats.chi2.ppf(0.95, 1) / 2.0] * 2, abs=1e-4)


@pytest.mark.parametrize("counts", [((10, 10), (0, 10)), ((3, 10), (6, 10)), ((0, 10), (0, 10)), ((10, 10), (10, 10))])
def test_who_is_never_wrong_or_worse_than_chance_has_a_finite_interval(counts):
    found = d_prime_same_different("d'", *counts)
    assert 0.0 <= found.low <= found.value < found.high < 20.0
    assert (found.value > 0.0) == (counts[0] > counts[1])


def test_a_map_has_the_distances_that_were_told():
    places = np.random.default_rng(1).standard_normal((6, 2))
    found, share = classical_scaling(distance.squareform(distance.pdist(places)))
    assert procrustes(places, found)[2] == pytest.approx(0.0, abs=1e-12)
    assert share == pytest.approx(1.0)


def test_people_with_known_answers_have_their_means_a_map_and_a_row_of_estimates():
    protocol = pairs(6)
    rows = [row for k in range(5) for row in simulated_rows(protocol, k, 1, {"dissimilar": 40.0})[0]]
    (found,) = analysed(rows, protocol, Settings())
    assert [table.title for table in found.tables] == [
        "Means over people", "Mean dissimilarities", "Map", "Dissimilarities of each person",
    ]  # fmt: skip
    means = {(one, other): [] for one, other in (("sand", "snow"), ("sand", "ice"), ("snow", "ice"))}
    for row in rows:
        means[next(pair for pair in means if set(pair) == {row["stimulus"], row["other"]})].append(row["dissimilarity"])
    expected = [np.mean(of) for of in means.values()]
    assert [line[2] for line in found.tables[0].rows] == pytest.approx(expected)
    assert found.tables[1].rows[0][1:] == pytest.approx((0.0, *expected[:2]))
    (drawn,) = found.drawings
    assert drawn.series[0].labels == ("sand", "snow", "ice")
    assert list(estimates_of_people(rows, protocol, Settings())[0]) == [
        "participant", *(f"main.dissimilarity {one} {other}" for one, other in means),
    ]  # fmt: skip


@pytest.mark.parametrize("left_out", [("sand", "ice"), ("sand",)])
def test_answers_that_lack_a_pair_or_are_of_two_stimuli_have_no_map(left_out):
    """As of a session that goes on: what is known of it is drawn after each answer."""
    rows = simulated_rows(pairs(), 0, 1, {})[0]
    kept = [row for row in rows if not set(left_out) <= {row["stimulus"], row["other"]}]
    (found,) = analysed(kept, pairs(), Settings())
    assert (found.drawings, len(found.remarks)) == ([], 1)
    assert found.remarks[0].startswith("No map: ")


def test_d_prime_of_a_pair_is_beside_each_of_its_own_two_beside_itself():
    """All is told rightly, but that sand is never felt to be the same as itself: what is beside sand is as nothing."""
    protocol = pairs(3, "same")
    rows = [
        {**row, "same": "yes" if row["stimulus"] == row["other"] != "sand" else "no"}
        for row in simulated_rows(protocol, 0, 1, {})[0]
    ]
    (found,) = estimates_of_people(rows, protocol, Settings())
    best, half = (d_prime_same_different("", (6, 6), (wrong, 12)).value for wrong in (0, 6))
    expected = {"main.d' sand snow": half, "main.d' sand ice": half, "main.d' snow ice": best}
    assert found == {"participant": "S1", **expected}


def test_people_who_tell_the_same_from_the_different_have_their_d_prime():
    protocol = pairs(40, "same")
    rows = [row for k in range(3) for row in simulated_rows(protocol, k, 1, {"apart": 2.0})[0]]
    (found,) = analysed(rows, protocol, Settings())
    assert [line[1:3] for line in found.tables[0].rows] == [
        (f"d' {pair}", pytest.approx(2.0, abs=0.4)) for pair in ("sand snow", "sand ice", "snow ice")
    ]
    with pytest.raises(BadValue, match=r"same is 'perhaps'; allowed: yes or no$"):
        analysed([{**rows[0], "same": "perhaps"}], protocol, Settings())
