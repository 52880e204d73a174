"""Sound files: float32, interleaved, without a time stamp: the same samples give the same bytes."""

import struct
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import path_of, replaced, write_file, written

_FLOAT = 3
"""The format's number for float samples (WAVE_FORMAT_IEEE_FLOAT)."""
_MOST = 2**32 - 1
"""Bytes that WAV can count. Beyond, a file is RF64 (EBU Tech 3306), which counts in 64 bits."""


def require_wav(path: str | Path) -> None:
    """Raise `BadFile` for the name of another format: `song.mp3` would be a WAV that players refuse.

    >>> require_wav("song.mp3")
    Traceback (most recent call last):
    underfoot.errors.BadFile: song.mp3 cannot be written: sound files are WAV; allowed: a name that ends in .wav
    """
    if path_of(path).suffix.lower() not in ("", ".wav"):
        raise BadFile(f"{path} cannot be written: sound files are WAV; allowed: a name that ends in .wav")


def write_wav(path: str | Path, samples: NDArray[np.float32], rate_hz: float) -> None:
    """Write float32 [frame, channel] as a float WAV, whole or not at all. `BadFile` where that cannot be."""
    data = np.ascontiguousarray(samples, "<f4")
    write_file(path, wav_header(len(data), data.shape[1], round(rate_hz)), data.data)


def write_wav_parts(
    path: str | Path,
    parts: Iterable[NDArray[np.float32]],
    frames: int,
    channels: int,
    rate_hz: float,
    comment: str,
) -> None:
    """Write successive `parts`, together `frames` frames, which need not fit into memory."""
    with wav_file(path, frames, channels, rate_hz, comment) as put:
        for samples in parts:
            put(samples)


@contextmanager
def wav_file(
    path: str | Path, frames: int, channels: int, rate_hz: float, comment: str = ""
) -> Iterator[Callable[[NDArray[np.float32]], None]]:
    """Yield a function that takes successive parts, together `frames` frames; afterwards they are the file `path`."""
    with replaced(path) as part, written(path), part.open("wb") as file:

        def put(samples: NDArray[np.float32]) -> None:
            with written(path):  # by its name, where several are written at once
                file.write(np.ascontiguousarray(samples, "<f4").data)

        file.write(wav_header(frames, channels, round(rate_hz), comment))
        yield put


def wav_samples(path: str | Path, frames: int, channels: int, rate_hz: float) -> NDArray[np.float32]:
    """Return the samples of a file that was written here, [frame, channel]; they stay on the disk until they are
    used."""
    header = len(wav_header(frames, channels, round(rate_hz)))
    with written(path):
        return np.asarray(np.memmap(path, "<f4", "r", header, (frames, channels)))


def wav_bytes(samples: NDArray[np.float32], rate_hz: float) -> bytes:
    """Return a WAV file as bytes."""
    data = np.ascontiguousarray(samples, "<f4")
    return wav_header(len(data), data.shape[1], round(rate_hz)) + data.tobytes()


def wav_header(frames: int, channels: int, rate_hz: int, comment: str = "") -> bytes:
    """Return the header before the samples; a `comment` is in it as the list INFO has it (ICMT).

    >>> len(wav_header(48_000, 4, 48_000)), wav_header(10**9, 4, 48_000)[:4]
    (56, b'RF64')
    """
    frame = 4 * channels
    size = frames * frame
    told = _info(comment) if comment else b""
    rest = 48 + len(told) + size
    is_long = rest > _MOST
    large = struct.pack("<4sIQQQI", b"ds64", 28, 36 + rest, size, frames, 0) if is_long else b""
    return (
        struct.pack("<4sI4s", b"RF64" if is_long else b"RIFF", _MOST if is_long else rest, b"WAVE")
        + large
        + struct.pack("<4sIHHIIHH", b"fmt ", 16, _FLOAT, channels, rate_hz, rate_hz * frame, frame, 32)
        + struct.pack("<4sII", b"fact", 4, min(frames, _MOST))
        + told
        + struct.pack("<4sI", b"data", _MOST if is_long else size)
    )


def _info(comment: str) -> bytes:
    """Return the list INFO with a comment, which ends with a zero and is filled up to an even length."""
    text = comment.encode() + b"\0"
    text += b"\0" * (len(text) % 2)
    return struct.pack("<4sI4s4sI", b"LIST", 12 + len(text), b"INFO", b"ICMT", len(text)) + text
