"""A floor on a line: what its tiles send, as corner forces on the session's clock.

Tile number n on the wire is the floor's tile in row n, counted from 0. Each tile has a clock of its own, and what came
of it is set to the session by `timing`; tiles whose times are the leading one's to the microsecond stand behind one
hub, and share its clock. The tile that was heard first leads: each of its samples makes a row, at its
own time, and a sample of another tile joins the row that it is nearest to. Nothing is interpolated. A tile of which
no sample belongs to a row is NaN in it, and a row to which none belongs is not there.
"""

import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from underfoot.devices import device_clock
from underfoot.devices.conversion import Conversion
from underfoot.devices.device import Port, room
from underfoot.devices.framing.parser import LIFE, WIDTH, Counts
from underfoot.devices.framing.wire_format import MICROSECONDS, READINGS, TILE
from underfoot.devices.health.sensor_health import SensorHealth
from underfoot.devices.transports.reader import Link
from underfoot.errors import require
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile
from underfoot.kernels import kernel

SENSOR_HZ = 1000.0
"""Samples a second of a tile, unless it is said otherwise."""

_INBOX = 1 << 16
_ROWS = 1024
_SETTLED_S = 5.0  # after which a clock's fit is told
_WRONG_RATE = 0.1
# What waits in the inbox: the tile's row, its life, its time in microseconds, when it came (s), and its forces.
_ROW, _LIFE, _TIME, _CAME, _FORCE, _ENTRY = 0, 1, 2, 3, 4, 8
# Where the rows stand: the next to hand over; the last that was begun, and when; the stamp of the last handed over; the
# leading tile, and its newest sample: its row, frame, time, and by which clock in which life; what came too late; and
# how much of the inbox is done.
_NEXT, _LAST, _LAST_AT, _BEFORE, _LEADER, _AT, _AT_FRAME, _AT_TIME, _AT_CLOCK, _AT_LIFE, _DROPPED, _PLACED = range(12)
_PLACE = 12
_LEFT_S = 0.1  # a leading tile that is silent for this long leads no more
_WAIT_S = 0.1  # so long the newest row waits for tiles that are not in it yet
# What is known of a tile: the row whose clock it goes by, and its newest time, in its present life.
_CLOCK, _NEWEST, _ALIVE, _TILE = range(4)


