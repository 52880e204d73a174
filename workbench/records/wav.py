"""Sound files that commands write: the same samples give the same bytes."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import replaced, written

_SET_ADD_PEAK_CHUNK = 0x1050
"""libsndfile's SFC_SET_ADD_PEAK_CHUNK: the chunk would carry a time stamp, and two files would differ."""
_MOST_BYTES = 0xFFFF0000


def write_wav(path: str | Path, samples: NDArray[np.float32], rate_hz: float) -> None:
    """Write float32 [frame, channel] as a float WAV, whole or not at all. `BadFile` where that cannot be."""
    import soundfile

    with replaced(path) as part, written(path):
        try:
            with float_wav(part, rate_hz, samples.shape[1], len(samples)) as file:
                file.write(samples)
        except soundfile.LibsndfileError as error:
            raise BadFile(f"{path} cannot be written: {error}") from None


def float_wav(path: Path, rate_hz: float, channels: int, frames: int) -> Any:
    """A float WAV to be written, of about so many frames: RF64 where WAV ends. A `soundfile.SoundFile`."""
    import soundfile

    kind = "WAV" if 4 * channels * frames < _MOST_BYTES else "RF64"
    file = soundfile.SoundFile(path, "w", round(rate_hz), channels, "FLOAT", format=kind)
    soundfile._snd.sf_command(file._file, _SET_ADD_PEAK_CHUNK, soundfile._ffi.NULL, 0)
    return file
