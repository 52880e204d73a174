"""How far two cards are apart is heard in a tone that both played, each by its own clock."""

from pathlib import Path

import numpy as np
import pytest

from underfoot.bench.stress import two_clocks
from underfoot.bench.stress.timed_sinks import TimedSink
from underfoot.clock import RATE_HZ

HZ = two_clocks.TONE_HZ


def played(folder, ppm, began_s, late_s, seconds=30.0):
    """A card that began at a time of the system's clock, and whose tone is so much later, as a function of that."""
    card = TimedSink(folder, f"card {ppm:g}", 2, ppm)
    time_s = began_s + np.arange(round(seconds * RATE_HZ)) / card.rate_hz
    sound = np.sin(2.0 * np.pi * HZ * (time_s - late_s(time_s))).astype(np.float32)
    card.samples = lambda: (began_s, sound)
    return card


def test_a_card_that_lags_more_and_more_is_heard(tmp_path: Path):
    first = played(tmp_path, 0.0, 100.0, lambda time_s: 0.0 * time_s)
    second = played(tmp_path, 200.0, 100.313, lambda time_s: 0.004 + 1e-4 * (time_s - 100.0))
    at_s, apart_s = two_clocks.apart_s(first, second, 20.0)
    assert len(apart_s) == len(at_s) == 40
    assert at_s[0] == pytest.approx(100.0 + 8.0, abs=0.1)
    moved_ms = 1e3 * (apart_s - apart_s[0])
    np.testing.assert_allclose(moved_ms, 0.1 * two_clocks.STRETCH_S * np.arange(40), atol=2e-3)
    assert apart_s[0] == pytest.approx(0.004 + 1e-4 * 8.2, abs=2e-4)


def test_two_clocks_in_simulated_time_are_within_a_millisecond():
    tried = two_clocks.simulated(60.0)
    assert tried.passed, tried.found
