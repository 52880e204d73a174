"""Macaron, a vibrotactile editor for browsers (Schneider and others 2015): amplitude and frequency by keyframes."""

from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from underfoot.errors import BadFile
from underfoot.exchange.foreign import Share, convert, read_json, unread
from underfoot.exchange.format import Format, Imported
from underfoot.exchange.patches import Channel, coarsened, patch_of
from underfoot.exchange.voices import Voice
from underfoot.kernels import Floats

PREFIX = "data:text/json;charset=utf8, "
"""Text that the editor writes before the document."""
_SILENT = frozenset(("id", "selected", "selectedTimeRange", "valueScale"))

Milliseconds = Annotated[float, msgspec.Meta(ge=0.0, le=3.6e6)]


class Loudness(msgspec.Struct, frozen=True):
    """A keyframe of the amplitude."""

    t: Milliseconds
    value: Share


class Pitch(msgspec.Struct, frozen=True):
    """A keyframe of the frequency, in hertz."""

    t: Milliseconds
    value: Annotated[float, msgspec.Meta(ge=0.0, le=5000.0)]


class Amplitudes(msgspec.Struct, frozen=True):
    """The curve of the amplitude."""

    data: Annotated[list[Loudness], msgspec.Meta(min_length=1, max_length=100_000)]


class Frequencies(msgspec.Struct, frozen=True):
    """The curve of the frequency."""

    data: Annotated[list[Pitch], msgspec.Meta(min_length=1, max_length=100_000)]


class Parameters(msgspec.Struct, frozen=True):
    """Both curves."""

    amplitude: Amplitudes
    frequency: Frequencies


class Icon(msgspec.Struct, frozen=True):
    """A whole file. `duration` is in milliseconds."""

    duration: Milliseconds
    parameters: Parameters


def read(path: Path) -> Imported:
    """Read an icon as a patch: one tone, constant before the first keyframe and after the last."""
    raw = read_json(path, prefix=PREFIX.strip())
    icon = convert(raw, path, Icon)
    end_s = 1e-3 * icon.duration
    if end_s <= 0.0:
        raise BadFile(f"{path}: $.duration is 0; allowed: above 0 ms")
    loud, high = _curve(icon.parameters.amplitude.data), _curve(icon.parameters.frequency.data)
    inside = np.concatenate([loud[:, 0], high[:, 0], [0.0, end_s]])
    times = np.unique(inside[(inside >= 0.0) & (inside <= end_s)])
    level, pitch = (np.interp(times, curve[:, 0], curve[:, 1]) for curve in (loud, high))
    points = np.column_stack([times, level, pitch])
    channels = [Channel([Voice(points)])]
    return Imported(patch_of(channels, path.stem), (*coarsened(channels), *unread(raw, Icon, _SILENT)))


def _curve(keyframes: list[Loudness] | list[Pitch]) -> Floats:
    rows = sorted((1e-3 * keyframe.t, keyframe.value) for keyframe in keyframes)
    return np.array(rows)


FORMAT = Format("macaron", "Macaron", (".json",), read=read, begins=(b'"valueScale"', b'"parameters":{"amplitude"'))
