"""Frames built by `struct`, by `zlib`, and by byte stuffing written out; and the expected counts."""

import struct
import zlib

import numpy as np

from underfoot.devices.framing.wire_format import FRAME_BYTES


def packed(row):
    """Return the 21 bytes of a frame."""
    body = struct.pack("<BHHI4H", 1, *row)
    return body + struct.pack("<I", zlib.crc32(body))


def stuffed(data):
    """Stuff fewer than 254 bytes (consistent overhead byte stuffing): each part between zeros with its length."""
    return b"".join(bytes([len(part) + 1]) + part for part in data.split(b"\0"))


def rows(count, tiles=1, first=0, period_us=1000, start_us=0):
    """Return integers (count times tiles, 7), one instant after the other; readings identify tile and sample."""
    number = np.repeat(np.arange(first, first + count), tiles)
    tile = np.tile(np.arange(tiles), count)
    out = np.zeros((len(number), 7), np.int64)
    out[:, 0], out[:, 1] = tile, number & 0xFFFF
    out[:, 2] = (start_us + number * period_us) & 0xFFFF_FFFF
    out[:, 3:] = (number[:, None] * np.array([1, 256, 7, 13]) + tile[:, None]) & 0xFFFF
    return out


def frames_of(data):
    """Split bytes of whole frames into frames."""
    return [data[i : i + FRAME_BYTES] for i in range(0, len(data), FRAME_BYTES)]


def expected_counts(sent):
    """Return the expected counts for frames sent in this order: rows of tile, sequence, intact or not."""
    accepted = lost = doubled = reordered = 0
    for tile in np.unique(sent[:, 0]):
        seen, newest = set(), -1
        for number in sent[(sent[:, 0] == tile) & (sent[:, 2] == 1), 1].tolist():
            if number in seen:
                doubled += 1
                continue
            seen.add(number)
            reordered += number < newest
            newest = max(newest, number)
        accepted += len(seen)
        lost += newest - min(seen) + 1 - len(seen)
    return {"accepted": accepted, "lost": lost, "doubled": doubled, "reordered": reordered}
