"""Samples that were recorded during a presentation, and how they are packed for the session's file."""

import json
import zlib
from dataclasses import dataclass
from string import ascii_lowercase
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

_LARGEST = 1 << 30
"""Bytes of a stretch: an hour and a half of a tile's vibration."""
Part = Annotated[int, msgspec.Meta(ge=0, lt=len(ascii_lowercase))]
"""Number of an interval of a trial, which has a letter in exports."""
Packed = tuple[Part, str, float, float, str, float, str, bytes]
"""A stretch as a row of its table, without the entry: part, kind, first, rate_hz, columns, scale, shape, data."""
_TYPES = {"force": "<f4", "vibration": "<i2", "measured": "<i2"}


@dataclass(frozen=True)
class Excerpt:
    """Samples recorded during a presentation, [frame, column].

    `kind` is "force" (N, per corner), "vibration" (commanded acceleration, m/s^2, per tile) or "measured" (an
    accelerometer's signal, m/s^2). `part` is the index of the interval. `first` is the time of the first row, in
    seconds of the session, and `rate_hz` the rate of the rows.
    """

    kind: str
    part: int
    first: float
    rate_hz: float
    columns: tuple[str, ...]
    values: NDArray[np.float64]


def packed(excerpt: Excerpt) -> Packed:
    """Return an excerpt as a row of the table; vibration has 16 bits relative to its largest value."""
    values = np.asarray(excerpt.values, np.float64)
    scale = 1.0
    if _TYPES[excerpt.kind] == "<i2":
        scale = (float(np.abs(values).max(initial=0.0)) or 1.0) / 32767.0
        values = np.round(values / scale)
    data = zlib.compress(np.ascontiguousarray(values, _TYPES[excerpt.kind]).tobytes(), 1)
    columns, shape = json.dumps(excerpt.columns), json.dumps(values.shape)
    return (excerpt.part, excerpt.kind, excerpt.first, excerpt.rate_hz, columns, scale, shape, data)


def unpacked(row: Packed) -> Excerpt:
    """Return the excerpt in a row; raise an error of zlib or msgspec or a `ValueError` if it is damaged."""
    part, kind, first, rate_hz, columns, scale, shape, data = msgspec.convert(row, Packed)
    values = np.frombuffer(_decompressed(data), _TYPES[kind]).reshape(json.loads(shape))
    names = msgspec.json.decode(columns, type=tuple[str, ...])
    if values.shape[1:] != (len(names),):
        raise ValueError(f"a stretch has {values.shape[1:]} columns, and names {len(names)}")
    return Excerpt(kind, part, first, rate_hz, names, values.astype(np.float64) * scale)


def _decompressed(data: bytes) -> bytes:
    """Decompress data, up to `_LARGEST` bytes, because a few bytes can expand to any size."""
    unpacking = zlib.decompressobj()
    values = unpacking.decompress(data, _LARGEST)
    if not unpacking.eof:
        raise ValueError("a stretch is cut short, or too large")
    return values
