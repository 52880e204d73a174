"""The frame encoder of the sketch, compiled by this machine's compiler: the same bytes, and decoded again."""

import ctypes
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from underfoot.devices.framing import wire_format
from underfoot.devices.framing.parser import Parser

SKETCH = Path(__file__).resolve().parents[3] / "assets/firmware/tile"
COMPILER = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)


@pytest.fixture(scope="module")
def encode(tmp_path_factory):
    """The C function: takes a row of a frame, gives its bytes."""
    if COMPILER is None:
        pytest.skip("there is no C compiler (cc, gcc or clang)")
    library = tmp_path_factory.mktemp("firmware") / "tile_frame.so"
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wconversion", "-pedantic", "-Werror", "-O1", "-shared", "-fPIC"]
    subprocess.run([COMPILER, *flags, str(SKETCH / "tile_frame.c"), "-o", str(library)], check=True)
    function = ctypes.CDLL(str(library)).tile_frame_encode
    function.restype = ctypes.c_size_t
    u16 = ctypes.c_uint16
    function.argtypes = [ctypes.c_char_p, u16, u16, ctypes.c_uint32, u16 * 4]

    shaken = ctypes.CDLL(str(library)).tile_frame_encode_acceleration
    shaken.restype, shaken.argtypes = function.restype, function.argtypes

    def run(row, of=function):
        out = ctypes.create_string_buffer(wire_format.FRAME_BYTES)
        size = of(out, *row[:3], (u16 * 4)(*row[3:]))
        return out.raw[:size]

    def line(row):
        out = ctypes.create_string_buffer(52)
        size = as_text(out, *row[:3], (u16 * 4)(*row[3:]))
        return out.value[:size]

    as_text = ctypes.CDLL(str(library)).tile_line_encode
    as_text.restype, as_text.argtypes = function.restype, function.argtypes
    run.acceleration, run.line = lambda row: run(row, shaken), line
    return run


def test_the_firmware_s_frames_are_ours(encode):
    rows = np.random.default_rng(7).integers(0, wire_format.MAX_VALUES + 1, (2000, 7))
    rows[::3] &= 0xFF00FF  # with many zero bytes among them
    rows[0], rows[1] = 0, wire_format.MAX_VALUES
    sent = b"".join(encode(row) for row in rows.tolist())
    assert sent == wire_format.encode(rows)
    assert b"".join(encode.line(row) for row in rows.tolist()) == wire_format.csv_lines(rows)


def test_the_parser_decodes_what_the_firmware_sends(encode):
    rows = [[5, i & 0xFFFF, (1000 * i) & 0xFFFFFFFF, i, 256 * (i % 256), 0, 65535 - i] for i in range(3000)]
    parser = Parser()
    got = parser.feed(b"".join(encode(row) for row in rows))
    np.testing.assert_array_equal(wire_format.rows_of(got), rows)
    assert parser.counts.lost == parser.counts.corrupted == 0


def test_frames_of_acceleration_stand_beside_those_of_forces(encode):
    """Each kind has a sequence of its own: nothing is lost where both count from 0."""
    rows = [[2, i, 1000 * i, 32768 + i, 32768 - i, 65535, 0] for i in range(100)]
    parser = Parser()
    got = parser.feed(b"".join(encode(row) + encode.acceleration(row) for row in rows)).copy()
    for kind in (wire_format.FORCES, wire_format.ACCELERATION):
        np.testing.assert_array_equal(wire_format.rows_of(got[got["kind"] == kind]), rows)
    assert parser.counts.lost == parser.counts.corrupted == parser.counts.doubled == 0


def test_the_sketch_sends_by_that_function():
    sketch = (SKETCH / "tile.ino").read_text()
    assert '#include "tile_frame.h"' in sketch
    assert "tile_frame_encode(frame, TILE, sequence, now, readings)" in sketch
    assert "tile_line_encode(line, TILE, sequence, now, readings)" in sketch
    assert "tile_frame_encode_acceleration(frame, TILE, shaken_sequence, now, shaken)" in sketch
