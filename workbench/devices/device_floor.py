"""A floor of hardware tiles: the samples received over a transport, as corner forces on the session's clock.

Tile number n on the wire is the floor's tile in row n, from 0. `row_assembly` combines the tiles' samples into samples
of the floor.
"""

import time
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.accelerometers import Accelerometer
from underfoot.devices.conversion import Conversion
from underfoot.devices.device_clock import IN_TIME, DeviceClocks
from underfoot.devices.force_source import SENSOR_HZ, sample_buffers
from underfoot.devices.framing.frame_faults import FrameFaults
from underfoot.devices.framing.parser import FrameCounts
from underfoot.devices.framing.wire_format import FORCES, SAMPLE
from underfoot.devices.health.sensor_health import SensorHealth
from underfoot.devices.link_acceleration import LinkAcceleration
from underfoot.devices.row_assembly import QUEUE, assembly, enqueue, hand_over
from underfoot.devices.silent_tiles import SilentTiles
from underfoot.devices.transport import Transport
from underfoot.devices.transport_reader import TransportReader
from underfoot.errors import require
from underfoot.floor.forces import LEAST_HZ, MOST_HZ
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile

_SETTLED_S = 5.0  # after which a clock's fit is reported


class DeviceFloor:
    """The force of `floor` as received over `transport`, from session frame `frame` on; a `ForceSource`.

    It reads from `start` to `close`. `rate` is session frames per second, `rate_hz` samples per second of each tile;
    `profiles`, by tile id, convert readings to newtons. Numbers `beside` those of the tiles are left out in silence: a
    load cell's, say.
    """

    def __init__(
        self,
        transport: Transport,
        floor: Floor,
        rate: float,
        profiles: Mapping[str, Profile] | None = None,
        rate_hz: float = SENSOR_HZ,
        frame: int = 0,
        beside: Sequence[int] = (),
    ) -> None:
        require(LEAST_HZ <= rate_hz <= MOST_HZ, "rate_hz", rate_hz, f"{LEAST_HZ:g} to {MOST_HZ:g} Hz")
        self.floor, self.rate_hz = floor, rate_hz
        self.stamps, self.arrivals, self.forces = buffers = sample_buffers(floor)
        self.clocks = DeviceClocks(len(floor.tiles), rate)
        session = DeviceClocks(1, rate)
        self._assembly = rows = assembly(floor, rate, rate_hz, self.clocks, session)
        self._acceleration: LinkAcceleration | None = None
        self._queue, self._progress = rows.queue, rows.progress[0]
        self._rows_parts, self._buffers_parts = tuple(rows), tuple(buffers)
        self._rate = float(rate)
        self._begin = self._end = frame
        self._since_s = time.perf_counter()
        self._queued = 0  # written by the reading thread, read by `pull`
        self._conversion = Conversion(floor, profiles or {})
        self._health = SensorHealth(floor, rate_hz)
        self._beside, self._unknown_tiles = frozenset(beside), set[int]()
        self._announced: set[str] = set()
        self._overflowed = 0
        self._silence = SilentTiles(floor.ids, self._since_s)
        self.reader = TransportReader(transport, self.receive)
        self._faults = FrameFaults(self.reader.parser, floor, rate_hz, transport.name, transport.doubt)
        self.reader.notices.extend(self._conversion.notices)
        self.receive(np.zeros(0, SAMPLE), self._since_s)  # loads the kernels in advance; there is no sample yet
        self._hand_over = hand_over.specialised(self._rows_parts, self._buffers_parts, 0, 0, 0, 0.0)

    def accelerations_of(self, accelerometers: tuple[Accelerometer, ...]) -> LinkAcceleration:
        """Return the acceleration over the link of these accelerometers; call before `start`."""
        self._acceleration = LinkAcceleration(accelerometers, self.floor, self._assembly)
        return self._acceleration

    def start(self) -> None:
        """Start reading; returns at once, also without a device."""
        self.reader.start()

    def close(self) -> None:
        """Stop reading, and close the transport."""
        self.reader.close()

    @property
    def end(self) -> int:
        """Session frame up to which samples were requested."""
        return self._end

    @property
    def counts(self) -> FrameCounts:
        """Counts of received frames."""
        return self.reader.parser.counts

    @property
    def lost(self) -> int:
        """Number of samples of the floor's tiles that did not arrive; what others on the line lost does not count."""
        return self.reader.parser.lost(len(self.floor.tiles))

    @property
    def late(self) -> int:
        """Number of samples that arrived after their row was handed over."""
        return int(self._progress["late"])

    @property
    def latency_s(self) -> float:
        """Seconds from a sample's jitter-free arrival to the first frame that it changes, averaged over a second."""
        return float(self._progress["latency"]) / self._rate

    @property
    def sensor_faults(self) -> dict[tuple[str, int], str]:
        """What is wrong with sensors now, by tile and number (1 to 4)."""
        return self._health.faults

    @property
    def silence(self) -> str:
        """Why nothing comes of all tiles or of some, as of the last `take_notices`; "" while all send."""
        return self.reader.trouble or self._silence.words

    def take_notices(self) -> list[str]:
        """Return the notices since the last call, one line each. Not for the callback."""
        now_s, heard = time.perf_counter(), self.reader.parser.heard(len(self.floor.tiles))
        notices = self.reader.take_notices() + self._health.take_notices() + self._silence.take_notices(heard, now_s)
        notices += self._faults.take_notices(now_s)
        for key, line in self._findings():
            if line and key not in self._announced:
                self._announced.add(key)
                notices.append(line)
        return notices

    def pull(self, end: int) -> int:
        """Write the samples before session frame `end` to the buffers. Allocates nothing."""
        now = (time.perf_counter() - self._since_s) * self._rate
        if end > self._end:
            self._begin, self._end = self._end, end
        return self._hand_over(self._rows_parts, self._buffers_parts, self._queued, self._begin, end, now)

    def receive(self, samples: NDArray[np.void], now_s: float) -> None:
        """Queue samples of tiles, records of `wire_format.SAMPLE` that arrived at `now_s` by `time.perf_counter`.

        Called in the reading thread: converts readings to newtons, and queues them for `pull`.
        """
        known = samples["tile"] < len(self.floor.tiles)
        if not known.all():
            self._unknown_tiles.update(set(samples["tile"][~known].tolist()) - self._beside)
            samples = samples[known]
        is_force = samples["kind"] == FORCES
        if not is_force.all():
            if self._acceleration is not None:
                self._acceleration.receive(samples[~is_force])
            samples = samples[is_force]
        tiles, readings = samples["tile"], samples["readings"]
        time_s = samples["microseconds"].astype(np.float64) * 1e-6
        force_n = self._conversion.newtons(tiles, readings, time_s, samples["epoch"])
        free = QUEUE - (self._queued - int(self._progress["placed"]))
        taken = min(len(samples), free)
        self._overflowed += len(samples) - taken
        enqueue(samples, force_n, self._queue, self._queued, taken, now_s - self._since_s)
        self._queued += taken
        self._health.feed(tiles, time_s, np.full(len(tiles), now_s), readings, force_n)

    def _findings(self) -> Iterator[tuple[str, str]]:
        """Yield notices to report once: a key, and a line, empty while there is nothing to report."""
        yield "clocks", self._clock_line()
        yield "overflow", "samples come faster than they are taken; some are dropped" if self._overflowed else ""
        yield "unknown tiles", self._unknown_line()
        for row, tile in enumerate(self.floor.tiles):
            yield f"stranger {tile.id}", self.reader.foreign_sender_line(row)

    def _clock_line(self) -> str:
        """Return the fit of the clocks, once it has settled."""
        settled = [row for row in range(len(self.floor.tiles)) if self.clocks.known_s(row) >= _SETTLED_S]
        fits = [fit for row in settled if (fit := self.clocks.fit(row)) is not None]
        if not fits:
            return ""
        drifts = [fit.drift_ppm for fit in fits]
        error_ms, delay_ms = max(fit.error_s for fit in fits) * 1e3, max(fit.delay_s for fit in fits) * 1e3
        drift = f"{min(drifts):+.1f}" + (f" to {max(drifts):+.1f}" if max(drifts) - min(drifts) >= 0.1 else "")
        held = f"samples are held for {delay_ms:.1f} ms, which {IN_TIME:.0%} of arrivals need"
        return f"device clock: {drift} ppm, fitted to {error_ms:.3f} ms; {held}"

    def _unknown_line(self) -> str:
        """Return a line with the tile numbers that the floor does not have."""
        if not self._unknown_tiles:
            return ""
        last = len(self.floor.tiles) - 1
        known = f"0 to {last} are {self.floor.ids[0]} to {self.floor.ids[-1]}" if last else "0 is its only tile"
        some = ", ".join(map(str, sorted(self._unknown_tiles)[:8]))
        return f"frames of tile {some}, which the floor does not have ({known})"
