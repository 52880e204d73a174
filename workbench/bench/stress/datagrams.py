"""Datagrams that no tile of the floor has sent: forged, with wrong times, too many, and noise."""

import socket
import time
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.stress.endurance import MORE_MB, resident_mb
from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.bench.stress.valid_files import FLOOR
from underfoot.clock import RATE_HZ
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.framing.parser import HELD_S, Parser
from underfoot.devices.framing.wire_format import encode
from underfoot.devices.transports.udp import UdpTransport

TIMES = 100_000
_FORGED = 60_000
"""The reading of a forged frame, which no tile here sends."""
_BATCH = 100
_LOST_AT_JUMP = 2
"""Samples that may go when a tile's clock steps; and one in fifty, where it stands still or what came last waits."""


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield a line for each kind of datagram, with `times` datagrams each."""
    times = effort.count(TIMES)
    yield _forged(times)
    yield _taken_over()
    yield _flooded(times, progress)
    yield _noise(times, effort.seed)
    yield _clocks(effort.seed)


class _Link:
    """A listening UDP port of this machine, and two sockets that send to it."""

    def __init__(self) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            self._port = free.getsockname()[1]
        self.transport, self.parser = UdpTransport("127.0.0.1", self._port), Parser()
        self.transport.open()
        self.sockets = [socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2)]

    def __enter__(self) -> "_Link":
        return self

    def __exit__(self, *of_error: object) -> None:
        self.transport.close()
        for one in self.sockets:
            one.close()

    def send(self, sender: int, data: bytes) -> None:
        """Send a datagram from one of the two sockets."""
        self.sockets[sender].sendto(data, ("127.0.0.1", self._port))

    def read(self, now_s: float) -> NDArray[np.void]:
        """Return the samples of the received datagrams at `now_s` of the reader's clock."""
        return self.parser.feed(self.transport.read(), self.transport.senders, now_s).copy()


def _frame(number: int, reading: int) -> bytes:
    """Return a frame of tile 0."""
    return encode([0, number & 0xFFFF, (1000 * number) & 0xFFFF_FFFF, *[reading] * 4])


def _forged(times: int) -> Outcome:
    """Test that valid frames of a tile from a second address are ignored while the tile sends at 1 kHz."""
    taken = forged = 0
    with _Link() as link:
        for number in range(0, times, _BATCH):
            for at in range(number, number + _BATCH):
                link.send(0, _frame(at, 1000))
                link.send(1, _frame(at + 1, _FORGED))
            samples = link.read(1e-3 * number)
            forged += int((samples["readings"][:, 0] == _FORGED).sum())
            taken += len(samples)
        named = link.transport.sender_name(link.parser.senders_of(0)[1])
        named_right = named == f"127.0.0.1:{link.sockets[1].getsockname()[1]}"
    found = f"{forged} of {times} taken; {taken} of the tile's own taken; the stranger is named"
    return Outcome("forged frames with valid checksums", times, found, forged == 0 and taken >= times and named_right)


def _taken_over() -> Outcome:
    """Test that a tile that restarts with another address is accepted after a silence."""
    with _Link() as link:
        link.send(0, _frame(1, 1000))
        first = len(link.read(0.0))
        link.send(1, _frame(2, 2000))
        at_once = len(link.read(0.5 * HELD_S))
        link.send(1, _frame(3, 2000))
        later = len(link.read(1.5 * HELD_S))
    found = f"left out after {0.5 * HELD_S:g} s of silence, taken after {1.5 * HELD_S:g} s"
    return Outcome("a tile that comes back from another address", 1, found, (first, at_once, later) == (1, 0, 1))


def _flooded(times: int, progress: Progress) -> Outcome:
    """Test frames of every possible tile number, sent from one address at full speed."""
    rng = np.random.default_rng(3)
    datagrams = [
        encode(np.column_stack([rng.integers(0, 0x10000, 40), *rng.integers(0, 0x10000, (6, 40))]))
        for _ in range(_BATCH)
    ]
    with _Link() as link:
        for tile in range(0, 0x10000, 40):  # memory for tiles is allocated once
            link.send(0, encode([[min(tile + k, 0xFFFF), 0, 0, 0, 0, 0, 0] for k in range(40)]))
            link.read(0.0)
        before, began, bytes_sent = resident_mb(), time.perf_counter(), 0
        for number in range(times):
            data = datagrams[number % _BATCH]
            link.send(number % 2, data)
            bytes_sent += len(data)
            if number % _BATCH == _BATCH - 1:
                link.read(time.perf_counter() - began)
        spent_s, grown = time.perf_counter() - began, resident_mb() - before
        read = link.parser.bytes
    progress(f"stress: {times} datagrams in {spent_s:.0f} s")
    found = f"{times / spent_s:.0f} a second, {read / bytes_sent:.0%} of their bytes read; memory {grown:+.1f} MB"
    return Outcome("a flood of frames of all tile numbers", times, found, grown <= MORE_MB)


def _noise(times: int, seed: int) -> Outcome:
    """Test random bytes: only frames whose checksum matches by chance are accepted."""
    rng, taken = np.random.default_rng(seed), 0
    with _Link() as link:
        for number in range(times):
            link.send(number % 2, rng.bytes(int(rng.integers(0, 1400))))
            if number % _BATCH == _BATCH - 1:
                taken += len(link.read(1e-3 * number))
    return Outcome("datagrams of noise", times, f"{taken} taken for frames", taken <= 1 + times // 1000)


def _clocks(seed: int) -> Outcome:
    """Test a tile whose microseconds run back, jump or stop; times at the engine must not decrease."""
    rng = np.random.default_rng(seed)
    source = DeviceFloor(UdpTransport("127.0.0.1", 9), FLOOR, float(RATE_HZ))
    parser, stamps, wild = Parser(), [], 6000
    began_s, time_us, jumps = time.perf_counter(), 0, 0
    for number in range(wild):
        time_us += 1000
        kind = int(rng.integers(0, 200))
        jumps += kind < 2
        match kind:
            case 0:
                time_us -= int(rng.integers(0, 10_000_000))
            case 1:
                time_us += int(rng.integers(0, 1 << 31))
            case 2:
                time_us -= 1000
        rows = [[tile, number & 0xFFFF, time_us & 0xFFFF_FFFF, 100, 100, 100, 100] for tile in (0, 1)]
        source.receive(parser.feed(encode(rows)), began_s + 1e-3 * number)
        if number % 4 == 3:
            time.sleep(max(began_s + 1e-3 * number - time.perf_counter(), 0.0))  # the session uses the real clock
            count = source.pull(round(number * RATE_HZ / 1000))
            stamps += source.stamps[:count].tolist()
    back = int((np.diff(stamps) < 0.0).sum())
    finite = bool(np.isfinite(stamps).all())
    counts = parser.counts
    missing = wild - len(stamps)
    found = f"{missing} of {wild} samples are not handed over at {jumps} jumps, {back} before the one before; "
    found += f"{counts.restarts} taken for restarts, {counts.stale} left out"
    passed = back == 0 and finite and missing <= _LOST_AT_JUMP * jumps + wild // 50
    return Outcome("a tile's clock that runs back, jumps, stands", wild, found, passed)
