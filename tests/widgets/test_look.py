"""The look that was chosen: kept between starts, on a screen of any size, and not mixed up with somebody else's."""

import os
from base64 import b64encode

import pytest
from on_screen import show
from PySide6.QtCore import QSize, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMainWindow, QSplitter
from windows import quiet_window

from underfoot.widgets import application, remembered, theme
from underfoot.widgets.session.settings import TEXT_SIZES, Settings
from underfoot.widgets.view_menu import ViewMenu


def test_what_was_chosen_is_there_at_the_next_start(qtbot, tmp_path):
    first = quiet_window(qtbot, tmp_path)
    first.resize(800, 700)  # as wide as the screen of the tests
    first.show_workspace("Monitor")
    across = first.findChild(QSplitter, "monitor across")
    across.setSizes([300, 500])
    sizes = across.sizes()
    QTest.keyClick(first, Qt.Key.Key_Plus, Qt.KeyboardModifier.ControlModifier)
    next(action for action in first.menu.view.actions() if action.text() == "Light").trigger()
    assert "Light, text 115 %: from the next start on" in first.status.message
    first.leave()

    kept = Settings.load(tmp_path)
    assert (kept.theme, kept.text_size, kept.workspace) == ("light", 115, "Monitor")
    second = quiet_window(qtbot, tmp_path)
    assert (second.workspace, second.width(), second.height()) == ("Monitor", 800, 700)
    assert second.findChild(QSplitter, "monitor across").sizes() == sizes


def test_text_grows_by_keys_and_no_further_than_there_are_sizes(qtbot):
    window, settings = QMainWindow(), Settings()
    qtbot.addWidget(window)
    menu = ViewMenu(settings, window)
    show(qtbot, window)
    assert not menu.again.isEnabled()
    seen = []
    for key in [Qt.Key.Key_Plus] * 5 + [Qt.Key.Key_Minus] * 5:
        QTest.keyClick(window, key, Qt.KeyboardModifier.ControlModifier)
        seen.append(settings.text_size)
    assert seen == [115, 130, 150, 150, 150, 130, 115, 100, 100, 100]
    assert set(seen) == set(TEXT_SIZES)
    assert not menu.again.isEnabled()


@pytest.mark.parametrize("chosen", ["dark", "light"])
def test_the_application_has_the_colours_of_the_settings(qapp, chosen):
    try:
        application.application(Settings(theme=chosen))
        assert chosen == theme.NAME
        assert qapp.palette().window().color().name() == theme.colours(chosen)["panel"]
        assert theme.colours(chosen)["text"] in qapp.styleSheet()
    finally:
        application.application(Settings())


def test_the_size_of_the_text_is_no_one_elses(monkeypatch):
    """Qt is told of it while the application is made; programs that it starts are not."""
    told = []
    monkeypatch.setattr(application, "QApplication", Made)
    monkeypatch.setattr(Made, "made", lambda: told.append(os.environ.get(application.SCALE)))
    monkeypatch.delenv(application.SCALE, raising=False)
    for given, size, scale in ((None, 130, "1.3"), ("2", 115, "2.3"), (None, 100, None)):
        if given:
            monkeypatch.setenv(application.SCALE, given)
        with pytest.raises(AssertionError):  # the one there is stays
            application.application(Settings(text_size=size))
        assert (told.pop(), os.environ.get(application.SCALE)) == (scale, given)
        monkeypatch.delenv(application.SCALE, raising=False)


class Made:
    """An application that is not made a second time."""

    @staticmethod
    def instance():
        return None

    def __init__(self, words):
        Made.made()


def test_a_window_is_never_larger_than_the_screen_nor_beside_it(qtbot):
    far = QMainWindow()
    qtbot.addWidget(far)
    far.setGeometry(9000, 9000, 4000, 3000)
    for settings in (Settings(), Settings(geometry=b64encode(bytes(far.saveGeometry().data())).decode())):
        window = QMainWindow()
        qtbot.addWidget(window)
        remembered.restore_window(window, settings)
        room = window.screen().availableGeometry()
        assert room.size() == QSize(800, 800)  # the screen of the tests, smaller than the least size
        show(qtbot, window)
        assert room.contains(window.geometry())
        assert room.contains(window.minimumSize().width() - 1, window.minimumSize().height() - 1)


def test_a_splitter_that_cannot_be_restored_stays_as_it_is(qtbot, tmp_path):
    Settings(splitters={"monitor across": "not base 64", "design across": "AAAA"}, workspace="gone").save(tmp_path)
    assert quiet_window(qtbot, tmp_path).workspace == "Design"
