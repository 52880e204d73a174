"""Open Sound Control 1.0: encoding and decoding of messages and bundles.

Input is decoded strictly: a datagram that deviates from the specification is refused as a whole, with a reason. So is
one with deeper nesting than `MOST_DEPTH`, or with more than `MOST_MESSAGES`.
"""

import re
import struct
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from msgspec import Struct

from underfoot.errors import BadValue

MOST_DEPTH, MOST_MESSAGES, MOST_ARGUMENTS = 4, 32, 32
"""Deepest nesting of bundles, most messages in a datagram, most arguments of a message."""

IMMEDIATELY = 1
"""The time tag for now."""

_BUNDLE = b"#bundle\0"
_CONTROL = re.compile("[\0-\x1f\x7f-\x9f\u2028\u2029]")  # and ends of lines; a space of any width is text
_NTP_1970_S = 2_208_988_800  # seconds from 1900, where OSC's time begins, to 1970

Argument = int | float | str | bool


class Long(int):
    """Integer that is sent with 64 bits."""


class Double(float):
    """Float that is sent with 64 bits."""


class TimeTag(int):
    """Time tag: seconds since 1900, times 2^32, in 64 bits: they begin anew in 2036, as NTP's."""

    @staticmethod
    def of(unix_s: float) -> "TimeTag":
        """Return the time tag of a time in seconds since 1970.

        >>> TimeTag.of(0.5) >> 32, TimeTag.of(0.5) & 0xFFFFFFFF == 1 << 31
        (2208988800, True)
        >>> TimeTag.of(2_085_978_497.0) >> 32  # in the new era
        1
        """
        return TimeTag(round((unix_s + _NTP_1970_S) * 4294967296.0) % (1 << 64))


class Message(Struct, frozen=True):
    """OSC message: address and arguments."""

    address: str
    arguments: tuple[Argument, ...] = ()


_TYPES: dict[type, tuple[str, Callable[[Any], bytes]]] = {
    str: ("s", lambda value: _text(value)),
    bool: ("", lambda value: b""),
    int: ("i", struct.Struct(">i").pack),
    float: ("f", struct.Struct(">f").pack),
    Long: ("h", struct.Struct(">q").pack),
    Double: ("d", struct.Struct(">d").pack),
    TimeTag: ("t", struct.Struct(">Q").pack),
}


def message(address: str, *arguments: Argument) -> bytes:
    """Encode a message. Text is sent as s, bool as T or F, int as i, float as f, `Long` as h, `Double` as d, `TimeTag`
    as t.

    >>> message("/a", 1)
    b'/a\\x00\\x00,i\\x00\\x00\\x00\\x00\\x00\\x01'
    """
    tags, parts = [","], []
    for argument in arguments:
        tag, pack = _TYPES[type(argument)]
        tags.append(tag or ("T" if argument else "F"))
        parts.append(pack(argument))
    return _text(address) + _text("".join(tags)) + b"".join(parts)


def bundle(messages: Sequence[bytes]) -> bytes:
    """Encode a bundle of messages, for immediate effect."""
    elements = (struct.pack(">i", len(element)) + element for element in messages)
    return _BUNDLE + struct.pack(">Q", IMMEDIATELY) + b"".join(elements)


def read(datagram: bytes) -> list[Message]:
    """Decode the messages of a datagram, in order; `BadValue` if it is refused. Time tags of bundles are ignored.

    >>> read(bundle([message("/a", 1, 0.5, "b", True)]))
    [Message(address='/a', arguments=(1, 0.5, 'b', True))]
    """
    found = list(_messages(datagram, 0))
    if len(found) > MOST_MESSAGES:
        raise BadValue(f"a datagram has {len(found)} messages; allowed: {MOST_MESSAGES}")
    return found


def _messages(packet: bytes, depth: int) -> Iterator[Message]:
    if len(packet) % 4:
        raise BadValue(f"an OSC packet has {len(packet)} bytes; allowed: a multiple of 4")
    if not packet.startswith(_BUNDLE):
        yield _message(packet)
        return
    if depth == MOST_DEPTH:
        raise BadValue(f"bundles lie deeper in one another than {MOST_DEPTH}")
    if len(packet) < 16:
        raise BadValue("a bundle ends before its time tag")
    at = 16
    while at < len(packet):
        size = struct.unpack_from(">i", packet, at)[0]
        at += 4
        if not 0 < size <= len(packet) - at:
            raise BadValue(f"a bundle's element has {size} bytes; allowed: 4 to what the bundle holds")
        yield from _messages(packet[at : at + size], depth + 1)
        at += size


def _message(packet: bytes) -> Message:
    address, at = _read_text(packet, 0)
    if not address.startswith("/"):
        raise BadValue("an OSC address begins with a slash")
    tags, at = _read_text(packet, at)
    if not tags.startswith(","):
        raise BadValue("an OSC message's types begin with a comma")
    if len(tags) > 1 + MOST_ARGUMENTS:
        raise BadValue(f"a message has {len(tags) - 1} arguments; allowed: {MOST_ARGUMENTS}")
    arguments: list[Argument] = []
    for tag in tags[1:]:
        argument: Argument
        if tag == "s":
            argument, at = _read_text(packet, at)
        elif tag in "TF":
            argument = tag == "T"
        elif tag in _NUMBERS:
            number = _NUMBERS[tag]
            if at + number.size > len(packet):
                raise BadValue("a message ends before its arguments do")
            (argument,) = number.unpack_from(packet, at)
            at += number.size
        else:
            raise BadValue(f"an argument is of type {tag!r}; allowed: i, f, s, h, d, T, F")
        arguments.append(argument)
    if at != len(packet):
        raise BadValue("a message is longer than its arguments")
    return Message(address, tuple(arguments))


_NUMBERS = {tag: struct.Struct(f">{code}") for tag, code in (("i", "i"), ("f", "f"), ("h", "q"), ("d", "d"))}


def _text(text: str) -> bytes:
    data = text.encode()
    return data + b"\0" * (4 - len(data) % 4)


def _read_text(packet: bytes, at: int) -> tuple[str, int]:
    """Return the text at a position, and the position after it."""
    end = packet.find(b"\0", at)
    behind = end + 4 - end % 4
    if end < 0 or behind > len(packet) or packet[end:behind].strip(b"\0"):
        raise BadValue("a text in an OSC message has no end")
    try:
        text = packet[at:end].decode()
    except UnicodeDecodeError:
        raise BadValue("a text in an OSC message is not UTF-8") from None
    if _CONTROL.search(text):
        raise BadValue("a text in an OSC message has control characters")
    return text, behind
