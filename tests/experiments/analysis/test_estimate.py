"""Intervals of means and shares against SciPy's, which takes half a second to load, and that analyses do without."""

import subprocess
import sys

import numpy as np
import pytest
from scipy import stats

from underfoot.errors import BadValue
from underfoot.experiments.analysis.estimate import mean_interval, share_interval


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
            "    assert simulate(jobs_of(Protocol.load(path, REGISTRY), path.parent, 1)[0])\n",
        ],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("count", [-1, 11])
def test_a_share_of_more_than_all_is_refused(count):
    with pytest.raises(BadValue, match=f"^count is {count}; allowed: 0 to of, 10$"):
        share_interval("share", count, 10)
