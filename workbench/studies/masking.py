"""Sound during a study: noise that masks the sound of the tiles, and a metronome, on a sound card's channel.

It uses its own stream, because headphones are often on another card than the tiles.
"""

import math
import os
import threading

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.sound import device_of, portaudio, settings_of
from underfoot.engine.card_process import CardProcess
from underfoot.errors import DeviceError, in_one_line, require
from underfoot.experiments.protocol import Sounds

RATE_HZ = 48_000
LOOP_S = 20.0
LOWEST_HZ, HIGHEST_HZ = 30.0, 16_000.0
CLICK_S, CLICK_HZ = 0.02, 1000.0
FADE_S = 0.5
LOOK_S = 0.25
"""Seconds between two looks at what a card has asked for."""
STILL_LOOKS, WAKING_LOOKS = 8, 60
"""Looks in a row at which a card has asked for nothing until it is given up: once it plays, and before. Looks are
counted, and not time: this process may have stood still itself.
"""
PLAYING_LOOKS = 3
"""Looks in a row at which a card has asked for more until it plays: what it fills its buffer with is seen at two."""
_GONE = (
    "the masking sound has stopped; is its sound card there, and does its server answer? Leave the session, and "
    "continue it to hear it again"
)


def is_audible(sounds: Sounds) -> bool:
    """Return whether there is any sound to play.

    >>> is_audible(Sounds()), is_audible(Sounds(noise="pink"))
    (False, True)
    """
    return sounds.noise != "none" or sounds.metronome_hz > 0.0


def sound_loop(sounds: Sounds) -> NDArray[np.float32]:
    """Return about twenty seconds of sound that loop without a gap: shape (frames,), full scale, at most 1.

    The noise is synthesised from its spectrum, so it is periodic. Pink noise falls by 10 dB per decade. Its RMS is
    `noise_db`. The loop contains a whole number of metronome periods.
    """
    beats = max(round(LOOP_S * sounds.metronome_hz), 1) if sounds.metronome_hz > 0.0 else 0
    seconds = beats / sounds.metronome_hz if beats else LOOP_S
    frames = round(seconds * RATE_HZ)
    out = np.zeros(frames)
    if sounds.noise != "none":
        hz = np.fft.rfftfreq(frames, 1.0 / RATE_HZ)
        inside = (hz >= LOWEST_HZ) & (hz <= HIGHEST_HZ)
        phases = np.random.default_rng(1).uniform(0.0, 2.0 * math.pi, inside.sum())
        spectrum = np.zeros(len(hz), complex)
        spectrum[inside] = np.exp(1j * phases) / (np.sqrt(hz[inside]) if sounds.noise == "pink" else 1.0)
        noise = np.fft.irfft(spectrum, frames)
        out += noise * 10.0 ** (sounds.noise_db / 20.0) / np.sqrt(np.mean(noise**2))
    click_s = np.arange(round(CLICK_S * RATE_HZ)) / RATE_HZ
    click = np.sin(2.0 * math.pi * CLICK_HZ * click_s) * np.exp(-click_s / (0.2 * CLICK_S))
    for beat in range(beats):
        at = round(beat * frames / beats)
        out[at : at + len(click)] += 10.0 ** (sounds.metronome_db / 20.0) * click[: frames - at]
    return np.clip(out, -1.0, 1.0).astype(np.float32)


class Masking:
    """Plays a study's sounds on a device, "" for the default, from `start` to `close`.

    The device is used in a process of its own. `DeviceError` if it is missing, lacks the channel, or does not answer.
    """

    def __init__(self, sounds: Sounds, device: str = "") -> None:
        self._card = CardProcess(_Player, sounds, device)

    def start(self) -> None:
        """Fade in."""
        self._card.tell("start")

    @property
    def problem(self) -> str:
        """Why it does not sound any more; "" while it can."""
        return "" if self._card.is_there else _GONE

    def close(self) -> None:
        """Close the device."""
        self._card.close()


class CardLooks:
    """Looks at how many blocks a card has asked for, until it is given up.

    Headphones that sleep fill their buffer, and ask for no more for the seconds until they are awake.
    """

    def __init__(self) -> None:
        self._blocks = self._still = self._moved = 0
        self._most = WAKING_LOOKS

    def is_given_up(self, blocks: int) -> bool:
        """Look once more, at the blocks so far; return whether it has asked for nothing for too long."""
        moves, self._blocks = blocks != self._blocks, blocks
        self._still, self._moved = (0, self._moved + 1) if moves else (self._still + 1, 0)
        if self._moved == PLAYING_LOOKS:
            self._most = STILL_LOOKS
        return self._still >= self._most


class _Player:
    """The sounds and their device, in its process."""

    def __init__(self, sounds: Sounds, device: str = "") -> None:
        library = portaudio()
        self._loop, self._channel = sound_loop(sounds), sounds.channel
        self._at, self._gain, self._target = 0, 0.0, 0.0
        self._step = 1.0 / (FADE_S * RATE_HZ)
        self._is_closing = threading.Event()
        self._blocks = 0
        try:
            most = int(library.query_devices(device_of(device), "output")["max_output_channels"])
            require(sounds.channel < most, "sounds.channel", sounds.channel, f"0 to {most - 1} on this device")
            self._stream = library.OutputStream(
                RATE_HZ,
                device=device_of(device),
                extra_settings=settings_of(device),
                channels=sounds.channel + 1,
                dtype="float32",
                callback=self._fill,
                finished_callback=self._finish,
            )
            self._stream.start()
        except (library.PortAudioError, ValueError) as error:
            where = device or "the default device"
            raise DeviceError(f"masking sound cannot be played on {where}: {in_one_line(error)}") from None
        threading.Thread(target=self._watch, name="watch", daemon=True).start()

    def start(self) -> None:
        """Fade in."""
        self._target = 1.0

    def close(self) -> None:
        """Close the device."""
        self._is_closing.set()
        self._stream.close()

    def _finish(self) -> None:
        """End the process with the stream, which nobody would miss: its device has gone."""
        if not self._is_closing.is_set():
            os._exit(1)

    def _watch(self) -> None:
        """End the process, too, where the device asks for nothing any more, as where a sound server hangs."""
        looks = CardLooks()
        while not self._is_closing.wait(LOOK_S):
            if looks.is_given_up(self._blocks):
                self._finish()

    def _fill(self, out: NDArray[np.float32], frames: int, time: object, status: object) -> None:
        out[:] = 0.0
        self._blocks += 1
        done = 0
        while done < frames:
            part = self._loop[self._at : self._at + frames - done]
            out[done : done + len(part), self._channel] = part
            done += len(part)
            self._at = (self._at + len(part)) % len(self._loop)
        end = min(self._gain + self._step * frames, self._target)
        out[:, self._channel] *= np.linspace(self._gain, end, frames, dtype=np.float32)
        self._gain = end
