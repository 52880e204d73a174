"""Sound files that commands write: the same samples give the same bytes."""

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import write_file

_FLOAT = 3
"""The format's number for float samples (WAVE_FORMAT_IEEE_FLOAT)."""
_MOST = 2**32 - 1
"""Bytes that the format can count."""


def write_wav(path: str | Path, samples: NDArray[np.float32], rate_hz: float) -> None:
    """Write float32 [frame, channel] as a float WAV, whole or not at all. `BadFile` where that cannot be."""
    data = np.ascontiguousarray(samples, "<f4")
    if data.nbytes + 50 > _MOST:
        raise BadFile(f"{path} cannot be written: a WAV file holds 4 GB at most; ask for fewer seconds or tiles")
    write_file(path, wav_header(len(data), data.shape[1], round(rate_hz)), data.data)


def wav_bytes(samples: NDArray[np.float32], rate_hz: float) -> bytes:
    """The same file as bytes."""
    data = np.ascontiguousarray(samples, "<f4")
    return wav_header(len(data), data.shape[1], round(rate_hz)) + data.tobytes()


def wav_header(frames: int, channels: int, rate_hz: int) -> bytes:
    """What stands before the samples: float32, interleaved. No time stamp, so that equal samples make equal files.

    >>> len(wav_header(48_000, 4, 48_000))
    56
    """
    frame = 4 * channels
    size = frames * frame
    return (
        struct.pack("<4sI4s", b"RIFF", 48 + size, b"WAVE")
        + struct.pack("<4sIHHIIHH", b"fmt ", 16, _FLOAT, channels, rate_hz, rate_hz * frame, frame, 32)
        + struct.pack("<4sII", b"fact", 4, frames)
        + struct.pack("<4sI", b"data", size)
    )
