"""The small plot in a node."""

import numpy as np
from PySide6.QtCore import QPointF
from PySide6.QtGui import QPainterPath, QPolygonF

from underfoot.drawing.thinning import thinned

BINS = 64


def thumbnail(values: np.ndarray, *, are_events: bool = False) -> QPainterPath:
    """Return samples, or events as rows of (share of the duration, strength), as a path in the unit square."""
    path = QPainterPath()
    if are_events:
        strongest = max(float(values[:, 1].max(initial=0.0)), 1e-12)
        path.moveTo(0.0, 1.0)
        path.lineTo(1.0, 1.0)
        for time, strength in values[:400]:
            path.moveTo(float(time), 1.0)
            path.lineTo(float(time), 1.0 - 0.9 * float(strength) / strongest)
        return path
    values = np.nan_to_num(values)
    if values.size == 0:
        return path
    x, y = thinned(np.arange(values.size) / values.size, values[:, None], 1.0 / BINS)
    bottom, top = min(float(y.min()), 0.0), max(float(y.max()), 0.0)
    if bottom < 0 < top and -bottom > 0.2 * top:
        top = max(top, -bottom)
        bottom = -top
    scale = 0.92 / max(top - bottom, 1e-12)
    points = [QPointF(a, b) for a, b in zip(x.tolist(), (0.96 - (y[:, 0] - bottom) * scale).tolist(), strict=True)]
    path.addPolygon(QPolygonF(points))
    return path
