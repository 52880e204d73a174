"""Sound files: the same samples make the same bytes."""

import numpy as np
import pytest
import soundfile

from underfoot.errors import BadFile
from underfoot.records.wav import write_wav

SAMPLES = np.random.default_rng(1).uniform(-1.0, 1.0, (4_800, 3)).astype(np.float32)


def test_the_same_samples_make_the_same_file(tmp_path):
    one, two = tmp_path / "one.wav", tmp_path / "two.wav"
    for path in (one, two):
        write_wav(path, SAMPLES, 48_000)
    assert one.read_bytes() == two.read_bytes()
    assert b"PEAK" not in one.read_bytes()[:200]
    back, rate = soundfile.read(one, dtype="float32", always_2d=True)
    assert (back.tobytes(), rate) == (SAMPLES.tobytes(), 48_000)
    assert soundfile.info(one).subtype == "FLOAT"


def test_a_file_that_cannot_be_written_is_one_line(tmp_path):
    with pytest.raises(BadFile, match="cannot be written"):
        write_wav(tmp_path / "none" / "out.wav", SAMPLES, 48_000)
    assert list(tmp_path.iterdir()) == []
