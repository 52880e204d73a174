"""Sound cards, through PortAudio. Without PortAudio or a card `devices` is empty; opening one raises the reason."""

import os
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.clock import FADE
from underfoot.devices.thread_priority import raise_thread_priority
from underfoot.errors import DeviceError, in_one_line

if TYPE_CHECKING:
    from sounddevice import CallbackFlags

_SAFE_S = 0.1
"""Latency in seconds at which a busy machine loses nothing."""
STILL_S = 3.0
"""Time in seconds after which a card that asks for nothing stands still."""
_STAMPS = 200
"""Blocks over which the median of the output time is taken: single stamps have milliseconds of jitter."""
MAX_CHANNELS = 32
"""Most channels of one stream (PulseAudio's limit)."""
CData = Any
"""Memory of a sound card, as CFFI hands it over."""
EXCLUSIVE = ", exclusive"
"""What ends the name of a card of WASAPI that is to be opened for this program alone."""
_EXCLUSIVE_SYSTEM = "Windows WASAPI"


class Card(Struct, frozen=True):
    """An output device: name, channels, and preferred rate.

    Where PortAudio lists cards of several sound systems (host APIs), as on Windows, the name ends with the system's:
    "Speakers, Windows WASAPI". PortAudio finds it by this name.
    """

    name: str
    channels: int
    rate_hz: float


def portaudio() -> ModuleType:
    """Return the sounddevice module; raise `DeviceError` if PortAudio is missing."""
    try:
        import sounddevice
    except Exception as error:  # the class of the error of a PortAudio that does not begin is in the module itself
        cure = "install libportaudio2" if sys.platform.startswith("linux") else "install sounddevice again"
        raise DeviceError(f"PortAudio is not there ({error}); {cure}") from None
    return sounddevice


def device_of(name: str) -> str | None:
    """Return PortAudio's name of a card; None for the default one.

    >>> device_of("Speakers, Windows WASAPI, exclusive"), device_of("")
    ('Speakers, Windows WASAPI', None)
    """
    return name.removesuffix(EXCLUSIVE) or None


def settings_of(name: str) -> object:
    """Return PortAudio's settings for a card; None unless it is to be opened exclusively."""
    return portaudio().WasapiSettings(exclusive=True) if name.endswith(EXCLUSIVE) else None


def _raw_memory(sounddevice: ModuleType) -> tuple[Callable[..., Any], Callable[..., Any]]:
    """Return functions that copy memory and cast addresses: sounddevice has them under a private name only."""
    try:
        return sounddevice._ffi.memmove, sounddevice._ffi.cast
    except AttributeError as error:
        version = getattr(sounddevice, "__version__", "of no version")
        raise DeviceError(f"sounddevice {version} cannot be played with ({error}); install sounddevice 0.5") from None


def devices() -> list[Card]:
    """Return the output devices; empty if PortAudio is missing or finds no card."""
    try:
        sounddevice = portaudio()
    except DeviceError:
        return []
    try:
        found = [device for device in sounddevice.query_devices() if device["max_output_channels"] > 0]
        systems = {device["hostapi"]: str(sounddevice.query_hostapis(device["hostapi"])["name"]) for device in found}
    except (OSError, RuntimeError, sounddevice.PortAudioError):
        return []
    cards = []
    for device in found:
        system = systems[device["hostapi"]]
        name = f"{device['name']}, {system}" if len(systems) > 1 else str(device["name"])
        ways = ("", EXCLUSIVE) if len(systems) > 1 and system == _EXCLUSIVE_SYSTEM else ("",)
        channels, rate_hz = int(device["max_output_channels"]), float(device["default_samplerate"])
        cards += [Card(name + way, channels, rate_hz) for way in ways]
    return cards


def drop_library_messages() -> None:
    """Drop what PortAudio and ALSA write to standard error at each attempt to open a card, and at each underrun.

    What matters of it is reported. Python's errors go where they went.
    """
    if sys.stderr is not None:
        nowhere, errors = os.open(os.devnull, os.O_WRONLY), os.dup(sys.stderr.fileno())
        os.dup2(nowhere, sys.stderr.fileno())
        os.close(nowhere)
        sys.stderr = os.fdopen(errors, "w", buffering=1, errors="backslashreplace")


def is_loaded() -> bool:
    """Return whether PortAudio is there, and was used in this process."""
    return "sounddevice" in sys.modules


def list_anew() -> None:
    """Have PortAudio list the cards that are there now, as it does only once; no stream of this process may be open.

    A card that comes back may have another number, and another card its own, by which PortAudio would open that one.
    """
    sounddevice = portaudio()
    for name in ("_terminate", "_initialize"):  # sounddevice has both under private names only
        with suppress(AttributeError, sounddevice.PortAudioError):
            getattr(sounddevice, name)()


def require_card(name: str) -> None:
    """Raise `DeviceError` if there is no such output device; "" is the default one."""
    sounddevice = portaudio()
    try:
        sounddevice.query_devices(device_of(name), "output")
    except (ValueError, sounddevice.PortAudioError) as error:
        raise DeviceError(f"{name or 'the default card'} cannot be played on: {error}; {_cards()}") from None


