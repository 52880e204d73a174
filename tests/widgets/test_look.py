"""The look that was chosen: kept between starts, on a screen of any size, and not mixed up with somebody else's."""

import os
import subprocess
import sys
from base64 import b64encode

import pytest
from on_screen import show
from PySide6.QtCore import QEvent, QSize, Qt
from PySide6.QtGui import QIcon
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QLineEdit,
    QListWidget,
    QMainWindow,
    QPushButton,
    QSplitter,
    QTableWidget,
    QVBoxLayout,
    QWidget,
)
from windows import delete_widgets, quiet_window

from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.patch.preset_files import all_presets
from underfoot.widgets import application, recolour, theme, window_state
from underfoot.widgets.controls.slider import Slider
from underfoot.widgets.controls.step_table import StepTable
from underfoot.widgets.design.canvas import Canvas
from underfoot.widgets.design.message import Message
from underfoot.widgets.design.node_list import NodeList
from underfoot.widgets.design.preset_list import PresetList
from underfoot.widgets.design.undo import Document
from underfoot.widgets.session.settings import TEXT_SIZES, Settings
from underfoot.widgets.view_menu import ViewMenu


@pytest.fixture(autouse=True)
def _dark_again():
    yield
    delete_widgets()  # or the test's windows are coloured once more
    if theme.NAME != "dark":
        application.application(Settings())


def test_what_was_chosen_is_there_at_the_next_start(qtbot, tmp_path):
    Settings(splitters={"monitor across": "not base 64", "design across": "AAAA"}, workspace="gone").save(tmp_path)
    first = quiet_window(qtbot, tmp_path)
    assert first.workspaces.chosen == "Design"
    first.resize(792, 700)  # the screen of the tests is 800 wide
    first.workspaces.choose("Monitor")
    across = first.findChild(QSplitter, "monitor across")
    across.setSizes([300, 500])
    sizes = across.sizes()
    QTest.keyClick(first, Qt.Key.Key_Plus, Qt.KeyboardModifier.ControlModifier)
    next(action for action in first.view_menu.actions() if action.text() == "Light").trigger()
    assert (theme.NAME, Settings.load(tmp_path).theme) == ("light", "light")
    offer = first.view_menu.size_dialog
    assert offer.title.text() == "Text 115 %"
    QTest.mouseClick(offer.now, Qt.MouseButton.LeftButton)
    assert first.is_restarting
    assert first.isHidden()

    kept = Settings.load(tmp_path)
    assert (kept.theme, kept.text_size, kept.workspace) == ("light", 115, "Monitor")
    second = quiet_window(qtbot, tmp_path)
    assert (second.workspaces.chosen, second.width(), second.height()) == ("Monitor", 792, 700)
    assert second.findChild(QSplitter, "monitor across").sizes() == sizes


def what_differs(part, picture, other):
    """The widgets of which the first row of pixels is that differs, with its number; none where pictures are alike."""
    for y in range(picture.height() if picture != other else 0):
        xs = [x for x in range(picture.width()) if picture.pixel(x, y) != other.pixel(x, y)]
        if xs:
            return y, {repr(part.childAt(x, y)) for x in xs}
    return ()


def test_other_colours_are_there_at_once_as_if_the_window_had_been_made_in_them(qtbot, qapp, tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))  # others' recordings are read late

    def parts(window):
        """The bar, all workspaces, and Design's parts: its preview waits for an engine, sooner or later."""
        for name in window.workspaces.names:
            window.workspaces.choose(name)
            made = window.workspaces[name]
            qapp.processEvents()
            if name == "Design":
                made.canvas.fit_view(all_nodes=True)
            for part in (made.side, made.canvas, made.inspector, window.main_bar) if name == "Design" else (made,):
                for under in filter(QWidget.underMouse, part.findChildren(QWidget)):  # where a test left the mouse
                    QApplication.sendEvent(under, QEvent(QEvent.Type.Leave))
                yield (name, type(part).__name__), part

    def pictures(window):
        return {name: part.grab().toImage() for name, part in parts(window)}

    def turn(window, words):
        next(action for action in window.view_menu.actions() if action.text() == words).trigger()

    window = quiet_window(qtbot, tmp_path)
    window.workspaces.create_all()
    dark = pictures(window)
    turn(window, "Light")
    turned = pictures(window)
    for part, picture in turned.items():
        assert picture != dark[part], part
    turn(window, "Dark")
    assert [part for part, picture in pictures(window).items() if picture != dark[part]] == []
    turn(window, "Light")
    for name, part in parts(quiet_window(qtbot, tmp_path / "other")):

        def is_alike(name=name, part=part):
            assert what_differs(part, part.grab().toImage(), turned[name]) == (), name

        qtbot.waitUntil(is_alike)  # a new one may not have laid itself out at once


