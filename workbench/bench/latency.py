"""Latency from the moment at which a tile sends a force to the first output frame that it changes.

A session and an emulated floor run in processes of their own, over a real socket or pseudo-terminal. The load steps
every few samples. The emulator notes when it sends each step; the bench notes when the engine has delivered the block
in which the vibration bends, and adds the position of the bend in its block: the time at which a card without a buffer
would play it. The delay of a card's buffer comes on top.
"""

import multiprocessing
import queue
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.requirements.requirement import Requirement
from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.force_source import SENSOR_HZ, sample_buffers
from underfoot.devices.transport import Sender
from underfoot.devices.transports.serial import PtySender
from underfoot.devices.transports.udp import UdpSender
from underfoot.engine.commands import Level
from underfoot.engine.rings import Reader, Ring
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.errors import UnderfootError
from underfoot.floor.forces import floor_beside
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.records.tables import force_table

RATE, BLOCK = 48_000, 64
MEDIAN_MS, NEARLY_ALL_MS = 2.5, 4.0
"""Limits on the median and the 99th percentile."""
BESIDE_MS = 1.0
"""Largest difference between the displayed latency and the median."""

_STEP = 47  # samples between steps of the load, chosen so that they fall on all positions in a block of 4/3 ms
_LOW_N, _HIGH_N = 50.0, 75.0  # per sensor
_RINGS = 400  # samples between steps whose plate response is measured: it has decayed by then
_GAIN = 0.01  # m/s^2 per newton
_BEND = 0.2 * 4 * (_HIGH_N - _LOW_N) * _GAIN / 20.0 / 48.0  # full scale per frame; a fifth of a step's own
_START_S = 180.0
_LOOK_S, _POLL_S = 0.0002, 0.1
_MOST_S = 0.045
_TILES = 4


@dataclass(frozen=True)
class Latency:
    """Results for one link.

    `seconds` (steps,) are from the sending of each step to the first frame that it changed; `shown_s` and `hold_s` are
    the medians of what the session reports; `late_share` is the share of samples later than the hold allows.
    """

    seconds: NDArray[np.float64]
    shown_s: float
    hold_s: float
    late_share: float


def requirements(quick: bool = False, progress: Callable[[str], None] = lambda line: None) -> Iterator[Requirement]:
    """Measure the latency of a hub of four tiles at 1 kHz over UDP and a pseudo-terminal and, in full, with jitter.

    Before each, for comparison, a bare datagram between two processes: the delay of the machine itself.
    """
    links = (("UDP", 0.0), ("pty", 0.0), ("UDP", 0.5e-3), ("UDP", 1e-3))
    for link, jitter_s in links[: 2 if quick else None]:
        what = f"{link}, block {BLOCK}" + (f", {1e3 * jitter_s:.1f} ms of jitter" if jitter_s else "")
        progress(f"latency: {what}")
        yield from _distribution(f"{what}: a bare datagram before", datagram_delays(3.0 if quick else 10.0))
        found = measured(link, jitter_s, seconds=10.0 if quick else 60.0)
        yield from _distribution(what, found.seconds, *(() if jitter_s else (MEDIAN_MS, NEARLY_ALL_MS)))
        yield Requirement("latency", f"{what}: shown", 1e3 * found.shown_s, "ms")
        beside = 1e3 * (found.shown_s - float(np.median(found.seconds)))
        yield Requirement("latency", f"{what}: shown, less the median", beside, "ms", -BESIDE_MS, BESIDE_MS)
        yield Requirement("latency", f"{what}: hold in it", 1e3 * found.hold_s, "ms")
        yield Requirement("latency", f"{what}: later than the hold", 100.0 * found.late_share, "%")
    progress("latency: from force to acceleration on the simulator")
    took = acceleration_latencies(5.0 if quick else 60.0)
    yield from _distribution(f"simulator, block {BLOCK}: force to acceleration", took)


def _distribution(what: str, seconds: NDArray[np.float64], most_ms: float = np.inf, nearly_ms: float = np.inf
) -> Iterator[Requirement]:  # fmt: skip
    half, nearly_all, worst = np.percentile(1e3 * seconds, (50, 99, 100))
    yield Requirement("latency", f"{what}: median", half, "ms", high=most_ms)
    yield Requirement("latency", f"{what}: 99 %", nearly_all, "ms", high=nearly_ms)
    yield Requirement("latency", f"{what}: worst", worst, "ms")


