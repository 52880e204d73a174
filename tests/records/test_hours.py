"""Recordings of hours: what is done with them does not grow with their length where it need not."""

import sqlite3
import tracemalloc
from contextlib import closing

import numpy as np
from made_recordings import ABOUT

from underfoot.records import envelopes
from underfoot.records.exports import ExportSource, write_export
from underfoot.records.force_files import read_force_file
from underfoot.records.recording import Gap, Recording
from underfoot.records.recording_writer import Writer


def test_a_recording_ends_without_being_read_again(tmp_path):
    """A block in its middle cannot be read: of hours on a large floor it is gigabytes, and the writer has minutes."""
    path, blocks, marker = tmp_path / "long.underfoot", 300, np.float32(1234.5)
    writer = Writer(path, ABOUT)
    for block in range(blocks):
        value = marker if block == blocks // 2 else np.float32(1.0)
        samples = np.full((50, 10), value, np.float64)
        samples[:, :2] = (100.0 * block + 2.0 * np.arange(50))[:, None]
        writer.put("force", 50 * block, samples)
        for table in ("vibration", "commanded", "measured"):
            writer.put(table, 100 * block, np.full((100, 2), value, np.float32))
    writer.close()
    data = bytearray(path.read_bytes())
    for page in range(0, len(data), 4096):
        if any(bytes(one) in data[page : page + 4096] for one in (marker, np.float64(marker))):
            data[page : page + 4096] = b"\xff" * 4096
    path.write_bytes(data)
    writer = Writer(path, {}, resume=True)
    writer.cut(100 * blocks - 30)
    writer.close()
    with Recording(path) as recording:
        assert recording.ends("vibration") == (0, 100 * blocks - 30)
        assert recording.ends("force") == (0, 50 * blocks - 15)


def test_gaps_of_a_recording_that_grows_are_looked_for_in_what_is_new(tmp_path):
    """The window asks each second, and each block takes a page of the disk: in an hour there are 72,000."""
    path, frames = tmp_path / "growing.underfoot", np.ones((100, 2), np.float32)
    with closing(Writer(path, ABOUT)) as writer, Recording(path) as recording:
        for first in (0, 100, 250):
            writer.put("vibration", first, frames)
        writer.commit()
        assert recording.gaps() == [Gap(200, 50)]
        with closing(sqlite3.connect(path)) as base, base:
            base.execute("update vibration set count = 7 where first = 0")
        for first in (350, 500):
            writer.put("vibration", first, frames)
        writer.commit()
        assert recording.gaps() == [Gap(200, 50), Gap(450, 50)]
        writer.cut(480)
        writer.commit()
        assert recording.gaps() == [Gap(7, 93), Gap(200, 50)]  # all anew: what was last is not there any more


def test_the_picture_of_a_recording_that_grows_is_read_from_what_is_new(tmp_path):
    path, frames = tmp_path / "growing.underfoot", np.arange(200, dtype=np.float32).reshape(100, 2)
    with closing(Writer(path, ABOUT)) as writer, Recording(path) as recording, closing(sqlite3.connect(path)) as base:
        seen = envelopes.empty(2)
        for first in (0, 100, 250, 350):
            writer.put("commanded", first, first + frames)
            writer.commit()
            seen = envelopes.read_overview(recording.envelope_base(), "commanded", seen)
            with base:
                base.execute("delete from envelope where first = 0")
    assert (seen.begin.tolist(), seen.end.tolist()) == ([0, 100, 250, 350], [100, 200, 350, 450])
    assert (seen.low[:, 1].tolist(), seen.high[:, 1].tolist()) == ([1, 101, 251, 351], [199, 299, 449, 549])


def test_c3d_of_a_clock_that_jumped_ahead_is_written_in_little_memory(tmp_path):
    """As are hours: 2 h of four tiles took 2.2 GB."""
    path, jump = tmp_path / "jumped.underfoot", 100_000
    writer = Writer(path, ABOUT)
    for first, stamp in ((0, 0), (1000, jump)):
        samples = np.full((1000, 10), 200.0)
        samples[:, :2] = 48.0 * (stamp + np.arange(1000.0))[:, None]
        writer.put("force", first, samples)
    writer.close()
    with Recording(path) as recording:
        write_export(ExportSource(recording, stretch_s=(0.0, jump / 1000.0 + 0.005)), tmp_path / "first.c3d")
        tracemalloc.start()
        try:
            write_export(ExportSource(recording), tmp_path / "whole.c3d")
            peak = tracemalloc.get_traced_memory()[1]
        finally:
            tracemalloc.stop()
    assert peak < 4e6
    assert len(read_force_file(tmp_path / "first.c3d")[0].force_n) == jump  # the last five fill no frame
    forces, _ = read_force_file(tmp_path / "whole.c3d")
    assert len(forces.force_n) == jump + 1000
    assert np.flatnonzero(forces.force_n[:, 0, 0]).tolist() == [*range(1000), *range(jump, jump + 1000)]
