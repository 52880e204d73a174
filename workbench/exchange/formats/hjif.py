"""HJIF, the readable form of MPEG haptics (ISO/IEC 23090-31): a channel per tile, three bands, an oscillation each."""

import datetime
import json
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from underfoot.clock import RATE_HZ
from underfoot.errors import BadFile
from underfoot.exchange.clip import bursts, envelope_error_line
from underfoot.exchange.foreign import convert, read_json, unread
from underfoot.exchange.format import Export, Format, Imported
from underfoot.exchange.full_scale import scale_from_words, scale_in_words
from underfoot.exchange.patches import Channel, coarsened, patch_of
from underfoot.exchange.voices import (
    AMPLITUDE,
    FREQUENCY,
    Voice,
    analysed,
    banded,
    envelope_error_db,
    lengthened,
    simplify_points,
)
from underfoot.files import write_file
from underfoot.kernels import Floats
from underfoot.parameters import IDENTIFIER

EDGES_HZ = (20, 143, 389, 1000)
"""Edges of the bands to write. More bands follow the spectrum more closely and the envelope less, since their phases
are lost. The edges avoid round frequencies: a tone on an edge would be in two bands.
"""
MOST_CHANNELS = 127
"""Most channels of a file of the Main profile, level 1."""
TICKS = 1000
"""Ticks per second: the reference player reads ticks as milliseconds where a frequency changes."""
TRANSIENT_HZ = 2.0 / 22e-3
"""A transient plays as two cycles in 22 ms."""
QUIET = 1e-3
"""Bands whose peak is below this share of full scale are omitted."""
_WAVES = {"Sine": "sine", "Square": "square", "Triangle": "triangle", "SawToothUp": "saw", "SawToothDown": "saw"}
_SILENT = frozenset(
    ("version", "profile", "level", "date", "id", "avatar_id", "body_part_mask", "mixing_coefficient", "phase")
)
_MOST = 100_000

Tick = Annotated[int, msgspec.Meta(ge=0, le=3600 * 48_000)]
Level = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]
Hertz = Annotated[float, msgspec.Meta(ge=0.0, le=20_000.0)]


class Keyframe(msgspec.Struct, frozen=True):
    """A point of an effect, its time relative to the effect's."""

    relative_position: Tick = 0
    amplitude_modulation: Level | None = None
    frequency_modulation: Hertz | None = None


class Effect(msgspec.Struct, frozen=True):
    """Points of one oscillation, or the id of one in the library."""

    position: Tick = 0
    effect_type: str = "Basis"
    base_signal: str = "Sine"
    keyframes: Annotated[list[Keyframe], msgspec.Meta(max_length=_MOST)] = []
    id: int = -1


class Band(msgspec.Struct, frozen=True):
    """Successive effects."""

    band_type: str
    lower_frequency_limit: Hertz = 0.0
    upper_frequency_limit: Hertz = 1000.0
    effects: Annotated[list[Effect], msgspec.Meta(max_length=_MOST)] = []


class HapticChannel(msgspec.Struct, frozen=True):
    """Channel of one actuator: its bands are added."""

    description: str = ""
    gain: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)] = 1.0
    bands: Annotated[list[Band], msgspec.Meta(max_length=65_536)] = []


class Perception(msgspec.Struct, frozen=True):
    """Channels of one sense."""

    perception_modality: str
    channels: Annotated[list[HapticChannel], msgspec.Meta(max_length=65_536)]
    effect_library: Annotated[list[Effect], msgspec.Meta(max_length=_MOST)] = []


class Hjif(msgspec.Struct, frozen=True):
    """A whole file."""

    timescale: Annotated[int, msgspec.Meta(ge=1, le=48_000)]
    perceptions: Annotated[list[Perception], msgspec.Meta(max_length=1000)]
    description: str = ""


