"""Streams of further sound cards: opened with the first card's, and reopened when a card is there again."""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from underfoot.devices.outputs import CardChannels
from underfoot.devices.sound import Stream, listed_name
from underfoot.engine.block_runner import BlockRunner
from underfoot.engine.further_card import FurtherCard
from underfoot.engine.status import Field
from underfoot.engine.target import Target
from underfoot.errors import DeviceError

_STILL_S = 2.0
"""Time in seconds for which a stream asks for no frames until its tiles are said to be silent."""
_LOOK_S = 0.1
"""Most seconds by which one look lengthens the time for which a stream has asked for nothing."""
_CALM_S = 0.04
"""Least latency in seconds of a further card's stream; it lags behind the first one anyway."""


class FurtherStream:
    """A further card: its stream, if open, and the frames it plays."""

    def __init__(self, frames: FurtherCard, tiles: str, target: Target, leaving: Callable[[], bool]) -> None:
        self.frames, self.tiles = frames, tiles
        self.stream: Stream | None = None
        self.underruns = 0
        """Late blocks in streams that have ended."""
        self._target, self._leaving = target, leaving
        self._looked_s = self._still_s = 0.0
        self._asked = 0
        self.stands_still = False
        """Whether an open stream asks for no frames, as where a sound server hangs."""
        self.is_missing = self.has_played = False
        """Whether the card has gone, or could not be opened; whether it was open before."""

    @property
    def name(self) -> str:
        """Name of the card."""
        return self.frames.card.name

    @property
    def silence(self) -> str:
        """Why its tiles are silent, with their names; "" if they are not."""
        if self.stream is not None and not self.stands_still:
            return ""
        return f"{self.name} {'stands still' if self.stands_still else 'is not there'}; silent: {self.tiles}"

    @property
    def loss_line(self) -> str:
        """What is said once it has gone."""
        return f"{self.name} has gone; silent: {self.tiles}"

    @property
    def return_line(self) -> str:
        """What is said once it plays again."""
        return f"{self.name} is back; it plays {self.tiles}"

    def open(self) -> None:
        """Open and start a stream; raise `DeviceError` if that fails."""
        card, target = self.frames.card, self._target
        latency = max(target.latency_s, _CALM_S)
        stream = Stream(card.output.name, card.count, target.rate, target.block, self._fill, latency)
        self.frames.begin(stream.latency_s)
        try:
            stream.start()
        except DeviceError:
            stream.close()
            raise
        self.stream, self.is_missing, self.has_played = stream, False, True

    def close(self) -> None:
        """Close the stream and release the card."""
        if self.stream is not None:
            if not self.stream.finished:
                self.stream.abort()
            self.underruns += self.stream.underruns
            self.stream.close()
            self.stream, self.stands_still = None, False

    def look(self) -> bool:
        """Return whether the stream has come to stand still, or asks for frames again; call it often.

        Time in which this was not called does not count: the whole process may have stood still.
        """
        now_s, before = time.perf_counter(), self.stands_still
        self._still_s += min(now_s - self._looked_s, _LOOK_S)
        self._looked_s = now_s
        if self.stream is None or self.frames.asked != self._asked:
            self._still_s, self._asked = 0.0, self.frames.asked
        self.stands_still = self._still_s > _STILL_S
        return self.stands_still != before

    def _fill(self) -> int:
        return 0 if self._leaving() else self.frames.fill()


class FurtherStreams:
    """All further cards of a target; `notify` receives a line when one disappears or returns."""

    def __init__(
        self,
        cards: Sequence[CardChannels],
        runner: BlockRunner,
        target: Target,
        leaving: Callable[[], bool],
        notify: Callable[[str], None],
    ) -> None:
        self._status, self._notify = runner.memory.status, notify
        tiles = list(zip(target.floor.ids, runner.loop.channels, strict=True))
        self._streams = [
            FurtherStream(
                FurtherCard(card, target.rate, target.block),
                ", ".join(name for name, channel in tiles if channel in card),
                target,
                leaving,
            )
            for card in cards
        ]
        runner.further_cards = tuple(stream.frames for stream in self._streams)

    def open(self) -> list[str]:
        """Open all cards that are closed; return a line for each that fails. One that was missing is told of."""
        notices, news = [], []
        for stream in self._streams:
            if stream.stream is None:
                stream.frames.silence(on=self._status.panic)
                was_missing = stream.is_missing
                try:
                    stream.open()
                except DeviceError as error:
                    stream.is_missing = True
                    notices.append(f"{error}; silent: {stream.tiles}")
                    if stream.has_played and not was_missing:
                        news.append(stream.loss_line)
                    continue
                if was_missing:
                    news.append(stream.return_line)
        for line in news:  # not before: it is told with all cards that do not play
            self._notify(line)
        return notices

    def open_found(self, there: Mapping[str, str]) -> set[str]:
        """Open missing cards of these that this process's PortAudio lists; return the names of those that it does not,
        or that do not open."""
        found = [one for one in self._streams if one.is_missing and there.get(one.frames.card.output.name)]
        for stream in found:
            name = stream.frames.card.output.name
            if listed_name(name) == there[name]:
                with suppress(DeviceError):
                    stream.open()
                    self._notify(stream.return_line)
        return {stream.frames.card.output.name for stream in found if stream.is_missing}

    def silence_all(self) -> None:
        """Ramp all down, until they are opened anew."""
        for stream in self._streams:
            stream.frames.silence(on=True)

    def keep(self) -> None:
        """Detect cards that have gone, and publish the largest offset from the engine's clock."""
        for stream in self._streams:
            if stream.stream is not None and stream.stream.finished:
                stream.close()
                stream.is_missing = True
                self._notify(stream.loss_line)
            elif stream.look():
                self._notify(stream.silence or stream.return_line)
        playing = [stream.frames for stream in self._streams if stream.stream is not None]
        worst = max(playing, key=lambda frames: abs(frames.offset_frames), default=None)
        if worst is not None:
            self._status.put(Field.CARDS_DELAY_S, worst.delay_frames / worst.rate_hz)
            self._status.put(Field.CARDS_OFFSET_S, worst.offset_frames / worst.rate_hz)
            self._status.put(Field.CARDS_DRIFT_PPM, worst.drift_ppm)

    @property
    def any_missing(self) -> bool:
        """Whether any of them is missing."""
        return any(stream.is_missing for stream in self._streams)

    @property
    def any_open(self) -> bool:
        """Whether any of them has a stream."""
        return any(stream.stream is not None for stream in self._streams)

    @property
    def latency_s(self) -> float:
        """The largest latency of their streams; 0 without any."""
        # Asked by the thread of commands as well, while a stream may be closed.
        return max((stream.latency_s for one in self._streams if (stream := one.stream) is not None), default=0.0)

    @property
    def any_playing(self) -> bool:
        """Whether any of them plays."""
        return any(not stream.silence for stream in self._streams)

    @property
    def silence(self) -> tuple[str, ...]:
        """The missing cards, and the tiles that are silent without them."""
        return tuple(stream.silence for stream in self._streams if stream.silence)

    @property
    def underruns(self) -> int:
        """Number of underruns and late blocks of all further cards."""
        return sum(
            stream.underruns + stream.frames.underruns + (stream.stream.underruns if stream.stream else 0)
            for stream in self._streams
        )

    def close(self) -> None:
        """Close all cards."""
        for stream in self._streams:
            stream.close()
