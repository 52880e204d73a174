"""A further sound card in simulated time: its clock is off, its blocks jitter, and still it stays behind the engine."""

import numpy as np
import pytest

from underfoot.devices.outputs import CardChannels, Output
from underfoot.engine.further_card import FurtherCard
from underfoot.models.filtering.resampling import resampled

RATE, BLOCK = 48_000.0, 128
HUM_HZ = 200.0


class Simulated:
    """An engine and a card whose clock is `ppm` off; both ask for four blocks at once, up to 4 ms late."""

    def __init__(self, ppm, seconds, seed=1):
        rng = np.random.default_rng(seed)
        self.now_s = 0.0
        self.card = FurtherCard(CardChannels(Output("card"), 1, 2), RATE, BLOCK, lambda: self.now_s)
        self.card.begin(0.02)
        engine, own = (_times(rate, seconds, rng) for rate in (RATE, RATE * (1.0 + 1e-6 * ppm)))
        whose = np.append(np.zeros(len(engine), bool), np.ones(len(own), bool))
        times = np.append(engine, own)
        order = np.argsort(times, kind="stable")
        self._events = list(zip(times[order], whose[order], strict=True))
        self._written = 0
        self.offsets_s, self.played = [], []

    def run(self, until_s=np.inf):
        out = np.zeros((BLOCK, 4), np.float32)
        while self._events and self._events[0][0] < until_s:
            self.now_s, is_card = self._events.pop(0)
            if is_card:
                address = self.card.fill()
                self.offsets_s.append(self.card.offset_frames / RATE)
                self.played.append(_block_at(address))
            else:
                frames = np.arange(self._written, self._written + BLOCK)
                out[:, 1], out[:, 2] = np.sin(2.0 * np.pi * HUM_HZ * frames / RATE), 0.5
                self.card.write(out, BLOCK)
                self._written += BLOCK
        return np.concatenate(self.played)


def _times(rate_hz, seconds, rng):
    blocks = np.arange(int(seconds * rate_hz / BLOCK))
    return np.maximum.accumulate((blocks // 4) * 4 * BLOCK / rate_hz + rng.uniform(0.0, 0.004, len(blocks)))


def _block_at(address):
    import ctypes

    return np.ctypeslib.as_array((ctypes.c_float * (2 * BLOCK)).from_address(address)).reshape(BLOCK, 2).copy()


@pytest.mark.parametrize("ppm", [200.0, -200.0])
def test_a_clock_that_is_off_is_followed_within_a_millisecond(ppm):
    simulated = Simulated(ppm, seconds=40.0)
    played = simulated.run()
    settled = len(simulated.offsets_s) // 2
    assert np.abs(simulated.offsets_s[settled:]).max() < 0.001
    assert simulated.card.underruns == 0
    assert simulated.card.drift_ppm == pytest.approx(ppm, abs=150.0)
    heard = played[len(played) // 2 :]
    np.testing.assert_allclose(heard[:, 1], 0.5, atol=1e-6)
    assert np.abs(np.diff(heard[:, 0])).max() < 1.01 * 2.0 * np.pi * HUM_HZ / RATE  # no click


def test_an_engine_that_stood_still_is_found_again():
    simulated = Simulated(0.0, seconds=12.0)
    simulated.run(until_s=5.0)
    simulated._events = [(t, is_card) for t, is_card in simulated._events if is_card or t > 5.4]
    played = simulated.run()
    assert simulated.card.underruns >= 1
    assert np.abs(simulated.offsets_s[-100:]).max() < 0.01
    assert np.abs(played[-9_600:, 0]).max() > 0.99


def test_a_panic_is_silence_in_a_millisecond():
    simulated = Simulated(0.0, seconds=4.0)
    simulated.run(until_s=3.0)
    simulated.card.silence(True)
    count = len(simulated.played)
    played = simulated.run()[count * BLOCK :, 1]
    np.testing.assert_allclose(played[:48], 0.5 * np.linspace(1.0, 0.0, 49)[1:], atol=1e-6)
    assert not played[48:].any()


@pytest.mark.parametrize(("hz", "error"), [(100.0, 1e-7), (1000.0, 1e-7), (5000.0, 4e-4)])
def test_a_sine_between_its_samples_is_the_sine(hz, error):
    """The ring holds float32, which is what limits low frequencies."""
    ring = np.sin(2.0 * np.pi * hz * np.arange(4096) / RATE).astype(np.float32)[:, None]
    out = np.zeros((2000, 1), np.float32)
    resampled(ring, 10.3, 1.0002, np.array((1.0, 1.0, 0.0)), out, np.zeros(6))
    place = 10.3 + 1.0002 * np.arange(2000)
    np.testing.assert_allclose(out[:, 0], np.sin(2.0 * np.pi * hz * place / RATE), atol=error + 1e-7)
