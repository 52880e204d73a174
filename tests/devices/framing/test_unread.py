"""Bytes of senders that a maker gets wrong: the reason names what is wrong in them."""

import struct
import zlib

import numpy as np
import pytest
from made_frames import packed, stuffed

from underfoot.devices.framing.unread import why_unread
from underfoot.devices.framing.wire_format import CHECKED_BYTES

FRAMES = [packed((3, number, 1000 * number, 0, 256, 1000, 65535)) for number in range(100)]


def sent(change, end=b"\0"):
    return b"".join(change(frame) + end for frame in FRAMES)


def rechecked(frame, order="<"):
    return stuffed(frame[:CHECKED_BYTES] + struct.pack(order + "I", zlib.crc32(frame[:CHECKED_BYTES])))


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (sent(lambda frame: rechecked(frame, ">")), "frames with a wrong CRC-32; allowed: that of zlib"),
        (sent(lambda frame: stuffed(frame[:CHECKED_BYTES])), "18 bytes before each zero byte; allowed: 22"),
        (sent(stuffed, b"\n"), "no zero byte, which ends a frame"),
        (sent(lambda frame: frame), "not at the ends of frames alone (COBS)"),
        (sent(lambda frame: rechecked(b"\7" + frame[1:])), "frames of kind 7; allowed: 1, forces, and 2, acceleration"),
        (sent(lambda frame: b"\x16" + bytes(range(1, 22))), "frames with a wrong CRC-32"),
        (sent(lambda frame: b"\x05" + bytes([9] * 21)), "not stuffed as COBS does"),
        (np.random.default_rng(1).bytes(2000), "is the baud rate right?"),
        (50 * b"0;41;41000;312;298;305;290\r\n", "lines as '0;41;41000;312;298;305;290'; allowed: tile,sequence,"),
        (50 * b"0,41,41000,312.0,298.5,-3,290\n", "lines as '0,41,41000,312.0,298.5,-3,290'; allowed:"),
        (50 * b"0;41;41000;312;298;305;290\n\0", "lines as '0;41;41000;312;298;305;290'; allowed:"),
        (
            50 * b"0,41,41000,312,298,305,290*0D\n",
            "*0D'; allowed: *0E at its end, the exclusive or",
        ),
        (bytes(600), "0 bytes before each zero byte"),
    ],
)
def test_what_is_wrong_in_bytes_is_named(data, words):
    assert words in why_unread(data, "is the baud rate right?")
