"""A plot's picture and its numbers, from its context menu."""

import numpy as np
import pytest
from on_screen import show
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QColor, QContextMenuEvent, QGuiApplication, QImage, QPainter
from PySide6.QtSvg import QSvgRenderer
from PySide6.QtWidgets import QApplication, QFileDialog, QMenu, QMessageBox, QToolButton

from underfoot.drawing import Drawing, series
from underfoot.drawing.look import palette
from underfoot.errors import BadFile
from underfoot.widgets import theme
from underfoot.widgets.plots import saving
from underfoot.widgets.plots.plot import Plot

DRAWING = Drawing("Creep", "time, s", "force, N", (series("held", [1, 2], [40, 41]),))


@pytest.fixture
def plot(qtbot):
    made = Plot()
    qtbot.addWidget(made)
    made.resize(320, 240)
    show(qtbot, made)
    made.show_drawing(DRAWING)
    return made


def ask(plot, words):
    """Choose what has these words in the plot's context menu."""
    QApplication.sendEvent(plot, QContextMenuEvent(QContextMenuEvent.Reason.Mouse, QPoint(9, 9), QPoint(9, 9)))
    menu = plot.findChild(QMenu)
    next(action for action in menu.actions() if words in action.text()).trigger()
    menu.close()


def test_the_menu_copies_the_picture_that_it_would_save(plot, tmp_path):
    ask(plot, "Copy picture")
    saving.save(plot, DRAWING, tmp_path / "creep.png")
    format = QImage.Format.Format_RGB32
    copied = QGuiApplication.clipboard().image().convertToFormat(format)
    assert copied == QImage(str(tmp_path / "creep.png")).convertToFormat(format)


@pytest.mark.parametrize("suffix", [suffix for _, suffix in saving.KINDS])
def test_the_menu_saves_what_is_shown(plot, tmp_path, suffix):
    ask(plot, suffix)
    dialog = plot.findChild(QFileDialog)
    back = dialog.findChild(QToolButton, "backButton").icon().pixmap(32).toImage()
    assert back == theme.icon("arrow-left", theme.TEXT).pixmap(32).toImage()
    path = tmp_path / f"creep{suffix}"
    dialog.fileSelected.emit(str(path))
    dialog.close()
    if suffix == ".png":
        image = QImage(str(path))
        assert (image.width(), image.height()) == (640, 480)
    else:
        assert "force, N" in path.read_text()
    if suffix == ".csv":
        assert np.loadtxt(path, delimiter=",", skiprows=1, usecols=(1, 2)).tolist() == [[1.0, 40.0], [2.0, 41.0]]


@pytest.mark.parametrize("y_range", [None, (0.0, 30.0)])
def test_another_reader_of_svg_draws_the_curve(plot, tmp_path, y_range):
    drawing = Drawing("Creep", "time, s", "force, N", (series("", [1, 2], [10, 20]),), y_range=y_range)
    saving.save(plot, drawing, tmp_path / "creep.svg")
    renderer = QSvgRenderer(str(tmp_path / "creep.svg"))
    image = QImage(renderer.defaultSize(), QImage.Format.Format_RGB32)
    painter = QPainter(image)
    renderer.render(painter)
    painter.end()
    curve = QColor(palette(theme.NAME)[drawing.series[0].colour]).rgb()
    drawn = {x for x in range(image.width()) for y in range(image.height()) if image.pixel(x, y) == curve}
    assert max(drawn) - min(drawn) > 400


def test_a_file_that_cannot_be_written_is_said(plot, tmp_path, qtbot):
    for _, suffix in saving.KINDS:
        with pytest.raises(BadFile, match="cannot be written"):
            saving.save(plot, DRAWING, tmp_path / "missing" / f"a{suffix}")
    ask(plot, ".svg")
    plot.findChild(QFileDialog).fileSelected.emit(str(tmp_path / "<b>missing" / "a.svg"))
    box = plot.findChild(QMessageBox)
    assert "<b>missing" in box.text()
    assert box.textFormat() == Qt.TextFormat.PlainText
    box.close()
    qtbot.waitUntil(lambda: plot.findChild(QMessageBox) is None)
