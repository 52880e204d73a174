"""Parameters driven by a signal: creation of the driving node, and its menu."""

from collections.abc import Sequence
from functools import partial

from PySide6.QtCore import QPoint, QPointF
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QWidget

from underfoot.errors import BadValue
from underfoot.models.signals.envelopes import FULL_FORCE_N
from underfoot.parameters import Number
from underfoot.patch.grouping import put_into
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import Wire, node_id
from underfoot.widgets.controls.menu import Menu
from underfoot.widgets.design.items import NodeItem
from underfoot.widgets.design.patch_editing import drivers, snapped
from underfoot.widgets.design.patch_view import PatchView
from underfoot.widgets.design.rewiring import known_range
from underfoot.widgets.design.scene import PatchScene
from underfoot.widgets.design.undo import Document

DRIVERS = ("lfo", "random-walk", "step-sequence", "stance-curve", "map", "value")
"""Node types offered as drivers of a parameter."""
DRIVER_SHARE = 0.1
"""Half the range of a new driver, as a share of the parameter's value; of the control's travel if the value is 0."""
_WIDTH, _HEIGHT, _GAP = 176.0, 160.0, 48.0


def drivable_parameters(registry: Registry, type: str) -> tuple[Number, ...]:
    """Return the parameters of a node type that a wire can drive."""
    return tuple(p for p in registry[type].parameters.values() if isinstance(p, Number) and p.wire)


def driver_range(parameter: Number, value: float) -> tuple[float, float]:
    """Return the range in which a new driver moves a parameter with `value`: a tenth of it to each side.

    If the value is 0, it is a tenth of the control's travel to each side.

    >>> driver_range(Number(300.0, 1.0, 20_000.0, scale="log"), 300.0)
    (270.0, 330.0)
    >>> driver_range(Number(0.0, -10.0, 10.0), 0.0)
    (-2.0, 2.0)
    """
    if value == 0.0:
        at = parameter.position(0.0)
        low, high = (parameter.value(min(max(at + side * DRIVER_SHARE, 0.0), 1.0)) for side in (-1.0, 1.0))
    else:
        low, high = sorted((value * (1.0 - DRIVER_SHARE), value * (1.0 + DRIVER_SHARE)))
    low, high = (round(min(max(end, parameter.low), parameter.high), 9) for end in (low, high))
    return low, high


def with_driver(
    patch: Patch,
    registry: Registry,
    id: str,
    name: str,
    type: str,
    beside: tuple[float, float] | None = None,
    source: str = "",
) -> Patch:
    """Return the patch with a new node of `type` wired to parameter `name` of node `id`.

    The node moves the parameter within `driver_range`. What follows a signal is wired to the output `source`, or else
    to the patch's Tile force, or a new one, and moves a loudness from 0 to its value: an empty floor is silent. One of
    0, of which a tenth is not felt, is moved from 0 to its default by any node. `beside` is where the sub-patch stands
    that the driven node is in.
    """
    node = patch.node(id)
    parameter = next(p for p in drivable_parameters(registry, node.type) if p.name == name)
    value = registry[node.type].values(node.parameters)[name]
    followed = [port.name for port in registry[type].inputs if port.kind == "signal"]
    is_from_silence = parameter.is_in_db and (followed or not value)
    low, high = (0.0, value or parameter.initial) if is_from_silence else driver_range(parameter, value)
    if type == "random-walk":
        ends = {"centre": 0.5 * (low + high), "deviation": 0.25 * (high - low)}
    else:
        ends = dict(zip(registry[type].ends("out"), (low, high), strict=True))
    for port in followed:
        known = known_range(patch, registry, source) if source else [0.0, FULL_FORCE_N]
        ends |= dict(zip(registry[type].ends(port), known, strict=False))
    left, top = beside or node.at
    at = _free_place(patch, left - _WIDTH - _GAP, top)
    after = patch.add(type, registry, at, **ends)
    new = after.nodes[-1].id
    for port in followed:
        followed_end = source or next((f"{node.id}.force" for node in patch.nodes if node.type == "tile-force"), "")
        if not followed_end:
            after = after.add("tile-force", registry, _free_place(after, at[0] - _WIDTH - _GAP, at[1]))
            followed_end = f"{after.nodes[-1].id}.force"
        after = after.connect(followed_end, f"{new}.{port}", registry)
    return after.connect(f"{new}.out", f"{id}.{name}", registry)


def _free_place(patch: Patch, x: float, y: float) -> tuple[float, float]:
    """Return (x, y), or the nearest position below it without a node."""
    while any(abs(node.at[0] - x) < _WIDTH and abs(node.at[1] - y) < _HEIGHT for node in patch.nodes):
        y += 8.0
    return snapped(x, y)


