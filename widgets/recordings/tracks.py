"""Painting of a recording's time axis: force, tiles, vibration, contacts, marks and gaps."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QBrush, QColor, QImage, QPainter, QPen

from underfoot.drawing.axes import round_top
from underfoot.quantities import number
from underfoot.records.envelopes import Envelope
from underfoot.records.survey import ContactSpan, Stance, noted_stances
from underfoot.widgets import theme
from underfoot.widgets.floor_map import FULL_SCALE_N
from underfoot.widgets.plots.painting import polygon
from underfoot.widgets.recordings.reader import FINE_S, DetailEnvelopes, OpenedRecording, OverviewEnvelopes

GUTTER_PX, RIGHT_PX, RULER_PX = 120, 12, 34
_ROW_PX = (3.0, 14.0)
"""Heights between which a tile's row is."""
_BAR_PX, _BARS_PAD_PX, _TRACKS_APART_PX = 14.0, 8.0, 6.0
_THIN_PX = 3.0
_BARS, _MOST_BARS = 4, 20
"""Rows of contacts, usual and at most: as many overlap without one hiding another."""
_BARS_SHARE, _LEAST_BAR_PX = 0.3, 7.0
"""Share of the height for more rows than usual, which are lower if need be; without texts then."""
_Times = TypeVar("_Times", float, NDArray[np.float64])
_TICKS_S = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600)


@dataclass
class TimelineView:
    """The visible range of a recording: `begin_s` to `end_s` in seconds; `tile` is the index of a tile of its floor."""

    begin_s: float = 0.0
    end_s: float = 1.0
    tile: int = 0
    step: int = -1
    """The number of the chosen step in the list of steps; -1 for none."""


@dataclass
class RecordingContent:
    """The content of a recording, as far as it has been read."""

    opened: OpenedRecording
    overview: OverviewEnvelopes | None = None
    detail: DetailEnvelopes | None = None
    contacts: Sequence[ContactSpan] = ()
    steps: Sequence[Stance] = ()
    balance: bytearray = field(default_factory=bytearray)
    """As in a `Survey`, which does not grow here."""

    def __post_init__(self) -> None:
        self.show_survey(self.contacts, self.steps)

    def show_survey(self, contacts: Sequence[ContactSpan], steps: Sequence[Stance]) -> None:
        """Set contacts and steps, with what is noted of these now."""
        self.contacts = contacts
        self.steps = noted_stances(steps, self.opened.notes)
        self.number_of = {one.step.contact: number for number, one in enumerate(steps)}
        """The number of a contact's step in the list."""
        self.visible_steps: Sequence[int] = range(len(steps))
        """The numbers of the steps that are not filtered out."""
        self.spans_s = np.array([(contact.start_s, contact.end_s) for contact in contacts]).reshape(-1, 2)
        free: list[float] = []
        rows = []
        for contact in contacts:
            row = next((k for k, free_s in enumerate(free) if free_s <= contact.start_s), len(free))
            if row == _MOST_BARS:
                row = int(np.argmin(free))
            free[row : row + 1] = [contact.end_s]
            rows.append(row)
        self.bar_rows, self.bars = np.array(rows, np.intp), max(len(free), _BARS)
        """The row of each contact's bar, and how many rows there are."""

    def envelope(self, source: str, begin: float, end: float, frames: float, tile: int) -> tuple[Envelope, int]:
        """Return the envelope to draw of a source, and the tile's column in it; force has all tiles."""
        detail, overview = self.detail, self.overview
        fits = detail is not None and detail.begin <= begin and end <= detail.end and detail.tile == tile
        if fits and detail is not None and frames < FINE_S * self.opened.rate and detail.frames <= 2.0 * frames:
            return detail.envelopes[source], tile if source == "force" else 0
        assert overview is not None
        return overview.envelope(source, frames), tile


@dataclass(frozen=True)
class Track:
    """A horizontal band of the picture from `top` to `bottom`, in pixels."""

    top: float
    bottom: float


def tracks_of(height: float, tiles: int, bars: int) -> dict[str, Track]:
    """Return the tracks by name, for a picture of this height in pixels."""
    left = height - RULER_PX - 6.0
    bar_px = _BAR_PX if bars <= _BARS else min(max(_BARS_SHARE * left / bars, _LEAST_BAR_PX), _BAR_PX)
    high = bars * bar_px + _BARS_PAD_PX
    rows = min(max(_ROW_PX[0] * tiles, min(_ROW_PX[1] * tiles, 0.25 * left)), 0.4 * left) + _TRACKS_APART_PX
    rest = max(left - high - rows, 90.0)
    found, top = {}, float(RULER_PX)
    for name, share in (
        ("force", 0.4 * rest),
        ("tiles", rows),
        ("contacts", high),
        ("commanded", 0.3 * rest),
        ("measured", 0.3 * rest),
    ):
        found[name] = Track(top, top + share - _TRACKS_APART_PX)
        top += share
    return found


