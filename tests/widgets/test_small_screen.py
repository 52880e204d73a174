"""Workspaces on a screen of 1280 x 800 at 200 %, which has 640 x 400 points: they scroll."""

from itertools import combinations

import pytest
from on_screen import show
from PySide6.QtCore import QEvent, QObject, QPoint, QRect, Qt
from PySide6.QtWidgets import (
    QApplication,
    QLabel,
    QLineEdit,
    QMenu,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)
from recordings_shown import recordings_shown
from study_hand import Hand

from underfoot.nodes import REGISTRY
from underfoot.widgets.controls.scrolled import Scrolled
from underfoot.widgets.design.workspace import DesignWorkspace
from underfoot.widgets.monitor.workspace import MonitorWorkspace
from underfoot.widgets.scenes.workspace import ScenesWorkspace


@pytest.fixture
def made(qtbot, tmp_path):
    hand = Hand(qtbot, tmp_path)
    hand.workspace.resize(640, 340)
    show(qtbot, hand.workspace)
    qtbot.waitUntil(lambda: hand.workspace.size().toTuple() == (640, 340))
    return hand


def places(page):
    """The rectangles of all visible texts and controls of a page."""
    parts = [part for kind in (QLabel, QLineEdit, QPushButton) for part in page.findChildren(kind) if part.isVisible()]
    return {part: QRect(part.mapTo(page, part.rect().topLeft()), part.size()) for part in parts}


@pytest.mark.parametrize("name", ["overview", "experimenter"])
def test_nothing_overlaps_and_all_can_be_scrolled_to(made, qtbot, name):
    page: QWidget = getattr(made.workspace, name)
    made.workspace.stack.setCurrentWidget(page)
    qtbot.waitUntil(lambda: page.isVisible() and page.width() > 320)
    found = places(page)
    assert len(found) > 4
    assert not [pair for pair in combinations(found.values(), 2) if pair[0].intersects(pair[1])]
    assert all(page.rect().contains(place) for place in found.values())
    area = made.workspace.stack.parentWidget().parentWidget()
    assert isinstance(area, QScrollArea)
    assert area.horizontalScrollBar().maximum() > 0


def test_the_form_of_a_stage_of_trials_is_read_to_its_right_end(made, qtbot):
    """The list of studies, of no use meanwhile, had a third of a window of 900 pixels, in which it was cut."""
    workspace, editor = made.workspace, made.protocol_editor
    workspace.resize(900, 540)
    made.click(workspace.study_list.copy_button)
    made.page(3)
    editor.stages.list.setCurrentRow([stage.id for stage in workspace.study_list.study.protocol.stages].index("main"))

    def is_read():
        seen = [(field.visibleRegion().boundingRect().width(), field.width())
                for field in editor.stages.findChildren(QLineEdit) if not field.visibleRegion().isEmpty()]  # fmt: skip
        return len(seen) > 2 and all(part == whole for part, whole in seen)

    qtbot.waitUntil(is_read)
    made.click(editor.close_button)
    assert workspace.study_list.isVisible()


def test_another_page_begins_at_its_left(made):
    area = made.workspace.stack.parentWidget().parentWidget()
    area.horizontalScrollBar().setValue(50)
    assert area.horizontalScrollBar().value() == 50
    made.click(made.workspace.study_list.new)
    assert area.horizontalScrollBar().value() == 0


def test_a_page_is_no_wider_than_the_window_where_a_title_or_a_message_is_long(made, qtbot):
    workspace, words = made.workspace, "what somebody feels underfoot, " * 12
    area = workspace.stack.parentWidget().parentWidget()
    workspace.resize(1280, 740)
    for label in (workspace.overview.title, workspace.overview.state, workspace.experimenter.title):
        label.setText(words)
    for page in (workspace.overview, workspace.experimenter):
        workspace.stack.setCurrentWidget(page)
        qtbot.waitUntil(lambda page=page: page.isVisible() and area.viewport().width() > 900)
        qtbot.waitUntil(lambda: area.widget().width() == area.viewport().width())


