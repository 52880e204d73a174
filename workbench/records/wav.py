"""Sound files that commands write: the same samples give the same bytes."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import replaced, written

_SET_ADD_PEAK_CHUNK = 0x1050
"""libsndfile's SFC_SET_ADD_PEAK_CHUNK: the chunk would carry a time stamp, and two files would differ."""


def write_wav(path: str | Path, samples: NDArray[np.float32], rate_hz: float) -> None:
    """Write float32 [frame, channel] as a float WAV, whole or not at all. `BadFile` where that cannot be."""
    import soundfile

    with replaced(path) as part, written(path):
        try:
            with soundfile.SoundFile(part, "w", round(rate_hz), samples.shape[1], "FLOAT", format="WAV") as file:
                soundfile._snd.sf_command(file._file, _SET_ADD_PEAK_CHUNK, soundfile._ffi.NULL, 0)
                file.write(samples)
        except soundfile.LibsndfileError as error:
            raise BadFile(f"{path} cannot be written: {error}") from None
