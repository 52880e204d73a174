"""Rigs with a shaker: a sound card that plays to a shaker and records its accelerometer, or the simulated tile.

Both play through the engine's safety stage only.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.rig import NO_READINGS, STOPPED, PressRequest, Readings, Sound
from underfoot.devices.outputs import card_channels
from underfoot.devices.sound import MAX_CHANNELS, STILL_S, PlayRecord, device_of, pairs_up_to, portaudio
from underfoot.engine.card_process import CardProcess
from underfoot.engine.safety import limited
from underfoot.errors import BadMeasurement, DeviceError, in_one_line, require
from underfoot.floor.layout import Floor, Tile
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.quantities import counted

_TAIL_S = 0.5
"""Length of the silence after a sound, which is recorded, too."""


def require_channel(device: Mapping[str, Any], kind: str, wanted: int) -> int:
    """Return the number of "input" or "output" channels of PortAudio's `device`; `DeviceError` without the wanted one.

    >>> require_channel({"name": "Stereo", "max_output_channels": 2}, "output", 1)
    2
    """
    there = int(device[f"max_{kind}_channels"])
    if wanted >= there:
        channels = counted(there, f"{kind} channel")
        raise DeviceError(f"sound device {device['name']!r} has {channels}, from 0; not {wanted}")
    return there


class SoundCard:
    """A shaker on one channel of an output device, an accelerometer on one of an input device; channels from 0.

    Names are parts of PortAudio's device names, "" for the default device. With `of_floor`, `output` names the floor's
    cards, as `outputs_of` takes them, and `channel` is the floor's. A floor with `channels` has as many of the card
    open as the engine has: a sound server would play on the others, too, or at another level. Raises `DeviceError` if
    PortAudio, the card or the channel is missing, or does not answer: the card is used in a process of its own.
    """

    def __init__(
        self,
        output: str = "",
        input: str = "",
        channel: int = 0,
        input_channel: int = 0,
        *,
        channels: int = 1,
        of_floor: bool = False,
    ) -> None:
        needed = max(channels, channel + 1)
        self._card = CardProcess(_on_floor if of_floor else _on_card, output, input, channel, input_channel, needed)
        self._is_silenced = False

    def press(self, press: PressRequest | None) -> None:
        """Do nothing: this rig cannot press."""

    def read(self) -> Readings:
        """Return no readings: a sound card has no force sensors."""
        return NO_READINGS

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Play through limiter and shaker; return the accelerometer's signal, of full scale, with half a second more.

        Raises `DeviceError` if the device fails, `BadMeasurement` if samples were lost or `silence` was called.
        """
        self._is_silenced = False
        self._card.call("open", sound)
        if self._is_silenced:
            raise BadMeasurement(STOPPED)
        lasts_s = sound.signal.size / sound.rate_hz + _TAIL_S
        recorded: NDArray[np.float64] = self._card.call("play", within_s=lasts_s + STILL_S)
        return recorded

    def silence(self) -> None:
        """Ramp down and end what is playing, from any thread. `play` then raises `BadMeasurement`."""
        self._is_silenced = True
        self._card.tell("silence")

    def close(self) -> None:
        """End the card's process, and in a ramp what plays, as at Ctrl-C."""
        self._card.tell("silence")
        self._card.close()


def channels_of(floor: Floor, tile: Tile) -> tuple[int, int]:
    """Return the output channel of a tile, and how many a session of its floor has open.

    >>> from underfoot.floor.layout import default_floor
    >>> channels_of(default_floor(1, 3), default_floor(1, 3).tiles[1])
    (1, 3)
    """
    return floor.channels[floor.index(tile.id)], max(floor.channels) + 1


