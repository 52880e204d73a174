"""What every transport must do, with an emulated floor behind it: over real pseudo-terminals and sockets."""

import re
import time
from contextlib import contextmanager

import numpy as np
import pytest
from made_frames import expected_counts, rows
from wired import EVERY_TRANSPORT, ends

from underfoot.devices.conversion import nominal_force, nominal_readings
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.emulation.faults import FaultInjector, Faults
from underfoot.devices.framing.wire_format import csv_lines, encode
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transport_reader import RETRY_S, TransportReader
from underfoot.errors import DeviceError
from underfoot.floor.layout import default_floor

RATE = 48_000.0
SECONDS = 0.6
CONNECTED = ("{} went away: ", "{} is back")
UNCONNECTED = ("{}: nothing comes", "{} sends again")
UNPLUGGED = {"udp": UNCONNECTED}
"""What is said of a transport that is unplugged and plugged in again, where it is not what connections say."""


class Listener:
    """A floor of hardware, asked for its samples as a session asks, and all that it gave."""

    def __init__(self, floor):
        self.floor, self._began = floor, time.perf_counter()
        self.stamps, self.forces, self.when, self.said = [], [], [], []

    def poll(self):
        passed = time.perf_counter() - self._began
        count = self.floor.pull(int(passed * RATE))
        if count:
            self.stamps.append(self.floor.stamps[:count].copy())
            self.forces.append(self.floor.forces[:count].copy())
            self.when.append(passed)
        self.said += self.floor.take_notices()
        return count

    @property
    def samples(self):
        return np.concatenate(self.stamps), np.concatenate(self.forces)


@contextmanager
def emulated(scheme, until, floor, faults=None, seconds=1.5, seed=1, **options):
    """An emulator of a floor and someone who listens to it."""
    sender, transport = ends(scheme)
    source = SimulatedFloor(floor)
    source.pull(480)  # loads its kernels
    source.skip(0)
    emulator = Emulator(sender, source, FaultInjector(faults, seed, keep=True), seconds=seconds, **options)
    hardware = DeviceFloor(transport, floor, RATE)
    listener = Listener(hardware)
    try:
        hardware.start()
        until(lambda: hardware.reader.is_open, "the transport is open")
        emulator.start()
        yield emulator, listener, hardware
    finally:
        emulator.close()
        hardware.close()


def listened(scheme, until, floor, expected, faults=None, **options):
    """An emulator that sent `SECONDS`, and who listened, once as many frames came as are `expected` of those sent.

    A port waits only so long for a reader, and a row for its last tile; where this machine keeps them waiting for
    longer, all is sent again.
    """

    def run():
        with emulated(scheme, until, floor, faults, seconds=SECONDS, **options) as (emulator, listener, hardware):
            until(lambda: listener.poll() == 0 and emulator.is_finished, "it sends all")
            if emulator.undelivered:
                return None
            whole = expected(np.concatenate(emulator.injector.sent))
            until(lambda: hardware.counts.accepted == whole, "all came", seen=lambda: hardware.counts)
            until(lambda: listener.poll() == 0, "all is taken")
            return None if faults is None and hardware.late else (emulator, listener, hardware)

    return until(run, "a run in which nobody is kept waiting", seconds=400.0)


@contextmanager
def read(scheme, until):
    """A sender, and a reader that is open; with what the reader was given."""
    sender, transport = ends(scheme)
    heard = []
    reader = TransportReader(transport, lambda samples, when: heard.extend(samples["sequence"].tolist()))
    reader.start()
    try:
        until(lambda: reader.is_open, "the transport is open")
        yield sender, reader, heard
    finally:
        reader.close()
        sender.close()


def walked(floor, seconds):
    """What its tiles send in so many seconds, in newtons."""
    source = SimulatedFloor(floor)
    parts = [source.forces[: source.pull(end)].copy() for end in range(4800, int(seconds * RATE) + 1, 4800)]
    return nominal_force(nominal_readings(np.concatenate(parts)))


# --- whole ---


@EVERY_TRANSPORT
def test_thirty_six_tiles_at_a_thousand_samples_lose_nothing(scheme, until):
    floor = default_floor(6, 6)
    _, listener, hardware = listened(scheme, until, floor, lambda sent: 36 * 600)
    counts = hardware.counts
    assert (counts.lost, counts.corrupted, counts.doubled, counts.reordered) == (0, 0, 0, 0)
    stamps, forces = listener.samples
    np.testing.assert_array_equal(forces, walked(floor, SECONDS))
    assert (np.diff(stamps) > 0.0).all()
    assert hardware.late == 0


