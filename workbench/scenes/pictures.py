"""Pictures of scenes without a screen: anti-aliased shapes, and PNG and GIF files."""

import struct
from collections.abc import Iterable, Sequence
from functools import singledispatchmethod

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing.look import rgb
from underfoot.floor.layout import Floor
from underfoot.scenes.shapes import Disc, Lines, Polygon, Shape, Text
from underfoot.scenes.strokes import written

GROUND = "#000000"
"""Background: no light from a projector."""
MARGIN_M = 0.05
_STROKE = 0.11
"""Width of the strokes of letters, as a share of their height."""
_KEPT = 200
"""Number of polygons whose pixels are cached."""

Pixels = NDArray[np.uint8]


class Canvas:
    """Paints a floor with a margin around its tiles, `width_px` wide."""

    def __init__(self, floor: Floor, width_px: int) -> None:
        low, high = floor.bounds_m()
        self._low, high = low - MARGIN_M, high + MARGIN_M
        self._px_per_m = width_px / (high[0] - self._low[0])
        self._height_px = max(round((high[1] - self._low[1]) * self._px_per_m), 1)
        self._image = np.zeros((self._height_px, width_px, 3))
        self._depths: dict[bytes, NDArray[np.float64]] = {}

    def paint(self, shapes: Iterable[Shape]) -> Pixels:
        """Return a picture of these shapes: uint8 [row, column, channel]."""
        self._image[:] = rgb(GROUND)
        for shape in shapes:
            self._add(shape)
        return np.round(self._image).astype(np.uint8)

    def _place(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Convert points of the floor to pixels, rows downwards."""
        x, y = np.moveaxis((points_m - self._low) * self._px_per_m, -1, 0)
        return np.stack([x, self._height_px - y], axis=-1)

    def _blend(self, colour: str, opacity: float, points: NDArray[np.float64], reach: float) -> "_Patch | None":
        """Return the pixels within `reach` of the bounding box of points."""
        height, width = self._image.shape[:2]
        low = np.clip(np.floor(points.min(axis=0) - reach - 1.0), 0, (width, height)).astype(int)
        high = np.clip(np.ceil(points.max(axis=0) + reach + 1.0), 0, (width, height)).astype(int)
        if (low >= high).any():
            return None
        return _Patch(self._image[low[1] : high[1], low[0] : high[0]], low, np.array(rgb(colour), float), opacity)

    @singledispatchmethod
    def _add(self, shape: Shape) -> None:
        raise AssertionError(f"no picture of {type(shape).__name__}")

    @_add.register
    def _(self, shape: Lines) -> None:
        half = max(0.5 * shape.width_m * self._px_per_m, 0.5)
        for begin, end in self._place(shape.ends_m):
            part = self._blend(shape.colour, shape.opacity, np.stack([begin, end]), half)
            if part is not None:
                part.fill(half - part.distance(begin, end))

    @_add.register
    def _(self, shape: Disc) -> None:
        middle = self._place(np.array([shape.x_m, shape.y_m]))
        radius = shape.radius_m * self._px_per_m
        part = self._blend(shape.colour, shape.opacity, middle[None], radius)
        if part is not None:
            distance = part.distance(middle, middle)
            inside = radius - distance
            rim = shape.rim_m * self._px_per_m
            part.fill(np.minimum(inside, distance - (radius - rim)) if rim > 0.0 else inside)

    @_add.register
    def _(self, shape: Polygon) -> None:
        points = self._place(shape.points_m)
        part = self._blend(shape.colour, shape.opacity, points, 0.0)
        if part is not None:
            key = points.tobytes()
            if key not in self._depths:  # most polygons are where they were in the picture before
                if len(self._depths) >= _KEPT:
                    self._depths.clear()
                self._depths[key] = part.inside(points)
            part.fill(self._depths[key])

    @_add.register
    def _(self, shape: Text) -> None:
        lines = written(shape.text, shape.x_m, shape.y_m, shape.height_m)
        self._add(Lines(lines, shape.colour, _STROKE * shape.height_m, shape.opacity))


class _Patch:
    """A part of a picture that one shape is blended into."""

    def __init__(self, image: NDArray[np.float64], at: NDArray[np.int64], colour: NDArray[np.float64], opacity: float):
        rows, columns = image.shape[:2]
        self._image, self._colour, self._opacity = image, colour, opacity
        self._x = (np.arange(columns) + at[0] + 0.5)[None, :]
        self._y = (np.arange(rows) + at[1] + 0.5)[:, None]

    def distance(self, begin: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return each pixel's distance from a line."""
        way_x, way_y = end - begin
        x, y = self._x - begin[0], self._y - begin[1]
        along = np.clip((x * way_x + y * way_y) / max(way_x**2 + way_y**2, 1e-12), 0.0, 1.0)
        return np.hypot(x - along * way_x, y - along * way_y)

    def inside(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return each pixel's depth in a polygon; negative outside."""
        nearest = np.full((self._y.size, self._x.size), np.inf)
        is_in = np.zeros(nearest.shape, bool)
        for begin, end in zip(points, np.roll(points, -1, axis=0), strict=True):
            nearest = np.minimum(nearest, self.distance(begin, end))
            crosses = (begin[1] > self._y) != (end[1] > self._y)
            rise = end[1] - begin[1]
            if rise != 0.0:
                is_in ^= crosses & (self._x < begin[0] + (self._y - begin[1]) / rise * (end[0] - begin[0]))
        return np.where(is_in, nearest, -nearest)

    def fill(self, depth: NDArray[np.float64]) -> None:
        """Blend the colour in by `depth`, in pixels from the edge of the shape: half at the edge."""
        share = (self._opacity * np.clip(depth + 0.5, 0.0, 1.0))[..., None]
        self._image += share * (self._colour - self._image)


def gif(frames: Sequence[Pixels], frame_s: float) -> bytes:
    """Encode pictures of one size as a looping GIF file: one palette of 255 colours; each frame has only changes.

    >>> film = gif([np.zeros((2, 3, 3), np.uint8), np.full((2, 3, 3), 255, np.uint8)], 0.1)
    >>> film[:6], film[-1:]
    (b'GIF89a', b';')
    """
    rows, columns, _ = frames[0].shape
    colours, place_of = _palette(frames)
    file = [b"GIF89a", struct.pack("<HHBBB", columns, rows, 0xF7, 0, 0), colours.tobytes()]
    file.append(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")
    before = np.full((rows, columns), _SAME, np.uint8)
    for frame in frames:
        now = place_of[_cell(frame)]
        changed = now != before
        ys, xs = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
        top, end, left, right = (ys[0], ys[-1] + 1, xs[0], xs[-1] + 1) if len(ys) else (0, 1, 0, 1)
        part = np.where(changed, now, _SAME).astype(np.uint8)[top:end, left:right]
        file.append(struct.pack("<BBBBHBB", 0x21, 0xF9, 4, 0x05, round(100 * frame_s), _SAME, 0))
        file.append(struct.pack("<BHHHHB", 0x2C, left, top, right - left, end - top, 0))
        file.append(b"\x08" + _blocks(_packed(part.tobytes())) + b"\x00")
        before = now
    return b"".join([*file, b";"])


_SAME = 255
"""Index of the transparent colour, for unchanged pixels."""


def _cell(frame: Pixels) -> NDArray[np.int64]:
    """Return each pixel's cell among 32 x 32 x 32 colours."""
    red, green, blue = np.moveaxis(frame.astype(np.int64) >> 3, -1, 0)
    return (red << 10) | (green << 5) | blue


def _palette(frames: Sequence[Pixels]) -> tuple[Pixels, Pixels]:
    """Return the colours of a film, uint8 [256, 3], and the index of the nearest one for each cell of `_cell`."""
    counts, sums = np.zeros(1 << 15), np.zeros((1 << 15, 3))
    for frame in frames:
        cells = _cell(frame).ravel()
        counts += np.bincount(cells, minlength=1 << 15)
        for channel in range(3):
            sums[:, channel] += np.bincount(cells, frame[..., channel].ravel(), 1 << 15)
    used = np.flatnonzero(counts)
    means = sums[used] / counts[used, None]
    chosen = means[np.argsort(-counts[used], kind="stable")[:_SAME]]
    place_of = np.zeros(1 << 15, np.uint8)
    place_of[used] = np.argmin(((means[:, None] - chosen[None]) ** 2).sum(axis=2), axis=1)
    colours = np.zeros((256, 3), np.uint8)
    colours[: len(chosen)] = np.round(chosen)
    return colours, place_of


def _packed(data: bytes) -> bytes:
    """Compress bytes for GIF: LZW (Lempel, Ziv and Welch), codes of 9 to 12 bits."""
    clear, stop = 256, 257
    single = {bytes([value]): value for value in range(256)}
    known, free, size = dict(single), 258, 9
    bits, count = clear, 9
    out = bytearray()
    word = b""
    for value in data:
        longer = word + bytes((value,))
        if longer in known:
            word = longer
            continue
        bits |= known[word] << count
        count += size
        while count >= 8:
            out.append(bits & 255)
            bits >>= 8
            count -= 8
        if free == 4096:
            bits |= clear << count
            count += size
            known, free, size = dict(single), 258, 9
        else:
            known[longer] = free
            size = max(size, free.bit_length())
            free += 1
        word = bytes((value,))
    bits |= known[word] << count
    count += size
    if free == 1 << size and size < 12:
        size += 1
    bits |= stop << count
    count += size
    out += bits.to_bytes((count + 7) // 8, "little")
    return bytes(out)


def _blocks(data: bytes) -> bytes:
    """Split bytes into blocks of up to 255, each after its length."""
    return b"".join(bytes([len(part)]) + part for part in (data[i : i + 255] for i in range(0, len(data), 255)))
