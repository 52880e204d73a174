"""WAV: the vibration of the tiles, one channel each, float samples."""

from pathlib import Path

from underfoot.errors import BadFile
from underfoot.files import replaced, written
from underfoot.records.exports import ExportFormat, Material
from underfoot.records.wav import float_wav

MOST_CHANNELS = 1024


def _write(material: Material, path: Path) -> None:
    import soundfile

    forces, source = material.forces, material.vibration
    channels = len(forces.floor.tiles)
    if channels > MOST_CHANNELS:
        raise BadFile(f"{path} would have {channels} channels; allowed: up to {MOST_CHANNELS}")
    frames = forces.end - forces.first
    with replaced(path) as part, written(path):
        try:
            with float_wav(part, forces.rate, channels, frames) as file:
                for rows in material.frames(source, f"Writing what tiles {_WORDS[source]}"):
                    file.write(rows)
        except soundfile.LibsndfileError as error:
            raise BadFile(f"{path} cannot be written: {error}") from None


_WORDS = {"commanded": "were asked", "measured": "did", "vibration": "played"}

FORMAT = ExportFormat(
    ".wav",
    "WAV: vibration, one channel a tile, float samples in m/s^2 (of full scale for what was played); RF64 beyond 4 GB",
    "force, contacts, steps, marks; gaps are silence",
    _write,
)
