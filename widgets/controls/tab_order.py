"""The order in which Tab reaches controls, where some are made later than those that follow them."""

from collections.abc import Iterable
from itertools import pairwise

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QWidget

from underfoot.widgets.controls.fields import Field


def set_tab_order(stops: Iterable[QWidget]) -> None:
    """Let Tab go through these controls, one after the other; without this, one that is made later is the last."""
    for one, following in pairwise(stops):
        QWidget.setTabOrder(one, following)


def tab_stops(editors: Iterable[QWidget]) -> list[QWidget]:
    """Return the visible controls within `editors` that Tab reaches, of each editor a field before its slider."""
    return [
        part
        for editor in editors
        for part in dict.fromkeys([*editor.findChildren(Field), *editor.findChildren(QWidget)])
        if part.focusPolicy() & Qt.FocusPolicy.TabFocus
        and not part.isHidden()
        and part.window() is editor.window()  # a choice's list is a separate window
    ]
