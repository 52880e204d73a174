"""`.haptic` 1.0, of Meta Haptics Studio (before: Lofelt): one oscillation, with emphasis on single points."""

import json
from pathlib import Path
from typing import Annotated

import msgspec
import numpy as np

from underfoot.errors import BadFile
from underfoot.exchange.clip import bursts, clip_of, written_report
from underfoot.exchange.foreign import Seconds, Share, convert, read_json, unread
from underfoot.exchange.format import Export, Format, Imported
from underfoot.exchange.full_scale import scale_from_words, scale_in_words
from underfoot.exchange.patches import Channel, coarsened, patch_of
from underfoot.exchange.voices import FREQUENCY, Voice, simplify_points
from underfoot.files import write_file
from underfoot.kernels import Floats

LOW_HZ, HIGH_HZ = 55.0, 200.0
"""Frequencies of the format's 0 and 1, which it leaves to the player; these are those of its own example player."""
_SILENT = frozenset(("version", "editor"))


class Emphasis(msgspec.Struct, frozen=True):
    """A transient on a point."""

    amplitude: Share
    frequency: Share


class AmplitudePoint(msgspec.Struct, frozen=True):
    """A point of the amplitude."""

    time: Seconds
    amplitude: Share
    emphasis: Emphasis | None = None


class FrequencyPoint(msgspec.Struct, frozen=True):
    """A point of the frequency."""

    time: Seconds
    frequency: Share


class Envelopes(msgspec.Struct, frozen=True):
    """Both curves."""

    amplitude: Annotated[list[AmplitudePoint], msgspec.Meta(min_length=2, max_length=200_000)]
    frequency: Annotated[list[FrequencyPoint], msgspec.Meta(max_length=200_000)] | None = None


class Continuous(msgspec.Struct, frozen=True):
    """The continuous signal."""

    envelopes: Envelopes


class Signals(msgspec.Struct, frozen=True):
    """The signals of a file."""

    continuous: Continuous


class Metadata(msgspec.Struct, frozen=True):
    """The metadata that are kept."""

    project: str = ""
    description: str = ""


class Haptic(msgspec.Struct, frozen=True):
    """A whole file."""

    signals: Signals
    metadata: Metadata = Metadata()


def write(export: Export, path: Path) -> tuple[str, ...]:
    """Write the tile that moves most."""
    clip = clip_of(export)
    points = clip.points.copy()
    points[:, FREQUENCY] = ((points[:, FREQUENCY] - LOW_HZ) / (HIGH_HZ - LOW_HZ)).clip(0.0, 1.0)
    points = simplify_points(points, 0.01, 0.01)
    document = {
        "version": {"major": 1, "minor": 0, "patch": 0},
        "metadata": {
            "editor": "Underfoot",
            "project": export.patch.title,
            "description": f"{scale_in_words(clip.full_m_s2)}; frequency 0 to 1 is {LOW_HZ:g} to {HIGH_HZ:g} Hz",
        },
        "signals": {
            "continuous": {
                "envelopes": {
                    "amplitude": [{"time": round(t, 6), "amplitude": round(a, 5)} for t, a, _ in points.tolist()],
                    "frequency": [{"time": round(t, 6), "frequency": round(f, 4)} for t, _, f in points.tolist()],
                }
            }
        },
    }
    write_file(path, json.dumps(document, indent=1).encode())
    return written_report(export, clip, [_voice(convert(document, path, Haptic).signals.continuous.envelopes, path)])


def read(path: Path) -> Imported:
    """Read a file as a patch: one tone, and another for emphasis."""
    raw = read_json(path)
    _require_version(raw, path)
    document = convert(raw, path, Haptic)
    envelopes = document.signals.continuous.envelopes
    voices = [_voice(envelopes, path)]
    emphasised = [
        (point.time, point.emphasis.amplitude, _hz(point.emphasis.frequency))
        for point in envelopes.amplitude
        if point.emphasis is not None
    ]
    if emphasised:
        voices.append(bursts(emphasised))
    full_m_s2 = scale_from_words(document.metadata.description)
    channels = [Channel(voices)]
    patch = patch_of(channels, document.metadata.project or path.stem, full_m_s2)
    return Imported(patch, (*coarsened(channels), *unread(raw, Haptic, _SILENT)))


def _require_version(raw: object, path: Path) -> None:
    version = raw.get("version") if isinstance(raw, dict) else None
    major = version.get("major") if isinstance(version, dict) else None
    if major != 1:
        raise BadFile(f"{path}: $.version.major is {json.dumps(major)}; allowed: 1")


def _voice(envelopes: Envelopes, path: Path) -> Voice:
    """Return amplitude and frequency at the times of both curves; a missing curve is constant at the middle."""
    times = np.array([point.time for point in envelopes.amplitude])
    amplitudes = np.array([point.amplitude for point in envelopes.amplitude])
    pitches = [(point.time, _hz(point.frequency)) for point in envelopes.frequency or ()]
    pitch = np.array(pitches or [(0.0, _hz(0.5))])
    for name, values in (("amplitude", times), ("frequency", pitch[:, 0])):
        if (np.diff(values) < 0.0).any():
            at = int(np.argmax(np.diff(values) < 0.0)) + 1
            raise BadFile(
                f"{path}: $.signals.continuous.envelopes.{name}[{at}].time is {values[at]:g}; "
                f"allowed: at or behind the point before, {values[at - 1]:g}"
            )
    between = pitch[(pitch[:, 0] > times[0]) & (pitch[:, 0] < times[-1]), 0]
    every: Floats = np.concatenate([times, np.setdiff1d(between, times)])
    order = np.argsort(every, kind="stable")
    levels = np.concatenate([amplitudes, np.interp(every[times.size :], times, amplitudes)])
    points = np.column_stack([every, levels, np.interp(every, pitch[:, 0], pitch[:, 1])])[order]
    if points[-1, 0] <= points[0, 0]:
        raise BadFile(f"{path}: $.signals.continuous.envelopes.amplitude lasts 0 s; allowed: more than 0")
    return Voice(points)


def _hz(share: float) -> float:
    return LOW_HZ + share * (HIGH_HZ - LOW_HZ)


FORMAT = Format(
    "haptic",
    "Meta Haptics Studio",
    (".haptic",),
    frozenset(("title", "range")),
    write,
    read,
    note=f"one tile; frequencies {LOW_HZ:g} to {HIGH_HZ:g} Hz",
)
