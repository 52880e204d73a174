"""MAT: a recording for MATLAB and Octave, in the format of MATLAB 5."""

import os
import struct
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
_AT_ONCE = 1 << 24
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
    pieces = list(export.pieces("Reading forces"))
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
        "time_s": np.concatenate([time_s for time_s, _ in pieces] or [np.zeros(0)]),
        "contacts": {name: np.concatenate([getattr(row, name) for row in rows]) for name in names},
        "steps": {name: v.astype(object) if v.dtype.kind == "U" else v for name, v in columns.items()},
        "marks": {"time_s": np.array([at for at, _ in marks]), "text": np.array([text for _, text in marks], object)},
    }
    with replaced(path) as part, written(path):
        savemat(str(part), content, appendmat=False, do_compression=True, oned_as="column")  # for struct2table
        with part.open("r+b") as file:
            file.seek(0, os.SEEK_END)
            corners_n = _column_major(
                (force_n for _, force_n in pieces), (sum(len(t) for t, _ in pieces), tiles, 4), "<f8"
            )
            del pieces
            _append(export, file, "corners_n", corners_n)
            del corners_n
            frames = _column_major(
                export.frames(source, f"Reading {source}"), (export.end - export.first, tiles), "<f4"
            )
            _append(export, file, f"{source}{'' if source == 'vibration' else '_m_s2'}", frames)


def _column_major(parts: Iterable[NDArray[Any]], shape: tuple[int, ...], kind: str) -> NDArray[Any]:
    """Return parts one after another, in MATLAB's order: what is of one tile lies together."""
    whole, at = np.empty(shape, kind, order="F"), 0
    for part in parts:
        whole[at : at + len(part)] = part
        at += len(part)
    return whole


def _append(export: ExportSource, file: BinaryIO, name: str, values: NDArray[Any]) -> None:
    """Append a large variable, compressed piece by piece: `savemat` makes several copies of each."""
    of_class, of_data = _NUMBERS[values.dtype.str]
    head = _element(_UINT32, struct.pack("<II", of_class, 0))
    head += _element(_INT32, struct.pack(f"<{values.ndim}i", *values.shape)) + _element(_INT8, name.encode())
    padding = -values.nbytes % 8
    begin, packer, data = file.tell(), zlib.compressobj(), values.ravel(order="F").view(np.uint8)
    file.write(struct.pack("<II", _COMPRESSED, 0))
    file.write(packer.compress(struct.pack("<II", _MATRIX, len(head) + 8 + values.nbytes + padding) + head))
    file.write(packer.compress(struct.pack("<II", of_data, values.nbytes)))
    for at in range(0, len(data), _AT_ONCE):
        export.report_progress(f"Writing {name}", at / len(data))
        file.write(packer.compress(data[at : at + _AT_ONCE].data))
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
