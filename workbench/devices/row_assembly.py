"""Kernels that map tile samples to the session's clock, and combine those of one instant into one row of forces.

Each tile has a clock of its own, which `device_clock` maps to the session; tiles whose times equal the leader's to the
microsecond are behind one hub, and share its clock. The tile heard first leads: each of its samples begins a row, at
its own time, and a sample of another tile joins the nearest row. Samples that come at twice the rate of rows or faster
share them, and each row has the last. Nothing is interpolated. A tile without a sample for a row is NaN in it, and a
row without any sample is omitted.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.devices import device_clock
from underfoot.devices.device_clock import DeviceClocks
from underfoot.devices.force_source import SampleBuffers
from underfoot.floor.layout import Floor
from underfoot.floor.tracking import OFF_SHARE, ON_N
from underfoot.kernels import block_kernel, kernel

QUEUE = 1 << 16
"""Capacity of the queue of tile samples."""
_ROWS = 1024
_LEFT_S = 0.1  # a leading tile that is silent for this many seconds no longer leads
_NEARLY = 1e-6  # of a row
_WAIT_S = 0.1  # seconds for which the newest row waits for missing tiles

QUEUED = np.dtype(
    [
        ("tile", np.int64),
        ("epoch", np.int64),
        ("time_us", np.float64),
        ("arrived_s", np.float64),
        ("force_n", np.float64, (4,)),
    ],
    align=True,
)
"""A queued sample: the floor's tile, its epoch and own time, its arrival, and its forces."""

TILE = np.dtype(
    [
        ("clock", np.int64),
        ("newest_us", np.float64),
        ("epoch", np.int64),
        ("seen_epoch", np.int64),
        ("force_n", np.float64),
    ],
    align=True,
)
"""State of a tile: the tile whose clock it uses, its newest time in its present epoch (-1: none), and its newest force.
`seen_epoch` is the epoch of the newest sample examined, which its clock may not have observed yet.
"""

PROGRESS = np.dtype(
    [
        ("observed", np.int64),
        ("placed", np.int64),
        ("next_row", np.int64),
        ("newest_row", np.int64),
        ("newest_since", np.int64),
        ("last_stamp", np.float64),
        ("leader", np.int64),
        ("reference_row", np.int64),
        ("reference_frame", np.float64),
        ("reference_us", np.float64),
        ("reference_clock", np.int64),
        ("reference_epoch", np.int64),
        ("leader_us", np.float64),
        ("late", np.int64),
        ("latency", np.float64),
    ],
    align=True,
)
"""Progress of the assembly. Of all samples queued so far, `observed` were passed to the clocks, and `placed` were put
into rows. Rows are numbered; `next_row` is handed over next, `newest_row` was begun last, at session frame
`newest_since`, and `last_stamp` is the stamp of the last one handed over. The reference is the newest sample of the
leading tile: its row, frame and own time, and its clock and epoch. `leader` and `reference_clock` are -1 before the
first sample; `leader_us` is the leader's newest time. `late` samples arrived after their row was handed over.
`latency` is the number of frames from a sample's earliest arrival to the first frame that it changes, averaged over a
second.
"""


class Assembly(NamedTuple):
    """State kept between two blocks. `rate` is session frames per second, `period` frames between two rows.

    Only the reading thread writes to `queue`, and only over samples that are `placed`.
    """

    rate: float
    period: float
    queue: NDArray[np.void]  # (QUEUE,) of QUEUED: a ring
    clocks: NDArray[np.void]  # (tiles,) of device_clock.CLOCK
    session: NDArray[np.void]  # (1,): the session's own clock
    tiles: NDArray[np.void]  # (tiles,) of TILE
    progress: NDArray[np.void]  # (1,) of PROGRESS
    rows: NDArray[np.float64]  # (rows, tiles, 4): a ring
    received: NDArray[np.bool_]  # (rows, tiles): whether `rows` has a sample


def assembly(floor: Floor, rate: float, rate_hz: float, clocks: DeviceClocks, session: DeviceClocks) -> Assembly:
    """Return an assembly of rows of `floor`, whose tiles send `rate_hz` samples per second, for a session at `rate`."""
    tiles = len(floor.tiles)
    made = Assembly(
        rate=float(rate),
        period=rate / rate_hz,
        queue=np.zeros(QUEUE, QUEUED),
        clocks=clocks.table,
        session=session.table,
        tiles=np.zeros(tiles, TILE),
        progress=np.zeros(1, PROGRESS),
        rows=np.zeros((_ROWS, tiles, 4)),
        received=np.zeros((_ROWS, tiles), np.bool_),
    )
    made.tiles["epoch"] = made.tiles["seen_epoch"] = -1
    for name in ("leader", "newest_row", "reference_clock"):
        made.progress[name] = -1
    made.progress["last_stamp"] = -np.inf
    return made


