"""Pictures and films that are made without a screen, read back by decoders that are not ours."""

import numpy as np
import pytest

from underfoot.drawing.png import png
from underfoot.floor.layout import default_floor
from underfoot.scenes.pictures import Canvas, gif
from underfoot.scenes.shapes import Disc, Lines, Text, box

QtGui = pytest.importorskip("PySide6.QtGui")


def decoded(path):
    """Every picture in a file, as Qt reads it: uint8 [picture, row, column, channel]."""
    reader, found = QtGui.QImageReader(str(path)), []
    while reader.canRead():
        image = reader.read().convertToFormat(QtGui.QImage.Format.Format_RGB888)
        rows = np.frombuffer(image.constBits(), np.uint8).reshape(image.height(), image.bytesPerLine())
        found.append(rows[:, : 3 * image.width()].reshape(image.height(), image.width(), 3).copy())
    assert found, reader.errorString()
    return np.array(found)


def test_a_picture_is_read_back_to_the_byte(tmp_path):
    pixels = np.random.default_rng(1).integers(0, 256, (31, 47, 3)).astype(np.uint8)
    (tmp_path / "noise.png").write_bytes(png(pixels))
    assert np.array_equal(decoded(tmp_path / "noise.png")[0], pixels)


@pytest.mark.parametrize("size", [(1, 1), (40, 60), (300, 200)])
def test_a_film_of_few_colours_is_read_back_to_the_byte(tmp_path, size):
    draws = np.random.default_rng(2)
    colours = draws.integers(0, 32, (200, 3)) * 8
    frames = [colours[draws.integers(0, 200, size)].astype(np.uint8) for _ in range(4)]
    frames.append(frames[-1])  # nothing changes
    (tmp_path / "film.gif").write_bytes(gif(frames, 0.1))
    read = decoded(tmp_path / "film.gif")
    assert len(read) == 5
    assert np.array_equal(read, np.array(frames))


def test_shapes_have_their_areas_and_places():
    canvas = Canvas(default_floor(), 400)
    empty = canvas.paint([])
    assert not empty.any()
    corners = np.concatenate([tile.corners_m() for tile in default_floor().tiles])
    px_per_m = 400 / (np.ptp(corners[:, 0]) + 0.1)
    disc = canvas.paint([Disc(0.1, 0.2, 0.05, "#ffffff")])[..., 0] / 255.0
    assert disc.sum() == pytest.approx(np.pi * (0.05 * px_per_m) ** 2, rel=0.01)
    rows, columns = np.indices(disc.shape)
    middle = (disc * (columns + 0.5)).sum() / disc.sum(), (disc * (rows + 0.5)).sum() / disc.sum()
    low, high = corners.min(axis=0) - 0.05, corners.max(axis=0) + 0.05
    expected = (0.1 - low[0]) * px_per_m, (high[1] - 0.2) * px_per_m
    assert middle == pytest.approx(expected, abs=0.5)
    ring = canvas.paint([Disc(0.3, 0.3, 0.05, "#ffffff", rim_m=0.01)])[..., 0] / 255.0
    assert ring.sum() == pytest.approx(np.pi * (0.05**2 - 0.04**2) * px_per_m**2, rel=0.02)
    half = canvas.paint([box(0.3, 0.3, 0.2, 0.1, "#ffffff", 0.5)])[..., 0] / 255.0
    assert half.sum() == pytest.approx(0.5 * 0.02 * px_per_m**2, rel=0.02)
    line = canvas.paint([Lines(np.array([[[0.1, 0.1], [0.3, 0.2]]]), "#ffffff", 0.01)])[..., 0] / 255.0
    assert line.sum() == pytest.approx((0.01 * np.hypot(0.2, 0.1) + np.pi * 0.005**2) * px_per_m**2, rel=0.03)
    assert canvas.paint([Text(0.3, 0.3, "12 cm", 0.05, "#ffffff")]).any()
    assert not canvas.paint([Disc(9.0, 9.0, 0.05, "#ffffff")]).any()  # beside the picture
