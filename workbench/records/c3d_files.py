"""Parameters and analog samples of a C3D file, as the manual of C3D describes them (www.c3d.org).

Libraries read the same numbers, but a damaged file can end the process that ezc3d runs in, or keep it busy for ever;
py-c3d takes 10 s for 10 minutes at 1 kHz, and refuses files whose rates are rounded.
"""

import math
import os
import struct
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile, in_one_line
from underfoot.files import require_readable

Values = NDArray[np.float64]
"""Numbers of a parameter, in its shape: the first index runs fastest in the file."""
MOST_FRAMES = 65_535
"""Frames that a header can count; with this number it tells nothing."""
BLOCK = 512
KEY = 0x50
"""The second byte of every C3D file."""
_ORDERS = {84: "<", 85: "<", 86: ">"}
"""Byte order of the processors: Intel, DEC, and MIPS or SGI."""
_DEC = 85
_AT_ONCE = 1 << 18
"""Bytes of frames that are read at once."""


class C3DFile:
    """A C3D file, of which only header and parameters have been read; `BadFile` if they cannot be.

    `numbers` and `texts` have the parameters by names such as "POINT:RATE". `samples` is the number of analog samples
    of a channel, and `channels` that of the channels.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self.numbers: dict[str, Values] = {}
        self.texts: dict[str, list[str]] = {}
        require_readable(path)  # a pipe would be waited for
        try:
            with self.path.open("rb") as file:
                self._read(file)
        except (OSError, ValueError, KeyError, IndexError, struct.error) as error:
            reason = in_one_line(error)[:120]
            raise BadFile(f"{path} is no C3D file that can be read: {reason}") from None

    def analogs(self, channels: NDArray[np.intp]) -> Iterator[Values]:
        """Yield the samples of channels, counted from 0, part by part, [channel, sample], in their units."""
        scale, offset = self._per_channel("SCALE", channels, 1.0), self._per_channel("OFFSET", channels, 0.0)
        if self._kind == "u2":
            offset %= 65_536.0
        general = self.number("ANALOG:GEN_SCALE", 1.0)
        a_time = max(_AT_ONCE // self._frame_bytes, 1)
        try:
            with self.path.open("rb") as file, np.errstate(all="ignore"):
                file.seek(self._data_at)
                for first in range(0, self._frames, a_time):
                    data = file.read(min(a_time, self._frames - first) * self._frame_bytes)
                    frames = self._decoded(data, self._kind).reshape(-1, self._frame_bytes // self._width)
                    rows = frames[:, 4 * self._points :].reshape(-1, self.channels)[:, channels]
                    yield ((rows - offset) * (scale * general)).T
        except (OSError, ValueError) as error:
            raise BadFile(f"{self.path} cannot be read: {in_one_line(error)[:120]}") from None

    def of_channels(self, name: str) -> Sequence[str]:
        """Return the texts of a parameter of channels; those from the 256th on are in NAME2, NAME3, ..."""
        return [text for part in _parts(name) for text in self.texts.get(part, [])]

    def number(self, name: str, otherwise: float) -> float:
        """Return the first number of a parameter, or `otherwise` if there is none."""
        found = self.numbers.get(name)
        return float(found.flat[0]) if found is not None and found.size else otherwise

    def _per_channel(self, name: str, channels: NDArray[np.intp], otherwise: float) -> Values:
        parts = [self.numbers[part].ravel() for part in _parts(f"ANALOG:{name}") if part in self.numbers]
        found = np.concatenate([np.zeros(0), *parts])
        if not len(found):
            return np.full(len(channels), otherwise)
        if channels.max() >= len(found):
            raise BadFile(f"{self.path}: ANALOG:{name} has {len(found)} values; allowed: one for each channel")
        return found[channels]

    def _read(self, file: BinaryIO) -> None:
        header = file.read(BLOCK)
        if len(header) < BLOCK or header[1] != KEY:
            raise ValueError("it does not begin as one")
        file.seek(BLOCK * (header[0] - 1))
        start = file.read(4)
        if len(start) < 4 or start[3] not in _ORDERS:
            raise ValueError("it does not say its processor; allowed: Intel, DEC, MIPS")
        self._order, self._is_dec = _ORDERS[start[3]], start[3] == _DEC
        self._points, words, first, last = struct.unpack_from(f"{self._order}4H", header, 2)
        data_block, in_frame = struct.unpack_from(f"{self._order}2H", header, 16)
        if data_block <= header[0]:
            raise ValueError("it does not say where its samples are, as one whose writing was stopped")
        self._data_at = BLOCK * (data_block - 1)
        self._read_parameters(file.read(max(self._data_at - file.tell(), 0)))
        is_float = self._decoded(header[12:16], "f4")[0] < 0.0
        unsigned = self.texts.get("ANALOG:FORMAT", [""])[:1] == ["UNSIGNED"]
        self._kind, self._width = ("f4", 4) if is_float else ("u2" if unsigned else "i2", 2)
        self.channels = words // in_frame if in_frame else 0
        self._frame_bytes = self._width * (4 * self._points + words)
        self._frames = self._counted(first, last, os.fstat(file.fileno()).st_size) if self.channels else 0
        self.samples = self._frames * in_frame
        if words != self.channels * in_frame:
            raise ValueError(f"its header has {words} analog samples in a frame, of {in_frame} for each channel")

    def _counted(self, first: int, last: int, size: int) -> int:
        """Return the number of frames: the header's, or that of the parameters where the header cannot tell it."""
        there = max(size - self._data_at, 0) // self._frame_bytes
        told = last - first + 1
        if last >= MOST_FRAMES or told < 0:
            start, end = (
                self.numbers.get(f"TRIAL:ACTUAL_{name}_FIELD", np.zeros(0)).ravel() for name in ("START", "END")
            )
            if len(start) == len(end) == 2:  # each in two words
                told = round(float((end % 65_536.0 - start % 65_536.0) @ (1.0, 65_536.0))) + 1
            else:
                frames = self.number("POINT:FRAMES", 0.0)
                told = round(frames) if frames > MOST_FRAMES else there
        if there < told:
            whole = "allowed: a whole file; copy or export it again"
            raise BadFile(f"{self.path} ends after {there} of its {told} frames; {whole}")
        return told

    def _read_parameters(self, data: bytes) -> None:
        """Read the groups and parameters of a parameter section without its first four bytes."""
        groups: dict[int, str] = {}
        found: list[tuple[int, str, Values | list[str]]] = []
        at, further = 0, 1
        while further and at + 2 <= len(data) and data[at]:
            length, group = struct.unpack_from("2b", data, at)
            after = at + 2 + abs(length)
            name = data[at + 2 : after].decode("latin-1").upper()
            (further,) = struct.unpack_from(f"{self._order}H", data, after)
            if group < 0:
                groups[-group] = name
            else:
                found.append((group, name, self._value(data, after + 2)))
            at = after + further
        for group, name, value in found:
            key = f"{groups.get(group, '')}:{name}"
            if isinstance(value, list):
                self.texts[key] = value
            else:
                self.numbers[key] = value

    def _value(self, data: bytes, at: int) -> Values | list[str]:
        kind, dimensions = struct.unpack_from("bB", data, at)
        shape = tuple(data[at + 2 : at + 2 + dimensions])
        begin, count = at + 2 + dimensions, math.prod(shape)
        if kind == -1:
            width = shape[0] if shape else 1
            text = data[begin : begin + count].decode("latin-1")
            return [text[k : k + width].strip() for k in range(0, count, max(width, 1))]
        kinds = {1: "u1", 2: "i2", 4: "f4"}
        if kind not in kinds:
            raise ValueError(f"a parameter is of type {kind}; allowed: -1, 1, 2, 4")
        raw = data[begin : begin + count * abs(kind)]
        return self._decoded(raw, kinds[kind]).reshape(shape, order="F")

    def _decoded(self, data: bytes, kind: str) -> Values:
        """Return numbers in the processor's form. Floats of DEC have their halves exchanged and another exponent."""
        with np.errstate(all="ignore"):
            if kind == "f4" and self._is_dec:
                halves = np.frombuffer(data, "<u2").reshape(-1, 2)[:, ::-1]
                return np.ascontiguousarray(halves).view("<f4").ravel().astype(np.float64) / 4.0
            return np.frombuffer(data, f"{self._order}{kind}").astype(np.float64)


def _parts(name: str) -> list[str]:
    return [name, *(f"{name}{k}" for k in range(2, 10))]