class TrackPainter:
    """Paints the content of a recording in a view."""

    def __init__(self, content: RecordingContent, view: TimelineView, width: float, height: float) -> None:
        self.content, self.view = content, view
        self.left, self.right = float(GUTTER_PX), max(width - RIGHT_PX, GUTTER_PX + 10.0)
        self.tracks = tracks_of(height, len(content.opened.floor.tiles), content.bars)
        contacts = self.tracks["contacts"]
        self._bar_px = (contacts.bottom - contacts.top + _TRACKS_APART_PX - _BARS_PAD_PX) / content.bars
        opened = content.opened
        columns = max(1, round(self.right - self.left))
        at_s = np.linspace(view.begin_s, view.end_s, columns + 1)
        self._edges = opened.first + at_s * opened.rate
        self._frames = float(self._edges[1] - self._edges[0])

    def x(self, time_s: _Times) -> _Times:
        """Return the position of a time, or of several, in pixels."""
        share = (time_s - self.view.begin_s) / (self.view.end_s - self.view.begin_s)
        return self.left + share * (self.right - self.left)

    def paint(self, painter: QPainter) -> None:
        """Paint everything except cursor and selection, which move."""
        painter.setFont(theme.font(theme.SMALL_PX))
        self._paint_ruler(painter)
        for track in self.tracks.values():
            painter.fillRect(self._area(track), QColor(theme.PANEL))
        if self.content.overview is not None:
            self._paint_force(painter)
            for source, colour in (("commanded", "vibration"), ("measured", "measured")):
                self._paint_vibration(painter, source, theme.PALETTE[colour])
        self._paint_contacts(painter)
        self._paint_gaps(painter)
        self._paint_marks(painter)

    def _area(self, track: Track) -> QRectF:
        return QRectF(self.left, track.top, self.right - self.left, track.bottom - track.top)

    # --- time ---

    def _paint_ruler(self, painter: QPainter) -> None:
        span_s = self.view.end_s - self.view.begin_s
        step_s = next((one for one in _TICKS_S if one * (self.right - self.left) / span_s >= 72.0), _TICKS_S[-1])
        first = math.ceil(self.view.begin_s / step_s - 1e-9)
        for k in range(first, int(self.view.end_s / step_s + 1e-9) + 1):
            x = self.x(k * step_s)
            painter.setPen(QPen(QColor(theme.LINE), 1.0))
            painter.drawLine(QPointF(x, RULER_PX - 6.0), QPointF(x, RULER_PX - 1.0))
            painter.setPen(QColor(theme.MUTED))
            text = time_text(k * step_s, step_s)
            room = min(50.0, self.right + RIGHT_PX - x)  # the last one ends at the picture's edge
            width = max(2.0 * room, painter.fontMetrics().horizontalAdvance(text) + 2.0)
            at = QRectF(x + room - width, 14.0, width, 14.0)
            painter.drawText(at, Qt.AlignmentFlag.AlignHCenter, text)

    def _paint_marks(self, painter: QPainter) -> None:
        opened = self.content.opened
        painter.setPen(QPen(QColor(theme.FAINT), 1.0))
        for x in self._pixels([(frame, "") for frame, _, _ in opened.commands]):
            painter.drawLine(QPointF(x, RULER_PX - 4.0), QPointF(x, RULER_PX))
        violet, bottom, free = QColor(theme.EVENTS), self.tracks["measured"].bottom, -math.inf
        for x, text in self._pixels([(mark.frame, mark.text) for mark in opened.marks]).items():
            painter.setPen(QPen(violet, 1.0, Qt.PenStyle.DashLine))
            painter.drawLine(QPointF(x, 12.0), QPointF(x, bottom))
            if x >= free:
                painter.setPen(violet)
                shown = painter.fontMetrics().elidedText(text or "mark", Qt.TextElideMode.ElideRight, 160)
                painter.drawText(QPointF(x + 3.0, 11.0), shown)
                free = x + painter.fontMetrics().horizontalAdvance(shown) + 12.0

    def _pixels(self, said: Sequence[tuple[int, str]]) -> dict[float, str]:
        """Return the pixels in view of these session frames, with the first words at each.

        A program can set 100,000 marks, which are seen in a thousand pixels.
        """
        opened = self.content.opened
        at_s = (np.array([frame for frame, _ in said], np.float64) - opened.first) / opened.rate
        found: dict[float, str] = {}
        for x, (_, text) in zip(np.rint(self.x(at_s)).tolist(), said, strict=True):
            if self.left <= x <= self.right:
                found[x] = found.get(x) or text
        return found

    def _paint_gaps(self, painter: QPainter) -> None:
        opened = self.content.opened
        for gap in opened.gaps:
            begin, end = ((frame - opened.first) / opened.rate for frame in (gap.first, gap.first + gap.count))
            left, right = max(self.x(begin), self.left), min(self.x(end), self.right)
            if right >= left:
                top, bottom = self.tracks["force"].top, self.tracks["measured"].bottom
                brush = QBrush(QColor(theme.ALARM), Qt.BrushStyle.BDiagPattern)
                painter.fillRect(QRectF(left, top, max(right - left, 1.0), bottom - top), brush)

    # --- force and vibration ---

    def _paint_force(self, painter: QPainter) -> None:
        view, overview = self.view, self.content.overview
        assert overview is not None
        envelope, _ = self.content.envelope(
            "force", float(self._edges[0]), float(self._edges[-1]), self._frames, view.tile
        )
        count = len(self.content.opened.floor.tiles)
        (low, high), (tile_low, tile_high) = (
            [found[:, 0] - overview.baseline_n[column] for found in envelope.column(column).between(self._edges)]
            for column in (count, view.tile)
        )
        all_high = overview.levels["force"][-1].high
        top_n = max(200.0, round_top(1.05 * float(np.nanmax(all_high[:, -1], initial=0.0) - overview.baseline_n[-1])))
        track = self.tracks["force"]
        self._paint_axis(painter, track, ("Force, N", ""), -0.05 * top_n, top_n)
        self._paint_band(painter, track, low, high, (-0.05 * top_n, top_n), QColor(theme.FORCE))
        middle = 0.5 * (tile_low + tile_high)
        self._paint_line(painter, track, middle, (-0.05 * top_n, top_n), QColor(theme.TEXT))
        x = self.left + 6.0
        for text, colour in (("all tiles", theme.FORCE), (self._tile(), theme.TEXT)):
            painter.setPen(QColor(colour))
            painter.drawText(QPointF(x, track.top + 11.0), text)
            x += painter.fontMetrics().horizontalAdvance(text) + 12.0
        self._paint_tiles(painter, (envelope.most(self._edges) - overview.baseline_n)[:, :-1])

    def _paint_tiles(self, painter: QPainter, load_n: NDArray[np.float32]) -> None:
        """Paint a row for each tile, with the selected one marked."""
        track, count = self.tracks["tiles"], load_n.shape[1]
        levels = np.clip(np.nan_to_num(load_n) * (255.0 / FULL_SCALE_N), 0.0, 255.0).astype(np.uint8)
        pixels = np.ascontiguousarray(_shades(theme.FORCE, theme.PANEL)[levels].T)
        image = QImage(pixels.data, pixels.shape[1], count, 4 * pixels.shape[1], QImage.Format.Format_RGB32)
        painter.drawImage(self._area(track), image)
        row = (track.bottom - track.top) / count
        painter.setPen(QColor(theme.MUTED))
        every = max(1, math.ceil(13.0 / row))
        for k in range(0, count, every):
            box = QRectF(0.0, track.top + k * row - 1.0, GUTTER_PX - 6.0, max(row, 13.0))
            name = self.content.opened.floor.tiles[k].id
            painter.drawText(box, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignTop, name)
        painter.setPen(QPen(QColor(theme.TEXT), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRect(QRectF(self.left, track.top + self.view.tile * row, self.right - self.left, max(row, 2.0)))

    def _paint_vibration(self, painter: QPainter, source: str, colour: str) -> None:
        track, overview = self.tracks[source], self.content.overview
        assert overview is not None
        envelope, column = self.content.envelope(
            source, float(self._edges[0]), float(self._edges[-1]), self._frames, self.view.tile
        )
        whole = overview.levels[source][-1]
        both = [overview.levels[one][-1] for one in ("commanded", "measured")]  # on a common scale, for comparison
        largest = max(max(np.nanmax(one.high, initial=0.0), -np.nanmin(one.low, initial=0.0)) for one in both)
        top = max(0.01, round_top(1.05 * float(largest)))
        self._paint_axis(painter, track, (source.capitalize() + ",", f"m/s², {self._tile()}"), -top, top)
        if not len(whole):
            painter.setPen(QColor(theme.MUTED))
            painter.drawText(self._area(track), Qt.AlignmentFlag.AlignCenter, f"nothing {source} was recorded")
            return
        low, high = envelope.column(column).between(self._edges)
        self._paint_band(painter, track, low[:, 0], high[:, 0], (-top, top), QColor(colour))

    def _tile(self) -> str:
        return f"tile {self.content.opened.floor.tiles[self.view.tile].id}"

    def _paint_axis(self, painter: QPainter, track: Track, labels: tuple[str, str], low: float, high: float) -> None:
        """Paint the track's labels, and lines at zero and at the top."""
        metrics = painter.fontMetrics()
        painter.setPen(QColor(theme.TEXT))
        painter.drawText(QPointF(8.0, track.top + 11.0), labels[0])
        painter.setPen(QColor(theme.MUTED))
        if track.bottom - track.top > 20.0 and metrics.horizontalAdvance(labels[1]) <= GUTTER_PX - 12.0:
            painter.drawText(QPointF(8.0, track.top + 24.0), labels[1])
        else:
            painter.drawText(QPointF(self.left + 6.0, track.top + 11.0), labels[1])
        values = (0.0, 0.5 * high, high) if low > -high else (low, 0.0, high)
        for value in values:
            y = float(_place(track, value, low, high))
            painter.setPen(QPen(QColor(theme.LINE), 1.0))
            painter.drawLine(QPointF(self.left, y), QPointF(self.right, y))
            painter.setPen(QColor(theme.MUTED))
            shown = number(value)
            at = min(max(y + 4.0, track.top + 9.0), track.bottom)
            if value != high:
                painter.drawText(QPointF(self.left - 6.0 - metrics.horizontalAdvance(shown), at), shown)
        shown = number(high)
        painter.drawText(QPointF(self.left - 6.0 - metrics.horizontalAdvance(shown), track.top + 9.0), shown)

    def _paint_band(
        self,
        painter: QPainter,
        track: Track,
        low: NDArray[np.float32],
        high: NDArray[np.float32],
        ends: tuple[float, float],
        colour: QColor,
    ) -> None:
        """Paint the area between minimum and maximum, at least one pixel high; nothing in gaps."""
        height = max(round(track.bottom - track.top), 1)
        top, bottom = (
            np.nan_to_num(np.asarray(_place(track, values.astype(np.float64), *ends)) - track.top, nan=-9.0)
            for values in (high, low)
        )
        rows = np.arange(height)[:, None]
        # An outline of a thousand corners takes ten times as long to paint as this image.
        inside = (rows >= np.floor(np.minimum(top, height - 1))) & (rows <= np.maximum(bottom - 0.5, top))
        pixels = np.where(inside, np.uint32(colour.rgb()), np.uint32(0))
        image = QImage(pixels.data, len(high), height, 4 * len(high), QImage.Format.Format_ARGB32_Premultiplied)
        painter.drawImage(QPointF(self.left, track.top), image)

    def _paint_line(
        self, painter: QPainter, track: Track, values: NDArray[np.float32], ends: tuple[float, float], colour: QColor
    ) -> None:
        seen = np.isfinite(values)
        x = self.left + 0.5 + np.arange(len(values))
        y = np.asarray(_place(track, values.astype(np.float64), *ends))
        painter.setPen(QPen(colour, 1.0))
        for run in np.split(np.arange(len(values)), np.flatnonzero(np.diff(seen)) + 1):
            if len(run) and seen[run[0]]:
                painter.drawPolyline(polygon(np.column_stack([x[run], y[run]])))

    # --- contacts ---

    def _paint_contacts(self, painter: QPainter) -> None:
        track = self.tracks["contacts"]
        painter.setPen(QColor(theme.TEXT))
        painter.drawText(QPointF(8.0, track.top + 11.0), "Contacts")
        painter.setPen(QColor(theme.MUTED))
        painter.drawText(QPointF(8.0, track.top + 24.0), "step, foot")
        chosen = self.content.steps[self.view.step].step.contact if self.view.step >= 0 else 0
        self._paint_thin(painter)
        passing = set(self.content.visible_steps)
        for contact, bar in self.bars(chosen):
            number = self.content.number_of.get(contact.id)
            step = self.content.steps[number].step if number is not None and number in passing else None
            foot = {"left": "left foot", "right": "right foot"}.get(step.side, "a foot") if step else "no step"
            foot = "no step" if step and step.left_out else foot
            colour = theme.PALETTE[foot]
            painter.setPen(QPen(QColor(theme.TEXT if contact.id == chosen else theme.CONTACT), 1.0))
            painter.setBrush(QColor(colour))
            painter.drawRect(bar)
            if step and bar.width() > 26.0 and self._bar_px > _BAR_PX - 0.5:
                painter.setPen(QColor(theme.text_on(colour)))
                text = f"{step.step} {step.side[0].upper() if step.side != 'unknown' else ''}"
                person = f"  person {step.person}" if step.person and bar.width() > 84.0 else ""
                painter.drawText(bar, Qt.AlignmentFlag.AlignCenter, text + person)

    def bars(self, chosen: int = 0) -> list[tuple[ContactSpan, QRectF]]:
        """Return the visible contacts with their bars; those too thin for a bar only if `chosen`."""
        found = []
        left, right, seen = self._spans_px()
        is_chosen = np.array([contact.id == chosen for contact in self.content.contacts], bool)
        for k in np.flatnonzero(seen & ((right - left >= _THIN_PX) | is_chosen)).tolist():
            bar = self._bar(int(self.content.bar_rows[k]), left[k], max(right[k] - left[k], 1.0))
            found.append((self.content.contacts[k], bar))
        return found

    def _spans_px(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
        """Return begin and end of each contact in pixels, and whether it is visible."""
        spans_s = self.content.spans_s
        scale = (self.right - self.left) / (self.view.end_s - self.view.begin_s)
        left, right = (self.left + scale * (spans_s[:, k] - self.view.begin_s) for k in (0, 1))
        seen = (spans_s[:, 1] >= self.view.begin_s) & (spans_s[:, 0] <= self.view.end_s)
        return np.maximum(left, self.left), np.minimum(right, self.right), seen

    def _paint_thin(self, painter: QPainter) -> None:
        """Paint all contacts that are about a pixel wide in one operation."""
        left, right, seen = self._spans_px()
        thin = seen & (right - left < _THIN_PX)
        if not thin.any():
            return
        width = max(round(self.right - self.left), 1)
        pixels = np.zeros((self.content.bars, width), np.uint32)
        at = np.clip((left[thin] - self.left).astype(np.intp), 0, width - 1)
        pixels[self.content.bar_rows[thin], at] = QColor(theme.PALETTE["a foot"]).rgb()
        for row in range(self.content.bars):
            image = QImage(pixels[row].data, width, 1, 4 * width, QImage.Format.Format_ARGB32_Premultiplied)
            painter.drawImage(self._bar(row, self.left, width), image)

    def _bar(self, row: int, left: float, width: float) -> QRectF:
        """Return the place of a bar in a row of contacts."""
        top = self.tracks["contacts"].top + 3.0 + row * self._bar_px
        return QRectF(left, top, width, self._bar_px - min(3.0, 0.25 * self._bar_px))


def time_text(time_s: float, step_s: float = 0.001) -> str:
    """Return a time of the recording as text, with the precision of `step_s`.

    >>> time_text(75.0, 5), time_text(2.5, 0.5), time_text(0.0, 60.0), time_text(3661.25, 0.01)
    ('1:15', '2.5 s', '0:00', '1:01:01.25')
    """
    decimals = max(0, -math.floor(math.log10(step_s) + 1e-9)) if step_s < 1.0 else 0
    if time_s < 60.0 and step_s < 10.0:
        return f"{time_s:.{decimals}f} s"
    minutes, seconds = divmod(round(time_s, decimals), 60.0)
    hours, minutes = divmod(int(minutes), 60)
    width = 3 + decimals if decimals else 2
    head = f"{hours}:{minutes:02d}" if hours else f"{minutes}"
    return f"{head}:{seconds:0{width}.{decimals}f}"


def _place(
    track: Track, value: "float | NDArray[np.float64]", low: float, high: float
) -> "float | NDArray[np.float64]":
    share = (np.clip(value, low, high) - low) / (high - low)
    return track.bottom - share * (track.bottom - track.top)


@cache
def _shades(full: str, none: str) -> NDArray[np.uint32]:
    """Return 256 colours from `none` to `full`, for the rows of tiles."""
    return np.array([QColor(theme.mixed(full, none, level / 255.0)).rgb() for level in range(256)], np.uint32)
