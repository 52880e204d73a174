"""Frames on the wire, against a packing by `struct`, a checksum by `zlib`, and byte stuffing written out in words."""

import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_frames import packed, stuffed

from underfoot.devices.framing import wire_format
from underfoot.errors import BadValue

SHORT = st.integers(0, 0xFFFF)
FRAME = st.tuples(SHORT, SHORT, st.integers(0, 0xFFFF_FFFF), SHORT, SHORT, SHORT, SHORT)


@given(st.lists(FRAME, min_size=1, max_size=5))
def test_frames_are_what_the_contract_says(rows):
    assert wire_format.encode(rows) == b"".join(stuffed(packed(row)) + b"\0" for row in rows)


@pytest.mark.parametrize(
    "row", [[0] * 7, [0xFFFF, 0xFFFF, 0xFFFF_FFFF] + [0xFFFF] * 4, [257, 256, 1 << 24, 1, 0, 256, 0]]
)
def test_frames_of_zeros_and_of_none(row):
    data = wire_format.encode(row)
    assert data == stuffed(packed(row)) + b"\0"
    assert len(data) == wire_format.FRAME_BYTES
    assert data.index(0) == wire_format.STUFFED_BYTES


@given(st.lists(FRAME, min_size=1, max_size=5))
def test_lines_hold_the_same_numbers(rows):
    lines = wire_format.csv_lines(rows).decode().splitlines()
    assert [tuple(map(int, line.partition("*")[0].split(","))) for line in lines] == rows


def test_no_frames_are_no_bytes():
    assert wire_format.encode(np.zeros((0, 7), np.int64)) == b""
    assert wire_format.csv_lines([]) == b""
    assert len(wire_format.samples_of([])) == 0


@given(st.lists(FRAME, min_size=1, max_size=5))
def test_records_hold_the_same_numbers(rows):
    samples = wire_format.samples_of(rows)
    assert [tuple(row) for row in wire_format.rows_of(samples).tolist()] == rows
    out = np.zeros(wire_format.FRAME_BYTES * len(rows), np.uint8)
    wire_format.pack(samples, out)
    assert out.tobytes() == wire_format.encode(rows)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ([-1, 0, 0, 0, 0, 0, 0], "tile is -1; allowed: 0 to 65535"),
        ([0, 65536, 0, 0, 0, 0, 0], "sequence is 65536; allowed: 0 to 65535"),
        ([0, 0, 1 << 32, 0, 0, 0, 0], "microseconds is 4294967296; allowed: 0 to 4294967295"),
        ([0, 0, 0, 0, 0, 0, 70000], "r4 is 70000; allowed: 0 to 65535"),
        ([0, 0, 0, 0, 0, 0], "the shape of frames is (1, 6); allowed: (n, 7)"),
        ([0, 0, 0, 0, 0, 0, 1.5], "the type of frames is 'float64'; allowed: integers"),
    ],
)
def test_what_does_not_fit_is_refused(given, message):
    for encode in (wire_format.encode, wire_format.csv_lines):
        with pytest.raises(BadValue, match=re.escape(message)):
            encode(given)


def test_the_example_of_the_firmware_s_description_is_right():
    text = (Path(__file__).resolve().parents[3] / "assets/firmware/README.md").read_text()
    assert wire_format.encode([3, 7, 1_000_000, 0, 1, 2, 65535]).hex(" ") in text
