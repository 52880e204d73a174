"""The View menu: which colours the window has and whether it fills the screen, at once, and how large its text is, once
it has started again.

Qt scales a whole program, and reads by how much only as that starts: in an open window every size of a text, a row and
a node would have to be scaled by itself. Starting again brings back what was open, unsaved work and undo included.
"""

from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QActionGroup
from PySide6.QtWidgets import QMenu, QWidget

from underfoot.widgets.controls.menu import add_action
from underfoot.widgets.dialogs.text_size_dialog import TextSizeDialog
from underfoot.widgets.session.settings import TEXT_SIZES, THEMES, Settings

_FULL_SCREEN = Qt.WindowState.WindowFullScreen


class ViewMenu(QMenu):
    """Changes `theme` and `text_size` of the settings. The keys work in the whole `window`."""

    notified = Signal(str)
    theme_chosen = Signal()
    """Other colours are wanted, at once."""
    restart_requested = Signal()
    """Underfoot is to be closed and started again."""

    def __init__(self, settings: Settings, window: QWidget) -> None:
        super().__init__("View", window)
        self._settings = settings
        self._window, self._running_size = window, settings.text_size
        self.size_dialog: TextSizeDialog | None = None
        """While another size than the window's is being chosen."""
        self._themes = QActionGroup(self)
        for name, text in THEMES.items():
            self._add_choice(self._themes, text, name)
        self._themes.triggered.connect(lambda action: self._choose(theme=action.data()))
        self.addSeparator()
        self._sizes = QActionGroup(self)
        for percent in TEXT_SIZES:
            self._add_choice(self._sizes, f"Text {percent} %", percent)
        self._sizes.triggered.connect(lambda action: self._choose(text_size=action.data()))
        add = partial(add_action, window, where=Qt.ShortcutContext.WindowShortcut)
        self.larger_text = add("Larger text", ("Ctrl++", "Ctrl+="), partial(self._step, 1))
        self.smaller_text = add("Smaller text", "Ctrl+-", partial(self._step, -1))
        full_screen = add("Full screen", "F11", lambda: window.setWindowState(window.windowState() ^ _FULL_SCREEN))
        self.addActions([self.larger_text, self.smaller_text])
        self.addSeparator()
        self.addAction(full_screen)
        self._show()

    def _add_choice(self, group: QActionGroup, text: str, value: str | int) -> None:
        action = self.addAction(text)
        action.setCheckable(True)
        action.setData(value)
        group.addAction(action)

    def _step(self, steps: int) -> None:
        """Choose the next larger or smaller size; at the ends nothing changes."""
        at = min(range(len(TEXT_SIZES)), key=lambda i: abs(TEXT_SIZES[i] - self._settings.text_size))
        self._choose(text_size=TEXT_SIZES[min(max(at + steps, 0), len(TEXT_SIZES) - 1)])

    def _choose(self, theme: str | None = None, text_size: int | None = None) -> None:
        self._settings.theme = theme or self._settings.theme
        self._settings.text_size = text_size or self._settings.text_size
        self._show()
        if theme:
            self.theme_chosen.emit()
            return
        if self._settings.text_size != self._running_size:
            self._offer_restart()
        elif self.size_dialog is not None:
            self.size_dialog.close()
        else:
            self.notified.emit(f"Text {self._settings.text_size} %: as it is now.")

    def _offer_restart(self) -> None:
        if self.size_dialog is None:
            self.size_dialog = TextSizeDialog(self._window)
            self.size_dialog.addActions([self.larger_text, self.smaller_text])
            self.size_dialog.restart_requested.connect(self.restart_requested)
            self.size_dialog.finished.connect(self._forget_dialog)
            self.size_dialog.open()
        self.size_dialog.show_size(self._settings.text_size, self._running_size)

    def _forget_dialog(self) -> None:
        self.size_dialog = None

    def _show(self) -> None:
        """Mark what is chosen."""
        chosen = self._settings.theme, self._settings.text_size
        for group, value in zip((self._themes, self._sizes), chosen, strict=True):
            for action in group.actions():
                action.setChecked(action.data() == value)
