"""A further sound card in simulated time: its clock is off, its blocks jitter, and still it stays behind the engine."""

from collections import deque

import numpy as np
import pytest

from underfoot.bench.stress.simulated_cards import HUM_HZ, SimulatedCards
from underfoot.clock import RATE_HZ
from underfoot.models.filtering.resampling import resampled


@pytest.mark.parametrize("ppm", [200.0, -200.0])
def test_a_clock_that_is_off_is_followed_within_a_millisecond(ppm):
    simulated = SimulatedCards(ppm, seconds=40.0)
    played = simulated.run()
    settled = len(simulated.offsets_s) // 2
    assert np.abs(simulated.offsets_s[settled:]).max() < 0.001
    assert simulated.card.underruns == 0
    assert simulated.card.drift_ppm == pytest.approx(ppm, abs=150.0)
    heard = played[len(played) // 2 :]
    np.testing.assert_allclose(heard[:, 1], 0.5, atol=1e-6)
    assert np.abs(np.diff(heard[:, 0])).max() < 1.01 * 2.0 * np.pi * HUM_HZ / RATE_HZ  # no click


def test_an_engine_that_stood_still_is_found_again():
    simulated = SimulatedCards(0.0, seconds=12.0)
    simulated.run(until_s=5.0)
    simulated.events = deque((t, is_card) for t, is_card in simulated.events if is_card or t > 5.4)
    played = simulated.run()
    assert simulated.card.underruns >= 1
    assert np.abs(simulated.offsets_s[-100:]).max() < 0.01
    assert np.abs(played[-9_600:, 0]).max() > 0.99


def test_a_panic_is_silence_in_a_millisecond_and_no_underrun_where_the_engine_stops():
    """As it does until a card that has come is open: a floor of two cards said that it had 17."""
    simulated = SimulatedCards(0.0, seconds=4.0)
    simulated.run(until_s=3.0)
    simulated.events = deque((t, is_card) for t, is_card in simulated.events if is_card)
    simulated.card.silence(on=True)
    played = simulated.run()[:, 1]
    np.testing.assert_allclose(played[:48], 0.5 * np.linspace(1.0, 0.0, 49)[1:], atol=1e-6)
    assert not played[48:].any()
    assert simulated.card.underruns == 0


@pytest.mark.parametrize(("hz", "error"), [(100.0, 1e-7), (1000.0, 1e-7), (5000.0, 4e-4)])
def test_a_sine_between_its_samples_is_the_sine(hz, error):
    """The ring holds float32, which is what limits low frequencies."""
    ring = np.sin(2.0 * np.pi * hz * np.arange(4096) / RATE_HZ).astype(np.float32)[:, None]
    out = np.zeros((2000, 1), np.float32)
    resampled(ring, 10.3, 1.0002, np.array((1.0, 1.0, 0.0)), out, np.zeros(6))
    place = 10.3 + 1.0002 * np.arange(2000)
    np.testing.assert_allclose(out[:, 0], np.sin(2.0 * np.pi * hz * place / RATE_HZ), atol=error + 1e-7)