def test_text_grows_by_keys_and_no_further_than_there_are_sizes(qtbot):
    window, settings = QMainWindow(), Settings()
    qtbot.addWidget(window)
    menu = ViewMenu(settings, window)
    restarts, said = [], []
    menu.restart_requested.connect(lambda: restarts.append(settings.text_size))
    menu.notified.connect(said.append)
    show(qtbot, window)
    seen, sample_px = [], []
    for key in [Qt.Key.Key_Plus] * 5 + [Qt.Key.Key_Minus] * 5:
        focused = menu.size_dialog or window
        show(qtbot, focused)
        QTest.keyClick(focused, key, Qt.KeyboardModifier.ControlModifier)
        seen.append(settings.text_size)
        if menu.size_dialog is not None:
            sample_px.append(menu.size_dialog.sample.font().pixelSize())
    assert seen == [115, 130, 150, 150, 150, 130, 115, 100, 100, 100]
    assert set(seen) == set(TEXT_SIZES)
    assert sample_px == [15, 17, 20, 20, 20, 17, 15]  # of 13
    assert menu.size_dialog is None
    assert (restarts, said) == ([], ["Text 100 %: as it is now."] * 2)


def test_a_key_fills_the_screen_with_the_window_and_takes_that_back(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.showMaximized()
    for fills in (True, False):
        QTest.keyClick(window, Qt.Key.Key_F11)
        assert (window.isFullScreen(), window.isMaximized()) == (fills, True)


def test_another_text_size_waits_for_the_next_start_or_does_not(qtbot):
    window, settings = QMainWindow(), Settings()
    qtbot.addWidget(window)
    menu = ViewMenu(settings, window)
    restarts = []
    menu.restart_requested.connect(lambda: restarts.append(settings.text_size))
    show(qtbot, window)
    menu.larger_text.trigger()
    QTest.mouseClick(menu.size_dialog.later, Qt.MouseButton.LeftButton)
    assert (menu.size_dialog, restarts, settings.text_size) == (None, [], 115)
    menu.larger_text.trigger()
    QTest.mouseClick(menu.size_dialog.now, Qt.MouseButton.LeftButton)
    assert (menu.size_dialog, restarts) == (None, [130])


@pytest.mark.parametrize("edited", [False, True])
def test_what_was_open_is_open_again_saved_or_not(qtbot, tmp_path, edited):
    """Neither a preset takes the place of a patch whose file is up to date, nor is one taken for edited that is not."""
    file = tmp_path / "mine.json"
    Patch(title="Mine").add("gain", REGISTRY).save(file)
    first = quiet_window(qtbot, tmp_path / "kept", file)
    if edited:
        first.workspaces["Design"].document.edit(first.open_patch.patch.add("noise", REGISTRY), "Add")
    first.open_patch.set_other(Patch(title="Other"))
    before, other = first.open_patch.patch, first.open_patch.other
    first.restart()
    second = quiet_window(qtbot, tmp_path / "kept").open_patch
    assert (second.patch, second.path, second.is_saved) == (before, file, not edited)
    assert (second.other.patch, second.is_all_saved) == (other.patch, not edited)


def test_a_start_after_a_restart_does_not_speak_of_a_crash(qtbot, tmp_path):
    first = quiet_window(qtbot, tmp_path)
    first.workspaces["Design"].document.edit(first.open_patch.patch.add("noise", REGISTRY), "Add")
    before = first.open_patch.patch
    first.restart()
    second = quiet_window(qtbot, tmp_path)
    assert (second.open_patch.patch, second.status.message) == (before, "")
    second.leave()
    assert "your unsaved work is restored" in quiet_window(qtbot, tmp_path).status.message


def test_a_history_that_cannot_be_kept_does_not_keep_the_window_from_a_restart(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    (tmp_path / "undo.json").mkdir()
    window.restart()
    assert not window.isVisible()


@pytest.mark.parametrize("chosen", ["dark", "light"])
def test_the_application_has_the_colours_of_the_settings(qapp, chosen):
    application.application(Settings(theme=chosen))
    assert chosen == theme.NAME
    assert qapp.palette().window().color().name() == theme.colours(chosen)["panel"]
    assert theme.colours(chosen)["text"] in qapp.styleSheet()


def test_everything_grows_with_the_text_and_programs_that_are_started_do_not():
    script = """
import os
from underfoot.widgets.application import SCALE_VARIABLE, application
from underfoot.widgets.session.settings import Settings
print(application(Settings(text_size=130)).devicePixelRatio(), os.environ.get(SCALE_VARIABLE))
"""
    for given, seen in (({}, "1.3 None"), ({application.SCALE_VARIABLE: "2"}, "2.6 2")):
        environment = {**os.environ, **given}
        done = subprocess.run([sys.executable, "-c", script], env=environment, capture_output=True, text=True)
        assert done.stdout.strip() == seen, done.stderr


def test_an_icon_is_drawn_when_it_is_asked_for_in_any_size(qapp):
    """Drawn beforehand, those of a start took 1.5 ms each; of sizes over 48 there were none."""
    copied = QIcon(theme.icon("play", theme.ALARM))
    copied.setIsMask(True)  # Qt copies what draws it
    for icon in (theme.icon("play", theme.ALARM), copied):
        picture = icon.pixmap(QSize(72, 72), 1.0).toImage()
        assert picture.size() == QSize(72, 72)
        colours = {picture.pixelColor(x, 36).name() for x in range(72) if picture.pixelColor(x, 36).alpha() == 255}
        assert colours == {theme.ALARM}
    off = copied.pixmap(QSize(72, 72), 1.0, QIcon.Mode.Disabled).toImage()
    assert theme.FAINT in {off.pixelColor(x, 36).name() for x in range(72)}


def test_a_window_is_never_larger_than_the_screen_nor_beside_it(qtbot):
    far = QMainWindow()
    qtbot.addWidget(far)
    far.setGeometry(9000, 9000, 4000, 3000)
    for settings in (Settings(), Settings(geometry=b64encode(bytes(far.saveGeometry().data())).decode())):
        window = QMainWindow()
        qtbot.addWidget(window)
        window_state.restore_window(window, settings)
        room = window.screen().availableGeometry()
        assert room.size() == QSize(800, 800)  # the screen of the tests, smaller than the least size
        show(qtbot, window)
        assert room.contains(window.geometry())
        assert room.contains(window.minimumSize().width() - 1, window.minimumSize().height() - 1)


def test_a_message_over_the_canvas_follows_the_colours(qtbot):
    canvas, app = QWidget(), QApplication.instance()
    canvas.resize(600, 200)
    qtbot.addWidget(canvas)
    for alarm, ground in ((True, "alarming"), (False, "assuring")):
        message = Message(canvas)
        for name in ("light", "dark"):
            recolour.apply_colours(app, Settings(theme=name))
            if name == "light":
                message.show_text("It cannot be bypassed", alarm=alarm)
            assert message.grab().toImage().pixelColor(4, 12).name() == theme.colours(name)[ground]


def test_all_of_a_scale_to_answer_on_is_seen(qtbot):
    slider = Slider()
    qtbot.addWidget(slider)
    slider.resize(200, 16)
    slider.is_scale = True
    slider.clear()
    picture = slider.grab().toImage()
    assert {picture.pixelColor(x, 8).name() for x in (4, 100, 195)} == {theme.FAINT}


def test_a_button_that_cannot_be_used_is_as_grey_if_it_is_the_first_one_to_press(qtbot):
    """On its colour the word could hardly be read: a contrast of 1.7 to 1, of others 3.5."""
    pictures = []
    for role in ("", "primary"):
        button = QPushButton("Begin")
        qtbot.addWidget(button)
        button.setProperty("role", role)
        for enabled in (False, True):
            button.setEnabled(enabled)
            pictures.append(button.grab().toImage())
    grey, plain, also_grey, coloured = pictures
    assert (also_grey, coloured == plain) == (grey, False)


def names():
    made = QListWidget()
    made.addItems(["one", "two"])
    made.setCurrentRow(1)
    return made


def nodes():
    made = NodeList(REGISTRY)
    made.step(1)
    return made


def untouched_nodes():
    return NodeList(REGISTRY)


def canvas():
    return Canvas(Document(Patch()), REGISTRY)


def presets():
    made = PresetList()
    made.show_presets(all_presets()[:3], {}, (), headed=False)
    made.step(1)
    return made


def table():
    made = QTableWidget(2, 2)
    made.setCurrentCell(1, 1)
    return made


def alarming_button():
    made = QPushButton("Panic")
    made.setProperty("role", "alarm")
    return made


@pytest.mark.parametrize(
    "make",
    [names, nodes, untouched_nodes, presets, canvas, table, StepTable, alarming_button],
    ids=lambda make: make.__name__,
)
def test_what_has_the_focus_can_be_seen(qtbot, make):
    window, made, other = QWidget(), make(), QLineEdit()
    qtbot.addWidget(window)
    column = QVBoxLayout(window)
    column.addWidget(made)
    column.addWidget(other)
    show(qtbot, window)

    def picture(focused):
        focused.setFocus(Qt.FocusReason.TabFocusReason)
        QApplication.processEvents()
        return made.grab().toImage()

    without = picture(other)
    assert picture(made) != without
    assert picture(other) == without