def write(export: Export, path: Path) -> tuple[str, ...]:
    """Write every tile, one channel each; of more than `MOST_CHANNELS`, those that move most."""
    edges = tuple(float(edge) for edge in EDGES_HZ)
    played = _that_move_most(export.acceleration_by_tile)
    played = {tile: lengthened(samples, RATE_HZ) for tile, samples in played.items()}
    found = {
        tile: [analysed(band, RATE_HZ) for band in banded(samples, RATE_HZ, edges)] for tile, samples in played.items()
    }
    full_m_s2 = max(float(np.sum([points[:, AMPLITUDE] for points in bands], axis=0).max()) for bands in found.values())
    channels = [_channel(at, tile, bands, full_m_s2) for at, (tile, bands) in enumerate(found.items())]
    perception = {
        "id": 0,
        "avatar_id": 0,
        "description": "",
        "perception_modality": "Vibrotactile",
        "effect_library": [],
        "reference_devices": [],
        "channels": channels,
    }
    text = f"{export.patch.title}; " if export.patch.title else ""
    document = {
        "version": "2023",
        "profile": "Main",
        "level": 1,
        "date": datetime.date.today().isoformat(),
        "description": f"{text}{scale_in_words(full_m_s2)}",
        "timescale": TICKS,
        "avatars": [],
        "perceptions": [perception],
        "syncs": [],
    }
    write_file(path, json.dumps(document, indent=1).encode())
    lines = _envelope_error_lines(played, convert(document, path, Hjif), path, full_m_s2)
    others = [tile for tile in export.acceleration_by_tile if tile not in played]
    if not others:
        return lines
    return (*lines, f"not written: {', '.join(others)}; a file has at most {MOST_CHANNELS} channels")


def _that_move_most(played: dict[str, Floats]) -> dict[str, Floats]:
    """Return the acceleration of at most `MOST_CHANNELS` tiles, in the given order."""
    most = sorted(played, key=lambda tile: float(np.square(played[tile]).sum()), reverse=True)[:MOST_CHANNELS]
    return {tile: played[tile] for tile in sorted(most, key=list(played).index)}


def _channel(at: int, tile: str, bands: list[Floats], full_m_s2: float) -> dict[str, Any]:
    written = []
    for (low, high), points in zip(pairwise(EDGES_HZ), bands, strict=True):
        points = points.copy()
        points[:, AMPLITUDE] /= full_m_s2
        if points[:, AMPLITUDE].max() > QUIET:
            written.append(_band(low, high, simplify_points(points, 0.005, 4.0)))
    return {
        "id": at,
        "description": tile,
        "gain": 1.0,
        "mixing_coefficient": 1.0,
        "body_part_mask": 0,
        "bands": written,
    }


def _band(low: int, high: int, points: Floats) -> dict[str, Any]:
    ticks = np.round(points[:, 0] * TICKS).astype(int)
    last = np.append(np.diff(ticks) > 0, True)  # the last of several points on one tick
    keyframes = [
        {
            "relative_position": int(tick),
            "amplitude_modulation": round(float(a), 5),
            "frequency_modulation": int(np.clip(round(f), low, high)),
        }
        for tick, (_, a, f) in zip(ticks[last], points[last].tolist(), strict=True)
    ]
    effect = {"effect_type": "Basis", "position": 0, "phase": 0, "base_signal": "Sine", "keyframes": keyframes}
    return {
        "band_type": "VectorialWave",
        "lower_frequency_limit": low,
        "upper_frequency_limit": high,
        "effects": [effect],
    }


def _envelope_error_lines(played: dict[str, Floats], document: Hjif, path: Path, full_m_s2: float) -> tuple[str, ...]:
    """Return the error of the envelope of each tile that moves, from the file's voices as read back."""
    lines = []
    channels, _ = _channels(document, path)
    for channel, (tile, samples) in zip(channels, played.items(), strict=True):
        if not samples.any():
            continue
        voices = [voice.samples(samples.size, RATE_HZ) for voice in channel.voices]
        written = full_m_s2 * np.sum([np.zeros(samples.size), *voices], axis=0)
        error_db = envelope_error_db(samples, written, RATE_HZ)
        lines.append(envelope_error_line(tile, samples.size, error_db))
    return tuple(lines)


def read(path: Path) -> Imported:
    """Read a file as a patch, with a group of tones for each channel."""
    raw = read_json(path)
    document = convert(raw, path, Hjif)
    channels, lost = _channels(document, path)
    full_m_s2 = scale_from_words(document.description)
    title = document.description.rpartition(";")[0] if ";" in document.description else path.stem
    losses = (*lost, *coarsened(channels), *unread(raw, Hjif, _SILENT))
    return Imported(patch_of(channels, title, full_m_s2), losses)


