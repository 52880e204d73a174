"""What accelerometers hear on a card's inputs is found again where the card or a sound server loses frames."""

import numpy as np
import pytest

from underfoot.devices.accelerometers import Accelerometer
from underfoot.engine.accelerometer_reader import CardReader
from underfoot.engine.rings import Reader
from underfoot.engine.session_memory import SessionMemory
from underfoot.floor.layout import default_floor

RATE, BLOCK, FULL_SCALE = 48_000, 64, 20.0
DELAY = 3_000
BEGIN = 100 * 365 * 86_400 * RATE
"""The session frame that is the first: what takes a step for each lap of a ring so far does not end."""
FLOOR = default_floor(1, 2)


@pytest.fixture
def memory():
    found = SessionMemory.create(2, RATE, 1000.0)
    yield found
    found.close()


def noise(frames, seed=1):
    """Noise of some 50 to 700 Hz, of full scale."""
    spectrum = np.fft.rfft(np.random.default_rng(seed).standard_normal(frames))
    hz = np.fft.rfftfreq(frames, 1.0 / RATE)
    found = np.fft.irfft(np.where((hz > 50.0) & (hz < 700.0), spectrum, 0.0), frames)
    return (0.1 * found / found.std()).astype(np.float32)


def simulated_recording(memory, played, arrives, told=DELAY):
    """What is told of t2's accelerometer while `played` goes out and `arrives` comes in: by frame from `BEGIN` on,
    NaN in gaps.

    And how often it was aligned anew.
    """
    reader = CardReader((Accelerometer("t2", 0, FULL_SCALE),), FLOOR, memory, RATE, BLOCK, inputs=1)
    reader.delay_frames = told
    memory.skip(BEGIN)
    measured, found = Reader(memory.measured), np.full(len(played), np.nan)
    rows = np.zeros((BLOCK, 2), np.float32)
    for block, at in enumerate(range(0, len(played) - BLOCK, BLOCK)):
        rows[:, 1] = played[at : at + BLOCK]
        memory.vibration.write(rows, BLOCK)
        reader.recorded[:, 0] = arrives[at : at + BLOCK]
        reader.write(BEGIN + at, BLOCK)
        if block % 40 == 39:
            reader.align()
            for _ in range(2):  # a gap parts what is read
                first, new = measured.read()
                found[first - BEGIN : first - BEGIN + len(new)] = new[:, 1] / FULL_SCALE
    return found, reader.jumps


def delayed(played, frames=DELAY):
    return np.append(np.zeros(frames, np.float32), played)[: len(played)]


def test_frames_that_are_lost_leave_a_gap_and_all_others_stand_where_they_were_commanded(memory):
    played = noise(6 * RATE)
    arrives = np.delete(delayed(played), slice(144_123, 144_123 + 511))
    found, jumps = simulated_recording(memory, played, np.append(arrives, np.zeros(511, np.float32)))
    known = np.isfinite(found)
    assert jumps == 1
    gap = np.flatnonzero(~known[: 5 * RATE])
    np.testing.assert_array_equal(gap, np.arange(144_123, 144_123 + 511) - DELAY)
    np.testing.assert_allclose(found[known], played[known], atol=1e-6)


def test_inserted_silence_is_left_out(memory):
    played = noise(6 * RATE)
    arrives = np.insert(delayed(played), 150_000, np.zeros(2_177, np.float32))
    found, jumps = simulated_recording(memory, played, arrives)
    assert jumps == 1
    known = np.isfinite(found)
    assert known[: 5 * RATE - DELAY].all()
    np.testing.assert_allclose(found[known], played[known], atol=1e-6)


def test_a_latency_that_the_device_reports_wrongly_is_found_and_is_no_jump(memory):
    played = noise(3 * RATE)
    found, jumps = simulated_recording(memory, played, delayed(played), told=DELAY - 2_200)
    known = np.isfinite(found)
    assert jumps == 0
    assert known.sum() > 1.5 * RATE
    np.testing.assert_allclose(found[known], played[known], atol=1e-6)


def test_a_tone_that_matches_at_each_period_changes_nothing(memory):
    tone = (0.1 * np.sin(2.0 * np.pi * 300.0 / RATE * np.arange(4 * RATE))).astype(np.float32)
    assert simulated_recording(memory, tone, np.roll(tone, DELAY + 40))[1] == 0


def test_shaking_that_has_nothing_to_do_with_the_command_changes_nothing(memory):
    assert simulated_recording(memory, noise(4 * RATE, 1), noise(4 * RATE, 2))[1] == 0