class LinkedFloor:
    """The force of `floor` as it comes over `port`, from session frame `frame` on. Reads from `start` to `close`."""

    def __init__(
        self,
        port: Port,
        floor: Floor,
        rate: float,
        profiles: Mapping[str, Profile] | None = None,
        rate_hz: float = SENSOR_HZ,
        frame: int = 0,
        form: str = "auto",
    ) -> None:
        require(20.0 <= rate_hz <= 100_000.0, "rate_hz", rate_hz, "20 to 100000 Hz")
        self.floor, self.rate_hz = floor, rate_hz
        self.stamps, self.arrivals, self.forces = room(floor)
        self.clocks = device_clock.Clocks(len(floor.tiles), rate)
        self._session = device_clock.Clocks(1, rate)
        self._rate = float(rate)
        self._begin = self._end = frame
        self._since = time.monotonic()
        self._inbox = np.zeros((_INBOX, _ENTRY))
        self._head = self._seen = 0  # written by the reading thread, and by `pull`: whole numbers, one writer each
        self._place = np.zeros(_PLACE)
        self._place[[_LEADER, _LAST, _AT_CLOCK]] = -1.0
        self._place[_BEFORE] = -np.inf
        self._tiles = np.zeros((len(floor.tiles), _TILE))
        self._tiles[:, _ALIVE] = -1.0
        self._rows = np.zeros((_ROWS, len(floor.tiles), 4))
        self._have = np.zeros((_ROWS, len(floor.tiles)), np.bool_)
        self._conversion = Conversion(floor, profiles or {})
        self._health = SensorHealth(floor, rate_hz)
        self._strangers: set[int] = set()
        self._told: set[str] = set()
        self._overflown = 0
        self._link = Link(port, self._hear, form)
        self._link.news.extend(self._conversion.lines)
        self._hear(np.zeros((0, WIDTH), np.int64), self._since)
        self.pull(frame)  # which has no sample yet, but loads the kernels before they are needed in time
        self._session.state[:, device_clock.LIFE] = -1.0

    def start(self) -> None:
        """Begin to read; returns at once, whether or not there is something to read."""
        self._link.start()

    def close(self) -> None:
        """Stop reading, and let go of the port."""
        self._link.close()

    @property
    def counts(self) -> Counts:
        """What became of the frames that came."""
        return self._link.counts

    @property
    def late(self) -> int:
        """Samples that came when the row they belong to had been handed over."""
        return int(self._place[_DROPPED])

    def news(self) -> list[str]:
        """What happened since the last call, a line each. Not for the callback."""
        lines = []
        while self._link.news:
            lines.append(self._link.news.popleft())
        lines += self._health.news()
        lines += self._once("clocks", self._clock_line())
        lines += self._once("rate", self._rate_line())
        if self._overflown:
            lines += self._once("overflow", "samples come faster than they are taken; some are dropped")
        if self._strangers:
            last = len(self.floor.tiles) - 1
            known = f"0 to {last} are {self.floor.ids[0]} to {self.floor.ids[-1]}" if last else "0 is its only tile"
            some = ", ".join(map(str, sorted(self._strangers)[:8]))
            lines += self._once("strangers", f"frames of tile {some}, which the floor does not have ({known})")
        return lines

    def pull(self, end: int) -> int:
        """The samples before session frame `end`. Allocates nothing."""
        now = (time.monotonic() - self._since) * self._rate
        head = self._head
        if end > self._end:
            self._begin, self._end = self._end, end
        count = _take(
            self.stamps, self.arrivals, self.forces, self._inbox, self._seen, head, self._begin, end, now,
            self.clocks.state, self.clocks.windows, self._session.state, self._session.windows, self._place,
            self._tiles, self._rows, self._have, self._rate, self._rate / self.rate_hz,
        )  # fmt: skip
        self._seen = head
        return count

    def _hear(self, frames: NDArray[np.int64], now: float) -> None:
        """In the reading thread: turn readings into newtons, and put them where `pull` finds them."""
        known = frames[:, TILE] < len(self.floor.tiles)
        if not known.all():
            self._strangers.update(frames[~known, TILE].tolist())
            frames = frames[known]
        readings = frames[:, READINGS:LIFE]
        time_s = frames[:, MICROSECONDS].astype(np.float64) * 1e-6
        newtons = self._conversion.newtons(frames[:, TILE], readings, time_s, frames[:, LIFE])
        free = _INBOX - (self._head - int(self._place[_PLACED]))
        taken = min(len(frames), free)
        self._overflown += len(frames) - taken
        _put(frames, newtons, self._inbox, self._head, taken, now - self._since)
        self._head += taken
        self._health.feed(frames[:, TILE], time_s, readings, newtons)

    def _once(self, key: str, line: str) -> list[str]:
        if not line or key in self._told:
            return []
        self._told.add(key)
        return [line]

    def _clock_line(self) -> str:
        """What is known of the clocks, when that has settled."""
        settled = self.clocks.state[:, device_clock.COUNT] * device_clock.WINDOW_US * 1e-6 >= _SETTLED_S
        fits = [fit for row in np.flatnonzero(settled) if (fit := self.clocks.fit(int(row))) is not None]
        if not fits:
            return ""
        drifts = [fit.drift_ppm for fit in fits]
        error, late = (max(getattr(fit, name) for fit in fits) * 1e3 for name in ("error_s", "late_s"))
        drift = f"{min(drifts):+.1f}" + (f" to {max(drifts):+.1f}" if max(drifts) - min(drifts) >= 0.1 else "")
        return f"device clock: {drift} ppm, fitted to {error:.3f} ms; samples are held for {late:.1f} ms against jitter"

    def _rate_line(self) -> str:
        """Say so where tiles do not sample as often as they were said to."""
        for row, tile in enumerate(self.floor.tiles):
            period = self._link.period_us(row)
            if period > 0 and abs(period * 1e-6 * self.rate_hz - 1.0) > _WRONG_RATE:
                return f"tile {tile.id} sends {1e6 / period:.0f} samples a second, not {self.rate_hz:.0f}"
        return ""


@kernel
def _put(frames, newtons, inbox, head, count, now):
    for i in range(count):
        entry = inbox[(head + i) % len(inbox)]
        entry[_ROW], entry[_LIFE], entry[_TIME] = frames[i, TILE], frames[i, LIFE], frames[i, MICROSECONDS]
        entry[_CAME] = now
        for sensor in range(4):
            entry[_FORCE + sensor] = newtons[i, sensor]