def _channels(document: Hjif, path: Path) -> tuple[list[Channel], tuple[str, ...]]:
    """Return the channels with their voices; if there are several, each goes to the tile of its name."""
    lost: dict[str, None] = {}
    found: list[tuple[str, list[Voice]]] = []
    for perception in document.perceptions:
        if perception.perception_modality not in ("Vibrotactile", "VibrotactileTexture", "Acceleration"):
            lost[f"perceptions of {perception.perception_modality}"] = None
            continue
        library = {effect.id: effect for effect in perception.effect_library}
        for channel in perception.channels:
            voices = [
                voice
                for band in channel.bands
                for voice in _voices(band, document.timescale, library, channel.gain, lost, path)
            ]
            found.append((channel.description, voices))
    names = [name for name, _ in found]
    are_tiles = len(set(names)) == len(names) and all(IDENTIFIER.fullmatch(name) for name in names)
    if len(found) > 1 and not are_tiles:
        lost[f"channels behind the first: {len(found) - 1}, for they are not called as tiles are"] = None
        found = found[:1]
    several = len(found) > 1
    return [Channel(voices, name if several else "all") for name, voices in found], tuple(lost)


def _voices(
    band: Band, ticks: int, library: dict[int, Effect], gain: float, lost: dict[str, None], path: Path
) -> list[Voice]:
    """Return the voices of a band: one for each wave in it, with effects of one wave in succession."""
    if band.band_type not in ("VectorialWave", "Transient"):
        lost[f"bands of type {band.band_type}"] = None
        return []
    waves: dict[str, list[Floats]] = {}
    transients = []
    for effect in sorted(band.effects, key=lambda effect: effect.position):
        basis = library.get(effect.id) if effect.effect_type == "Reference" else effect
        if basis is None or basis.effect_type == "Composite":
            lost[f"effects of type {effect.effect_type}" + ("" if basis else " that the library does not have")] = None
        elif band.band_type == "Transient":
            transients += [
                (
                    (effect.position + k.relative_position) / ticks,
                    gain * abs(k.amplitude_modulation or 0.0),
                    TRANSIENT_HZ,
                )
                for k in basis.keyframes
            ]
        else:
            if basis.base_signal not in _WAVES:
                allowed = ", ".join(_WAVES)
                raise BadFile(f"{path}: base_signal is {basis.base_signal[:40]!r}; allowed: {allowed}")
            points = _points(effect.position, basis, band, ticks)
            if points.size:
                points[:, AMPLITUDE] = gain * np.abs(points[:, AMPLITUDE])
                waves.setdefault(_WAVES[basis.base_signal], []).append(points)
    voices = [Voice(_in_order(parts), wave) for wave, parts in waves.items()]
    return voices + ([bursts(transients)] if transients else [])


def _points(position: int, effect: Effect, band: Band, ticks: int) -> Floats:
    """Return the points of an effect, in seconds; silent before the first and after the last."""
    keys = sorted(effect.keyframes, key=lambda key: key.relative_position)
    if not keys:
        return np.zeros((0, 3))
    times = np.array([key.relative_position for key in keys], float)
    amplitude = _known(times, [key.amplitude_modulation for key in keys], 1.0)
    frequency = _known(times, [key.frequency_modulation for key in keys], 0.0)
    frequency = frequency.clip(band.lower_frequency_limit, max(band.upper_frequency_limit, band.lower_frequency_limit))
    points = np.column_stack([(position + times) / ticks, amplitude, frequency])
    edges = points[[0, -1]].copy()
    edges[:, AMPLITUDE] = 0.0
    return np.concatenate([edges[:1], points, edges[1:]])


def _known(times: Floats, values: list[float | None], otherwise: float) -> Floats:
    """Return values at all times, linearly interpolated between the given ones."""
    given = [at for at, value in enumerate(values) if value is not None]
    if not given:
        return np.full(times.size, otherwise)
    return np.interp(times, times[given], np.array([values[at] for at in given], float))


def _in_order(parts: list[Floats]) -> Floats:
    """Join successive effects: one that overlaps the next ends there, as in the reference player."""
    kept = []
    for part, following in zip(parts, [*parts[1:], None], strict=True):
        if following is not None and part[-1, 0] > following[0, 0]:
            end = following[0, 0]
            inside = part[part[:, 0] < end]
            last = [end, 0.0, float(np.interp(end, part[:, 0], part[:, FREQUENCY]))]
            before = [end, float(np.interp(end, part[:, 0], part[:, AMPLITUDE])), last[2]]
            part = np.concatenate([inside, [before, last]])
        kept.append(part)
    return np.concatenate(kept)


FORMAT = Format(
    "hjif",
    "MPEG haptics",
    (".hjif",),
    frozenset(("title", "spectrum", "frequency", "tiles")),
    write,
    read,
    note=f"a channel a tile; {EDGES_HZ[0]} to {EDGES_HZ[-1]} Hz in {len(EDGES_HZ) - 1} bands",
)
