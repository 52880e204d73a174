"""How the Calibrate workspace looks, and how keys go through it, on every page of a small calibration."""

import itertools

import msgspec
import pytest
from calibrate_samples import PAGES
from on_screen import show
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QApplication, QScrollArea, QWidget

from underfoot.calibration.declaration import MeasurementSetup
from underfoot.calibration.procedures import CALIBRATIONS
from underfoot.engine.target import Target
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.profile import Profile
from underfoot.widgets.calibrate.overview import Overview
from underfoot.widgets.calibrate.page_view import PageView


def test_everything_that_takes_the_focus_has_a_name(driver):
    driver.begin()
    for page in PAGES:
        driver.go(page)
        for widget in driver.workspace.findChildren(QWidget):
            if widget.isVisible() and widget.focusPolicy() & Qt.FocusPolicy.TabFocus and widget.focusProxy() is None:
                text = widget.text() if isinstance(widget, QAbstractButton) else ""
                assert widget.accessibleName() or text, (page, widget)


def test_tab_goes_through_the_fields_and_then_the_buttons(driver):
    driver.begin()
    first, second = driver.wizard.page.editors
    order = []
    for _ in range(8):
        order.append(QApplication.focusWidget())
        QTest.keyClick(QApplication.focusWidget(), Qt.Key.Key_Tab)
    assert order[0] is first.field
    assert order.index(second.box) < order.index(driver.wizard.leaving) < order.index(driver.wizard.going)


def test_nothing_overlaps_or_is_cut_off_at_the_smallest_size(driver):
    driver.begin()
    for page in PAGES:
        driver.go(page)
        for view in (driver.wizard, driver.wizard.page if page != "result" else driver.wizard.result):
            inside = view.rect()
            for widget in view.children():
                if isinstance(widget, QWidget) and widget.isVisible():
                    assert inside.contains(widget.geometry()), (page, widget)
        buttons = sorted(
            (b.geometry() for b in driver.wizard.leaving.parentWidget().findChildren(QAbstractButton) if b.isVisible()),
            key=lambda place: place.x(),
        )
        assert all(a.right() < b.left() for a, b in itertools.pairwise(buttons))


@pytest.mark.parametrize("kind", list(CALIBRATIONS))
def test_questions_are_scrolled_where_the_window_is_too_low_for_them(qtbot, kind):
    procedure = CALIBRATIONS[kind]().procedure(MeasurementSetup(default_floor().tiles[0], Profile(tile="t1")))
    window = QWidget()
    qtbot.addWidget(window)
    window.resize(300, 1000)
    view = PageView()
    view.setParent(window)
    view.set_tile(default_floor().tiles[0], "")
    view.show_page(procedure.page)
    view.resize(300, 240)
    show(qtbot, window)
    for editor in view.editors:
        assert editor.height() >= editor.minimumSizeHint().height(), editor.parameter.name
    view.resize(300, 1000)
    QApplication.processEvents()
    last = view.editors[-1]
    assert last.visibleRegion().boundingRect() == last.rect()  # where there is room, nothing is scrolled


def test_what_a_calibration_is_for_is_not_scrolled_sideways_on_a_small_screen(qtbot):
    view = Overview()
    qtbot.addWidget(view)
    view.resize(628, 526)  # beside the choice, on 900 pixels
    show(qtbot, view)
    for one in CALIBRATIONS.values():
        view.show_kind(one.title, one.about)
        QApplication.processEvents()
        assert view.findChild(QScrollArea).horizontalScrollBar().maximum() == 0, one.title


def test_a_tile_with_a_long_id_makes_the_panel_no_wider(driver):
    tile = msgspec.structs.replace(default_floor(1, 1).tiles[0], id="jump-field-front-left-entrance")
    driver.workspace.set_target(Target(Floor((tile,))))
    area = driver.workspace.choice.findChild(QScrollArea)
    assert area.widget().minimumSizeHint().width() <= area.viewport().width()
