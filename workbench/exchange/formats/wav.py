"""WAV: the drive, relative to full scale, one channel per tile."""

from pathlib import Path

from underfoot.errors import BadFile
from underfoot.exchange.format import Export, Format, Imported
from underfoot.exchange.patches import player_of
from underfoot.files import require_readable
from underfoot.quantities import counted
from underfoot.records.wav import write_wav


def write(export: Export, path: Path) -> tuple[str, ...]:
    """Write the same samples as `underfoot render`: of all tiles, or of one."""
    samples = export.samples
    write_wav(path, samples, export.rendered.rate_hz)
    seconds, channels = len(samples) / export.rendered.rate_hz, samples.shape[1]
    return (f"{seconds:.3f} s, {counted(channels, 'channel')}, exact to 32-bit floats",)


def read(path: Path) -> Imported:
    """Read a file as a patch that plays it; the file stays where it is."""
    import soundfile

    require_readable(path)  # reports a missing file in the usual way
    try:
        with soundfile.SoundFile(path) as file:
            channels, frames = file.channels, file.frames
    except (soundfile.LibsndfileError, OSError, TypeError, ValueError) as error:
        raise BadFile(f"{path} cannot be played: {str(error).rstrip('.')}") from None
    if not frames:
        raise BadFile(f"{path} cannot be played: it has no samples")
    lost = (f"channels behind the first: {channels - 1}",) if channels > 1 else ()
    return Imported(player_of(path.absolute(), path.stem), lost)


FORMAT = Format(
    "wav",
    "Sound file",
    (".wav",),
    frozenset(("tiles", "sound", "waveform", "spectrum", "frequency", "range", "onsets")),
    write,
    read,
    note="a channel a tile, and one for ears where the patch has it; full scale as the profile says",
)
