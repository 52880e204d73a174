"""What paces the engine's blocks: a sound card's stream, or the clock where there is none or it has ended."""

import threading
import time
from collections.abc import Callable

from underfoot.clock import SPAN
from underfoot.devices.sound import Stream
from underfoot.engine.block_runner import BlockRunner
from underfoot.engine.status import Field
from underfoot.engine.target import Target
from underfoot.errors import DeviceError

_LATE_S = 0.05  # a block by the clock that is later than this counts as an xrun


class Pacer:
    """Has blocks run at the right pace until `leave` is set. `tell` is called with a line for the person."""

    def __init__(self, runner: BlockRunner, target: Target, tell: Callable[[str], None]) -> None:
        self.leave = threading.Event()
        self._runner, self._target, self._tell = runner, target, tell
        self._status = runner.memory.status
        self._address = runner.loop.out.ctypes.data
        self._late = 0
        self._stream: Stream | None = None
        self._status.put(Field.LATENCY_S, runner.block_s + SPAN / target.rate)

    @property
    def has_stream(self) -> bool:
        """Whether a sound card plays."""
        return self._stream is not None

    def open(self) -> str:
        """Open the sound card, if one is wanted; why there is none, otherwise."""
        target, loop, accelerometers = self._target, self._runner.loop, self._runner.accelerometers
        self._stream = None
        self._runner.hears = False
        if target.sound is None:
            return ""
        try:
            channels, latency = loop.out.shape[1], target.latency_s or "low"
            heard = accelerometers.heard if accelerometers else None
            self._stream = Stream(target.sound, channels, target.rate, target.block, self.fill, latency, heard)
        except DeviceError as error:
            return f"{error}; going on without sound"
        measured_s = target.round_trip_frames / target.rate
        self._status.put(Field.ROUND_TRIP_S, measured_s)
        self._status.put(Field.STREAM_LATENCY_S, 0.5 * measured_s or self._stream.latency_s)
        if accelerometers:
            reported = round(self._stream.round_trip_s * target.rate)
            accelerometers.delay_frames = target.round_trip_frames or reported
        silent = [t.id for t, channel in zip(target.floor.tiles, loop.channels, strict=True) if channel < 0]
        notices = [f"tiles without a channel: {', '.join(silent)}"] if silent else []
        if loop.program.has_sound and loop.safety.sound_channel < 0:
            notices.append("no channel is left behind the tiles' for Sound")
        return "; ".join(notices)

    def run(self) -> None:
        """Let the sound card play, and where it does not, run blocks by the clock, until it is time to leave."""
        self._start()
        while not self.leave.is_set():
            if self._stream is None or self._stream.finished:
                self._run_by_clock()
            else:
                self.leave.wait(0.05)

    def close(self) -> None:
        """Let go of the sound card; the ramp down is over."""
        if self._stream is not None and not self._stream.finished:
            self._stream.abort()
        if self._stream is not None:
            self._stream.close()

    def fill(self) -> int:
        """The stream's callback: the address of the next block, or 0 to end the stream and drop what is buffered."""
        if self.leave.is_set() or self._runner.silenced:
            return 0
        self._runner.hears = True
        self._run_block()
        return self._address

    def _run_block(self) -> None:
        self._runner.run()
        self._status.put(Field.XRUNS, float(self._late + (self._stream.underruns if self._stream else 0)))

    def _start(self) -> None:
        """Let the sound card play, or go on without it."""
        if self._stream is None:
            return
        try:
            self._stream.start()
        except DeviceError as error:
            self._stream.close()
            self._stream = None
            self._tell(f"{error}; going on without sound")

    def _resume(self, ended: Stream) -> None:
        """Play on in a new stream: PortAudio would wait for ever for one whose card has gone away."""
        self._late += ended.underruns
        ended.close()
        notice = self.open()
        if self._stream is None:
            self._tell(notice)
        self._start()

    def _run_by_clock(self) -> None:
        """Blocks at their own pace while no stream does it; after a panic, until sound is let out again."""
        due = time.monotonic()
        self._runner.hears = False
        while not self.leave.is_set():
            if self._stream is not None and not self._status.panic and not self._runner.silenced:
                self._resume(self._stream)
                return
            self._run_block()
            due += self._runner.block_s
            wait = due - time.monotonic()
            if wait > 0.0:
                time.sleep(wait)
            elif wait < -_LATE_S:
                self._late += 1
                due = time.monotonic()