def scenes_of(qtbot, width, height):
    """The workspace of scenes in this size, and what scrolls its picture."""
    workspace = ScenesWorkspace()
    qtbot.addWidget(workspace)
    workspace.resize(width, height)
    show(qtbot, workspace)
    return workspace, next(a for a in workspace.findChildren(QScrollArea) if a.isAncestorOf(workspace.view))


def test_the_panel_of_a_scene_is_whole_and_scrolls(qtbot):
    workspace, area = scenes_of(qtbot, 640, 340)
    qtbot.waitUntil(lambda: area.verticalScrollBar().maximum() > 0)
    assert area.horizontalScrollBar().maximum() == 0
    parts = (workspace.list, workspace.view, workspace.panel)
    assert not [pair for pair in combinations(parts, 2) if pair[0].geometry().intersects(pair[1].geometry())]
    assert all(area.widget().rect().contains(part.geometry()) for part in parts)
    panel = workspace.panel
    for row in range(workspace.list.list.count()):
        workspace.list.list.setCurrentRow(row)
        qtbot.waitUntil(lambda: panel.about.height() >= panel.about.heightForWidth(panel.about.width()))
        assert panel.parameters.height() >= min(editor.sizeHint().height() for editor in panel.editors.values())


def test_the_picture_of_a_scene_is_whole_on_a_screen_of_1280_x_800_at_150_percent(qtbot):
    workspace, area = scenes_of(qtbot, 853, 460)
    for row in range(workspace.list.list.count()):
        workspace.list.list.setCurrentRow(row)
        qtbot.waitUntil(lambda: area.widget().height() == area.viewport().height())


def test_the_picture_of_a_scene_which_has_no_keys_is_no_tab_stop(qtbot):
    workspace = ScenesWorkspace()
    qtbot.addWidget(workspace)
    show(qtbot, workspace)
    workspace.list.list.setFocus()
    qtbot.keyClick(workspace.list.list, Qt.Key.Key_Tab)
    assert workspace.panel.isAncestorOf(workspace.focusWidget())


def test_steps_stance_and_floor_of_a_recording_lie_beside_each_other(qtbot, tmp_path, monkeypatch):
    monkeypatch.setattr("underfoot.widgets.recordings.workspace.documents_folder", lambda: tmp_path)
    workspace = recordings_shown(qtbot, 640, 340)
    area = next(area for area in workspace.findChildren(QScrollArea) if area.isAncestorOf(workspace.steps))
    qtbot.waitUntil(lambda: area.horizontalScrollBar().maximum() > 0)
    parts = (workspace.steps.table, workspace.steps.plot, workspace.readout.map)
    places = [QRect(part.mapTo(area.widget(), part.rect().topLeft()), part.size()) for part in parts]
    assert not [pair for pair in combinations(places, 2) if pair[0].intersects(pair[1])]
    assert all(area.widget().rect().contains(place) for place in places)


def test_all_of_design_and_of_monitor_can_be_scrolled_to(qtbot):
    design, monitor = DesignWorkspace(REGISTRY), MonitorWorkspace()
    columns = (design.side, design.canvas, design.inspector), (monitor.floor, monitor.force)
    for workspace, parts in zip((design, monitor), columns, strict=True):
        qtbot.addWidget(workspace)
        workspace.resize(640, 340)
        show(qtbot, workspace)
        area = next(area for area in workspace.findChildren(QScrollArea) if area.isAncestorOf(workspace.focused_first))
        bars = area.horizontalScrollBar(), area.verticalScrollBar()
        qtbot.waitUntil(lambda bars=bars: all(bar.maximum() > 0 for bar in bars))
        held = [QRect(part.mapTo(area.widget(), part.rect().topLeft()), part.size()) for part in parts]
        assert not [pair for pair in combinations(held, 2) if pair[0].intersects(pair[1])]
        assert all(area.widget().rect().contains(place) for place in held)
        workspace.resize(853, 480)  # at 150 %
        qtbot.waitUntil(lambda bar=bars[0]: bar.maximum() == 0)
    assert all(button.width() >= button.sizeHint().width() for button in monitor.force.span_buttons.values())