def _cards() -> str:
    """Return which cards there are, as the end of an error's line."""
    return f"cards: {', '.join(card.name for card in devices()) or 'none is there'}"


def listed_name(name: str) -> str:
    """Return PortAudio's whole name of the output device that `name` means; "" if it lists none, or several."""
    device = _listed(name, "output")
    return str(device["name"]) if device else ""


def max_channels(name: str) -> int:
    """Return the channels of the device in one stream; `MAX_CHANNELS` also if there is no such device."""
    return _channels(name, "output", MAX_CHANNELS)


def inputs_to_open(name: str, channel: int) -> int:
    """Return how many inputs of a device to open for `channel`, from 0: all, as far as they are known.

    Where fewer are open, a sound server mixes the others in.
    """
    return max(channel + 1, _channels(name, "input", 0))


def pairs_up_to(channel: int, there: int) -> int:
    """Return how many channels make whole pairs up to `channel`, of those that are there.

    >>> pairs_up_to(0, 2), pairs_up_to(1, 8), pairs_up_to(2, 8), pairs_up_to(0, 1)
    (2, 2, 4, 1)
    """
    return min(channel + 2 - channel % 2, there)


def _channels(name: str, kind: str, unknown: int) -> int:
    """Return the "input" or "output" channels of the device in one stream; `unknown` if there is no such device."""
    device = _listed(name, kind)
    return min(int(device[f"max_{kind}_channels"]), MAX_CHANNELS) if device else unknown


def _listed(name: str, kind: str) -> dict[str, Any]:
    """Return what PortAudio says of an "input" or "output" device; {} if it is missing, or lists none, or several."""
    try:
        sounddevice = portaudio()
    except DeviceError:
        return {}
    try:
        return dict(sounddevice.query_devices(device_of(name), kind))
    except (OSError, RuntimeError, ValueError, sounddevice.PortAudioError):
        return {}


class PlayRecord:
    """Plays `played`, float32 [frame, channel], on one device while another records: once, in `run`.

    Devices are parts of PortAudio's names, "" for the default ones. `silence` ends it early, from any thread.
    """

    def __init__(
        self, input: str, output: str, played: NDArray[np.float32], input_channels: int, rate_hz: int, block: int = 0
    ) -> None:
        """Open the devices. `input_channels` are recorded. With `block`, blocks have that many frames, and latency is
        low."""
        self._sounddevice = device = portaudio()
        self._devices = (input, output)
        self._played = played
        self.recorded = np.zeros((len(played), input_channels), np.float32)
        """The recording, float32 [frame, channel], from the first frame played on."""
        self.lost = False
        """Whether samples were lost in either direction."""
        self.silenced = False
        """Whether it was ended early."""
        # Silence after the ramp: a stream that ends drops what is in the device's buffer.
        down, rest = np.linspace(1.0, 0.0, FADE), np.zeros(round(2.0 * _SAFE_S * rate_hz))
        self._ramp = np.append(down, rest).astype(np.float32)[:, None]
        self.played_frames = 0
        """Number of frames of `played` that were output."""
        self._faded = 0
        self._over = threading.Event()
        try:
            self._stream = device.Stream(
                samplerate=rate_hz,
                channels=(input_channels, played.shape[1]),
                dtype="float32",
                device=tuple(map(device_of, self._devices)),
                extra_settings=tuple(map(settings_of, self._devices)),
                latency="low" if block else _SAFE_S,
                blocksize=block,
                callback=self._exchange,
                finished_callback=self._over.set,
            )
        except (device.PortAudioError, ValueError) as error:
            raise self._failure(error) from None

    def run(self) -> None:
        """Play and record; raise `DeviceError` if a device fails, or asks for nothing any more.

        In that case the stream stays open, in a process that ends then: to close it would wait, too.
        """
        self._faded = FADE if self.silenced else 0
        try:
            self._stream.start()
        except self._sounddevice.PortAudioError as error:
            raise self._failure(error) from None
        before = -1
        while not self._over.wait(STILL_S):
            if self.played_frames == before:
                raise DeviceError("the sound card stands still; does its server answer? Take it again")
            before = self.played_frames
        self._stream.close()
        self.lost |= self.played_frames < len(self._played) and not self.silenced

    def _failure(self, error: Exception) -> DeviceError:
        name = next((name for name in self._devices if name), "default")
        why = f"{in_one_line(error)}; is it plugged in, and free?"
        return DeviceError(f"sound device {name!r} cannot play and record: {why}")

    def silence(self) -> None:
        """Ramp down, in `FADE` frames, what is not yet in the device's buffer, and end; before `run`, play nothing."""
        self.silenced = True

    def _exchange(self, indata: CData, out: CData, frames: int, time: CData, status: "CallbackFlags") -> None:
        at = self.played_frames
        n = min(frames, len(self._played) - at)
        self.lost |= bool(status.input_overflow or status.output_underflow)
        out[:n], out[n:] = self._played[at : at + n], 0.0
        self.recorded[at : at + n] = indata[:n]
        self.played_frames += n
        if self.silenced:
            faded, m = self._faded, min(frames, len(self._ramp) - self._faded)
            np.multiply(out[:m], self._ramp[faded : faded + m], out=out[:m])
            out[m:] = 0.0
            self._faded += m
        if self.played_frames == len(self._played) or self._faded == len(self._ramp):
            raise self._sounddevice.CallbackStop