class DriverMenus:
    """The menus of drivers for parameters of a document's nodes. Each choice is one undo step."""

    def __init__(self, document: Document, scene: PatchScene, parent: PatchView) -> None:
        self._document, self._scene, self._parent = document, scene, parent

    def open_menu(self, id: str, name: str, place: QPoint, further: Sequence[QAction] = ()) -> None:
        """Open a menu of drivers for a parameter, and of `further` actions, at a position of the screen."""
        menu = self._menu(id, name, self._parent)
        heading = QAction(menu.title(), menu)
        heading.setEnabled(False)
        menu.insertAction(menu.actions()[0], heading)
        menu.addActions(further)
        menu.open_once(place)

    def add_menu(self, menu: QMenu, item: NodeItem, place: QPointF) -> None:
        """Insert the drivers of the parameter whose port is at `place`, or of all parameters, at the top of a menu."""
        id, known = item.node.id, drivable_parameters(self._scene.registry, item.node.type)
        if not known:
            return
        before, port = menu.actions()[0], item.port_at(place)
        names = [p.name for p in known if port is not None and port.side == "in" and p.name == port.name]
        if names or len(known) == 1:
            menu.insertMenu(before, self._menu(id, (names or [known[0].name])[0], menu))
        else:
            into = QMenu("Drive", menu)
            for parameter in known:
                one = self._menu(id, parameter.name, into)
                one.setTitle(parameter.label)
                into.addMenu(one)
            menu.insertMenu(before, into)
        menu.insertSeparator(before)

    def drive(self, id: str, name: str, by: str, source: str = "", old: Wire | None = None) -> None:
        """Drive a parameter by a new node of type `by`; what follows a signal follows the output `source`, if given, in
        place of that output's `old` wire.
        """
        patch, registry = self._document.patch.disconnect([old] if old else []), self._scene.registry
        self._parent.setFocus()  # the number's field had the focus, and may be replaced by the driver's
        label = registry[patch.node(id).type].parameters[name].label.lower()
        shown_as = self._scene.group_view.shown_as
        # What is outside of the open sub-patch is driven from here, by a node behind the one that is followed.
        shown = shown_as[id if id in shown_as else node_id(source)]
        place = self._scene.movable()[shown].pos() + QPointF(0.0 if id in shown_as else 2.0 * (_WIDTH + _GAP), 0.0)
        try:
            after = with_driver(patch, registry, id, name, by, (place.x(), place.y()), source)
        except BadValue:
            self._parent.show_message(f"{label.capitalize()} would follow itself")
            return
        new = after.nodes[len(patch.nodes) :]
        for node in new:
            frame = self._scene.frame_around(QPointF(*node.at))
            if around := frame.shown_group.id if frame else self._scene.inside:
                after = put_into(after, [node.id], around)
        self._document.edit(after, f"Drive {label} with {registry[by].label}")
        self._parent.ensure_visible([shown, *(node.id for node in new)])

    def _disconnect(self, target: str) -> None:
        """Take away the wire that drives a parameter, "node.parameter"."""
        patch = self._document.patch
        self._parent.setFocus()
        self._document.edit(patch.disconnect([wire for wire in patch.wires if wire[1] == target]), "Disconnect")

    def _show_port(self, id: str, name: str, *, wanted: bool) -> None:
        """Show or hide a parameter's port."""
        self._parent.setFocus()
        self._scene.nodes[id].show_port(name, wanted=wanted)

    def _menu(self, id: str, name: str, parent: QWidget) -> Menu:
        patch, registry = self._document.patch, self._scene.registry
        menu = Menu(f"Drive {registry[patch.node(id).type].parameters[name].label.lower()} with", parent)
        for type in DRIVERS:
            if type in registry:
                follows = any(port.kind == "signal" for port in registry[type].inputs)
                text = f"{registry[type].label} of the force" if follows else registry[type].label
                menu.addAction(text, partial(self.drive, id, name, type))
        menu.addSeparator()
        if name in drivers(patch).get(id, {}):
            menu.addAction("Disconnect its wire", partial(self._disconnect, f"{id}.{name}"))
        elif id in self._scene.nodes:  # a sub-patch has ports for wires alone
            if name in self._scene.nodes[id].shown_ports:
                menu.addAction("Hide its port", partial(self._show_port, id, name, wanted=False))
            else:
                menu.addAction("A wire: show its port", partial(self._show_port, id, name, wanted=True))
        return menu
