"""Pacing of the engine's blocks: by a sound card's stream, or by the clock where there is none or it has ended."""

import math
import threading
import time
from collections.abc import Callable, Sequence

import numpy as np

from underfoot.clock import FADE, SPAN
from underfoot.devices.outputs import CardChannels
from underfoot.devices.sound import Stream, is_loaded, list_anew, listed_name
from underfoot.engine.block_runner import BlockRunner
from underfoot.engine.further_streams import FurtherStreams
from underfoot.engine.reports import NO_ANSWER, SOUND_CARD, Notice, OutputChanged
from underfoot.engine.status import Field
from underfoot.engine.target import Target
from underfoot.errors import DeviceError

_LATE_S = 0.05  # lateness at which a block paced by the clock counts as an xrun
_STOOD_S = 1.0  # time without a block, as of a process that stood still, in which every card's buffer has run out
_LISTING_S = 5.0  # time after which a list of cards that does not come is told
_BUFFERED_S = 0.060  # a ramp down, and what a sound server buffers beyond its reported latency


class Pacer:
    """Runs blocks at the right pace until `leave` is set. `notify` receives messages for the user.

    `there` has the cards that another process has found, as in `CardsThere`; it is taken from there.
    """

    def __init__(
        self, runner: BlockRunner, target: Target, cards: Sequence[CardChannels], notify: Callable[[Notice], None]
    ) -> None:
        self.leave = threading.Event()
        self.there: dict[str, str] | None = None
        self._runner, self._target, self._notify = runner, target, notify
        self._status = runner.memory.status
        self._first = cards[0] if cards else None
        self._further = FurtherStreams(cards[1:], runner, target, self.leave.is_set, self._tell_output)
        width = self._first.count if self._first else 0
        self._own_channels = runner.loop.out[:, :width]
        self._out = runner.loop.out if width in (0, runner.loop.out.shape[1]) else self._own_channels.copy()
        self._address = self._out.ctypes.data
        self._is_away = False
        self._late, self._refusal = 0, ""
        self._listing: threading.Thread | None = None
        self._listing_s, self._is_pause_told = math.inf, False
        self._tried: set[str] = set()  # cards that were listed while the others were interrupted, since they came
        self._ramp = np.linspace(0.0, 1.0, FADE, dtype=np.float32)[:, None]
        self._opened = FADE  # how far the ramp from silence is played; one that ends goes back from there
        self._is_ending = False
        self._filled_s = math.inf
        self._stood_s = 0.0  # how long no block was asked for, until it is told
        self._stream: Stream | None = None
        self._status.put(Field.LATENCY_S, runner.block_s + SPAN / target.rate)

    @property
    def where(self) -> str:
        """The device that plays, as in `Started`."""
        forces_from = "the simulator" if self._target.kind == "simulator" else self._target.kind
        plays = self._stream is not None or self._further.any_playing
        return SOUND_CARD if plays else f"{forces_from}, without sound"

    @property
    def silence(self) -> str:
        """Which cards do not play that should; "" for none."""
        silent = self._further.silence
        if self._is_away and self._first is not None:
            silent = (f"{self._first.name} is not there", *silent)
        return "; ".join(silent)

    def open(self) -> str:
        """Open the sound card, if one is wanted; return the reason if that fails."""
        target, loop, accelerometers = self._target, self._runner.loop, self._runner.accelerometers
        self._stream = None
        self._runner.has_input = False
        if self._first is None:
            return ""
        try:
            name, channels, latency = self._first.output.name, self._first.count, target.latency_s or "low"
            recorded = accelerometers.recorded if accelerometers else None
            self._stream = Stream(name, channels, target.rate, target.block, self.fill, latency, recorded)
        except DeviceError as error:
            self._is_away = True
            self._status.put(Field.STREAM_LATENCY_S, 0.0)
            further = self._further.open()
            silent = [self._without_sound()] if self._further.any_playing else []
            self._refusal = str(error)
            return "; ".join((self._refusal, *silent, *further))
        self._status.put(Field.ROUND_TRIP_S, target.round_trip_frames / target.rate)
        self._publish_latency(self._stream)
        if accelerometers:
            reported = round(accelerometers.delay_s(self._stream) * target.rate)
            trip = target.round_trip_frames if accelerometers.needs_stream else target.round_trip_frames // 2
            accelerometers.delay_frames = trip or reported
        silent = [t.id for t, channel in zip(target.floor.tiles, loop.channels, strict=True) if channel < 0]
        notices = [f"tiles without a channel: {', '.join(silent)}"] if silent else []
        notices += self._further.open()
        if loop.program.lacks_sound:
            notices.append("no channel is left behind the tiles' for Sound")
        return "; ".join(notices)

    def run(self) -> None:
        """Play on the sound card, or without one run blocks by the clock, until asked to leave."""
        self._start()
        while not self.leave.is_set():
            if self._stream is None or self._stream.finished:
                self._run_by_clock()
            else:
                self._keep()
                self._publish_latency(self._stream)
                if not self._runner.align():
                    line = "what the sound card hears has fallen far behind: its stream is opened anew"
                    self._notify(Notice(line))
                    self._stream.abort()
                self.leave.wait(0.05)
                self._use_found()

    def close(self) -> None:
        """Close the sound card, after the ramp down."""
        if self._stream is not None and not self._stream.finished:
            self._stream.abort()
        if self._stream is not None:
            self._stream.close()
        self._further.close()

    def fill(self) -> int:
        """Return the address of the next block, or 0 to end the stream and drop its buffer; the stream's callback.

        A block ramps up where the card was silent before it.
        """
        if self.leave.is_set() or self._runner.silenced:
            return 0
        self._runner.has_input = True
        now_s = time.perf_counter()
        if now_s - self._filled_s > _STOOD_S:
            self._opened, self._stood_s = 0, now_s - self._filled_s
        self._filled_s = now_s
        self._run_block()
        if self._out is not self._runner.loop.out:
            np.copyto(self._out, self._own_channels)
        if self._is_ending:
            n = min(len(self._out), self._opened)
            self._opened -= n
            down = self._ramp[self._opened : self._opened + n][::-1]
            np.multiply(self._out[:n], down, out=self._out[:n])
            self._out[n:] = 0.0
        elif self._opened < FADE:
            n = min(len(self._out), FADE - self._opened)
            np.multiply(self._out[:n], self._ramp[self._opened : self._opened + n], out=self._out[:n])
            self._opened += n
        return self._address

    @property
    def ramp_down_s(self) -> float:
        """Time in seconds in which a ramp down that begins now is heard."""
        latency_s = max(self._status.get(Field.STREAM_LATENCY_S), self._further.latency_s)
        return _BUFFERED_S + 4 * self._runner.block_s + latency_s

    def _run_block(self) -> None:
        self._runner.run()
        own = self._late + (self._stream.underruns if self._stream else 0)
        self._status.put(Field.XRUNS, float(own + self._further.underruns))

    def _publish_latency(self, stream: Stream) -> None:
        """Publish the output latency: by the card's clock, else half of a measured round trip, else as requested.

        If the clock reports both directions, each is given half of the difference to a measured round trip.
        """
        trip_s = self._status.get(Field.ROUND_TRIP_S)
        out_s, in_s = stream.stamped_output_latency_s, stream.stamped_input_latency_s
        self._status.put(Field.CLOCK_TRIP_S, out_s + in_s if in_s else 0.0)
        if out_s and in_s and trip_s:
            out_s = max(out_s + 0.5 * (trip_s - out_s - in_s), 0.0)
        found_s = out_s or 0.5 * trip_s or stream.latency_s
        self._status.put(Field.STREAM_LATENCY_S, min(found_s, trip_s or found_s))

    def _start(self) -> None:
        """Start the sound card, or continue without it."""
        if self._stream is None:
            return
        try:
            self._stream.start()
        except DeviceError as error:
            self._stream.close()
            self._stream, self._is_away = None, True
            self._tell_output(f"{error}; {self._without_sound()} until it does")

    def _resume(self, ended: Stream) -> None:
        """Continue in a new stream: PortAudio would wait for ever for one whose card has gone."""
        self._late += ended.underruns
        ended.close()
        self.open()
        if self._stream is None:
            self._tell_loss()
        self._start()

    def _keep(self) -> None:
        """Look after further cards, publish whether a card is to be looked for, and tell what stood still."""
        self._further.keep()
        if self._stood_s:
            lost = f"for {self._stood_s:.1f} s nothing was played, nor taken from the floor"
            self._notify(Notice(f"{lost}: the sound card, its server or this program stood still"))
            self._stood_s = 0.0
        is_missing = (self._is_away or self._further.any_missing) and is_loaded()
        self._status.put(Field.MISSING, float(is_missing))

    def _use_found(self) -> None:
        """Open missing cards that are there now.

        Where PortAudio does not list one, as it was not there when it made its list, it lists anew, for which all
        streams must end: once for a card that has come, unless it was away again as the list was made.
        """
        there, self.there = self.there, None
        if there is None or self._first is None or self._listing is not None:
            return
        self._tried &= there.keys()
        left, first = self._further.open_found(there), self._first.output.name
        if self._is_away and first in there:
            if self._further.any_open and listed_name(first) == there[first]:
                self._return()
            if self._is_away:
                left.add(first)
        plays = self._stream is not None or self._further.any_open
        if left - self._tried if plays else left:
            self._tried |= left
            if plays:
                self._tell_pause("a sound card has come; the others pause until the cards are listed")
            self._end_streams()
            self._listing = threading.Thread(target=list_anew, name="cards", daemon=True)  # it may wait for a server
            self._listing.start()
            self._listing_s = time.perf_counter()

    def _await_list(self) -> None:
        """Open the cards once PortAudio has listed them; tell if it does not: nothing plays meanwhile."""
        if self._listing is None:
            return
        if not self._listing.is_alive():
            self._listing = None
            self._tried = {name for name in self._tried if listed_name(name)}  # a loose plug was out
            self._return()
            if self._is_pause_told:
                self._tell_output("the sound card and its server answer again")
        elif time.perf_counter() - self._listing_s > _LISTING_S:
            self._listing_s = math.inf
            self._tell_pause(NO_ANSWER)

    def _tell_pause(self, line: str) -> None:
        """Report that nothing plays, until something else is told."""
        self._is_pause_told = True
        self._notify(OutputChanged(line, self.where, line))

    def _end_streams(self) -> None:
        """End all streams, in a ramp."""
        self._is_ending = True
        self._further.silence_all()
        if self._stream is not None or self._further.any_open:
            self.leave.wait(self.ramp_down_s)
        if self._stream is not None:
            self._late += self._stream.underruns
        self.close()
        self._stream, self._is_ending = None, False

    def _return(self) -> None:
        """Play on the cards that are there now."""
        before, was_away = self._refusal, self._is_away
        self.open()
        if self._first is None:
            return
        if self._stream is None and not was_away:
            self._tell_loss()
        elif self._stream is None and self._refusal != before and listed_name(self._first.output.name):
            self._notify(Notice(self._refusal))  # as where it has too few channels
        if self._stream is not None:
            self._is_away = False
            self._start()
            if was_away and not self._is_away:
                self._tell_output(f"{self._first.name} is back")

    def _tell_loss(self) -> None:
        """Report that the first card, if there is one, has gone."""
        if self._first is not None:
            self._tell_output(f"{self._first.name} has gone; {self._without_sound()} until it is back")

    def _tell_output(self, line: str) -> None:
        """Report the state of a card, and the tiles that are silent now."""
        self._is_pause_told = False
        self._notify(OutputChanged(line, self.where, self.silence))

    def _without_sound(self) -> str:
        """Return the tiles that are silent without the first card, as text."""
        loop = self._runner.loop
        if not self._further.any_playing or self._first is None:
            return "going on without sound"
        tiles = zip(loop.source.floor.ids, loop.channels, strict=True)
        return f"silent: {', '.join(name for name, channel in tiles if channel in self._first)}"

    def _run_by_clock(self) -> None:
        """Run blocks by the clock while no stream does; after a panic, until the outputs are opened again.

        What opening cards takes is caught up: the session's clock would lose it, every time.
        """
        due, late_s = time.perf_counter(), _LATE_S
        self._opened, self._filled_s = 0, math.inf  # the next stream plays from silence
        self._runner.has_input = False
        while not self.leave.is_set():
            if self._stream is not None and not self._status.panic and not self._runner.silenced:
                self._resume(self._stream)
                return
            began_s = time.perf_counter()
            if self._stream is None:
                self._use_found()
                self._await_list()
                if self._stream is not None:
                    return
                late_s += time.perf_counter() - began_s
            self._keep()
            self._run_block()
            due += self._runner.block_s
            wait = due - time.perf_counter()
            if wait > 0.0:
                late_s = _LATE_S
                time.sleep(wait)
            elif wait < -late_s:
                self._late += 1
                self._stood_s = -wait if wait < -_STOOD_S else 0.0
                due, late_s = time.perf_counter(), _LATE_S
