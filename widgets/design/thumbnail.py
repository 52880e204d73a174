"""The small plot in a node."""

import numpy as np
from PySide6.QtCore import QPointF
from PySide6.QtGui import QPainterPath, QPolygonF

from underfoot.drawing.thinning import thinned

BINS = 64


def thumbnail(values: np.ndarray, *, are_events: bool) -> QPainterPath:
    """Return samples, or events as rows of (share of the duration, strength), as a path in the unit square."""
    path = QPainterPath()
    values = np.nan_to_num(values)
    if are_events:
        zero, scale = _axis(values[:, 1])
        path.moveTo(0.0, zero)
        path.lineTo(1.0, zero)
        for time, strength in values[:400].tolist():
            path.moveTo(time, zero)
            path.lineTo(time, zero - strength * scale)
        return path
    if values.size == 0:
        return path
    x, y = thinned(np.arange(values.size) / values.size, values[:, None], 1.0 / BINS)
    zero, scale = _axis(y)
    points = [QPointF(a, b) for a, b in zip(x.tolist(), (zero - y[:, 0] * scale).tolist(), strict=True)]
    path.addPolygon(QPolygonF(points))
    return path


def _axis(values: np.ndarray) -> tuple[float, float]:
    """Return where 0 lies in the unit square, and the scale that fits all values; of a vibration 0 is in the middle."""
    bottom, top = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    if bottom < 0.0 < top and -bottom > 0.2 * top:
        top = max(top, -bottom)
        bottom = -top
    scale = 0.92 / max(top - bottom, 1e-12)
    return 0.96 + bottom * scale, scale
