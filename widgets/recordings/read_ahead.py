"""Reading of the visible part of a recording in detail, with a margin on both sides for scrolling."""

from PySide6.QtCore import QObject

from underfoot.widgets.recordings.reader import FINE_S, DetailEnvelopes, RecordingReader
from underfoot.widgets.recordings.timeline import Axis

_MARGIN = 0.6
"""Read-ahead on each side, as a multiple of the visible range."""


class ReadAhead(QObject):
    """Requests detail from `reader` before `axis` needs it, and shows it there."""

    def __init__(self, axis: Axis, reader: RecordingReader, parent: QObject) -> None:
        super().__init__(parent)
        self._axis, self._reader = axis, reader
        axis.view_changed.connect(self._request)
        reader.overview_read.connect(self._request)
        reader.detail_read.connect(self._show)

    def _request(self) -> None:
        """Request the visible range and its margins, unless they are there or the overview is fine enough."""
        content, view = self._axis.content, self._axis.view
        if content is None or self._axis.seconds_per_px >= FINE_S:
            return
        opened, span_s = content.opened, view.end_s - view.begin_s
        begin, end = (opened.first + opened.rate * at for at in (view.begin_s, view.end_s))
        frames = self._axis.seconds_per_px * opened.rate
        detail = content.detail
        if detail is not None and detail.begin <= begin and end <= detail.end and detail.tile == view.tile:
            inner = _MARGIN * 0.3 * span_s * opened.rate
            near_edge = begin - inner < detail.begin > opened.first or end + inner > detail.end < opened.end
            if not near_edge and 0.5 <= detail.frames / frames <= 2.0:
                return
        margin = _MARGIN * span_s * opened.rate
        begin, end = max(begin - margin, opened.first), min(end + margin, opened.end)
        self._reader.request_detail(begin, end, frames, view.tile)

    def _show(self, detail: DetailEnvelopes) -> None:
        if self._axis.content is not None:
            self._axis.content.detail = detail
            self._axis.redraw()
