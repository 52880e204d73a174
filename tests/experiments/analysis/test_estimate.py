"""Intervals of means and shares against SciPy's, which takes half a second to load, and that analyses do without."""

import subprocess
import sys

import numpy as np
import pytest
from made_studies import preset_protocol
from scipy import stats

from underfoot.errors import BadValue
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.estimate import mean_interval, people_share_interval, share_interval
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.simulation import simulated_rows


@pytest.mark.parametrize("of", [1, 2, 7, 40, 1000])
def test_a_share_has_wilsons_interval(of):
    for count in range(0, of + 1, max(1, of // 50)):
        expected = stats.binomtest(count, of).proportion_ci(method="wilson")
        found = share_interval("x", count, of)
        assert (found.low, found.high) == pytest.approx((expected.low, expected.high), abs=1e-12)
        assert 0.0 <= found.low <= found.value <= found.high <= 1.0


@pytest.mark.parametrize("count", [2, 3, 12, 200])
def test_a_mean_has_students_interval(count):
    values = np.random.default_rng(count).normal(3.0, 2.0, count)
    expected = stats.t.interval(0.95, count - 1, values.mean(), stats.sem(values))
    found = mean_interval("x", values.tolist())
    assert (found.low, found.high) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(("logits", "differ"), [(0.0, 0.8), (1.4, 0.8), (2.9, 0.3), (4.6, 0.8)])
def test_a_share_over_people_is_bounded_and_holds_the_mean_of_all_people(logits, differ):
    """Student's interval went beyond 1, and held 0.99 in half of studies; all answers together held 0.5 in 73 %."""
    random = np.random.default_rng(1)
    truth = np.mean(1.0 / (1.0 + np.exp(-logits - differ * random.standard_normal(100_000))))
    shares = 1.0 / (1.0 + np.exp(-logits - differ * random.standard_normal((500, 12))))
    found = [people_share_interval("x", [(int(k), 16) for k in study]) for study in random.binomial(16, shares)]
    assert np.mean([one.covers(truth) for one in found]) > 0.925
    assert all(0.0 <= one.low <= one.value <= one.high <= 1.0 for one in found)


@pytest.mark.parametrize(
    ("name", "good", "bad"),
    [
        ("identification-impact", {"first_rate": 1.0, "last_rate": 1.0}, {"first_rate": 0.6, "last_rate": 0.6}),
        ("target-selection", {"error_m": 0.001, "reach_spread_s": 0.0}, {"error_m": 0.1}),
        ("free-labels", {"impact_share_it": 1.0}, {"impact_share_it": 0.2}),
    ],
)
def test_shares_over_people_are_within_0_and_1_and_say_how_people_differ(name, good, bad):
    pytest.importorskip("statsmodels")
    protocol = preset_protocol(name)
    truths = [{**truth, "rates_differ": 0.0, "errors_differ": 0.0, "labels_differ": 0.0} for truth in (good, good, bad)]
    rows = [row for k, truth in enumerate(truths) for row in simulated_rows(protocol, k, 1, truth)[0]]
    of = {"All", "By width", "By distance", "Set IT", "Sorts", "Right answers"}
    (found, *_) = analysed(rows, protocol, Settings(bootstrap=0))
    tables = [table for table in found.tables if table.title in of]
    shares = [row[2:5] for table in tables for row in table.rows if str(row[1]).startswith(("rate", "impact IT"))]
    assert shares
    assert all(0.0 <= low <= value <= high <= 1.0 and high - low > 0.4 for value, low, high in shares)


def test_people_are_simulated_without_what_takes_long_to_load():
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys\n"
            "sys.modules['scipy.stats'] = None\n"
            "from underfoot.experiments.protocol import Protocol\n"
            "from underfoot.experiments.simulation import jobs_of, simulate\n"
            "from underfoot.nodes import REGISTRY\n"
            "from underfoot.patch import preset_files\n"
            "for name in ('detection-threshold', 'free-labels', 'target-selection'):\n"
            "    path = preset_files.protocols()[name]\n"
            "    assert simulate(jobs_of(Protocol.load(path), path.parent, 1)[0])\n",
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("count", [-1, 11])
def test_a_share_of_more_than_all_is_refused(count):
    with pytest.raises(BadValue, match=f"^count is {count}; allowed: 0 to of, 10$"):
        share_interval("share", count, 10)
