"""Asking for an input that an output is to be wired to, for a new node there, or for a wire to take away."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QWidget

from underfoot.patch.wiring import Wire, node_id, port_name
from underfoot.widgets import theme
from underfoot.widgets.design.items import NodeItem
from underfoot.widgets.design.named_list import NamedList
from underfoot.widgets.design.node_geometry import accent, display_name
from underfoot.widgets.design.patch_editing import open_targets, targets_by_map
from underfoot.widgets.design.rewiring import sum_of
from underfoot.widgets.design.scene import PatchScene
from underfoot.widgets.design.search_popup import SearchPopup

_WIDTH_PX = 400
"""Room for the names of a node and of its port, and for that of the output."""


class Answers(NamedTuple):
    """What is done with the choice."""

    connect: Callable[[str, str], object]
    """Takes the output and the input, "node.port"."""
    add_up: Callable[[str, str], object]
    """Takes the same, for an input that has a wire, which stays."""
    connect_by_map: Callable[[str, str], object]
    """Takes the same, for a parameter in another unit."""
    add: Callable[[str], object]
    """Takes the output, for which a new node is asked."""
    disconnect: Callable[[Wire], object]


class ConnectionSearch(SearchPopup):
    """Asks what the outputs of a node or sub-patch are wired to, by words. A menu of all inputs of a large patch would
    not fit on a screen.
    """

    list: "_ConnectionList"

    def __init__(self, scene: PatchScene, view: QWidget, answers: Answers) -> None:
        super().__init__(view, _ConnectionList(scene, answers))
        self.chosen.connect(lambda id: self.list.answer(id))

    def ask_for(self, item: NodeItem, at: QPoint) -> bool:
        """Ask, at a point of the view; return whether there is anything to ask for."""
        self.list.asking = item
        is_possible = any(True for _ in self.list.rows())
        if is_possible:
            self.setFixedWidth(min(_WIDTH_PX, self._view.width() - 2 * theme.GRID))
            self.open_at(at, f"Connect {item.description.title} to")
        return is_possible


class _Row(NamedTuple):
    name: str
    colour: str
    own_port: str
    """The port of the asking node, if it has several."""
    answer: Callable[[], object]
    removes: bool = False


class _ConnectionList(NamedList):
    def __init__(self, scene: PatchScene, answers: Answers) -> None:
        super().__init__(None, "Inputs and wires")
        self._scene, self._answers = scene, answers
        self.asking: NodeItem | None = None
        self._shown: Sequence[_Row] = ()

    def filter_by(self, text: str) -> None:
        """Show the rows that have all words of the text; those that begin with them come first, then those that have
        them in their name, before those of an output of the asking node that has them.

        Enter takes no wire away unless it was stepped to, or asked for by its first word: it may be there already.
        """
        super().filter_by(text)
        sought = text.lower().split()
        found = [row for row in self.rows() if all(word in f"{row.name} {row.own_port}".lower() for word in sought)]

        def rank(row: _Row) -> tuple[bool, bool]:
            name = row.name.lower()
            return not name.startswith(text.strip().lower()), not all(word in name for word in sought)

        self._shown = sorted(found, key=rank)
        for i, row in enumerate(self._shown):
            self.add(str(i), row.name, row.colour, row.own_port, row.name)
        if not found:
            self.add_words("No input that fits has these words")
        is_asked = bool(sought) and "disconnect".startswith(sought[0])
        self.setCurrentRow(-1 if found and self._shown[0].removes and not is_asked else 0)

    def answer(self, id: str) -> None:
        """Do what the row with this id says."""
        self._shown[int(id)].answer()

    def rows(self) -> Iterator[_Row]:
        """Yield a new node and the inputs for each output, then the wires that can be taken away."""
        if self.asking is None:
            return
        patch, registry, item, do = self._scene.patch, self._scene.registry, self.asking, self._answers
        names = patch.names(registry)

        def name(end: str) -> str:
            return f"{names[node_id(end)]}: {display_name(port_name(end))}"

        outputs = [port for port in item.geometry.ports if port.side == "out"]
        for port in outputs:
            source, own = item.end(port), port.row.text if len(outputs) > 1 else ""
            yield _Row("A new node…", theme.MUTED, own, partial(do.add, source))
            for target, by, answer in self._offers(source, port.port.kind):
                colour = accent(registry[patch.node(node_id(target)).type])
                text = f"{name(target)}, by {registry[by].label}" if by else name(target)
                yield _Row(text, colour, own, partial(answer, source, target))
        for wire in [shown.wire for shown in item.wires]:
            is_out = node_id(wire[0]) in self._scene.members([item.node.id])
            other, own = wire[is_out], display_name(port_name(wire[not is_out]))
            yield _Row(f"Disconnect {name(other)}", theme.ALARM, own, partial(do.disconnect, wire), removes=True)

    def _offers(self, source: str, kind: str) -> Iterator[tuple[str, str, Callable[[str, str], object]]]:
        """Yield the inputs for an output of this kind, the type of the node that is put between, and what does it."""
        patch, registry, do = self._scene.patch, self._scene.registry, self._answers
        adding, wired = sum_of(registry, kind), {target for _, target in patch.wires}
        for target in open_targets(patch, registry, source):
            yield target, "", do.connect
            if adding and target in wired:
                yield target, adding, do.add_up
        for target in targets_by_map(patch, registry, source):
            yield target, "map", do.connect_by_map
