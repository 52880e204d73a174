"""Is X A or B: what is drawn, what is kept, and what the analysis makes of it."""

import json

import pytest
from scipy import stats

from underfoot.errors import BadValue
from underfoot.experiments.blind_comparison import BlindComparison, chance_p
from underfoot.experiments.trial_files import read_csv, write_csv


def answered(participant, right, of, seed=3):
    """A test in which the first so many answers are right."""
    test = BlindComparison(participant, of, seed, "Gravel", "Wood")
    for k in range(of):
        wrong = "B" if test.x == "A" else "A"
        test.answer(test.x if k < right else wrong, 1.5, 4)
    return test


def test_x_is_drawn_evenly_and_again_the_same_for_seed_and_participant():
    def drawn(participant, seed):
        test, found = BlindComparison(participant, 200, seed), []
        while not test.is_over:
            found.append(test.x)
            test.answer("A", 0.0, 1)
        return found

    assert drawn("P1", 1) == drawn("P1", 1)
    assert drawn("P1", 1) != drawn("P2", 1) != drawn("P2", 2)
    every = [x for seed in range(20) for x in drawn("P1", seed)]
    assert stats.binomtest(every.count("A"), len(every)).pvalue > 1e-3


def test_p_is_that_of_the_binomial_distribution():
    for right, of in ((12, 16), (16, 16), (5, 10), (0, 4)):
        assert chance_p(right, of) == pytest.approx(float(stats.binom.sf(right - 1, of, 0.5)))


@pytest.mark.parametrize("given", [{"trials": 0}, {"trials": 1000}, {"participant": " "}])
def test_what_cannot_be_is_refused(given):
    with pytest.raises(BadValue):
        BlindComparison(**{"participant": "P1", "trials": 4, **given})


def test_analyse_reads_the_answers(underfoot, tmp_path):
    path = tmp_path / "blind.csv"
    tests = [answered("P1", 12, 16), answered("P2", 7, 10)]
    write_csv(path, [row for test in tests for row in test.rows()])
    assert len(read_csv(path)) == 26
    found = json.loads(underfoot("analyse", path, "--json").out)
    table = found[0]["tables"][0]
    rows = {row[0]: dict(zip(table["columns"], row, strict=True)) for row in table["rows"]}
    assert found[0]["title"] == "Blind comparison: A and B"
    assert (rows["P1"]["right"], rows["P1"]["of"], rows["P1"]["which"]) == (12, 16, "Gravel or Wood")
    assert rows["P1"]["p"] == pytest.approx((1820 + 560 + 120 + 16 + 1) / 2**16)  # the ways to be right 12 to 16 times
    assert rows["all"]["p"] == pytest.approx(float(stats.binom.sf(18, 26, 0.5)))
    wilson = stats.binomtest(12, 16).proportion_ci(method="wilson")
    assert (rows["P1"]["95 % from"], rows["P1"]["to"]) == pytest.approx((wilson.low, wilson.high))


def test_one_that_was_stopped_is_read_too(underfoot, tmp_path):
    test = BlindComparison("P1", 16, 5)
    for _ in range(3):
        test.answer("A", 1.0, 2)
    write_csv(tmp_path / "part.csv", test.rows())
    said = underfoot("analyse", tmp_path / "part.csv", "--json")
    assert said.status == 0
    assert json.loads(said.out)[0]["tables"][0]["rows"][0][3] == 3
