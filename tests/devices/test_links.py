"""Lines to hardware that is not there, over a real pseudo-terminal and a real socket."""

import os
import socket
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest

from underfoot.devices.conversion import nominal_force, nominal_readings
from underfoot.devices.device_floor import LinkedFloor
from underfoot.devices.emulation.emulator import Emulator, PtyWay, UdpWay
from underfoot.devices.emulation.faults import Faults, FaultyLine
from underfoot.devices.framing.wire_format import encode
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports.reader import Link, port_of
from underfoot.devices.transports.serial import SerialPort
from underfoot.devices.transports.udp import UdpPort
from underfoot.errors import BadValue, DeviceError
from underfoot.floor.layout import default_floor

RATE = 48_000.0
LINES = pytest.mark.parametrize("kind", ["pty", "udp"])
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")


def free_port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def ends(kind):
    """Where an emulator sends, and the port at which that is read."""
    if kind == "pty":
        way = PtyWay()
        return way, SerialPort(way.name)
    number = free_port()
    return UdpWay("127.0.0.1", number), UdpPort("127.0.0.1", number)


class Listener:
    """A floor on a line, asked for its samples as a session asks, and all that it gave."""

    def __init__(self, floor):
        self.floor, self._began = floor, time.monotonic()
        self.stamps, self.forces, self.when, self.said = [], [], [], []

    def poll(self):
        passed = time.monotonic() - self._began
        count = self.floor.pull(int(passed * RATE))
        if count:
            self.stamps.append(self.floor.stamps[:count].copy())
            self.forces.append(self.floor.forces[:count].copy())
            self.when.append(passed)
        self.said += self.floor.news()
        return count

    @property
    def samples(self):
        return np.concatenate(self.stamps), np.concatenate(self.forces)


@contextmanager
def emulated(kind, until, floor, faults=None, seconds=1.5, seed=1, pace=True, **options):
    """An emulator of a floor and someone who listens to it."""
    way, port = ends(kind)
    line = FaultyLine(faults, seed, keep=True)
    source = SimulatedFloor(floor)
    source.pull(480)  # loads its kernels
    source.skip(0)
    emulator = Emulator(way, source, line, seconds=seconds, pace=pace, **options)
    linked = LinkedFloor(port, floor, RATE)
    listener = Listener(linked)
    try:
        linked.start()
        until(lambda: linked._link.is_open, "the line is open")
        emulator.start()
        yield emulator, listener, linked
    finally:
        emulator.close()
        linked.close()


def walked(floor, seconds, **_):
    """What its tiles send in so many seconds, in newtons."""
    source = SimulatedFloor(floor)
    parts = [source.forces[: source.pull(end)].copy() for end in range(4800, int(seconds * RATE) + 1, 4800)]
    return nominal_force(nominal_readings(np.concatenate(parts)))


# --- whole ---


@LINES
def test_thirty_six_tiles_at_a_thousand_samples_lose_nothing(kind, until):
    floor = default_floor(6, 6)
    with emulated(kind, until, floor, seconds=1.2) as (emulator, listener, linked):
        until(lambda: listener.poll() == 0 and emulator.over and linked.counts.good == 36 * 1200, "all came", 30.0)
        until(lambda: listener.poll() == 0 and sum(map(len, listener.stamps)) == 1200, "all rows are there")
        assert emulator.unheard == 0
        counts = linked.counts
        assert (counts.lost, counts.corrupted, counts.doubled, counts.reordered) == (0, 0, 0, 0)
    stamps, forces = listener.samples
    np.testing.assert_array_equal(forces, walked(floor, 1.2))
    assert (np.diff(stamps) > 0.0).all()
    assert linked.late == 0


@LINES
def test_with_faults_no_wrong_sample_is_taken_and_losses_are_counted_exactly(kind, until):
    from test_emulator import expected

    floor = default_floor()
    with emulated(kind, until, floor, Faults(*[0.05] * 5), seconds=2.0, seed=9) as (emulator, listener, linked):
        until(lambda: listener.poll() == 0 and emulator.over, "it sends all")
        counts = expected(np.concatenate(emulator.line.sent))
        until(lambda: listener.poll() == 0 and linked.counts.good == counts["good"], "all came")
        assert {name: getattr(linked.counts, name) for name in counts} == counts
        assert emulator.unheard == 0
    true = walked(floor, 2.0)
    _, forces = listener.samples
    # Every sample that was handed over is one that was sent, in order.
    for tile in range(4):
        got = forces[:, tile][np.isfinite(forces[:, tile, 0])]
        assert len(got) > 0.75 * len(true)
        at = 0
        for sample in got:
            while not np.array_equal(true[at, tile], sample):
                at += 1


