"""Finding what is on the canvas by its name: nodes, notes, frames and sub-patches, on all levels."""

from collections.abc import Iterator
from typing import NamedTuple

from PySide6.QtCore import QPoint
from PySide6.QtWidgets import QWidget

from underfoot.patch.groups import chain, innermost, parents
from underfoot.widgets import theme
from underfoot.widgets.design.group_view import colour_of
from underfoot.widgets.design.named_list import NamedList
from underfoot.widgets.design.node_geometry import accent
from underfoot.widgets.design.scene import PatchScene
from underfoot.widgets.design.search_popup import SearchPopup


class ItemSearch(SearchPopup):
    """Asks for an item of the patch."""

    def __init__(self, scene: PatchScene, view: QWidget) -> None:
        super().__init__(view, _ItemList(scene))

    def ask(self) -> None:
        """Open at the top of the view."""
        self.open_at(QPoint((self._view.width() - self.width()) // 2, 0), "Find a node, note or group")


class _Row(NamedTuple):
    id: str
    name: str
    colour: str
    note: str
    words: str
    """By which it is found, too."""


class _ItemList(NamedList):
    def __init__(self, scene: PatchScene) -> None:
        super().__init__(None, "Items of the patch")
        self._scene = scene

    def filter_by(self, text: str) -> None:
        """Show the items that have all words of the text; those whose name begins with them come first."""
        super().filter_by(text)
        sought = text.lower().split()
        found = [row for row in self._rows() if all(word in f"{row.name} {row.words}".lower() for word in sought)]
        for row in sorted(found, key=lambda row: not row.name.lower().startswith(text.strip().lower())):
            self.add(row.id, row.name, row.colour, row.note)
        if not found:
            self.add_words("Nothing in the patch has these words" if sought else "The patch is empty")
        self.setCurrentRow(0)

    def _rows(self) -> Iterator[_Row]:
        patch, registry = self._scene.patch, self._scene.registry
        names = {group.id: group.title or ("Sub-patch" if group.collapsed else "Group") for group in patch.groups}
        inner, above = innermost(patch.groups), parents(patch.groups)

        def path(group: str, *ids: str) -> str:
            return " › ".join([*(names[id] for id in chain(patch.groups, group)), *ids])

        for node in patch.nodes:
            type, around = registry[node.type], path(inner.get(node.id, ""), node.id)
            yield _Row(node.id, node.name_in(registry), accent(type), around, f"{node.id} {type.label}")
        for group in patch.groups:
            yield _Row(group.id, names[group.id], colour_of(group), path(above[group.id]), "group")
        for note in patch.notes:
            around = path(inner.get(note.id, ""))
            yield _Row(note.id, note.text.partition("\n")[0] or "Note", theme.MUTED, around, f"note {note.text}")
