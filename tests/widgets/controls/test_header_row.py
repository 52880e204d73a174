"""A head line that is too narrow: what gives way, and in which order; and text that ends in dots."""

import pytest
from on_screen import show
from PySide6.QtCore import QCoreApplication, Qt

from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.controls.header_row import HeaderRow
from underfoot.widgets.controls.panels import tool_button


@pytest.fixture
def parts():
    title, figures = theme.label("Force", "title"), [theme.label(f"{k}00 N", "small") for k in range(1, 4)]
    return title, tool_button("crosshairs", "Follow", "Follow the steps"), figures


def test_words_of_buttons_go_before_figures_and_all_come_back(qtbot, parts):
    title, button, figures = parts
    line = HeaderRow([title, None, *figures, button], [[button], figures[1:], figures[:1]])
    qtbot.addWidget(line)
    seen = []
    for wide in (600, 250, 200, 130, 600):
        line.setFixedWidth(wide)
        show(qtbot, line)
        QCoreApplication.processEvents()
        has_words = button.toolButtonStyle() != Qt.ToolButtonStyle.ToolButtonIconOnly
        seen.append((has_words, [figure.isVisible() for figure in figures]))
        assert title.width() >= title.sizeHint().width()
        assert button.geometry().right() < wide
    assert seen[0] == seen[-1] == (True, [True] * 3)
    assert seen[2] == (False, [True, False, False])
    assert seen[3] == (False, [False] * 3)


def test_a_button_that_is_not_there_takes_no_room(qtbot, parts):
    title, button, figures = parts
    line = HeaderRow([title, None, *figures, button], [[button], figures])
    qtbot.addWidget(line)
    line.setFixedWidth(210)
    button.hide()
    show(qtbot, line)
    assert button.isHidden()
    assert all(figure.isVisible() for figure in figures)


def test_a_label_of_many_words_ends_in_dots_before_it_goes(qtbot, parts):
    title, button, figures = parts
    words = ElidedLabel()
    words.set_full_text("weighs 712 N  ·  3 steps left out  ·  36 tiles  ·  simulator")
    line = HeaderRow([title, words, None, figures[0], button], [[words], figures[:1]])
    qtbot.addWidget(line)
    whole = words.sizeHint().width()
    for less, is_seen, is_whole in ((-40, True, True), (60, True, False), (whole - 40, False, False)):
        line.setFixedWidth(title.sizeHint().width() + figures[0].sizeHint().width() + 130 + whole - less)
        show(qtbot, line)
        QCoreApplication.processEvents()
        assert (words.isVisible(), words.text() == words.full_text) == (is_seen, is_whole)
        assert figures[0].isVisible()
        assert button.geometry().right() < line.width()


def test_text_without_room_ends_in_dots_and_is_in_the_tooltip(qtbot):
    label = ElidedLabel("title")
    qtbot.addWidget(label)
    label.set_full_text("Strain rate envelope")
    label.setFixedWidth(60)
    show(qtbot, label)
    assert label.text().endswith("…")
    assert label.toolTip() == label.full_text == "Strain rate envelope"
    label.setFixedWidth(400)
    assert (label.text(), label.toolTip()) == ("Strain rate envelope", "")