def measured(link: str, jitter_s: float = 0.0, settled_s: float = 12.0, seconds: float = 20.0) -> Latency:
    """Measure over a link, "UDP" or "pty", for this many seconds, once the clocks have settled.

    The link adds a random delay, exponential with mean `jitter_s`, and keeps the order. Raises `UnderfootError` if the
    engine does not play.
    """
    context = multiprocessing.get_context("spawn")
    tiles, theirs = context.Pipe()
    process = context.Process(target=_emulate, args=(theirs, link, jitter_s), daemon=True)
    process.start()
    theirs.close()
    try:
        kind = "udp" if link == "UDP" else "serial"
        target = Target(default_floor(), kind=kind, source=tiles.recv(), rate=RATE, block=BLOCK)
        session = Session(target, _patch(), REGISTRY)
        try:
            recorder = _OutputRecorder(session)
            recorder.start()
            recorder.record(settled_s)
            recorder.clear()
            recorder.record(seconds)
            late_share = recorder.late_share()
            shown_s, hold_s = recorder.shown_s()
        finally:
            session.close()
        tiles.send(None)
        found = recorder.step_latencies(tiles.recv())
    finally:
        process.kill()
        process.join()
        tiles.close()
    return Latency(found, shown_s, hold_s, late_share)


def acceleration_latencies(seconds: float) -> NDArray[np.float64]:
    """Return the seconds from each load step's due time to the report of the simulated tile's changed acceleration.

    The change is detected at a tenth of the step's response, which includes the delay of shaker and plate.
    """
    with tempfile.TemporaryDirectory() as folder:
        path, floor = Path(folder) / "steps.csv", default_floor(1, 1)
        forces = np.where(np.arange(2 * _RINGS) < _RINGS, _LOW_N, _HIGH_N)
        columns = {f"t1.{corner}": forces for corner in (1, 2, 3, 4)}
        force_table(path, {"time_s": np.arange(2 * _RINGS) / SENSOR_HZ} | columns)
        floor.save(floor_beside(path))
        session = Session(Target(floor, "replay", str(path), rate=RATE, block=BLOCK), _patch(), REGISTRY)
        try:
            recorder = _OutputRecorder(session, session.memory.measured)
            recorder.start()
            recorder.record(2.0)
            recorder.clear()
            recorder.record(seconds)
        finally:
            session.close()
    return recorder.step_response_latencies(round(_RINGS * RATE / SENSOR_HZ))


def datagram_delays(seconds: float) -> NDArray[np.float64]:
    """Return the seconds from the due time of each of 1000 datagrams a second to its reception."""
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    found = np.zeros(round(SENSOR_HZ * seconds))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(_START_S)
        port = receiver.getsockname()[1]
        process = context.Process(target=_send_datagrams, args=(theirs, port, len(found)), daemon=True)
        process.start()
        ours.recv()
        for i in range(len(found)):
            due = float(np.frombuffer(receiver.recv(8))[0])
            found[i] = time.perf_counter() - due
    process.join()
    return found


def _patch() -> Patch:
    """Return a patch whose vibration is the force."""
    patch = Patch().add("tile-force", REGISTRY).add("gain", REGISTRY, gain=_GAIN).add("tile-output", REGISTRY)
    patch = patch.connect("tile-force.force", "gain.signal", REGISTRY)
    return patch.connect("gain.out", "tile-output.acceleration", REGISTRY)


def wait_for(session: Session, ring: Ring) -> None:
    """Poll a session that was started until it writes to a ring; raise `UnderfootError` if it does not play."""
    began = time.perf_counter()
    while not ring.written:
        reports = session.poll()
        if time.perf_counter() - began > _START_S:
            raise UnderfootError(f"the engine does not play within {_START_S:.0f} s: {reports}")
        time.sleep(_POLL_S)


