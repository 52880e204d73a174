"""WAV: the vibration of the tiles, one channel each, float samples."""

from pathlib import Path

from underfoot.errors import BadFile
from underfoot.records.exports import ExportFormat, ExportSource
from underfoot.records.wav import write_wav_parts

MOST_CHANNELS = 1024


def _write(export: ExportSource, path: Path) -> None:
    forces, source = export.forces, export.vibration
    channels = len(forces.floor.tiles)
    if channels > MOST_CHANNELS:
        raise BadFile(f"{path} would have {channels} channels; allowed: up to {MOST_CHANNELS}")
    parts = export.frames(source, f"Writing what tiles {_WORDS[source]}")
    comment = "" if export.stretch_s is None else f"from_s={export.from_s:.10g}: seconds of the recording before"
    write_wav_parts(path, parts, export.end - export.first, channels, forces.rate, comment)


_WORDS = {"commanded": "were asked", "measured": "did", "vibration": "played"}

FORMAT = ExportFormat(
    ".wav",
    "WAV: vibration, one channel a tile, float samples in m/s^2 (of full scale for what was played); RF64 beyond 4 GB",
    "force, contacts, steps, marks; gaps are silence",
    _write,
)