class Stream:
    """A stream that calls `fill() -> address` for each block of interleaved float32, and plays that block.

    With `recorded`, float32 [frame, input], it also records: the input of a block is there when `fill` is called, in
    PortAudio's thread. `underruns` counts blocks that were late or incomplete. `finished` is set when the stream has
    ended by itself.
    """

    def __init__(
        self,
        name: str,
        channels: int,
        rate: float,
        block: int,
        fill: Callable[[], int],
        latency_s: float | str = "low",
        recorded: NDArray[np.float32] | None = None,
    ) -> None:
        self._sounddevice = sounddevice = portaudio()
        self.underruns = 0
        self._inputs = 0 if recorded is None else recorded.ctypes.data
        self._input_bytes = 0 if recorded is None else recorded.nbytes
        how: dict[str, Any] = {
            "device": device_of(name),
            "extra_settings": settings_of(name),
            "samplerate": rate,
            "blocksize": block,
            "dtype": "float32",
            "latency": latency_s,
            "finished_callback": self._finish,
        }
        self._fill = fill
        self._bytes = 4 * channels * block
        self._move, self._cast = _raw_memory(sounddevice)
        self._stamps_s, self._stamped = np.zeros((2, _STAMPS)), 0  # of output, and of input
        self.finished = False
        try:
            if recorded is None:
                self._stream = sounddevice.RawOutputStream(channels=channels, callback=self._callback, **how)
            else:
                both = recorded.shape[1], channels
                self._stream = sounddevice.RawStream(channels=both, callback=self._exchange, **how)
        except (sounddevice.PortAudioError, ValueError) as error:
            if not name and not devices():
                raise DeviceError("there is no sound device") from None
            also = "" if recorded is None else f" and hear {recorded.shape[1]}"
            what = f"{channels} channels{also} at {rate:g} Hz"
            which = f"; {_cards()}" if isinstance(error, ValueError) else ""  # where no name is like this
            why = f"{in_one_line(error)}{which}"
            raise DeviceError(f"sound device {name or 'default'!r} cannot play {what}: {why}") from None

    @property
    def latency_s(self) -> float:
        """Output latency as reported by the stream."""
        return float(np.max(self._stream.latency) if self._inputs == 0 else self._stream.latency[1])

    @property
    def round_trip_s(self) -> float:
        """Round trip from output to input as reported by the stream."""
        return float(np.sum(self._stream.latency))

    @property
    def stamped_output_latency_s(self) -> float:
        """Output latency from the stamps of the last blocks; 0 without stamps.

        The latency that a stream reports is the requested one; a sound server may use more, or less.
        """
        return self._stamped_s(0)

    @property
    def stamped_input_latency_s(self) -> float:
        """Input latency from the stamps of the last blocks; 0 without stamps or inputs."""
        return self._stamped_s(1) if self._inputs else 0.0

    def _stamped_s(self, way: int) -> float:
        return max(float(np.median(self._stamps_s[way])), 0.0) if self._stamped >= _STAMPS else 0.0

    def start(self) -> None:
        """Start playing; once only."""
        try:
            self._stream.start()
        except self._sounddevice.PortAudioError as error:
            raise DeviceError(f"the sound device does not start: {in_one_line(error)}") from None

    def abort(self) -> None:
        """Stop at once, and drop what is buffered."""
        self._stream.abort(ignore_errors=True)

    def close(self) -> None:
        """Close the device."""
        self._stream.close(ignore_errors=True)

    def _callback(self, out: CData, frames: int, time: CData, status: "CallbackFlags") -> None:
        if status:
            self.underruns += 1
        if not self._stamped:
            raise_thread_priority()
        self._stamp(time)
        address = self._fill()
        if address == 0:
            raise self._sounddevice.CallbackAbort
        self._move(out, self._cast("char *", address), self._bytes)

    def _exchange(self, indata: CData, out: CData, frames: int, time: CData, status: "CallbackFlags") -> None:
        self._move(self._cast("char *", self._inputs), indata, self._input_bytes)
        self._callback(out, frames, time, status)

    def _stamp(self, time: CData) -> None:
        """Store the output and input latency of a block; 0 on hosts without clocks."""
        self._stamps_s[0, self._stamped % _STAMPS] = time.outputBufferDacTime - time.currentTime
        self._stamps_s[1, self._stamped % _STAMPS] = time.currentTime - time.inputBufferAdcTime
        self._stamped += 1

    def _finish(self) -> None:
        self.finished = True
