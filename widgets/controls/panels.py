"""Building blocks of panels in workspaces: a header row above a body, and its buttons."""

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QSplitter,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.drawing.look import heat_table
from underfoot.quantities import number
from underfoot.widgets import theme
from underfoot.widgets.controls.header_row import HeaderRow
from underfoot.widgets.controls.key_names import with_native_keys


def with_header(
    head: Sequence[QWidget | None],
    body: QWidget,
    shrinking: Sequence[Sequence[QWidget]] = (),
    parent: QWidget | None = None,
) -> QWidget:
    """Return `body` below a row of widgets; None is a stretch. In a narrow panel those of `shrinking` shrink."""
    panel = QWidget(parent)
    panel.setMinimumSize(240, 120)
    top = HeaderRow(head, shrinking, panel)
    layout = QVBoxLayout(panel)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(0)
    layout.addWidget(top)
    body.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
    layout.addWidget(body)
    return panel


def column(*widgets: QWidget, body: QWidget, parent: QWidget | None = None) -> QWidget:
    """Return widgets below one another without gaps; `body`, one of them, takes the remaining height."""
    panel = QWidget(parent)
    layout = QVBoxLayout(panel)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(0)
    for widget in widgets:
        layout.addWidget(widget, 1 if widget is body else 0)
    return panel


def splitter(name: str, orientation: Qt.Orientation) -> QSplitter:
    """Return a splitter whose sizes are remembered by its name; nothing in it collapses."""
    made = QSplitter(orientation)
    made.setObjectName(name)
    made.setHandleWidth(1)
    made.setChildrenCollapsible(False)
    return made


def progress_bar(says: str, height_px: int = theme.GRID // 2) -> QProgressBar:
    """Return a bar without text, of thousandths; a screen reader says what it is of."""
    bar = QProgressBar()
    bar.setRange(0, 1000)
    bar.setTextVisible(False)
    bar.setFixedHeight(height_px)
    bar.setAccessibleName(says)
    return bar


def tool_button(icon: str, text: str, tip: str, *, checkable: bool = False) -> QToolButton:
    """Return a button for a header row, with an icon, a text or both."""
    button = QToolButton()
    button.setProperty("role", "tab" if checkable else "flat")
    button.setText(text)
    button.setToolTip(with_native_keys(tip))
    button.setAccessibleName(text if any(map(str.isalnum, text)) else tip)  # a sign alone is not read out
    button.setCheckable(checkable)
    if icon:
        button.setIcon(theme.icon(icon))
    button.setToolButtonStyle(
        Qt.ToolButtonStyle.ToolButtonTextBesideIcon if icon and text else
        Qt.ToolButtonStyle.ToolButtonIconOnly if icon else Qt.ToolButtonStyle.ToolButtonTextOnly
    )  # fmt: skip
    button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
    return button


def chip(
    text: str, tip: str, parent: QWidget | None = None, *, checkable: bool = True, checked: bool = False
) -> QToolButton:
    """Return a small button, which stays pressed if it is `checkable`."""
    button = QToolButton(parent)
    button.setText(text)
    button.setCheckable(checkable)
    button.setChecked(checked)
    button.setProperty("role", "chip")
    button.setToolTip(with_native_keys(tip))
    return button


def one_of_several(text: str, tip: str, role: str = "tab", parent: QWidget | None = None) -> QPushButton:
    """Return a button of which one among several is down: a radio button to a screen reader, to which Qt calls every
    tool button that stays down a check box. Tab comes to the one that is down; Qt leaves that to where the focus was.
    """
    button = QPushButton(text, parent)
    button.setProperty("role", role)
    button.setToolTip(with_native_keys(tip))
    button.setCheckable(True)
    button.setAutoExclusive(True)
    button.setFocusPolicy(Qt.FocusPolicy.NoFocus)
    button.toggled.connect(lambda down: button.setFocusPolicy(_with_tab(button.focusPolicy(), down)))
    return button


def _with_tab(policy: Qt.FocusPolicy, has_tab: bool) -> Qt.FocusPolicy:
    """Return how a widget takes the focus, by Tab too or not."""
    return policy | Qt.FocusPolicy.TabFocus if has_tab else policy & ~Qt.FocusPolicy.TabFocus


class ColourBar(QWidget):
    """The colour scale of the spectrogram, with its levels."""

    def __init__(self) -> None:
        super().__init__()
        layout = QHBoxLayout(self)
        layout.setContentsMargins(theme.GRID, 0, 0, 0)
        layout.setSpacing(theme.GRID // 2)
        self._bar = bar = QLabel()
        self.update_colours()
        bar.setFixedSize(8 * theme.GRID, theme.GRID)
        self.low, self.high = theme.label("", "small"), theme.label("", "small")
        for widget in (self.low, bar, self.high):
            layout.addWidget(widget)

    def update_colours(self) -> None:
        """Update the bar to the spectrogram's current colours."""
        stops = ", ".join(
            f"stop:{i / 8} rgb({r}, {g}, {b})"
            for i, (r, g, b, _) in enumerate(heat_table(theme.NAME)[np.linspace(0, 255, 9).astype(int)])
        )
        self._bar.setStyleSheet(f"background: qlineargradient(x1:0, y1:0, x2:1, y2:0, {stops})")

    def set_range(self, low_db: float, high_db: float) -> None:
        """Set the levels of the first and the last colour, in dB re full scale."""
        self.low.setText(number(low_db))
        self.high.setText(f"{number(high_db)} dB of full scale")
