"""Pictures of several parameters of a node together, in the inspector, with handles to drag."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Signal
from PySide6.QtGui import QColor, QPainter, QPen

from underfoot.models.modal.hunt_crossley import WallImpact, wall_impact
from underfoot.models.signals.envelopes import attack_decay
from underfoot.parameters import Number
from underfoot.patch.node import NodeType
from underfoot.quantities import quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.handle_pad import HandlePad

_HEADROOM = 1.25
"""The ratio of an axis' length to its largest value."""


class NodePicture(HandlePad):
    """Shows a node's values, and emits those that the user changes."""

    edited = Signal(str, object)
    """Parameter and value."""

    def __init__(self, type: NodeType) -> None:
        super().__init__()
        self._parameters = type.parameters
        self._values: dict[str, Any] = {}
        self._ends = (1.0, 1.0)

    def set_values(self, values: Mapping[str, Any]) -> None:
        """Show these values, without emitting a change."""
        if dict(values) != self._values:
            self._values = dict(values)
            self._fit()

    def _let_go(self) -> None:
        super()._let_go()
        self._fit()

    def value(self, name: str) -> float:
        return float(self._values[name])

    def ends(self) -> tuple[float, float]:
        """Return the upper ends of both axes."""
        raise AssertionError(f"{type(self).__name__} has no axes")

    def place(self, x: float, y: float) -> QPointF:
        """Return the position of a point in the picture, in pixels."""
        area = self.area()
        return QPointF(area.x() + x / self._ends[0] * area.width(), area.bottom() - y / self._ends[1] * area.height())

    def value_at(self, place: QPointF) -> tuple[float, float]:
        """Return the values at a position of the picture."""
        area = self.area()
        across, up = (place.x() - area.x()) / area.width(), (area.bottom() - place.y()) / area.height()
        return max(across, 0.0) * self._ends[0], max(up, 0.0) * self._ends[1]

    def set(self, name: str, value: float) -> None:
        """Set a parameter, limited to its range, as a change by the user."""
        parameter = self._parameters[name]
        assert isinstance(parameter, Number)
        value = float(f"{min(max(value, parameter.low), parameter.high):.4g}")
        if value != self._values[name]:
            self._values[name] = value
            self._update_curve()
            self.edited.emit(name, value)
            self.emit_changed()

    def _fit(self) -> None:
        self._update_curve()
        if not self.is_dragged and self._values:
            across, up = self.ends()
            self._ends = (_HEADROOM * across, _HEADROOM * up)
        self.update()

    def _update_curve(self) -> None:
        """Recompute the curve."""

    def paint_line(self, painter: QPainter, x: np.ndarray, y: np.ndarray, colour: str) -> None:
        painter.setPen(QPen(QColor(colour), 1.5))
        painter.drawPolyline([self.place(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)])

    def paint_axis(self, painter: QPainter, unit: str) -> None:
        for x, text in axis_texts(self._ends[0], unit):
            self.draw_axis_line(painter, self.place(x, 0.0).x(), text)


def axis_texts(end: float, unit: str) -> list[tuple[float, str]]:
    """Return places on an axis from 0 to `end`, in SI `unit`, and their texts; 0 has no unit, for it has no prefix.

    >>> axis_texts(0.25, "s")
    [(0.0, '0'), (0.125, '125 ms'), (0.25, '250 ms')]
    """
    return [(0.0, "0"), *((x, quantity(x, unit, 2)) for x in (0.5 * end, end))]


