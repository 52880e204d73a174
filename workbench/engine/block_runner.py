"""The work of one block of the live engine: take commands, run the loop, publish results."""

import time
from collections import deque

import numpy as np
from numpy.typing import NDArray

from underfoot.engine.accelerometer_reader import AccelerometerReader, CardReader
from underfoot.engine.commands import Action, Play
from underfoot.engine.further_card import FurtherCard
from underfoot.engine.loop import Loop
from underfoot.engine.rings import HEADER, load_reading, publish, write_rows, write_zeros
from underfoot.engine.session_memory import SessionMemory
from underfoot.engine.status import Field
from underfoot.kernels import block_kernel

_LOAD_SHARE = 0.01  # weight of a block in the running mean of the load


class BlockRunner:
    """Runs `loop` block by block, for the audio callback or the clock, and writes the results to `memory`.

    `inbox` holds `prepared` commands, which are taken at the next block. `load` is the mean fraction of a block's time
    that is used. After a panic, `silenced` is true once the outputs are closed. `accelerometers` on a card are written
    only while `has_input` is true, that is while a stream delivers their input; those on the link always.
    """

    def __init__(self, loop: Loop, memory: SessionMemory) -> None:
        self.loop, self.memory = loop, memory
        self.inbox: deque[Action] = deque()
        self.load = 0.0
        self.silenced = False
        self.accelerometers: AccelerometerReader | None = None
        self.has_input = False
        self.further_cards: tuple[FurtherCard, ...] = ()
        self.block_s = loop.block / loop.rate_hz
        self._panicked = False
        self._worst = memory.status.get(Field.WORST)
        channels, tiles = loop.safety.channels, len(loop.source.floor.tiles)
        in_order = np.array_equal(channels, np.arange(tiles))
        self._played = loop.out if in_order else np.zeros((loop.block, tiles), np.float32)
        source, ring = loop.source, memory.force
        self._write_samples = _write_samples.specialised(
            ring.header, ring.rows, source.stamps, source.arrivals, source.forces, 0
        )
        loop.intake.on_samples = self._write_forces

    def run(self) -> None:
        """Run one block, in the audio callback. Allocates no arrays and takes no locks."""
        began = time.perf_counter()
        loop, memory, n = self.loop, self.memory, self.loop.block
        panic = memory.status.panic
        if panic and not self._panicked:
            loop.panic()
        if panic != self._panicked:
            for card in self.further_cards:
                card.silence(on=panic)
        self._panicked = panic
        while self.inbox:
            action = self.inbox.popleft()
            if not (panic and isinstance(action, Play) and action.on):  # sent before the panic
                loop.send(action)
        loop.run(n)
        self.silenced = panic and loop.safety.closed(loop.frame)
        for card in self.further_cards:
            card.write(loop.out, n)
        self._write_vibration(n)
        if loop.measures:
            memory.commanded.write(loop.commanded, n)
        if loop.plates:
            memory.measured.write(loop.plates["accelerometer"].out, n)
        elif self.accelerometers is not None and (self.has_input or not self.accelerometers.needs_stream):
            self.accelerometers.write(loop.frame - n, n)
        if loop.program.scope_names:
            memory.scope.write(loop.scope_frames, n)
        load = (time.perf_counter() - began) / self.block_s
        self.load += _LOAD_SHARE * (load - self.load)
        self._worst = max(self._worst, load)
        memory.status.put_block(self.load, self._worst, loop.frame, loop.safety.peak)

    def align(self) -> bool:
        """Write the delayed accelerometer input; return whether it can still be aligned. Not for the callback."""
        if not isinstance(self.accelerometers, CardReader):
            return True
        self.accelerometers.align()
        self.memory.status.put(Field.JUMPS, float(self.accelerometers.jumps))
        if self.accelerometers.is_found:
            self.memory.status.put(Field.ROUND_TRIP_S, self.accelerometers.delay_frames / self.loop.rate_hz)
        return not self.accelerometers.is_too_late

    def _write_vibration(self, n: int) -> None:
        loop, ring = self.loop, self.memory.vibration
        if loop.safety.sounded_until <= loop.frame - n:
            ring.write_zeros(n)
            return
        if self._played is not loop.out:
            _gather(loop.out, loop.safety.channels, self._played, n)
        ring.write(self._played, n)

    def _write_forces(self, count: int) -> None:
        source, ring = self.loop.source, self.memory.force
        self._write_samples(ring.header, ring.rows, source.stamps, source.arrivals, source.forces, count)


def load_kernels() -> None:
    """Load the kernels that a block calls besides the loop."""
    header, rows, wide = np.zeros(1, HEADER), np.zeros((1, 1), np.float32), np.zeros((1, 6))
    write_rows(header, rows, rows, 0)
    write_zeros(header, rows, 0)
    load_reading()  # called by others, to be compiled here
    _gather(rows, np.zeros(1, np.int64), rows, 0)
    _write_samples(header, wide, np.zeros(0), np.zeros(0), np.zeros((0, 1, 4)), 0)


@block_kernel
def _gather(out: NDArray[np.float32], channels: NDArray[np.int64], rows: NDArray[np.float32], n: int) -> None:
    """Gather the output of each tile from its channel; 0 for a tile without one."""
    for i in range(n):
        for row in range(rows.shape[1]):
            rows[i, row] = out[i, channels[row]] if channels[row] >= 0 else 0.0


@block_kernel
def _write_samples(
    header: NDArray[np.void],
    ring: NDArray[np.float64],
    stamps: NDArray[np.float64],
    arrivals: NDArray[np.float64],
    forces: NDArray[np.float64],
    n: int,
) -> None:
    """Write force samples to their ring: stamp, arrival, then the corner forces of each tile."""
    at = header[0].written
    for i in range(n):
        row = ring[(at + i) % ring.shape[0]]
        row[0], row[1] = stamps[i], arrivals[i]
        for tile in range(forces.shape[1]):
            for corner in range(4):
                row[2 + 4 * tile + corner] = forces[i, tile, corner]
    publish(header, at + n)