class _OutputRecorder:
    """The output of a session, with the time at which each block was first seen."""

    def __init__(self, session: Session, ring: Ring | None = None) -> None:
        self._session, self._ring = session, ring or session.memory.vibration
        self._output = Reader(self._ring)
        self._samples = Reader(session.memory.force)
        self.clear()

    def start(self) -> None:
        """Start the session, and wait until it plays."""
        self._session.send(Level(0.0))
        self._session.start()
        wait_for(self._session, self._ring)

    def clear(self) -> None:
        """Discard everything up to now."""
        self._samples.read()
        self._first, _ = self._output.read()
        self._seen: list[tuple[float, int]] = []
        self._parts: list[NDArray[np.float32]] = []
        self._shown: list[tuple[float, float]] = []

    def record(self, seconds: float) -> None:
        """Record the output, and when it is delivered."""
        ring, now = self._ring, time.perf_counter()
        end, polled, last = now + seconds, now, 0
        while now < end:
            written, now = ring.written, time.perf_counter()
            if written > last:
                self._seen.append((now, written))
                last = written
            if now - polled > _POLL_S:
                polled = now
                self._session.poll()
                self._shown.append((self._session.health.latency_s, self._session.health.hold_s))
                first, frames = self._output.read()
                if not self._parts:
                    self._first = first
                self._parts.append(frames)
            time.sleep(_LOOK_S)

    def late_share(self) -> float:
        """Share of samples that arrived too late; the last four seconds are kept."""
        _, rows = self._samples.read()
        return float((rows[:, 1] > rows[:, 0]).mean())

    def shown_s(self) -> tuple[float, float]:
        """Return the median of the displayed latency, and the hold in it."""
        return sorted(self._shown)[len(self._shown) // 2]

    def step_latencies(self, sent_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the seconds from each step sent to the delivery of its first frame."""
        when, ends = np.array([when for when, _ in self._seen]), np.array([end for _, end in self._seen])
        frames = self._first + _kinks(np.concatenate(self._parts)[:, 0])
        frames = frames[frames < ends[-1]]
        changed_s = when[np.searchsorted(ends, frames, "right")] + frames % BLOCK / RATE
        sent_s = sent_s[(sent_s > when[0]) & (sent_s < changed_s[-1] - _MOST_S)]
        following = np.searchsorted(changed_s, sent_s)
        return changed_s[following] - sent_s

    def step_response_latencies(self, every: int) -> NDArray[np.float64]:
        """Return, for each step, at multiples of `every` frames, the seconds to the delivery of its response."""
        when, ends = np.array([when for when, _ in self._seen]), np.array([end for _, end in self._seen])
        output = np.concatenate(self._parts)[:, 0]
        found = []
        for due in range(-(-self._first // every) * every, self._first + len(output) - every, every):
            after = np.abs(output[due - self._first :][: every // 2])
            frame = due + int(np.argmax(after > 0.1 * after.max()))
            # The clock that paces blocks skips time it has missed, so the time of frame 0 is estimated for each step.
            near = np.abs(ends - due) < every // 2
            began_s = (when[near] - ends[near] / RATE).min()
            found.append(when[np.searchsorted(ends, frame, "right")] - (began_s + due / RATE))
        return np.array(found)


def _kinks(played: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the frames at which a straight signal begins to bend."""
    bent = np.flatnonzero(np.abs(np.diff(played.astype(np.float64), 2)) > _BEND) + 2
    return bent[np.diff(bent, prepend=-RATE) > RATE / SENSOR_HZ * _STEP // 2]


# --- the tiles, in a process of their own ---


class _Steps:
    """A load on the first tile that steps up or down every `_STEP` samples; a `ForceSource`."""

    def __init__(self) -> None:
        self.floor, self.rate_hz = default_floor(), SENSOR_HZ
        self.stamps, self.arrivals, self.forces = sample_buffers(self.floor)
        self._sample = 0

    def pull(self, end: int) -> int:
        """Write the samples before session frame `end` to the buffers."""
        period = RATE / SENSOR_HZ
        numbers = np.arange(self._sample, min(int(np.ceil(end / period)), self._sample + len(self.stamps)))
        count = len(numbers)
        self.stamps[:count] = numbers * period
        self.forces[:count, 0] = np.where(numbers // _STEP % 2, _HIGH_N, _LOW_N)[:, None]
        self._sample += count
        return count


class _JitteredSender(Sender):
    """Sends over `sender`, each sample delayed at random; `sent_s` has the times at which they were sent."""

    powers_tiles = False

    def __init__(self, sender: Sender, jitter_s: float) -> None:
        self.name, self.sent_s = sender.name, list[float]()
        self._sender, self._jitter_s = sender, jitter_s
        self._random = np.random.default_rng(1)
        self._waiting: queue.SimpleQueue[tuple[float, bytes, Sequence[int]]] = queue.SimpleQueue()
        threading.Thread(target=self._send_delayed, daemon=True).start()

    @classmethod
    def of(cls, value: str) -> Self:
        """To a UDP port, without jitter."""
        return cls(UdpSender.of(value), 0.0)

    def send(self, data: bytes, ends: Sequence[int]) -> bool:
        """Note the time, and send it now or later."""
        now = time.perf_counter()
        self.sent_s += [now] * (len(ends) // _TILES)
        if self._jitter_s == 0.0:
            return self._sender.send(data, ends)
        self._waiting.put((now + self._random.exponential(self._jitter_s), data, ends))
        return True

    def unplug(self) -> None:
        """Do nothing."""

    plug = close = unplug

    def _send_delayed(self) -> None:
        while True:
            due, data, ends = self._waiting.get()
            time.sleep(max(due - time.perf_counter(), 0.0))
            self._sender.send(data, ends)


def _emulate(connection: Connection, link: str, jitter_s: float) -> None:
    """Send steps until something arrives over `connection`, then answer with their times."""
    sender = _JitteredSender(UdpSender("127.0.0.1", _free_port()) if link == "UDP" else PtySender(), jitter_s)
    Emulator(sender, _Steps()).start()
    connection.send(sender.name)
    connection.recv()
    connection.send(np.array(sender.sent_s[::_STEP]))


def _send_datagrams(connection: Connection, port: int, count: int) -> None:
    """Send a datagram each millisecond, with its due time."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        connection.send(None)
        began = time.perf_counter()
        for due in began + np.arange(count) / SENSOR_HZ:
            time.sleep(max(due - time.perf_counter(), 0.0))
            sender.sendto(due.tobytes(), ("127.0.0.1", port))


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])
