"""A workspace that shows the title of the open patch."""

from collections.abc import Sequence

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QVBoxLayout

from underfoot.patch.patch import Patch
from underfoot.widgets import theme
from underfoot.widgets.dialogs.shortcuts import Keys, keys_of
from underfoot.widgets.workspace import Workspace, WorkspaceContext


class AboutWorkspace(Workspace):
    """Listens to the open patch; its action says the title in the status line."""

    def __init__(self) -> None:
        super().__init__()
        self._title = theme.label("")
        QVBoxLayout(self).addWidget(self._title)
        self._tell = QAction("Tell the title", self)
        self._tell.setShortcut("T")
        self._tell.triggered.connect(lambda: self.said.emit(self._title.text()))
        self.addAction(self._tell)

    def listen(self, context: WorkspaceContext) -> None:
        self._show(context.open_patch.patch)
        context.open_patch.patch_changed.connect(self._show)

    def menu_actions(self) -> Sequence[QAction]:
        return (self._tell,)

    def shortcuts(self) -> Keys:
        return keys_of([self._tell])

    def _show(self, patch: Patch) -> None:
        self._title.setText(patch.title or "Untitled")
