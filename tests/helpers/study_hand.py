"""The Experiment workspace without a session, and the hand of who makes a study in it."""

from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox, QPushButton

from underfoot.widgets.experiment.workspace import ExperimentWorkspace

LEFT, CTRL = Qt.MouseButton.LeftButton, Qt.KeyboardModifier.ControlModifier

UNSAVED = "unsaved-0.draft"
"""The first window's copy of an unsaved study, beside the user's protocols."""


class Hand:
    """A workspace without a session, and the hand of who makes a study in it."""

    def __init__(self, qtbot, folder):
        self.qtbot, self.folder, self.said, self.open = qtbot, folder, [], []
        self.workspace = self.opened()

    def opened(self):
        workspace = ExperimentWorkspace(*(self.folder / name for name in ("studies", "protocols", "presets")))
        self.open.append(workspace)
        self.qtbot.addWidget(workspace, before_close_func=self.close_down)
        workspace.notified.connect(self.said.append)
        workspace.resize(1280, 740)
        show(self.qtbot, workspace)
        return workspace

    def close_down(self, workspace):
        """Close a workspace as its window does, unless it is closed."""
        if workspace in self.open:
            self.open.remove(workspace)
            workspace.close_down()

    @property
    def protocol_editor(self):
        return self.workspace.protocol_editor

    def click(self, button):
        assert button.isEnabled()
        self.qtbot.mouseClick(button, LEFT)

    def page(self, place):
        self.click(self.protocol_editor.tabs.button(place))

    def type(self, field, text):
        field.selectAll()
        self.qtbot.keyClicks(field, text)

    def choose(self, box, words):
        """Choose in a box as keys do: its text is typed."""
        box.setFocus()
        box.setCurrentIndex(box.findText(words))
        box.activated.emit(box.currentIndex())

    def keep(self):
        """Save and close, by keys."""
        self.qtbot.waitUntil(self.protocol_editor.save_button.isEnabled)
        self.qtbot.keyClick(self.protocol_editor, Qt.Key.Key_S, CTRL)
        assert self.workspace.stack.currentWidget() is self.protocol_editor
        self.qtbot.keyClick(self.protocol_editor, Qt.Key.Key_Escape)

    def protocols(self):
        return sorted(path.name for path in (self.folder / "protocols").glob("*.json"))

    def answer(self, words):
        box = next(box for box in self.workspace.findChildren(QMessageBox) if box.isVisible())
        self.click(next(button for button in box.findChildren(QPushButton) if button.text().replace("&", "") == words))
