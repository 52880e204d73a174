"""The window's menu: files, presets, what workspaces add to it, playing, and help."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QWidget

from underfoot.patch import preset_files
from underfoot.widgets.controls.menu import literal


class MainMenu(QMenu):
    """Shows the window's actions; `recent` gives the files that were opened lately, `view` is a menu in it."""

    recent_chosen = Signal(object)
    """The `Path` of a file to be opened."""
    preset_chosen = Signal(object)
    """The `Path` of a preset to begin with."""

    def __init__(
        self,
        actions: Mapping[str, QAction],
        recent: Callable[[], Sequence[str]],
        view: QMenu,
        parent: QWidget,
    ) -> None:
        super().__init__(parent)
        self._recent = recent
        self.addActions([actions["new"], actions["open"]])
        self._recent_menu = self.addMenu("Open recent")
        self._recent_menu.aboutToShow.connect(self._fill_recent)
        self.presets = self.addMenu("Presets")
        for family, patches in preset_files.families().items():
            menu = self.presets.addMenu(family) if family else self.presets
            for text, path in patches.items():
                menu.addAction(text).triggered.connect(lambda _=False, path=path: self.preset_chosen.emit(path))
        self.addActions([actions["save"], actions["save as"]])
        self.addActions([actions["import"], actions["export"]])
        self.addSeparator()
        self._end_of_workspaces = self.addSeparator()
        self.addActions([actions[name] for name in ("play", "panic", "record", "mark", "mark with words")])
        self.addActions([actions[name] for name in ("audio", "network", "cost")])
        self.addSeparator()
        self.addMenu(view)
        self.addActions([actions[name] for name in ("keys", "about", "quit")])

    def add_workspace_actions(self, actions: Sequence[QAction]) -> None:
        """Show what a workspace adds."""
        self.insertActions(self._end_of_workspaces, list(actions))

    def _fill_recent(self) -> None:
        self._recent_menu.clear()
        for path in self._recent():
            self._recent_menu.addAction(literal(path), partial(self.recent_chosen.emit, Path(path)))
        if not self._recent():
            self._recent_menu.addAction("None yet").setEnabled(False)
