"""A sweep and its recording in WAV files."""

from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from underfoot.errors import BadFile, BadMeasurement, BadValue
from underfoot.files import read_file
from underfoot.kernels import Floats

if TYPE_CHECKING:
    from underfoot.calibration.science.transfer_function import SweepMeasurement

_MOST_SAMPLES = 1 << 26
"""Samples of a sound file, 512 MB of memory: a compressed one of a megabyte can hold hours."""


def measure_files(sweep: Path, recorded: Path, channel: int | None) -> "tuple[SweepMeasurement, int]":
    """Evaluate a recording of a sweep; return the measurement and the sample rate. By default, find the channel.

    `BadFile` for files that cannot be read, `BadMeasurement` for an implausible recording, `BadValue` for a missing
    channel.
    """
    played, rate_hz = read_wav(sweep)
    recording, recorded_hz = read_wav(recorded)
    if recorded_hz != rate_hz:
        raise BadMeasurement(
            f"sweep and recording do not fit: {sweep} is at {rate_hz} Hz, {recorded} at {recorded_hz} Hz"
        )
    loudest = abs(played).max(axis=0)
    try:
        return measure_channel(played[:, int(loudest.argmax())], recording, rate_hz, channel), rate_hz
    except BadValue as error:
        raise BadFile(f"{sweep} and {recorded}: {error}") from None


def measure_channel(played: Floats, recording: Floats, rate_hz: int, channel: int | None) -> "SweepMeasurement":
    """Evaluate one channel of a recording (frames, channels) of a sweep (frames,), as `measure_files` does."""
    from underfoot.calibration.science.transfer_function import measure

    several = recording.shape[1]
    if channel is not None:
        if not 0 <= channel < several:
            raise BadValue(f"--channel is {channel}; allowed: 0 to {several - 1}")
        return measure(played, recording[:, channel], rate_hz)
    found: dict[int, SweepMeasurement] = {}
    reasons: list[BadMeasurement] = []
    for k in range(several):
        try:
            found[k] = measure(played, recording[:, k], rate_hz)
        except BadMeasurement as reason:
            reasons.append(reason)
    # The same accelerometer on both channels of a stereo file is one measurement.
    if len(found) > 1 and not _are_one_signal(recording[:, list(found)]):
        raise BadMeasurement(f"channels {', '.join(map(str, found))} all hold the sweep; say --channel")
    if not found:
        raise reasons[int(abs(recording).max(axis=0).argmax())]
    return next(iter(found.values()))


def read_wav(path: Path) -> tuple[Floats, int]:
    """Return the samples of a WAV file, (frames, channels), and its rate; `BadFile` if it has none or too many."""
    import soundfile

    try:
        with soundfile.SoundFile(BytesIO(read_file(path, 8 * _MOST_SAMPLES))) as file:
            if file.frames * file.channels > _MOST_SAMPLES:
                says = f"{file.frames} frames of {file.channels} channels; allowed: {_MOST_SAMPLES} samples"
                raise BadFile(f"{path} has {says}, 23 minutes at 48 kHz")
            samples, rate_hz = file.read(dtype="float64", always_2d=True), file.samplerate
    except soundfile.LibsndfileError as error:
        raise BadFile(f"{path} cannot be read: {error.error_string.rstrip('.').lower()}") from None
    if not samples.size:
        raise BadFile(f"{path} holds no samples")
    return samples, int(rate_hz)


def _are_one_signal(channels: Floats) -> bool:
    """Return whether channels (frames, channels) are one signal at different levels."""
    return bool((np.corrcoef(channels, rowvar=False) > 0.9999).all())
