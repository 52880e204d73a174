"""Other colours while the window is open: nothing is made anew, and so nothing that is open is lost.

What is painted takes its colours as it is painted. What keeps some, as a style, an icon or a picture, is found here, or
has a method `update_colours`.
"""

import re

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel, QWidget

from underfoot.drawing import look
from underfoot.widgets import theme
from underfoot.widgets.session.settings import Settings

_COLOUR = re.compile("#[0-9a-f]{6}")


def choose_colours(app: QApplication, settings: Settings) -> None:
    """Take the palette that was chosen, or the system's, for what will be made."""
    is_light = app.styleHints().colorScheme() == Qt.ColorScheme.Light
    system = "light" if is_light else "dark"
    theme.choose_palette(settings.theme if settings.theme in look.PALETTES else system)
    theme.apply(app)


def apply_colours(app: QApplication, settings: Settings) -> None:
    """Take the palette that was chosen, with all that there is."""
    before = theme.NAME
    choose_colours(app, settings)
    if before == theme.NAME:
        return
    for widget in app.allWidgets():
        if widget.styleSheet():
            widget.setStyleSheet(_recoloured(widget.styleSheet()))
        if isinstance(widget, QLabel) and _COLOUR.search(widget.text()):
            widget.setText(_recoloured(widget.text()))
        if isinstance(widget, QAbstractButton):
            widget.setIcon(theme.recoloured_icon(widget.icon()))
        if hasattr(widget, "update_colours"):
            widget.update_colours()
        QWidget.update(widget)  # lists of older Qt for Python have only their own, of an index


def _recoloured(text: str) -> str:
    """Return a text with colours of any palette replaced by the present ones."""
    return _COLOUR.sub(lambda found: theme.current_colour(found[0]), text)