def test_all_of_calibrate_can_be_scrolled_to_and_the_buttons_stay_in_sight(driver, qtbot):
    workspace, wizard = driver.workspace, driver.workspace.wizard
    workspace.resize(640, 340)
    qtbot.waitUntil(lambda: workspace.size().toTuple() == (640, 340))
    area_of(workspace.overview.begin, workspace.overview.drawings, qtbot=qtbot)
    driver.begin()
    driver.go("tare")  # a page with a picture, which needs more room than there is
    area = area_of(wizard.page, wizard.drawings, qtbot=qtbot)
    assert area.horizontalScrollBar().maximum() == 0
    assert wizard.drawings.width() >= 280
    area.verticalScrollBar().setValue(100)
    for button in (button for button in wizard.findChildren(QPushButton) if button.isVisible()):
        assert workspace.rect().contains(QRect(button.mapTo(workspace, QPoint()), button.size()))
    assert not workspace.choice.isVisible()  # it would leave no room for them
    driver.go("weigh")
    qtbot.waitUntil(lambda: area.verticalScrollBar().maximum() > 0)
    assert area.verticalScrollBar().value() == 0
    driver.click(wizard.leaving)
    assert workspace.choice.isVisible()


def area_of(*parts, qtbot):
    """Return what the parts scroll in, upwards; they are whole in there, and beside each other."""
    area = next(area for area in ancestors(parts[0]) if isinstance(area, QScrollArea))
    qtbot.waitUntil(lambda: area.verticalScrollBar().maximum() > 0)
    held = [QRect(part.mapTo(area.widget(), part.rect().topLeft()), part.size()) for part in parts]
    assert not [pair for pair in combinations(held, 2) if pair[0].intersects(pair[1])]
    assert all(area.widget().rect().contains(place) for place in held)
    return area


def ancestors(widget):
    while widget := widget.parentWidget():
        yield widget


def test_a_page_that_grows_where_there_is_room_shows_no_scroll_bar_meanwhile(qtbot):
    """For one picture there was one, beside each question of a study."""
    page, held, part = QWidget(), QWidget(), QWidget()
    for around, inside in ((page, scrolled := Scrolled(held)), (held, part)):
        QVBoxLayout(around).addWidget(inside)
    qtbot.addWidget(page)
    page.resize(400, 600)
    show(qtbot, page)
    seen = Seen(scrolled.verticalScrollBar(), QEvent.Type.Show)
    part.setMinimumHeight(400)
    qtbot.waitUntil(lambda: scrolled.height() >= 400)
    assert not seen.count
    part.setMinimumHeight(800)
    qtbot.waitUntil(scrolled.verticalScrollBar().isVisible)
    assert seen.count == 1


class Seen(QObject):
    """Counts a widget's events of one kind."""

    def __init__(self, widget, kind):
        super().__init__(widget)
        self.kind, self.count = kind, 0
        widget.installEventFilter(self)

    def eventFilter(self, watched, event):
        self.count += event.type() == self.kind
        return False


def test_a_menu_higher_than_the_screen_scrolls(qtbot):
    """Its second column was cut, in which the keys are."""
    menu = QMenu()
    qtbot.addWidget(menu)
    for _ in range(QApplication.primaryScreen().availableGeometry().height() // 16):
        menu.addAction("Quit").setShortcut("Ctrl+Q")
    menu.popup(QPoint())
    assert {menu.actionGeometry(action).x() for action in menu.actions()} == {
        menu.actionGeometry(menu.actions()[0]).x()
    }
    menu.close()
