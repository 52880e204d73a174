"""Saving of a plot to a file, as a picture or as numbers; and copying of the picture."""

from pathlib import Path

from PySide6.QtCore import QBuffer, QByteArray
from PySide6.QtGui import QContextMenuEvent, QGuiApplication, QImage, QImageWriter
from PySide6.QtWidgets import QWidget

from underfoot.drawing import Drawing
from underfoot.drawing.svg import svg
from underfoot.drawing.table import csv
from underfoot.errors import UnderfootError
from underfoot.files import write_file
from underfoot.widgets import theme
from underfoot.widgets.controls.file_dialog import ask_save
from underfoot.widgets.controls.menu import Menu
from underfoot.widgets.controls.question import message_box

PICTURE_SCALE = 2
"""Pixels of a picture per pixel of the screen."""
KINDS = (("Picture", ".svg"), ("Picture", ".png"), ("Data", ".csv"))


def show_menu(plot: QWidget, drawing: Drawing, event: QContextMenuEvent) -> None:
    """Show a menu to copy or save a plot."""
    menu = Menu(plot)
    menu.addAction("Copy picture").triggered.connect(lambda: QGuiApplication.clipboard().setImage(_picture(plot)))
    for kind, suffix in KINDS:
        text = f"Save {kind.lower()} ({suffix})…"
        menu.addAction(text).triggered.connect(lambda _=False, suffix=suffix: _ask(plot, drawing, suffix))
    menu.open_once(event.globalPos())


def save(plot: QWidget, drawing: Drawing, path: Path) -> None:
    """Save a plot in the format of the path's suffix. Raises `BadFile` if it cannot be written."""
    if path.suffix.lower() == ".svg":
        write_file(path, svg(drawing, theme.NAME).encode())
    elif path.suffix.lower() == ".csv":
        write_file(path, csv(drawing).encode())
    else:
        buffer = QBuffer()
        buffer.open(QBuffer.OpenModeFlag.WriteOnly)
        QImageWriter(buffer, QByteArray(b"png")).write(_picture(plot))
        write_file(path, bytes(buffer.data().data()))


def _picture(plot: QWidget) -> QImage:
    image = QImage(plot.size() * PICTURE_SCALE, QImage.Format.Format_RGB32)
    image.setDevicePixelRatio(PICTURE_SCALE)
    plot.render(image)
    return image


def _ask(plot: QWidget, drawing: Drawing, suffix: str) -> None:
    name = (drawing.title or plot.accessibleName() or "plot").lower().replace(" ", "-")

    def chosen(path: Path) -> None:
        try:
            save(plot, drawing, path)
        except UnderfootError as error:
            message_box(plot.window(), "Save a plot", str(error)).open()

    ask_save(plot.window(), "Save a plot", f"{name}{suffix}", f"*{suffix}", suffix, chosen)