@kernel
def enqueue(
    samples: NDArray[np.void],
    force_n: NDArray[np.float64],
    queue: NDArray[np.void],
    head: int,
    count: int,
    now_s: float,
) -> None:
    """Queue the first `count` samples, `wire_format.SAMPLE`, with their forces (n, 4), as numbers `head` and on."""
    for i in range(count):
        entry, sample = queue[(head + i) % len(queue)], samples[i]
        entry.tile, entry.epoch, entry.time_us = sample.tile, sample.epoch, sample.microseconds
        entry.arrived_s = now_s
        for sensor in range(4):
            entry.force_n[sensor] = force_n[i, sensor]


@block_kernel
def hand_over(
    assembly_parts: tuple[Any, ...], buffers: tuple[Any, ...], head: int, begin: int, end: int, now: float
) -> int:
    """Map the queued samples, up to number `head`, to the session's clock; hand over the rows before frame `end`.

    The block before `end` began at frame `begin`; `now` is the host's time, in frames. Returns the number of rows.
    `assembly_parts` and `buffers` are the parts of an `Assembly` and of `SampleBuffers`: Numba allocates when it is
    given a named tuple.
    """
    assembly, out = Assembly(*assembly_parts), SampleBuffers(*buffers)
    rate, at = assembly.rate, assembly.progress[0]
    device_clock.observe(assembly.session[0], 0, begin / rate * 1e6, now, rate)
    count, delay = 0, _delay(assembly.clocks, now, rate)
    while True:
        has_space = True
        while has_space and at.placed < head:
            if at.placed >= at.observed:
                _observe(assembly, _end_of_epoch(assembly, head), begin, end)
                delay = _delay(assembly.clocks, now, rate)
            has_space = _set(assembly, assembly.queue[at.placed % len(assembly.queue)], delay, begin)
            at.placed += has_space
        before = count
        count = _emit(assembly, out, count, begin, end)
        if at.placed >= head or count == len(out.stamps):
            return count
        if count == before:  # no space for new samples, and the waiting ones are of a distant time
            assembly.received[:] = False
            at.next_row = at.newest_row + 1


@kernel
def _end_of_epoch(assembly: Assembly, head: int) -> int:
    """Return the number of the next sample, after the first that waits, at which a tile restarts; `head` for none.

    Samples sent before a tile's clock stepped are mapped with the clock's state before the step.
    """
    observed = assembly.progress[0].observed
    for i in range(observed, head):
        entry = assembly.queue[i % len(assembly.queue)]
        tile = assembly.tiles[entry.tile]
        if i > observed and 0 <= tile.seen_epoch != entry.epoch:
            return i
        tile.seen_epoch = entry.epoch
    return head


@kernel
def _observe(assembly: Assembly, until: int, begin: int, end: int) -> None:
    """Pass all samples queued since the last call, up to number `until`, to the clocks.

    This precedes the mapping of any of them: the last sample of a delayed burst gives the best estimate.
    """
    rate, at = assembly.rate, assembly.progress[0]
    most = device_clock.MAX_DELAY_S * rate + end - begin
    for i in range(at.observed, until):
        entry = assembly.queue[i % len(assembly.queue)]
        k = _clock_of(assembly.tiles, at, entry)
        epoch = entry.epoch if k == entry.tile else assembly.clocks[k].epoch
        device_clock.observe(assembly.clocks[k], epoch, entry.time_us, entry.arrived_s * rate, rate)
    for i in range(at.observed, until):
        entry = assembly.queue[i % len(assembly.queue)]
        clock = assembly.clocks[assembly.tiles[entry.tile].clock]
        late = begin - session_frame(assembly, clock, entry.time_us)
        device_clock.note_lateness(clock, entry.arrived_s * rate, late, most, assembly.period, rate)
    at.observed = until


@kernel
def _set(assembly: Assembly, entry: np.record, delay: float, begin: int) -> bool:
    """Map a sample to the session's clock and put it into its row; return False if there is no space for it yet."""
    at, clock = assembly.progress[0], assembly.clocks[assembly.tiles[entry.tile].clock]
    sent = session_frame(assembly, clock, entry.time_us)
    assembly.tiles[entry.tile].force_n = entry.force_n.sum()
    jump = device_clock.JUMP_S * assembly.rate
    step = device_clock.step_to(clock, entry.time_us, sent + delay, assembly.rate)
    if abs(step) > jump and _is_loaded(assembly.tiles, assembly.tiles[entry.tile].clock):
        jump = min(device_clock.LOADED_JUMP_S * assembly.rate, 0.5 * len(assembly.rows) * assembly.period)
    frame = device_clock.slewed(clock, entry.time_us, sent + delay, assembly.rate, jump)
    if not _place(assembly, entry, frame, clock.epoch, begin):
        return False
    at.latency += (max(frame, begin) - sent - at.latency) * assembly.period / (assembly.rate * len(assembly.tiles))
    return True


