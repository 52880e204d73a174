"""Writing of C3D files without points, as the manual of C3D describes them: parameters, and analog samples as floats.

Samples are written part by part: an hour of a large floor does not fit into memory several times. Libraries hold a
file as a whole, and ezc3d 1.7 leaves the units and descriptions of 255 channels empty where there are more.
"""

import struct
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import replaced, written
from underfoot.records.c3d_files import BLOCK, KEY

Parameters = Mapping[str, list[str] | NDArray[Any] | float]
"""Parameters of a group by name: texts, or numbers in the parameter's shape, of which the first index runs fastest."""
MOST = 255
"""Values along one dimension of a parameter: it is told in a byte. As the C3D manual has it, the 256th and the
following values of LABELS are in LABELS2, the next ones in LABELS3."""
MOST_TEXT = 100
"""Bytes that are kept of a text: the longest is the size of all in a parameter, and `MOST` of them must stay within its
32 KiB."""
MOST_WORD = 65_535
"""The largest whole number: frames of a file, samples of all channels in one of them, blocks before the samples."""
_INTEL = 84


def write_c3d(
    path: Path,
    groups: Mapping[str, Parameters],
    frame_hz: float,
    shape: tuple[int, int, int],
    parts: Iterable[NDArray[np.float32]],
) -> None:
    """Write a file of `shape`: frames, analog samples in each, and channels. `parts` are its samples, [n, channels].

    `BadFile` if it cannot be written, or has more parameters than a header can tell.
    """
    frames, in_frame, channels = shape
    data_block = 2 + len(_section(groups, frame_hz, frames, 0)) // BLOCK
    if data_block > MOST_WORD:
        raise BadFile(f"{path} would have more events than a C3D file can hold; allowed: stretches of the recording")
    numbers = (2, KEY, 0, channels * in_frame, 1, frames, 0, -1.0, data_block, in_frame, frame_hz)
    with replaced(path) as part, written(path), part.open("wb") as file:
        file.write(struct.pack("<2B5Hf2Hf", *numbers).ljust(BLOCK, b"\0"))
        file.write(_section(groups, frame_hz, frames, data_block))
        for samples in parts:
            file.write(np.ascontiguousarray(samples, "<f4").data)
        file.write(bytes(-file.tell() % BLOCK))


def _section(groups: Mapping[str, Parameters], frame_hz: float, frames: int, data_block: int) -> bytes:
    """Return the parameter section, with the group of points, of which there are none."""
    points: Parameters = {
        "USED": 0,
        "SCALE": -1.0,
        "RATE": frame_hz,
        "DATA_START": data_block,
        "FRAMES": frames,
        "LABELS": [],
        "DESCRIPTIONS": [],
        "UNITS": ["mm"],
    }
    records = []
    for number, (group, parameters) in enumerate({"POINT": points, **groups}.items(), 1):
        records.append(_record(-number, group, b""))
        for name, value in parameters.items():
            records += [_record(number, called, _encoded(part)) for called, part in _split(name, value)]
    section = b"".join(records) + b"\0"
    blocks = -(-(4 + len(section)) // BLOCK)
    # Of more blocks than a byte can tell it tells the most: readers that rely on it then miss only the last ones.
    return (bytes((1, KEY, min(blocks, MOST), _INTEL)) + section).ljust(BLOCK * blocks, b"\0")


def _split(name: str, value: list[str] | NDArray[Any] | float) -> Iterator[tuple[str, list[str] | NDArray[Any]]]:
    """Yield a parameter, and NAME2, NAME3, ... with what is beyond `MOST` values."""
    values = value if isinstance(value, list) else np.asarray(value)
    count = len(values) if isinstance(values, list) else values.shape[-1] if values.ndim else 1
    if count <= MOST:
        yield name, values
        return
    for number, first in enumerate(range(0, count, MOST), 1):
        called = name if number == 1 else f"{name}{number}"
        yield called, values[first : first + MOST] if isinstance(values, list) else values[..., first : first + MOST]


def _encoded(value: list[str] | NDArray[Any]) -> bytes:
    """Return type, dimensions and values. Whole numbers that do not fit into two bytes are floats."""
    if isinstance(value, list):
        texts = [text.encode()[:MOST_TEXT].decode(errors="ignore").encode() for text in value]  # whole letters
        width = max(map(len, texts), default=0) or 1
        kind, shape, data = -1, (width, len(texts)), b"".join(text.ljust(width) for text in texts)
    else:
        is_short = value.dtype.kind in "iu" and value.max(initial=0) <= MOST_WORD
        kind, form = (2, "<u2") if is_short else (4, "<f4")
        shape, data = value.shape, value.astype(form).tobytes(order="F")
    return struct.pack(f"<2b{len(shape)}B", kind, len(shape), *shape) + data


def _record(number: int, name: str, body: bytes) -> bytes:
    """Return a group (of a negative number) or a parameter of one, without a description."""
    return struct.pack("<2b", len(name), number) + name.encode() + struct.pack("<H", 3 + len(body)) + body + b"\0"
