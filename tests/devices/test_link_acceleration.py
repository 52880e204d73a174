"""Acceleration that comes beside forces: from a device's frames to session frames, beside the command."""

from types import SimpleNamespace

import numpy as np
import pytest
from bare_transport import BareTransport
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.devices import device_floor
from underfoot.devices.accelerometers import accelerometers_of
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.emulation.faults import FaultInjector
from underfoot.devices.framing.parser import Parser
from underfoot.devices.framing.wire_format import FORCES, REST
from underfoot.devices.link_acceleration import EACH
from underfoot.devices.replay import Replay
from underfoot.engine.accelerometer_reader import LinkReader, reader_of
from underfoot.engine.rings import Reader, Ring
from underfoot.engine.session_memory import RING_S, ResponseReader, SessionMemory
from underfoot.errors import BadValue
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor

RATE, FULL_SCALE = 48_000.0, 98.1
FLOOR = default_floor(1, 2)


class Unheard:
    """Where an emulator would send."""

    name, powers_tiles = "nowhere", False

    def close(self):
        pass


def sine(hz, seconds):
    """Readings of two accelerometers, the second at rest, four a millisecond."""
    at_s = np.arange(round(4000 * seconds)) / 4000.0
    m_s2 = np.stack([5.0 * np.sin(2 * np.pi * hz * at_s), np.zeros_like(at_s)], axis=1)
    return np.rint(m_s2 * REST / FULL_SCALE).astype(np.int64) + REST


@pytest.fixture
def clock(monkeypatch):
    """The host's time, which a test sets: a list of seconds."""
    now = [100.0]
    monkeypatch.setattr(device_floor, "time", SimpleNamespace(perf_counter=lambda: now[0]))
    return now


def measured(clock, hz, seconds=2.0, keep=lambda number: True, block=128, turn_us=0):
    """What a session is told of a device that shakes like this: the ring of m/s^2 and its first frame."""
    force = ForceSeries(np.arange(2) / 1000.0, np.zeros((2, 2, 4)), 1000.0)
    emulator = Emulator(Unheard(), Replay(force, FLOOR, RATE), acceleration=sine(hz, seconds))
    count = round(1000 * seconds)
    frames = emulator.samples(48.0 * np.arange(count), np.zeros((count, 2, 4))).reshape(count, -1)
    source, parser, injector = DeviceFloor(BareTransport(), FLOOR, RATE), Parser(), FaultInjector()
    heard = accelerometers_of(f"t1:link:{FULL_SCALE} t2:link:{FULL_SCALE}", FLOOR)
    memory = SessionMemory.create(2, 2.0 * RATE * seconds / RING_S, 1000.0)
    ring, sent, began_s = memory.measured, 0, clock[0]
    reader = reader_of(heard, source, memory, RATE, block)
    assert isinstance(reader, LinkReader)
    for end in range(block, round(RATE * seconds), block):
        while 48.0 * sent < end and sent < count:
            clock[0] = began_s + sent / 1000.0
            if keep(sent):
                samples = parser.feed(injector.send(frames[sent]))
                samples["microseconds"][samples["kind"] == FORCES] += turn_us
                source.receive(samples, clock[0])
            sent += 1
        clock[0] = began_s + (end - block) / RATE
        source.pull(end)
        reader.write(end - block, block)
    _, rows = Reader(ring, 0).read()
    memory.close()
    return rows


def test_a_sine_of_the_device_is_the_same_sine_in_session_frames(clock):
    rows = measured(clock, 300.0)
    found = rows[24_000:72_000, 0]
    at_s = np.arange(len(found)) / RATE
    basis = np.stack([np.sin(2 * np.pi * 300.0 * at_s), np.cos(2 * np.pi * 300.0 * at_s)], axis=1)
    parts = np.linalg.lstsq(basis, found, rcond=None)[0]
    assert np.hypot(*parts) == pytest.approx(5.0, rel=0.005)
    assert np.std(found - basis @ parts) < 0.03
    assert not rows[:, 1].any()


def test_what_is_lost_counts_as_rest_and_the_rest_stands_where_it_did(clock):
    whole = measured(clock, 200.0)
    holes = measured(clock, 200.0, keep=lambda number: not 1000 <= number < 1010)
    np.testing.assert_allclose(holes[60_000:80_000], whole[60_000:80_000], atol=0.05)
    assert not holes[48_100:48_300, 0].any()


def test_microseconds_of_forces_that_are_a_turn_ahead_are_the_same_times(clock):
    """After 71 minutes a line was away for 40 s: the numbers of forces may have gone round, those of 500 Hz not yet.

    Only the forces' times began anew, and acceleration was 0 from then on.
    """
    expected = measured(clock, 300.0, 0.5)
    for turn_us in (1 << 32, -3 << 32):
        np.testing.assert_allclose(measured(clock, 300.0, 0.5, turn_us=turn_us), expected, atol=1e-3)


def test_accelerometers_of_no_device_are_not_read_and_both_kinds_together_are_refused():
    memory = SessionMemory.create(2, RATE, 1000.0)
    assert (
        reader_of(
            accelerometers_of("t1:link:9.81", FLOOR),
            Replay(ForceSeries(np.arange(2) / 1000.0, np.zeros((2, 2, 4)), 1000.0), FLOOR, RATE),
            memory,
            RATE,
            64,
        )
        is None
    )
    memory.close()
    with pytest.raises(BadValue, match="all on inputs of the card, or all over the link"):
        accelerometers_of("t1:link:9.81 t2:0:9.81", FLOOR)
    with pytest.raises(BadValue, match=r"t2:0:9\.81'; allowed: an input of its own"):
        accelerometers_of("t1:0:9.81 t2:0:9.81", FLOOR)


def test_command_and_measurement_are_paired_by_frame_however_late_the_second_is():
    asked, done = Ring.create(1, 4096), Ring.create(1, 4096)
    pairs = ResponseReader(asked, done)
    numbers = np.arange(4096, dtype=np.float32)[:, None]
    got = []
    for at in range(0, 1024, 64):
        asked.write(numbers[at : at + 64], 64)
        if at >= 256:
            done.write(numbers[at - 256 : at - 192], 64)
        first, commanded, measured_rows = pairs.read()
        assert (commanded == measured_rows).all()
        assert not len(commanded) or commanded[0, 0] == first
        got.append(commanded)
    np.testing.assert_array_equal(np.concatenate(got)[:, 0], np.arange(768))
    asked.close()
    done.close()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["simulator", "--accelerometers", "t1:0:98"], "--accelerometers are on inputs of a sound card"),
        (["simulator", "--accelerometers", "t9:link:98"], "tile of an accelerometer is 't9'"),
    ],
)
def test_accelerometers_that_cannot_be_are_refused_before_a_session(options, message):
    with pytest.raises(BadValue, match=message):
        CliRunner().invoke(cli, ["monitor", *options], catch_exceptions=False)


def test_an_emulator_that_sends_text_has_no_accelerometer():
    with pytest.raises(BadValue, match="binary frames alone"):
        Emulator(Unheard(), Replay(ForceSeries(np.arange(2) / 1000.0, np.zeros((2, 2, 4)), 1000.0), FLOOR, RATE),
                 FaultInjector(csv=True), acceleration=np.zeros((EACH, 2), np.int64))  # fmt: skip
