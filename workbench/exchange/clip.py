"""Reduction of an export to one channel and one oscillation, as formats of phones and controllers need it."""

from dataclasses import dataclass

import numpy as np

from underfoot.clock import RATE_HZ
from underfoot.exchange.format import Export
from underfoot.exchange.voices import AMPLITUDE, Voice, analysed, envelope_error_db, lengthened
from underfoot.kernels import Floats

BURST_S, RISE_S = 22e-3, 2e-3
"""Duration and rise time of a transient, as in the reference player of MPEG haptics."""


@dataclass(frozen=True)
class Clip:
    """The tile that moves most: id, samples in m/s^2, and analysed points, with amplitudes relative to `full_m_s2`."""

    tile: str
    samples: Floats
    points: Floats
    full_m_s2: float


def clip_of(export: Export) -> Clip:
    """Return the single channel of an export."""
    tile, moved = export.loudest
    samples = lengthened(moved, RATE_HZ)
    points = analysed(samples, RATE_HZ)
    full_m_s2 = float(points[:, AMPLITUDE].max())
    points[:, AMPLITUDE] /= full_m_s2
    return Clip(tile, samples, points, full_m_s2)


def written_report(export: Export, clip: Clip, voices: list[Voice]) -> tuple[str, ...]:
    """Return the report on a written file, from its voices as read back: the error of the envelope."""
    written = np.sum([voice.samples(clip.samples.size, RATE_HZ) for voice in voices], axis=0) * clip.full_m_s2
    error_db = envelope_error_db(clip.samples, written, RATE_HZ)
    others = [tile for tile in export.acceleration_by_tile if tile != clip.tile]
    lines = [envelope_error_line(clip.tile, clip.samples.size, error_db)]
    if others:
        lines.append(f"not written: {', '.join(others)}; --tile writes another one")
    return tuple(lines)


def envelope_error_line(tile: str, frames: int, error_db: float) -> str:
    """Return the line on the error of a tile's envelope."""
    return f"{frames / RATE_HZ:.3f} s of tile {tile}, read again: envelope within {error_db:.1f} dB (root mean square)"


def bursts(transients: list[tuple[float, float, float]]) -> Voice:
    """Convert transients (time, amplitude, frequency) to one voice of short tones; each ends at the next."""
    rows: list[tuple[float, float, float]] = []
    transients = sorted(transients)
    for at, (time_s, amplitude, frequency_hz) in enumerate(transients):
        end_s = time_s + BURST_S
        if at + 1 < len(transients):
            end_s = min(end_s, transients[at + 1][0])
        rise_s = min(time_s + RISE_S, 0.5 * (time_s + end_s))
        rows += [(time_s, 0.0, frequency_hz), (rise_s, amplitude, frequency_hz), (end_s, 0.0, frequency_hz)]
    return Voice(np.array(rows))