# --- gone and back ---


@LINES
def test_unplugged_and_plugged_in_again_it_is_back_within_a_second(kind, until):
    floor = default_floor(1, 1)
    faults = Faults(unplugged=((0.6, 0.7),))
    with emulated(kind, until, floor, faults, seconds=10.0) as (_, listener, linked):
        until(listener.poll, "it sends")
        began = time.monotonic()
        until(lambda: listener.poll() and listener.when[-1] - listener.when[-2] > 0.3, "it is back", 20.0, every=0.001)
        back = time.monotonic() - began
        until(lambda: listener.poll() and len(listener.said) >= 3, "it is said")
        name = linked._link.port.name
    assert back < 0.6 + 0.7 + 1.0
    lost = linked.counts.lost
    if kind == "pty":  # the power went, too
        assert linked.counts.restarts == 1
        assert lost == 0
        assert any(line.startswith(f"{name} went away: ") for line in listener.said)
        assert f"{name} is back" in listener.said
    else:
        assert linked.counts.restarts == 0
        assert lost == pytest.approx(700, abs=60)
        assert f"{name}: nothing comes" in listener.said
        assert f"{name} sends again" in listener.said
    stamps, _ = listener.samples
    steps = np.diff(stamps) / RATE
    assert (steps > 0.0).all()
    assert 0.5 < steps.max() < 1.7  # the gap stays a gap


def test_a_port_that_is_not_there_is_waited_for(until, tmp_path):
    name = tmp_path / "tile"
    heard = []
    link = Link(SerialPort(str(name)), lambda frames, when: heard.append(len(frames)))
    link.start()
    try:
        until(lambda: link.news, "it says so")
        assert link.news[0] == f"serial:{name} cannot be opened: there is no such port; waiting for it"
        way = PtyWay()
        try:
            os.symlink(way.name, name)
            until(lambda: link.is_open, "it is opened")
            rows = [[0, i, 1000 * i, 1, 2, 3, 4] for i in range(5)]
            assert way.send(encode(rows), [])
            until(lambda: sum(heard) == 5, "it is read")
            until(lambda: f"serial:{name} is back" in link.news, "it says so")
        finally:
            way.close()
    finally:
        link.close()


def test_rubbish_on_a_line_is_said(until):
    way = PtyWay()
    link = Link(SerialPort(way.name), lambda frames, when: None)
    link.start()
    try:
        until(lambda: link.is_open, "it is open")
        noise = np.random.default_rng(1).integers(1, 256, 4000).astype(np.uint8).tobytes()
        until(lambda: way.send(noise, []) and link.news, "it says so")
        assert link.news[0].endswith("bytes came, but no frame")
    finally:
        link.close()
        way.close()


# --- ports ---


def test_a_serial_port_belongs_to_one():
    way = PtyWay()
    one, other = SerialPort(way.name), SerialPort(way.name)
    one.open()
    try:
        with pytest.raises(DeviceError, match="cannot be opened"):
            other.open()
    finally:
        one.close()
        way.close()


def test_what_lay_in_the_buffer_is_dropped():
    way = PtyWay()
    port = SerialPort(way.name)
    try:
        assert way.send(b"old", [])
        port.open()
        assert way.send(b"new", [])
        assert port.read()[:1] == b"n"
    finally:
        port.close()
        way.close()


def test_datagrams_end_frames():
    port = UdpPort("127.0.0.1", free_port())
    with pytest.raises(DeviceError, match="is not open"):
        port.read()
    port.open()
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            for part in (b"one", b"two"):
                sender.sendto(part, ("127.0.0.1", port.port))
        data = b""
        while len(data) < 8:
            data += bytes(port.read())
        assert data == b"one\0two\0"
        with pytest.raises(DeviceError, match="cannot be listened at: address already in use"):
            UdpPort("127.0.0.1", port.port).open()
    finally:
        port.close()


@pytest.mark.parametrize(
    ("kind", "source", "message"),
    [
        ("serial", "", "port is ''; allowed: a port's name"),
        ("serial", "/dev/ttyUSB0@fast", "allowed: PORT or PORT@BAUD"),
        ("serial", "/dev/ttyUSB0@1", "baud is 1; allowed: 50 to 20000000"),
        ("udp", "127.0.0.1", "allowed: HOST:PORT with a port of 1 to 65535"),
        ("udp", "127.0.0.1:99999", "allowed: HOST:PORT with a port of 1 to 65535"),
        ("tcp", "127.0.0.1:9", "kind is 'tcp'; allowed: serial, udp"),
    ],
)
def test_lines_that_cannot_be_are_refused(kind, source, message):
    with pytest.raises(BadValue, match=message.replace("(", r"\(")):
        port_of(kind, source)