@kernel
def _take(
    stamps, arrivals, forces, inbox, seen, head, begin, end, now, clocks, windows, session, session_windows, place,
    tiles, rows, have, rate, period,
):  # fmt: skip
    """Set what came to the session's clock, and hand over the rows before `end`: how many there are."""
    ours = session[0]
    device_clock.observe(ours, session_windows[0], 0.0, begin / rate * 1e6, now, rate)
    # All that came is seen before any of it is set: the last of a heap that was held up knows best.
    for i in range(seen, head):
        entry = inbox[i % len(inbox)]
        k = _clock_of(entry, place, tiles)
        life = entry[_LIFE] if k == entry[_ROW] else clocks[k, device_clock.LIFE]
        device_clock.observe(clocks[k], windows[k], life, entry[_TIME], entry[_CAME] * rate, rate)
    late = 0.0
    for i in range(seen, head):
        entry = inbox[i % len(inbox)]
        clock = clocks[int(tiles[int(entry[_ROW]), _CLOCK])]
        device_clock.note_late(
            clock, begin - device_clock.sent(ours, device_clock.arrival(clock, entry[_TIME], rate), rate), rate
        )
    for k in range(len(clocks)):
        if clocks[k, device_clock.LIFE] >= 0.0 and now - clocks[k, device_clock.HEARD] < rate:
            late = max(late, clocks[k, device_clock.LATE])
    count, grace = 0, _WAIT_S * rate
    while True:
        while place[_PLACED] < head:
            entry = inbox[int(place[_PLACED]) % len(inbox)]
            clock = clocks[int(tiles[int(entry[_ROW]), _CLOCK])]
            frame = device_clock.sent(ours, device_clock.arrival(clock, entry[_TIME], rate), rate) + late
            frame = device_clock.settle(clock, entry[_TIME], frame, rate)
            if not _put_in_row(entry, frame, clock[device_clock.LIFE], begin, place, tiles, rows, have, rate, period):
                break
            place[_PLACED] += 1.0
        before = count
        count = _hand_over(stamps, arrivals, forces, count, begin, end, place, rows, have, period, grace)
        if place[_PLACED] >= head or count == len(stamps):
            return count
        if count == before:  # no room for what comes, and what waits is of a time far off
            have[:] = False
            place[_NEXT] = place[_LAST] + 1.0


@kernel
def _clock_of(entry, place, tiles):
    """The row whose clock this sample goes by."""
    k = int(entry[_ROW])
    if place[_LEADER] < 0.0:
        place[_LEADER] = k
    leader = int(place[_LEADER])
    if tiles[k, _ALIVE] != entry[_LIFE]:
        tiles[k, _ALIVE], tiles[k, _CLOCK] = entry[_LIFE], k
    tiles[k, _NEWEST] = entry[_TIME]
    for j in range(len(tiles)) if k == leader else range(k, k + 1):
        if tiles[j, _NEWEST] == tiles[leader, _NEWEST] and tiles[j, _ALIVE] >= 0.0:
            tiles[j, _CLOCK] = tiles[leader, _CLOCK]
    return int(tiles[k, _CLOCK])


@kernel
def _put_in_row(entry, frame, life, begin, place, tiles, rows, have, rate, period):
    """Put a sample into its row; False where there is no room for it before others are handed over."""
    k = int(entry[_ROW])
    if place[_AT_CLOCK] < 0.0:
        place[_AT_FRAME] = frame
    apart = (frame - place[_AT_FRAME]) / period
    if tiles[k, _CLOCK] == place[_AT_CLOCK] and life == place[_AT_LIFE]:
        apart = (entry[_TIME] - place[_AT_TIME]) * rate * 1e-6 / period  # which moves of the mapping do not touch
    n = place[_AT] + np.rint(apart)
    if n >= place[_NEXT] + len(rows):
        if place[_NEXT] <= place[_LAST]:
            return False
        place[_NEXT] = n - len(rows) // 2
        place[_LAST] = place[_NEXT] - 1.0
    if k == place[_LEADER] or frame - place[_AT_FRAME] > _LEFT_S * rate:
        place[_LEADER], place[_AT], place[_AT_FRAME], place[_AT_TIME] = k, n, frame, entry[_TIME]
        place[_AT_CLOCK], place[_AT_LIFE] = tiles[k, _CLOCK], life
    if n < place[_NEXT]:
        place[_DROPPED] += 1.0
        return True
    at = int(n) % len(rows)
    have[at, k] = True
    for sensor in range(4):
        rows[at, k, sensor] = entry[_FORCE + sensor]
    if n > place[_LAST]:
        place[_LAST], place[_LAST_AT] = n, begin
    return True


@kernel
def _hand_over(stamps, arrivals, forces, count, begin, end, place, rows, have, period, grace):
    while place[_NEXT] <= place[_LAST] and count < len(stamps):
        frame = place[_AT_FRAME] + (place[_NEXT] - place[_AT]) * period
        if frame >= end:
            break
        at = int(place[_NEXT]) % len(rows)
        if place[_NEXT] == place[_LAST] and begin - place[_LAST_AT] < grace and not have[at].all():
            break  # the rest of it may be on its way
        some = False
        for k in range(rows.shape[1]):
            for sensor in range(4):
                forces[count, k, sensor] = rows[at, k, sensor] if have[at, k] else np.nan
            some |= have[at, k]
            have[at, k] = False
        if some:
            stamps[count] = max(frame, place[_BEFORE] + 0.01 * period)
            arrivals[count] = max(begin, 0)
            place[_BEFORE] = stamps[count]
            count += 1
        place[_NEXT] += 1.0
    return count
