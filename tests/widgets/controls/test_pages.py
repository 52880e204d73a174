"""Pages of which one is shown at a time."""

from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QHBoxLayout, QLineEdit, QPushButton, QVBoxLayout, QWidget

from underfoot.widgets.controls.scrolled import Pages


def test_the_page_that_goes_is_deleted_and_gives_its_focus_to_no_button_beside(qtbot):
    window = QWidget()
    pages, row = Pages(), QHBoxLayout(window)
    for one in (QPushButton("Before"), pages, QPushButton("Remove")):
        row.addWidget(one)
    qtbot.addWidget(window)
    window.show()
    window.activateWindow()
    qtbot.waitUntil(window.isActiveWindow)
    for turn in range(3):
        page = QWidget(pages.inside)
        field = QLineEdit()
        QVBoxLayout(page).addWidget(field)
        pages.show_page(page)
        assert (window.focusWidget() is None) == (turn > 0)  # at first the window's own choice
        assert [one for one in pages.findChildren(QLineEdit) if one.isVisible()] == [field]
        field.setFocus()
        QApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
        assert pages.inside.findChildren(QLineEdit) == [field]
