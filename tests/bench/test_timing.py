"""Times are of many runs by turns, over a floor that was looked at in between."""

import numpy as np
import pytest

from underfoot.bench import machine, timing
from underfoot.bench.timing import Run


@pytest.fixture
def clock(monkeypatch):
    """A clock that only calls of `clock.run` move, on a processor that is as slow as `clock.slow` says."""

    class Clock:
        now, slow = 0.0, 1.0

        def run(self, *steps):
            left = iter(steps)

            def call():
                self.now += next(left)

            return Run(call, lambda: self.now)

    found = Clock()
    monkeypatch.setattr(machine, "slowness", lambda: found.slow)
    return found


def test_the_lower_quartile_counts_and_the_first_run_does_not(clock):
    (took,) = timing.timed_in_turn([clock.run(50.0, 1.0, 2.0, 3.0, 4.0, 90.0)], 0.0)
    assert took.seconds == 2.0


def test_runs_take_turns(clock):
    seen = []
    timing.timed_in_turn([Run(lambda name=name: seen.append(name), iter(range(100)).__next__) for name in "ab"], 0.0)
    assert seen == ["a", "b"] * 6


def test_a_slow_processor_shows_in_its_floor_and_not_in_its_best(clock):
    clock.slow = 2.0
    (took,) = timing.timed_in_turn([clock.run(*[3.0] * 6)], 0.0)
    assert (took.seconds, took.slowness, took.at_best, took.spread) == (3.0, 2.0, 1.5, 0.0)


def test_times_that_drift_have_a_spread(clock):
    (took,) = timing.timed_in_turn([clock.run(*np.linspace(1.0, 2.0, 6))], 0.0)
    assert took.spread > 0.3


def test_the_floor_is_that_of_a_processor():
    looks = [machine.slowness() for _ in range(20)]
    assert 0.05 < min(looks) <= max(looks)