@kernel
def _is_loaded(tiles: NDArray[np.void], clock: int) -> bool:
    """Return whether a contact may be on a tile that uses this clock."""
    loaded = False
    for j in range(len(tiles)):
        loaded |= tiles[j].clock == clock and tiles[j].force_n >= OFF_SHARE * ON_N
    return loaded


@kernel
def session_frame(assembly: Assembly, clock: np.record, time_us: float) -> float:
    """Return the session frame of a device time, before any delay."""
    arrived = device_clock.arrival_frame(clock, time_us, assembly.rate)
    return device_clock.sent_frame(assembly.session[0], arrived, assembly.rate)


@kernel
def _delay(clocks: NDArray[np.void], now: float, rate: float) -> float:
    """Return the largest playout delay of the clocks heard in the last second."""
    delay = 0.0
    for k in range(len(clocks)):
        if clocks[k].epoch >= 0 and now - clocks[k].heard < rate:
            delay = max(delay, clocks[k].delay)
    return delay


@kernel
def _clock_of(tiles: NDArray[np.void], at: np.record, entry: np.record) -> int:
    """Return the tile whose clock this sample uses."""
    k = entry.tile
    if at.leader < 0:
        at.leader = k
    leader = at.leader
    if tiles[k].epoch != entry.epoch:
        tiles[k].epoch, tiles[k].clock = entry.epoch, k
    tiles[k].newest_us = entry.time_us
    for j in range(len(tiles)) if k == leader else range(k, k + 1):
        if tiles[j].newest_us == tiles[leader].newest_us and tiles[j].epoch >= 0:
            tiles[j].clock = tiles[leader].clock
    return tiles[k].clock


@kernel
def _place(assembly: Assembly, entry: np.record, frame: float, epoch: int, begin: int) -> bool:
    """Put a sample into its row; return False if other rows must be handed over first."""
    at, k, period = assembly.progress[0], entry.tile, assembly.period
    if at.reference_clock < 0:
        at.reference_frame = frame
    clock = assembly.tiles[k].clock
    apart, period_us, is_fast = (frame - at.reference_frame) / period, 1e6 * period / assembly.rate, False
    if clock == at.reference_clock and epoch == at.reference_epoch:
        apart = (entry.time_us - at.reference_us) / period_us  # not affected by slewing
        is_fast = k == at.leader and 0.0 <= entry.time_us - at.leader_us <= 0.5 * period_us
    rows = int(np.floor(apart + _NEARLY)) if is_fast else int(np.rint(apart))
    row = at.reference_row + rows
    if row >= at.next_row + len(assembly.rows):
        if at.next_row <= at.newest_row:
            return False
        at.next_row = row - len(assembly.rows) // 2
        at.newest_row = at.next_row - 1
    if is_fast:  # several samples in a row: it keeps its time, or none would ever begin another
        at.reference_row, at.reference_us = row, at.reference_us + rows * period_us
        at.reference_frame, at.leader_us = frame - (apart - rows) * period, entry.time_us
    elif k == at.leader or frame - at.reference_frame > _LEFT_S * assembly.rate:
        at.leader, at.reference_row, at.reference_frame, at.reference_us = k, row, frame, entry.time_us
        at.leader_us = entry.time_us
        at.reference_clock, at.reference_epoch = clock, epoch
    if row < at.next_row:
        at.late += 1
        return True
    place = row % len(assembly.rows)
    assembly.received[place, k] = True
    for sensor in range(4):
        assembly.rows[place, k, sensor] = entry.force_n[sensor]
    if row > at.newest_row:
        at.newest_row, at.newest_since = row, begin
    return True


@kernel
def _emit(assembly: Assembly, out: SampleBuffers, count: int, begin: int, end: int) -> int:
    """Hand over the rows due before frame `end`, after the `count` already there; return the new count."""
    at, rows, received, period = assembly.progress[0], assembly.rows, assembly.received, assembly.period
    while at.next_row <= at.newest_row and count < len(out.stamps):
        frame = at.reference_frame + (at.next_row - at.reference_row) * period
        if frame >= end:
            break
        place = at.next_row % len(rows)
        is_newest = at.next_row == at.newest_row
        if is_newest and begin - at.newest_since < _WAIT_S * assembly.rate and not received[place].all():
            break  # the rest of it may still arrive
        some = False
        for k in range(rows.shape[1]):
            for sensor in range(4):
                out.forces[count, k, sensor] = rows[place, k, sensor] if received[place, k] else np.nan
            some |= received[place, k]
            received[place, k] = False
        if some:
            out.stamps[count] = max(frame, at.last_stamp + 0.01 * period)
            out.arrivals[count] = max(begin, 0)
            at.last_stamp = out.stamps[count]
            count += 1
        at.next_row += 1
    return count
