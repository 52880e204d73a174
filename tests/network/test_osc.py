"""OSC: the same bytes as another library makes, and nothing accepted that is not exactly OSC."""

import contextlib
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder, build_msg

from underfoot.errors import BadValue
from underfoot.network.osc import Double, Long, Message, TimeTag, bundle, message, read

ARGUMENTS = st.lists(
    st.one_of(
        st.integers(1 - 2**31, 2**31 - 1),
        st.floats(width=32, allow_nan=False),
        st.booleans(),
        st.text("aäß€ x/,#", max_size=9),
    ),
    max_size=8,
)


@given(ARGUMENTS)
def test_messages_are_those_of_python_osc_and_come_back(arguments):
    made = message("/one/two", *arguments)
    assert made == build_msg("/one/two", arguments).dgram
    assert read(made) == [Message("/one/two", tuple(arguments))]


def test_bundles_and_long_numbers_are_those_of_python_osc():
    builder = OscMessageBuilder("/long")
    for value, kind in ((2**40, "h"), (0.1, "d")):
        builder.add_arg(value, kind)
    long = builder.build()
    outer, inner = OscBundleBuilder(IMMEDIATELY), OscBundleBuilder(IMMEDIATELY)
    inner.add_content(long)
    outer.add_content(build_msg("/a", [1]))
    outer.add_content(inner.build())
    made = bundle([message("/a", 1), bundle([message("/long", Long(2**40), Double(0.1))])])
    assert made == outer.build().dgram
    assert read(made) == [Message("/a", (1,)), Message("/long", (2**40, 0.1))]


def test_a_time_tag_counts_from_1900():
    tagged = message("/t", TimeTag.of(0.25))
    assert tagged[-8:] == struct.pack(">II", 2_208_988_800, 1 << 30)


@given(st.binary(max_size=96))
def test_whatever_comes_is_read_or_refused(datagram):
    with contextlib.suppress(BadValue):
        read(datagram)


@given(st.data())
def test_a_message_with_bytes_changed_is_read_or_refused(data):
    good = bytearray(bundle([message("/underfoot/play", "gravel", "t1", -6.0, 3)]))
    for place in data.draw(st.lists(st.integers(0, len(good) - 1), min_size=1, max_size=4)):
        good[place] = data.draw(st.integers(0, 255))
    with contextlib.suppress(BadValue):
        read(bytes(good))


def nested(depth):
    packet = message("/a")
    for _ in range(depth):
        packet = bundle([packet])
    return packet


FORGED = {
    "nothing": b"",
    "a slash": b"/",
    "no end of the address": b"/abc",
    "no types": b"/abc\0\0\0\0",
    "types without a comma": b"/a\0\0i\0\0\0\0\0\0\1",
    "an argument that is not there": b"/a\0\0,i\0\0",
    "half an argument": b"/a\0\0,h\0\0\0\0\0\1",
    "more than the arguments": message("/a", 1) + b"\0\0\0\0",
    "letters in the padding": b"/a\0x,\0\0\0",
    "text that is not UTF-8": b"/a\0\0,s\0\0\xff\xfe\0\0",
    "a control character": b"/a\0\0,s\0\0\x07ab\0",
    "an end of a line": message("/a", "two\nlines"),
    "another end of a line": message("/a", "two\u2028lines"),
    "a type that there is not": b"/a\0\0,q\0\0\0\0\0\0",
    "a blob of 2 GB": b"/a\0\0,b\0\0\x7f\xff\xff\xff",
    "an array": b"/a\0\0,[i]\0\0\0\0\0\0\0\1",
    "an open array": b"/a\0\0,[\0\0",
    "too many arguments": b"/a\0\0," + b"T" * 33 + b"\0\0",
    "a bundle without a time": b"#bundle\0",
    "a bundle in half": b"#bundle\0" + b"\0" * 8 + b"\0\0",
    "an element of negative size": b"#bundle\0" + b"\0" * 8 + struct.pack(">i", -4),
    "an element of size 0": b"#bundle\0" + b"\0" * 12,
    "an element beyond the end": b"#bundle\0" + b"\0" * 8 + struct.pack(">i", 400) + message("/a"),
    "bundles nested deeply": nested(5),
    "bundles nested very deeply": nested(90),
    "too many messages": bundle([message("/a")] * 33),
    "one bad element behind a good one": bundle([message("/a"), b"/a\0\0,i\0\0"]),
}


def test_what_is_just_allowed_is_read():
    assert len(read(nested(4))) == 1
    assert len(read(bundle([message("/a", *range(32))] * 32))) == 32


@pytest.mark.parametrize("datagram", FORGED.values(), ids=FORGED)
def test_forged_datagrams_are_refused_whole(datagram):
    with pytest.raises(BadValue):
        read(datagram)
