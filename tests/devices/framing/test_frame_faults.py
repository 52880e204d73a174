"""Faults of tiles that show in their frames, said as they come and when they change."""

import re

import numpy as np

from underfoot.devices.framing.frame_faults import FrameFaults
from underfoot.devices.framing.parser import Parser
from underfoot.devices.framing.wire_format import FRAME_BYTES, encode
from underfoot.floor.layout import default_floor


def test_microseconds_that_wrap_too_early_are_said():
    """Those of a counter of cycles, divided by 120 MHz: after 36 s. Only power and frame numbers were asked about."""
    parser = Parser()
    faults = FrameFaults(parser, default_floor(1, 1), 100.0, "given", "")
    i = np.arange(15_000)
    parser.feed(encode(np.column_stack([0 * i, i, 10_000 * i % (2**32 // 120), *[0 * i] * 4])))
    (line,) = faults.take_notices(150.0)
    assert line.startswith("tile t1 began anew 4 times; ")
    assert line.endswith("its microseconds to 4294967295?")


def test_a_fault_that_begins_late_is_said_within_a_minute_and_so_is_that_of_the_next_tile():
    """Among all frames since the start, the lost ones were few for hours; and only the first tile was named.

    Its share was named while the minute filled, as 7 %, then as 33 %; and nothing was said of a fault that came back
    after hours.
    """
    parser, said = Parser(), []
    faults = FrameFaults(parser, default_floor(1, 2), 50.0, "given", "")
    for k in range(100):  # of ten seconds; there are two hours before the last twenty
        i = np.arange(500 * k, 500 * (k + 1))
        for tile in range(2):
            come = i if k < 20 + 20 * tile or 60 <= k < 90 else i[i % 3 > 0]
            rows = np.column_stack([0 * come + tile, come % 65536, 20_000 * come, *[come % 9] * 4])
            parser.feed(encode(rows))
        lines = faults.take_notices(10.0 * k + 7200.0 * (k >= 80))
        said += [(k, re.sub(" of its frames.* samples", "", line)) for line in lines]
    assert said == [
        (20, "tile t1: 33%"),
        (40, "tile t2: 33%"),
        (90, "tile t1: 33%; likewise t2"),
    ]


def test_a_board_that_began_anew_a_moment_ago_is_not_said_to_leap():
    """Its period is not known again until its second frame; the bytes of its numbers were said to be swapped."""
    parser = Parser()
    faults = FrameFaults(parser, default_floor(1, 1), 1000.0, "given", "is it?")
    for number in (*range(1500), 0, 1):
        parser.feed(encode([[0, number, 1000 * number, 0, 0, 0, 0]]))
    assert (parser.counts.restarts, parser.period_us(0)) == (1, 0)
    assert faults.take_notices(2.0) == []


def test_a_board_that_sends_each_frame_from_another_port_is_said():
    """As code that makes a socket for each datagram: all but a frame a second was left out, and nothing was said."""
    parser = Parser()
    faults = FrameFaults(parser, default_floor(1, 1), 1000.0, "given", "")
    rows = [[0, i, 1000 * i, *[1000] * 4] for i in range(3000)]
    parser.feed(encode(rows), [(FRAME_BYTES * (i + 1), i) for i in range(3000)], 0.5)
    (line,) = faults.take_notices(3.0)
    assert line.startswith("tile t1: nearly all of its frames are left out: address and port from which it sends must")