@EVERY_TRANSPORT
def test_with_faults_no_wrong_sample_is_taken_and_losses_are_counted_exactly(scheme, until):
    floor = default_floor()
    faults = Faults(*[0.05] * 5)
    emulator, listener, hardware = listened(
        scheme, until, floor, lambda sent: expected_counts(sent)["accepted"], faults, seed=9
    )
    counts = expected_counts(np.concatenate(emulator.injector.sent))
    assert {name: getattr(hardware.counts, name) for name in counts} == counts
    true = walked(floor, SECONDS)
    _, forces = listener.samples
    # Every sample that was handed over is one that was sent, in order.
    for tile in range(4):
        got = forces[:, tile][np.isfinite(forces[:, tile, 0])]
        assert len(got) > 0.75 * len(true)
        at = 0
        for sample in got:
            while not np.array_equal(true[at, tile], sample):
                at += 1


@EVERY_TRANSPORT
@pytest.mark.parametrize("write", [encode, csv_lines])
def test_both_forms_come_through(scheme, write, until):
    with read(scheme, until) as (sender, reader, heard):
        data = write(rows(1))
        # What a connection begins with may be the end of a frame: it is passed over.
        until(lambda: sender.send(data, [len(data)]) and heard, "the first is read")
        data = write(rows(50, first=1))
        assert sender.send(data, [len(data)])
        until(lambda: len(set(heard)) == 51, "all are read")
        assert reader.parser.counts.corrupted == 0


# --- gone and back ---


@EVERY_TRANSPORT
def test_unplugged_and_plugged_in_again_it_is_back(scheme, until):
    """Within a second where no other program keeps it waiting."""
    assert RETRY_S < 0.3
    floor = default_floor(1, 1)
    faults = Faults(unplugged=((1.0, 0.7),))  # one read again later than it had run before goes on, by its numbers
    with emulated(scheme, until, floor, faults, seconds=10.0) as (emulator, listener, hardware):
        gone, returned = (line.format(hardware.reader.transport.name) for line in UNPLUGGED.get(scheme, CONNECTED))

        def is_back():
            listener.poll()
            if returned not in listener.said:
                return False
            return hardware.counts.restarts if emulator.sender.powers_tiles else hardware.counts.lost >= 590

        until(is_back, "it is back", seen=lambda: (listener.said, hardware.counts))
        accepted = hardware.counts.accepted
        until(lambda: listener.poll() and hardware.counts.accepted > accepted + 200, "it goes on")
        assert any(line.startswith(gone) for line in listener.said)
    if emulator.sender.powers_tiles:
        assert hardware.counts.restarts == 1
        assert hardware.counts.lost == 0
    else:
        assert hardware.counts.restarts == 0
    stamps, _ = listener.samples
    steps = np.diff(stamps) / RATE
    assert (steps > 0.0).all()
    assert steps.max() > 0.5  # the gap stays a gap


# --- not what was hoped for ---


@EVERY_TRANSPORT
def test_rubbish_is_said_and_what_follows_is_read(scheme, until):
    with read(scheme, until) as (sender, reader, heard):
        noise = np.random.default_rng(1).integers(1, 256, 1400).astype(np.uint8).tobytes()
        until(lambda: sender.send(noise, [len(noise)]) and reader.notices, "it is said")
        assert re.search("bytes came, but no frame: (no zero byte|1400 bytes before)", reader.take_notices()[0])
        data = encode(rows(20))
        assert sender.send(b"\0" + data, [1 + len(data)])
        until(lambda: heard == list(range(20)), "it is read")
        assert f"{reader.transport.name} sends again" in reader.notices


@EVERY_TRANSPORT
def test_what_is_not_open_cannot_be_read_and_can_be_closed(scheme):
    sender, transport = ends(scheme)
    try:
        transport.close()
        with pytest.raises(DeviceError, match="is not open"):
            transport.read()
        transport.open()
        assert len(transport.read()) == 0
        transport.close()
        transport.close()
        with pytest.raises(DeviceError, match="is not open"):
            transport.read()
    finally:
        sender.close()