class _OpenCard:
    """A card in its process, with this many `outputs` open, if it has them."""

    def __init__(self, output: str, input: str, channel: int, input_channel: int, outputs: int) -> None:
        require(0 <= channel <= 31, "channel", channel, "0 to 31")
        require(0 <= input_channel <= 31, "input_channel", input_channel, "0 to 31")
        self._sounddevice = portaudio()
        self._devices = (input, output)
        self._play_record: PlayRecord | None = None
        self._channel, self._input_channel = channel, input_channel
        self._outputs = min(outputs, self._require_channel(output, "output", channel))
        # All inputs: of fewer, a server mixes the others in.
        self._inputs = min(self._require_channel(input, "input", input_channel), MAX_CHANNELS)

    def open(self, sound: Sound) -> None:
        """Open both devices for the sound."""
        signal = np.append(limited(sound.signal, sound.rate_hz), np.zeros(round(_TAIL_S * sound.rate_hz)))
        played = np.zeros((signal.size, self._outputs), np.float32)
        played[:, self._channel] = signal
        self._play_record = PlayRecord(*self._devices, played, self._inputs, sound.rate_hz, sound.block)

    def play(self) -> NDArray[np.float64]:
        """Play what was opened last, once."""
        play_record = self._play_record
        assert play_record is not None
        play_record.run()
        if play_record.silenced:
            raise BadMeasurement(STOPPED)
        if play_record.played_frames < len(play_record.recorded):
            raise BadMeasurement("the sound card lost samples and stopped; is it plugged in? Take it again")
        if play_record.lost:
            raise BadMeasurement("the sound card lost samples while it played; take it again")
        return play_record.recorded[:, self._input_channel].astype(np.float64)

    def silence(self) -> None:
        """Silence what is open, played or not; one that was played stays as it is."""
        play_record = self._play_record
        if play_record is not None:
            play_record.silence()

    def close(self) -> None:
        """Do nothing: nothing plays between two calls of `play`."""

    def _require_channel(self, name: str, kind: str, wanted: int) -> int:
        """Return the number of channels of the named device; raise `DeviceError` if it or the channel is missing."""
        try:
            found: Any = self._sounddevice.query_devices(device_of(name), kind)
        except (self._sounddevice.PortAudioError, ValueError) as error:
            if not name:
                raise DeviceError(f"there is no sound device for {kind}; connect one, and try again") from None
            why = f"cannot play and record: {in_one_line(error)}"
            raise DeviceError(f"sound device {name!r} {why}") from None
        return require_channel(found, kind, wanted)


def _on_card(output: str, input: str, channel: int, input_channel: int, needed: int) -> _OpenCard:
    """Open one card for a floor that needs so many of its channels."""
    return _OpenCard(output, input, channel, input_channel, pairs_up_to(needed - 1, MAX_CHANNELS))


def _on_floor(cards: str, input: str, channel: int, input_channel: int, needed: int) -> _OpenCard:
    """Open that of a floor's `cards` which has the floor's `channel`, of those that it needs."""
    card = next((card for card in card_channels(cards, needed + 1) if channel in card), None)
    if card is None:
        raise DeviceError(f"no sound device has a channel {channel + 1}; add a card under Audio")
    return _OpenCard(card.output.name, input, channel - card.first, input_channel, card.opened(needed))


def simulated_recording(tile: SimulatedTile, sound: Sound) -> NDArray[np.float64]:
    """Return the simulated accelerometer's signal, of its full scale, of a sound through limiter and shaker."""
    signal = limited(sound.signal, sound.rate_hz)
    return tile.respond(signal, float(sound.rate_hz), sound.load) / tile.parameters.accelerometer.range_m_s2


class SimulatedShaker:
    """The simulated tile with its accelerometer; it cannot press."""

    def __init__(self, tile: SimulatedTile) -> None:
        self._tile = tile

    def press(self, press: PressRequest | None) -> None:
        """Do nothing: loads come with the sounds."""

    def read(self) -> Readings:
        """Return no readings."""
        return NO_READINGS

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Return the accelerometer's signal, relative to full scale, under the load that the sound specifies."""
        return simulated_recording(self._tile, sound)

    def close(self) -> None:
        """Do nothing: nothing is open."""