class EnvelopePicture(NodePicture):
    """An envelope: its attack, peak, start of decay, and end."""

    NAMES = ("attack", "decay", "duration")

    def ends(self) -> tuple[float, float]:
        return self.value("duration"), max(self.value("amplitude"), 0.1)

    def handles(self) -> list[QPointF]:
        if not self._values:
            return []
        attack, decay, duration = self._fitted()
        height = self.value("amplitude")
        return [self.place(attack, height), self.place(duration - decay, height), self.place(duration, 0.0)]

    def _fitted(self) -> tuple[float, float, float]:
        """Return attack, decay and duration in seconds; attack and decay are shortened to fit, as in playback."""
        attack, decay, duration = (self.value(name) for name in self.NAMES)
        fit = min(1.0, duration / (attack + decay))
        return attack * fit, decay * fit, duration

    def drag(self, index: int, place: QPointF) -> None:
        time, height = self.value_at(place)
        duration = self.value("duration")
        if index == 0:
            self.set("attack", min(time, duration - self._fitted()[1]))
            self.set("amplitude", round(height, 2))
        elif index == 1:
            self.set("decay", min(duration - time, duration - self._fitted()[0]))
        else:
            self.set("duration", time)

    def nudge(self, index: int, across: float, up: float) -> None:
        name = self.NAMES[index]
        if across:
            self.set(name, self.value(name) * 1.1 ** (-across if index == 1 else across))
        else:
            self.set("amplitude", self.value("amplitude") + 0.05 * up)

    def caption(self) -> str:
        if not self._values:
            return ""
        attack, decay, duration = (quantity(self.value(name), "s") for name in self.NAMES)
        return f"up in {attack}, down in {decay}, {duration} long"

    def paint_picture(self, painter: QPainter, area: QRectF) -> None:
        self.paint_axis(painter, "s")
        time = np.linspace(0.0, self._ends[0], 240)
        note = attack_decay(time, 0.0, self.value("duration"), 1.0, self.value("attack"), self.value("decay"))
        self.paint_line(painter, time, self.value("amplitude") * note, theme.VIBRATION)


class ContactPicture(NodePicture):
    """An impact on a rigid wall: force over penetration; the area of the loop is the dissipated energy."""

    HEIGHT_PX = 152
    _blow: WallImpact

    def _update_curve(self) -> None:
        v = self._values
        self._blow = wall_impact(v["mass"], v["velocity"], v["stiffness"], v["exponent"], v["damping"])

    def ends(self) -> tuple[float, float]:
        return float(self._blow.penetration_m.max()), float(self._blow.force_n.max())

    def handles(self) -> list[QPointF]:
        if not self._values:
            return []
        at = self._blow.penetration_m.argmax()
        return [self.place(self._blow.penetration_m[at], self._blow.force_n[at])]

    def drag(self, index: int, place: QPointF) -> None:
        depth = max(self.value_at(place)[0], 1e-3 * self._ends[0])
        now = float(self._blow.penetration_m.max())
        self.set("stiffness", self.value("stiffness") * (now / depth) ** (self.value("exponent") + 1.0))

    def nudge(self, index: int, across: float, up: float) -> None:
        if across:
            self.set("stiffness", self.value("stiffness") * 1.25**-across)
        else:
            self.set("exponent", self.value("exponent") + 0.05 * up)

    def caption(self) -> str:
        if not self._values:
            return ""
        depth, force = self.ends()
        back = 100.0 * self._blow.restitution
        return f"{quantity(force, 'N')} at {quantity(depth, 'm')}; bounces with {back:.0f} %"

    def paint_picture(self, painter: QPainter, area: QRectF) -> None:
        self.paint_axis(painter, "m")
        painter.save()
        painter.setClipRect(area)
        x, y = self._blow.penetration_m, self._blow.force_n
        painter.setPen(QPen(QColor(theme.FORCE), 1.5))
        painter.setBrush(QColor(theme.mixed(theme.FORCE, theme.RAISED, 0.2)))
        painter.drawPolygon([self.place(a, b) for a, b in zip(x.tolist(), y.tolist(), strict=True)])
        painter.restore()


PICTURES: Mapping[str, type[NodePicture]] = {"attack-decay": EnvelopePicture, "impact": ContactPicture}
"""The picture of a node, by its type."""
TIPS = {
    "attack-decay": "Drag: attack and height, where the decay begins, the end. Keys: N and P choose, arrows move.",
    "impact": "Force over penetration, on a rigid wall. Drag the tip: stiffness. Keys: N chooses it,\n"
    "left and right change the stiffness, up and down the exponent.",
}
