"""Rigs that shake: a sound card that plays to a shaker and records its accelerometer, or the simulated tile.

Both play what the engine's safety stage lets out, and nothing else: no sound reaches a shaker past it.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.rig import NO_READINGS, PressRequest, Readings, Sound
from underfoot.devices.sound import Exchange, portaudio
from underfoot.engine.safety import limited
from underfoot.errors import BadMeasurement, DeviceError, require
from underfoot.floor.simulated_tile import SimulatedTile

_TAIL_S = 0.5


class SoundCard:
    """A shaker on one channel of an output device, an accelerometer on one of an input device; channels from 0.

    Names are parts of PortAudio's, "" the default device. Raises `DeviceError` in one line where PortAudio, the card or
    the channel is not there.
    """

    def __init__(self, output: str = "", input: str = "", channel: int = 0, heard_on: int = 0) -> None:
        require(0 <= channel <= 31, "channel", channel, "0 to 31")
        require(0 <= heard_on <= 31, "heard_on", heard_on, "0 to 31")
        self._sounddevice = portaudio()
        self._devices = (input, output)
        self._exchange: Exchange | None = None
        self._channel, self._heard_on = channel, heard_on
        self._require_channel(input, "input", heard_on)
        # Pairs of channels are opened: a server would spread a single one over all.
        self._channels = self._require_channel(output, "output", channel)

    def press(self, press: PressRequest | None) -> None:
        """A person presses; this rig cannot."""

    def read(self) -> Readings:
        """No readings: there is no force on a sound card."""
        return NO_READINGS

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Play through the shaker, past the limiter; the accelerometer's signal, of full scale, and half a second more.

        Raises `DeviceError` where the device fails, `BadMeasurement` where samples were lost or `silence` was called.
        """
        signal = np.append(limited(sound.signal, sound.rate_hz), np.zeros(round(_TAIL_S * sound.rate_hz)))
        played = np.zeros((signal.size, min(self._channel + 2 - self._channel % 2, self._channels)), np.float32)
        played[:, self._channel] = signal
        exchange = Exchange(*self._devices, played, self._heard_on + 1, sound.rate_hz, sound.block)
        self._exchange = exchange
        try:
            exchange.run()
        finally:
            self._exchange = None
        if exchange.silenced:
            raise BadMeasurement("the sound was stopped; take it again")
        if exchange.lost:
            raise BadMeasurement("the sound card lost samples while it played; take it again")
        return exchange.recorded[:, self._heard_on].astype(np.float64)

    def silence(self) -> None:
        """Ramp down what plays, if anything does, and end it; from any thread. `play` raises `BadMeasurement`."""
        exchange = self._exchange
        if exchange is not None:
            exchange.silence()

    def close(self) -> None:
        """Nothing sounds between two calls of `play`."""

    def _require_channel(self, name: str, kind: str, wanted: int) -> int:
        """How many channels a device has; `DeviceError` where the one that is wanted is not among them."""
        try:
            found: Any = self._sounddevice.query_devices(name or None, kind)
        except (self._sounddevice.PortAudioError, ValueError) as error:
            raise self._failure(error, name) from None
        there = int(found[f"max_{kind}_channels"])
        if wanted >= there:
            raise DeviceError(f"sound device {found['name']!r} has {there} {kind} channels, from 0; not {wanted}")
        return there

    def _failure(self, error: Exception, name: str = "") -> DeviceError:
        shown = name or next((name for name in self._devices if name), None) or "default"
        return DeviceError(f"sound device {shown!r} cannot play and record: {' '.join(str(error).split())}")


def heard_of(tile: SimulatedTile, sound: Sound) -> NDArray[np.float64]:
    """What the simulated accelerometer hears, of its full scale, of a sound through limiter and simulated shaker."""
    signal = limited(sound.signal, sound.rate_hz)
    return tile.respond(signal, float(sound.rate_hz), sound.load) / tile.parameters.accelerometer.range_m_s2


class SimulatedShaker:
    """The simulated tile, heard by its accelerometer; it presses nothing."""

    def __init__(self, tile: SimulatedTile) -> None:
        self._tile = tile

    def press(self, press: PressRequest | None) -> None:
        """Nothing to press: loads come with the sounds."""

    def read(self) -> Readings:
        """No readings."""
        return NO_READINGS

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """The accelerometer's signal, of its full scale, under the load that the sound is for."""
        return heard_of(self._tile, sound)

    def close(self) -> None:
        """Nothing to let go."""
