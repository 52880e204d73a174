"""C3D files of every processor and form of numbers, beside what ezc3d reads; and damaged ones."""

import random
import struct
import tracemalloc

import ezc3d
import numpy as np
import pytest

from underfoot.errors import BadFile
from underfoot.floor import forces as forces_module
from underfoot.records.c3d_files import C3DFile
from underfoot.records.force_files import floor_of, read_force_file

INTEL, DEC, MIPS = 84, 85, 86
CORNERS_MM = [(500, 0, 0), (0, 0, 0), (0, 400, 0), (500, 400, 0)]
PLATE = {
    "POINT": {"USED": 0, "SCALE": -1.0, "RATE": 100.0, "UNITS": ["mm"], "DATA_START": 6, "FRAMES": 1},
    "ANALOG": {
        "USED": 8,
        "RATE": 200.0,
        "GEN_SCALE": 0.5,
        "SCALE": [2.0] * 4 + [0.1, 0.2, 0.3, 0.4],
        "OFFSET": [0] * 8,
    },
    "FORCE_PLATFORM": {
        "USED": 1,
        "TYPE": [3],
        "CORNERS": np.array(CORNERS_MM, float).T[:, :, None],
        "ORIGIN": np.array([[120.0], [200.0], [-40.0]]),
        "CHANNEL": np.arange(1, 9)[:, None],
    },
}


class FileBytes:
    """Bytes of a C3D file as a processor writes them."""

    def __init__(self, processor):
        self.processor, self.order = processor, ">" if processor == MIPS else "<"

    def floats(self, values):
        if self.processor != DEC:
            return np.asarray(values, f"{self.order}f4").tobytes()
        halves = (np.asarray(values, "<f4") * np.float32(4.0)).view("<u2").reshape(-1, 2)
        return halves[:, ::-1].tobytes()

    def words(self, *values):
        return struct.pack(f"{self.order}{len(values)}H", *(value % 65_536 for value in values))

    def parameter(self, group, name, value):
        if isinstance(value, list) and isinstance(value[0], str):
            width = max(map(len, value))
            body = struct.pack("bBBB", -1, 2, width, len(value)) + b"".join(
                text.ljust(width).encode() for text in value
            )
        else:
            array = np.asarray(value)
            is_whole = array.dtype.kind == "i"
            flat = array.ravel(order="F").tolist()
            told = struct.pack(f"bB{array.ndim}B", 2 if is_whole else 4, array.ndim, *array.shape)
            body = told + (self.words(*flat) if is_whole else self.floats(flat))
        return struct.pack("bb", len(name), group) + name.encode() + self.words(len(body) + 3) + body + b"\0"

    def groups(self, groups):
        found = b""
        for number, (name, parameters) in enumerate(groups.items(), 1):
            found += struct.pack("bb", len(name), -number) + name.encode() + self.words(3) + b"\0"
            for one, value in parameters.items():
                found += self.parameter(number, one, value)
        return bytes([1, 80, 4, self.processor]) + found

    def file(self, samples, kind, in_frame=2, frames=None, last=None, **more):
        """Return a file with these samples (n, 8) of a plate of type 3, as "float", "signed" or "unsigned"."""
        frames = frames or len(samples) // in_frame
        groups = {name: dict(parameters) for name, parameters in PLATE.items()} | more
        groups["POINT"]["FRAMES"] = frames if frames < 65_536 else float(frames)
        if kind == "unsigned":
            groups["ANALOG"] |= {"FORMAT": ["UNSIGNED"], "OFFSET": [-32_768] * 8}
        scale = -1.0 if kind == "float" else 1.0
        groups["POINT"]["SCALE"] = scale
        header = bytes([2, 80]) + self.words(0, 8 * in_frame, 1, last or frames, 0) + self.floats([scale])
        header += self.words(6, in_frame) + self.floats([100.0])
        data = self.floats(samples.ravel()) if kind == "float" else self.words(*samples.ravel().astype(int).tolist())
        return header.ljust(512, b"\0") + self.groups(groups).ljust(4 * 512, b"\0") + data


def integers(kind, count=100):
    """Samples (n, 8) that each kind of numbers can hold."""
    low, high = (20_000, 60_000) if kind == "unsigned" else (-30_000, 30_000)
    return np.random.default_rng(1).integers(low, high, (count, 8)).astype(float)


def analogs(file):
    return np.concatenate(list(file.analogs(np.arange(8))), axis=1)


