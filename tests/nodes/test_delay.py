"""The delay against the echoes that its three numbers say."""

import numpy as np
import pytest
from bare_row import BareRow

from underfoot.nodes import REGISTRY

RATE = 48_000
DELAY = REGISTRY["delay"]


def echoes(signal, **parameters):
    row = BareRow(DELAY, RATE, **parameters)
    row.run(0, len(signal), {"signal": signal})
    return row.outputs["out"]


def test_each_echo_is_weaker_by_the_feedback():
    click = np.eye(1, RATE)[0]
    out = echoes(click, time=0.1, feedback=0.5, damping=0.0)
    expected = np.zeros(RATE)
    expected[[4800 * k for k in range(1, 10)]] = 0.5 ** np.arange(9)
    np.testing.assert_allclose(out, expected, atol=1e-12)


def test_a_time_between_two_frames_delays_a_slow_sine_by_so_much():
    at = np.arange(RATE) / RATE
    out = echoes(np.sin(2.0 * np.pi * 20.0 * at), time=0.0100071, feedback=0.0, damping=0.0)
    np.testing.assert_allclose(out[600:], np.sin(2.0 * np.pi * 20.0 * (at - 0.0100071))[600:], atol=1e-6)


@pytest.mark.parametrize("damping", [0.2, 0.9])
def test_echoes_lose_what_the_damping_says(damping):
    out = echoes(np.eye(1, RATE)[0], time=0.1, feedback=0.5, damping=damping)
    first = out[4800:9600]
    np.testing.assert_allclose(first, (1.0 - damping) * damping ** np.arange(4800.0), atol=1e-12)
    assert first.sum() == pytest.approx(1.0)  # what is slow stays
    assert first @ np.arange(4800.0) == pytest.approx(damping / (1.0 - damping))  # frames later, as the doc says


@pytest.mark.parametrize("rate", [8_000, 44_100, 96_000, 192_000])
def test_an_echo_is_as_dull_at_any_rate(rate):
    row = BareRow(DELAY, rate, time=0.1, feedback=0.0, damping=0.9)
    row.run(0, rate, {"signal": np.ones(rate)})
    half_ms_later = int(0.1005 * rate)
    left = 0.9 ** (48_000 * (half_ms_later + 1 - 0.1 * rate) / rate)  # of the step, after as many frames at 48 kHz
    assert row.outputs["out"][half_ms_later] == pytest.approx(1.0 - left, rel=1e-9)


def test_a_new_time_is_come_to_in_a_glide():
    row = BareRow(DELAY, RATE, time=0.1, feedback=0.0, damping=0.0)
    tone = np.sin(2.0 * np.pi * 30.0 * np.arange(RATE) / RATE)
    row.run(0, RATE // 2, {"signal": tone[: RATE // 2]})
    before = row.outputs["out"][-1]
    row.controls.values[0] = 0.2
    row.run(RATE // 2, RATE // 2, {"signal": tone[RATE // 2 :]})
    out = np.append(before, row.outputs["out"])
    assert np.abs(np.diff(out)).max() <= 1.5 * 2.0 * np.pi * 30.0 / RATE * 1.001
    np.testing.assert_allclose(out[-4800:], tone[-4800 - 9600 : -9600], atol=1e-9)
