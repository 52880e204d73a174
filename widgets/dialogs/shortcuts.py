"""The list of keys, read from the actions themselves."""

import re
from collections.abc import Iterable, Sequence

from PySide6.QtGui import QAction, QKeySequence
from PySide6.QtWidgets import QDialogButtonBox, QGridLayout, QScrollArea, QVBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.dialog import Dialog
from underfoot.widgets.controls.key_names import with_native_keys

_RARE_KEY = re.compile(r"F(1[3-9]|[23]\d)|New|Open|Save|Find|Cut|Copy|Paste")

Keys = Sequence[tuple[str, str]]
"""Actions and their keys."""


class ShortcutsDialog(Dialog):
    """Keys in groups, each under its heading."""

    def __init__(self, groups: Sequence[tuple[str, Keys]], parent: QWidget | None = None) -> None:
        super().__init__("Keyboard shortcuts", parent)
        inside = QWidget()
        grid = QGridLayout(inside)
        grid.setContentsMargins(2 * theme.GRID, theme.GRID, 2 * theme.GRID, theme.GRID)
        grid.setHorizontalSpacing(4 * theme.GRID)
        grid.setVerticalSpacing(theme.GRID // 2)
        for heading, keys in groups:
            if grid.rowCount() > 1:
                grid.setRowMinimumHeight(grid.rowCount(), theme.GRID)
            grid.addWidget(theme.label(heading, "heading"), grid.rowCount(), 0, 1, 2)
            for what, key in keys:
                row = grid.rowCount()
                grid.addWidget(theme.label(with_native_keys(what)), row, 0)
                grid.addWidget(theme.label(with_native_keys(key), "muted"), row, 1)
        grid.setRowStretch(grid.rowCount(), 1)
        grid.setColumnStretch(1, 1)
        area = QScrollArea()
        area.setWidget(inside)
        area.setWidgetResizable(True)
        area.setAccessibleName(self.windowTitle())
        buttons = self.button_row(QDialogButtonBox.StandardButton.Close)
        layout = QVBoxLayout(self)
        layout.addWidget(area)
        layout.addWidget(buttons)
        room = parent.height() if parent is not None else 100 * theme.GRID
        size = inside.sizeHint()
        self.resize(size.width() + 6 * theme.GRID, min(size.height() + 10 * theme.GRID, room - 4 * theme.GRID))


def keys_of(actions: Iterable[QAction]) -> Keys:
    """Return text and keys of the actions that have keys; without F13 to F35, Copy, Save and
    the like, which few keyboards have.
    """
    native = QKeySequence.SequenceFormat.NativeText
    found = []
    for action in actions:
        keys = [key for key in action.shortcuts() if not _RARE_KEY.fullmatch(key.toString())]
        if keys:
            found.append((action.text().rstrip("…"), ", ".join(key.toString(native) for key in keys[:3])))
    return found
