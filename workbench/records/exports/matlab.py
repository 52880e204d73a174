"""MAT: a recording for MATLAB and Octave, in the format of MATLAB 5."""

import math
import os
import struct
import tempfile
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import replaced, written
from underfoot.records.exports import ExportFormat, ExportSource, stance_columns
from underfoot.records.survey import Stance

MOST_BYTES = (1 << 31) - 1
"""Of one variable."""
_INT8, _INT32, _UINT32, _MATRIX, _COMPRESSED = 1, 5, 6, 14, 15
"""Kinds of elements of a MAT file."""
_NUMBERS = {"<f4": (7, 7), "<f8": (6, 9)}
"""Class of a matrix and kind of its data."""
_AT_ONCE = 1 << 20
"""Bytes that are compressed at once."""


def _write(export: ExportSource, path: Path) -> None:
    from scipy.io import savemat

    forces, source = export.forces, export.vibration
    tiles = len(forces.floor.tiles)
    needed = max(32 * tiles * export.length_s * forces.rate_hz, 4 * tiles * (export.end - export.first))
    if needed > MOST_BYTES:
        raise BadFile(
            f"{path} would need {needed / 1e9:.1f} GB for one variable; allowed: 2.1 GB; export a stretch, or as .h5"
        )
    times = [time_s for time_s, _ in export.pieces("Reading times")]
    steps: list[Stance] = []
    rows = []
    for found, stances in export.found("Looking for steps and contacts"):
        steps += stances
        rows.append(found)
    names = ("time_s", "contact", "x_m", "y_m", "force_n", "on_tile")
    marks, columns = export.marks(), stance_columns(steps)
    content: dict[str, Any] = {
        "tiles": np.array(forces.floor.ids, object),
        "rate_hz": forces.rate,
        "force_rate_hz": forces.rate_hz,
        "from_s": export.from_s,
        "begun": export.begun,
        "calibrations": np.array(export.calibrations, object),
        "floor_json": export.recording.about["floor"],
        "patch_json": export.recording.about["patch"],
        "time_s": np.concatenate([*times, np.zeros(0)]),
        "contacts": {name: np.concatenate([getattr(row, name) for row in rows]) for name in names},
        "steps": {name: v.astype(object) if v.dtype.kind == "U" else v for name, v in columns.items()},
        "marks": {"time_s": np.array([at for at, _ in marks]), "text": np.array([text for _, text in marks], object)},
    }
    with replaced(path) as part, written(path):
        savemat(str(part), content, appendmat=False, do_compression=True, oned_as="column")  # for struct2table
        with part.open("r+b") as file:
            file.seek(0, os.SEEK_END)
            pieces = (force_n for _, force_n in export.pieces("Reading forces"))
            _append(export, file, "corners_n", pieces, (len(content["time_s"]), tiles, 4), "<f8")
            frames = export.frames(source, f"Reading {source}")
            name = source if source == "vibration" else f"{source}_m_s2"
            _append(export, file, name, frames, (export.end - export.first, tiles), "<f4")


def _append(
    export: ExportSource, file: BinaryIO, name: str, parts: Iterable[NDArray[Any]], shape: tuple[int, ...], kind: str
) -> None:
    """Append a large variable, given part by part, and compressed piece by piece. In MATLAB's order what is of one tile
    lies together: it is put so in a file beside, and not in memory."""
    of_class, of_data = _NUMBERS[kind]
    size = np.dtype(kind).itemsize
    length, at = size * math.prod(shape), 0
    head = _element(_UINT32, struct.pack("<II", of_class, 0))
    head += _element(_INT32, struct.pack(f"<{len(shape)}i", *shape)) + _element(_INT8, name.encode())
    padding, begin, packer = -length % 8, file.tell(), zlib.compressobj()
    file.write(struct.pack("<II", _COMPRESSED, 0))
    file.write(packer.compress(struct.pack("<II", _MATRIX, len(head) + 8 + length + padding) + head))
    file.write(packer.compress(struct.pack("<II", of_data, length)))
    with tempfile.TemporaryFile(dir=os.path.dirname(file.name)) as beside:
        for part in parts:
            for number, column in enumerate(part.T.reshape(-1, len(part)).astype(kind, "C")):
                beside.seek(size * (number * shape[0] + at))
                beside.write(column.data)
            at += len(part)
        beside.seek(0)
        while piece := beside.read(_AT_ONCE):
            export.report_progress(f"Writing {name}", beside.tell() / length)
            file.write(packer.compress(piece))
    file.write(packer.compress(bytes(padding)) + packer.flush())
    end = file.tell()
    file.seek(begin)
    file.write(struct.pack("<II", _COMPRESSED, end - begin - 8))
    file.seek(end)


def _element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


FORMAT = ExportFormat(
    ".mat",
    "MAT (MATLAB 5): forces, one kind of vibration, contacts, steps and marks, with floor and patch as JSON",
    "commands and gaps; more than 2 GB a variable",
    _write,
)
