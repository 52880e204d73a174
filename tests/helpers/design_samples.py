"""A few node types without function, a patch of them, and mouse positions, for tests of the Design workspace."""

from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication
from windows import delete_widgets

from underfoot.parameters import Choice, Count, Number, Rows, Tiles
from underfoot.patch.node import Input, Output, node
from underfoot.patch.patch import Patch
from underfoot.widgets.design.workspace import DesignWorkspace


@node("push", "Floor")
class Push:
    """Force, in newtons."""

    force = Output("N")

    def run(force):
        pass


@node("step", "Timing")
class Step:
    """Events from a force."""

    force = Input("N")
    threshold = Number(30.0, 1.0, 1000.0, unit="N", scale="log", doc="force at which a foot is down")
    onset = Output(kind="event")

    def run(onset):
        pass


@node("shaker", "Outputs")
class Shaker:
    """Where a patch ends."""

    acceleration = Input("m/s^2")
    level = Number(1.0, 0.0, 10.0, wire="audio", doc="factor on the way out")
    tiles = Tiles()
    played = Output("m/s^2")
    is_sink = True

    def run(played):
        pass


@node("hum", "Tones")
class Hum:
    """A tone."""

    frequency = Number(50.0, 1.0, 1000.0, unit="Hz", scale="log", wire="audio", doc="of the tone")
    chains = Count(2000, 1, 100_000, doc="how many")
    sharing = Choice("global", options=("global", "local"))
    out = Output("m/s^2")

    def run(out):
        pass


@node("beat", "Timing")
class Beat:
    """A rhythm."""

    notes = Rows(((0, 4, 1.0),), (("step", 0, 23), ("length", 1, 24), ("amplitude", 0.0, 1.0)), most=24)
    out = Output(kind="event")

    def run(out):
        pass


@node("through", "Shapes")
class Through:
    """The same again."""

    signal = Input()
    out = Output()

    def run(out):
        pass


REGISTRY = {type.type: type for type in (Push, Step, Shaker, Hum, Beat, Through)}


def sample() -> Patch:
    patch = Patch(title="sample")
    for type, at in (("push", (0, 0)), ("step", (240, 0)), ("hum", (0, 160)), ("shaker", (480, 160))):
        patch = patch.add(type, REGISTRY, at)
    return patch.connect("push.force", "step.force", REGISTRY)


LEFT, NONE = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier


def shared_workspace(registry):
    """Yield a workspace of these nodes for the tests of a file, and delete it when they are through."""
    made = DesignWorkspace(registry)
    yield made
    made.close()
    made.deleteLater()
    delete_widgets()


def port(workspace, id: str, side: str, name: str) -> QPoint:
    canvas = workspace.canvas
    return canvas.mapFromScene(canvas.patch_scene.nodes[id].port_place(side, name))


def middle(workspace, id: str) -> QPoint:
    """Return a position in a node's small plot, away from its ports."""
    item = workspace.canvas.patch_scene.nodes[id]
    return workspace.canvas.mapFromScene(item.mapToScene(item.geometry.plot.center()))


def drag(workspace, start: QPoint, end: QPoint, release: bool = True, modifiers=NONE) -> None:
    """`modifiers` are held at the release."""
    view = workspace.canvas.viewport()
    send(view, QEvent.Type.MouseButtonPress, start, LEFT)
    for share in (0.1, 0.5, 0.9, 1.0):
        place = QPoint(
            round(start.x() + share * (end.x() - start.x())), round(start.y() + share * (end.y() - start.y()))
        )
        send(view, QEvent.Type.MouseMove, place, LEFT)
    if release:
        send(view, QEvent.Type.MouseButtonRelease, end, LEFT, modifiers)


def send(widget, kind, place, button, modifiers=NONE) -> None:
    which = Qt.MouseButton.NoButton if kind == QEvent.Type.MouseMove else button
    held = Qt.MouseButton.NoButton if kind == QEvent.Type.MouseButtonRelease else button
    at = QPointF(place)
    QApplication.sendEvent(widget, QMouseEvent(kind, at, QPointF(widget.mapToGlobal(place)), which, held, modifiers))