@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS])
@pytest.mark.parametrize("kind", ["float", "signed", "unsigned"])
def test_files_of_every_processor_hold_what_was_measured(tmp_path, processor, kind):
    path, counts = tmp_path / "lab.c3d", integers(kind)
    path.write_bytes(FileBytes(processor).file(counts, kind))
    own = C3DFile(path)
    expected = 0.5 * np.array(PLATE["ANALOG"]["SCALE"]) * (counts - (32_768 if kind == "unsigned" else 0))
    np.testing.assert_allclose(analogs(own), expected.T, rtol=1e-6)
    forces, floor = read_force_file(path)
    assert floor == floor_of(path)
    assert floor.tiles[0].size_m == (0.5, 0.4)
    assert (len(forces.force_n), forces.rate_hz) == (100, 200.0)
    if processor != MIPS and kind != "unsigned":  # ezc3d refuses the one, and takes the other for signed numbers
        theirs = ezc3d.c3d(str(path))
        np.testing.assert_allclose(analogs(own), theirs["data"]["analogs"][0], rtol=1e-6)
        for name in PLATE["FORCE_PLATFORM"]:
            found = np.ravel(theirs["parameters"]["FORCE_PLATFORM"][name]["value"], order="F")
            np.testing.assert_allclose(own.numbers[f"FORCE_PLATFORM:{name}"].ravel(order="F"), found, rtol=1e-6)


def test_a_long_file_takes_little_more_memory_than_its_forces_and_has_a_limit(tmp_path, monkeypatch):
    path, samples = tmp_path / "long.c3d", np.tile(integers("signed"), (4000, 1))
    path.write_bytes(FileBytes(INTEL).file(samples, "signed", last=65_535))
    tracemalloc.start()
    forces, _ = read_force_file(path)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(forces.force_n) == 400_000
    assert most < 2.5 * (forces.force_n.nbytes + forces.time_s.nbytes)
    for at in (0, 200_000, 399_900):
        assert (forces.force_n[at : at + 100] == forces.force_n[:100]).all()
    monkeypatch.setattr(forces_module, "MOST_BYTES", forces.force_n.nbytes - 1)
    with pytest.raises(BadFile, match=r"long\.c3d: \d+ s are too much to be played at once; allowed: \d+ s"):
        read_force_file(path)


@pytest.mark.parametrize("z", ["down", "up"])
def test_an_empty_plate_that_has_drifted_has_the_sign_of_the_one_that_is_stood_on(tmp_path, z):
    """Each took the sign of its own greatest force: the empty one was pressed with 30 N from its first sample on."""
    path, samples = tmp_path / "two.c3d", np.zeros((100, 8))
    samples[30:60, 4:], samples[:, :4] = 200.0, -7.5
    corners = np.stack([np.array(CORNERS_MM), np.array(CORNERS_MM) + np.array([600, 0, 0])], axis=2).astype(float)
    second = corners[:, :, 1] if z == "down" else corners[::-1, :, 1]
    samples[:, :4] *= 1 if z == "down" else -1
    plates = {
        "USED": 2,
        "TYPE": [3, 3],
        "CORNERS": np.stack([corners[:, :, 0].T, second.T], axis=2),
        "ORIGIN": np.repeat(PLATE["FORCE_PLATFORM"]["ORIGIN"], 2, axis=1),
        "CHANNEL": np.array([[1, 2, 3, 4, 5, 6, 7, 8], [5, 6, 7, 8, 1, 2, 3, 4]]).T,
    }
    analog = PLATE["ANALOG"] | {"GEN_SCALE": 1.0, "SCALE": [1.0] * 8}
    path.write_bytes(FileBytes(INTEL).file(samples, "float", FORCE_PLATFORM=plates, ANALOG=analog))
    loads_n = read_force_file(path)[0].force_n.sum(axis=2)
    np.testing.assert_allclose(loads_n, np.stack([samples[:, 4] * 4.0, np.full(100, -30.0)], axis=1))


@pytest.mark.parametrize(
    "more", [{}, {"TRIAL": {"ACTUAL_START_FIELD": [1, 0], "ACTUAL_END_FIELD": [70_000 - 65_536, 1]}}], ids=["", "TRIAL"]
)
def test_a_file_of_more_frames_than_its_header_can_count_is_read_whole(tmp_path, more):
    path = tmp_path / "long.c3d"
    samples = np.arange(70_000.0)[:, None] * np.ones(8)
    path.write_bytes(FileBytes(INTEL).file(samples, "float", in_frame=1, last=65_535, **more) + b"\0" * 300)
    assert read_force_file(path)[0].force_n[:, 0, 3] == pytest.approx(0.05 * samples[:, 0])


def test_damaged_files_are_refused_in_a_line_or_read(tmp_path):
    """ezc3d ended the process at one in thirty of them, and went on for ever at one in two hundred."""
    path = tmp_path / "damaged.c3d"
    whole = FileBytes(INTEL).file(integers("float"), "float")
    drawn, found = random.Random(1), []
    for _ in range(1000):
        damaged = bytearray(whole)
        for _ in range(drawn.choice((1, 2, 4))):
            damaged[drawn.randrange(5 * 512)] = drawn.choice((0, 1, 128, 255, drawn.randrange(256)))
        path.write_bytes(damaged[: drawn.choice((None, drawn.randrange(len(damaged))))])
        try:
            read_force_file(path)
        except BadFile as error:
            found.append(str(error))
    assert 200 < len(found) < 900
    assert all(line.startswith(str(path)) and "\n" not in line for line in found)
