"""HDF5: all of a recording, as datasets with their units."""

import io
import os
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import replaced, written
from underfoot.quantities import split_unit
from underfoot.records.exports import VIBRATION, ExportFormat, ExportSource, stance_columns
from underfoot.records.survey import Stance

if TYPE_CHECKING:
    import h5py
    from typing_extensions import Buffer

CHUNK_FRAMES, CHUNK_ROWS = 48_000, 1024
"""Of vibration, and of tables: as much is read from a file at once."""


def _write(export: ExportSource, path: Path) -> None:
    try:
        import h5py
    except ImportError:
        raise BadFile(f"{path} cannot be written: h5py is missing; install underfoot[hdf5]") from None
    forces, recording = export.forces, export.recording
    tiles = len(forces.floor.tiles)
    with replaced(path) as part, written(path), _Disk(part) as disk, h5py.File(disk, "w") as file:
        file.attrs.update({key: recording.about[key] for key in ("floor", "patch")})
        file.attrs.update(rate_hz=forces.rate, force_rate_hz=forces.rate_hz, tiles=list(forces.floor.ids))
        file.attrs.update(from_s=export.from_s, begun=export.begun, calibrations=export.calibrations)
        table = _Growing(file.create_group("force"), ("time_s", "corners_n"))
        table.append(time_s=np.zeros(0), corners_n=np.zeros((0, tiles, 4)))  # there also if no sample came
        for time_s, force_n in export.pieces("Writing forces"):
            table.append(time_s=time_s, corners_n=force_n)
            disk.require_room()
        for source in VIBRATION:
            unit = "of full scale" if source == "vibration" else "m/s^2"
            frames = _Frames(file.require_group("vibration"), source, unit, export.end - export.first, tiles)
            for rows in export.frames(source, f"Writing {source}"):
                frames.append(rows)
                disk.require_room()
            frames.flush()
        contacts = _Growing(file.create_group("contacts"), ("time_s", "contact", "x_m", "y_m", "force_n", "on_tile"))
        steps: list[Stance] = []
        for found, stances in export.found("Writing steps and contacts"):
            steps += stances
            contacts.append(**{name: getattr(found, name) for name in contacts.names})
        for name, values in stance_columns(steps).items():
            _put(file.require_group("steps"), name, values)
        marks = export.marks()
        _put(file.require_group("marks"), "time_s", np.array([time_s for time_s, _ in marks]))
        _put(file.require_group("marks"), "text", [text for _, text in marks])
        commands = export.commands()
        _put(file.require_group("commands"), "time_s", np.array([time_s for time_s, _, _ in commands]))
        for name, place in (("kind", 1), ("body", 2)):
            _put(file.require_group("commands"), name, [str(command[place]) for command in commands])
        _put(file, "gaps_s", np.array(export.gaps()).reshape(-1, 2))
        file.flush()
        disk.require_room()


class _Disk(io.FileIO):
    """A file that keeps in memory what a full disk refuses: HDF5 cannot close a file that it could not write."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "w+b")
        self._error: OSError | None = None
        self._kept: list[tuple[int, bytes]] = []
        self._end = 0

    def require_room(self) -> None:
        """Raise the error with which something was refused."""
        if self._error is not None:
            raise self._error

    def seek(self, place: int, whence: int = os.SEEK_SET) -> int:
        if whence == os.SEEK_END:
            place = max(super().seek(0, os.SEEK_END), self._end) + place
        return super().seek(place)

    def write(self, data: "Buffer") -> int:
        rest, at = memoryview(data), self.tell()
        self._end = max(self._end, at + len(rest))
        try:
            while rest and self._error is None:
                rest = rest[super().write(rest) :]
        except OSError as error:
            self._error = error
        if self._error is not None:
            self._kept.append((at, bytes(data)))
        return len(memoryview(data))

    def readinto(self, into: "Buffer") -> int:
        at, found = self.tell(), memoryview(into)
        super().readinto(found)
        for begin, kept in self._kept:
            first, last = max(begin, at), min(begin + len(kept), at + len(found))
            if first < last:
                found[first - at : last - at] = kept[first - begin : last - begin]
        return len(found)

    def truncate(self, size: int | None = None) -> int:
        if self._error is None:
            with suppress(OSError):  # it is longer only once it is written
                return super().truncate(size)
        return size or 0


class _Frames:
    """A dataset [frame, tile] that is written from its first frame to its last. What a tile does lies together, second
    by second, and a second in which it is still is not written at all: HDF5 reads it as zeros. Nothing is compressed:
    vibration does not become much smaller, and takes ten times as long."""

    def __init__(self, group: "h5py.Group", name: str, unit: str, frames: int, tiles: int) -> None:
        length = min(CHUNK_FRAMES, max(frames, 1))
        self._data = group.create_dataset(name, (frames, tiles), "<f4", chunks=(length, 1))
        self._data.attrs["unit"] = unit
        self._chunk = np.zeros((tiles, length), np.float32)
        self._first = self._filled = 0

    def append(self, rows: NDArray[np.float32]) -> None:
        at = 0
        while at < len(rows):
            part = rows[at : at + self._chunk.shape[1] - self._filled]
            self._chunk[:, self._filled : self._filled + len(part)] = part.T
            self._filled += len(part)
            at += len(part)
            if self._filled == self._chunk.shape[1]:
                self.flush()

    def flush(self) -> None:
        """Write what is there; before the last frame only where a chunk is full."""
        self._chunk[:, self._filled :] = 0.0
        for tile in np.flatnonzero(self._chunk.any(axis=1)) if self._filled else ():
            self._data.id.write_direct_chunk((self._first, int(tile)), self._chunk[tile].astype("<f4").tobytes())
        self._first, self._filled = self._first + self._filled, 0


class _Growing:
    """Datasets of a group that grow together, piece by piece."""

    def __init__(self, group: "h5py.Group", names: tuple[str, ...]) -> None:
        self._group, self.names = group, names

    def append(self, **rows: NDArray[np.generic]) -> None:
        for name, new in rows.items():
            if name not in self._group:
                chunks, most = (CHUNK_ROWS, *new.shape[1:]), (None, *new.shape[1:])
                made = self._group.create_dataset(name, data=new, maxshape=most, chunks=chunks)
                made.attrs["unit"] = split_unit(name)[1]
            elif len(new):
                data = self._group[name]
                data.resize(len(data) + len(new), axis=0)
                data[-len(new) :] = new


def _put(group: "h5py.Group", name: str, values: NDArray[np.generic] | list[str]) -> None:
    import h5py

    if isinstance(values, list) or values.dtype.kind == "U":
        texts = [str(text).replace("\0", " ") for text in values]  # at which a text of HDF5 would end
        group.create_dataset(name, data=np.array(texts, object), dtype=h5py.string_dtype())
    else:
        group.create_dataset(name, data=values).attrs["unit"] = split_unit(name)[1]


FORMAT = ExportFormat(
    ".h5",
    "HDF5: forces, vibration, contacts, steps, marks, commands and gaps, with floor and patch as JSON",
    "nothing is left out (needs h5py: install underfoot[hdf5])",
    _write,
)
